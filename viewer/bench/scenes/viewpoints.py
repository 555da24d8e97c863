"""Where a benchmark looks from: all round a subject, or from where its pods are, from far and from near."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...camera import Camera
from ...errors import InputError
from ...geometry import up_vector, vector
from ...mesh.reference import trace
from ...mesh.scene import Rays
from ...mesh.triangles import Mesh
from ...scan.range_view import RangeView
from .samples import evenly

COVERAGE = (0.25, 0.85)  # of the picture's pixels (Slomp 2014, VII)
_CLOSE = 0.005  # how near a view comes to the coverage that it should have
_PIXELS = 2400  # of the pictures that coverage is measured in
_NEAREST, _FARTHEST = 0.05, 20.0  # distances to the subject that are tried, in radii of its bounds
_HALVINGS = 16
_TRIES = 50  # directions a view
_ASIDE = 20.0  # degrees from a pod's direction that every second view of its samples looks from
_FAR = 4.0  # distance of the eye from what a parallel projection measured, in longest edges of its box


def viewpoints(
    mesh: Mesh, count: int, size: tuple[int, int], *, up: str = "+y", seed: int = 0
) -> list[Camera]:
    """Cameras in evenly spread directions whose pictures a mesh covers by evenly spread 25 % to 85 %.

    size: (width, height) of the pictures, pixels. Each looks at the point of the surface that is nearest
    to the middle when seen from afar, and comes nearer until the coverage is right; a direction in which
    it never is (a plane edge on) is left out for the next one. The order of coverages is shuffled.
    Raises InputError where there is no such view.
    """
    if count < 1:
        raise InputError(f"a scene of the benchmark needs 1 or more viewpoints, not {count}")
    rng = np.random.default_rng(seed)
    low, high = COVERAGE[0] + 2 * _CLOSE, COVERAGE[1] - 2 * _CLOSE
    wanted = low + (high - low) * (rng.permutation(count) + 0.5) / count
    cameras: list[Camera] = []
    for direction in _directions(_TRIES * count, rng.random(2)):
        camera = _look(mesh, direction, float(wanted[len(cameras)]), size, up)
        if camera is not None:
            cameras.append(camera)
        if len(cameras) == count:
            return cameras
    raise InputError(
        f"the subject fills {COVERAGE[0]:.0%} to {COVERAGE[1]:.0%} of the picture in only {len(cameras)} of "
        f"{count} views"
    )


def pod_viewpoints(
    views: Sequence[RangeView],
    zoom: float,
    count: int,
    size: tuple[int, int],
    *,
    up: str = "+y",
    seed: int = 0,
) -> list[Camera]:
    """Cameras that look at samples of range views, by turns from the pod's direction and 20 degrees aside.

    zoom: how many pixels of the picture a sample is wide and high at the sample looked at, where the eye is
    as far as the pod: s z / (d f), s the view's pixels per unit, d the distance of the eye, z the sample's
    depth, f the pod's focal length in pixels (parallel projection: s / (d f)). The lens makes the zoom.
    count: of cameras. size: (width, height) of the pictures, pixels. Samples are spread evenly over each
    pod's picture, the pods take turns, and every zoom looks at the same ones.
    """
    shift = np.random.default_rng(seed).random(2)
    cameras = []
    for pair, position in enumerate(evenly(np.arange((count + 1) // 2), shift)):
        view = views[pair % len(views)]
        camera = pod_camera(view, sample_near(view, position), zoom, size, up)
        cameras += [camera, camera.orbited(_ASIDE, 0)]
    return cameras[:count]


def sample_near(view: RangeView, position: NDArray[np.float64]) -> Rays:
    """The world position (3,) of the sample nearest to a position in the box around all of them, 0 to 1."""
    pixels = np.argwhere(view.valid())
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    nearest = np.square(pixels - (low + position * (high - low))).sum(axis=1).argmin()
    alone = np.zeros_like(view.mask)
    alone[tuple(pixels[nearest])] = True
    return replace(view, mask=alone).positions()[0]


def pod_camera(view: RangeView, target: Rays, zoom: float, size: tuple[int, int], up: str = "+y") -> Camera:
    """A camera in the pod's direction from a sample (3,), at a zoom as `pod_viewpoints` has it."""
    rotation, translation = view.world_to_camera[:3, :3], view.world_to_camera[:3, 3]
    focal = float(np.sqrt(view.fx * view.fy))
    if view.kind == "height":
        distance = _FAR * float(np.ptp(view.positions(), axis=0).max())
        eye, density = target + distance * rotation[2], focal
    else:
        eye = view.eye
        density = focal / -float(rotation[2] @ target + translation[2])
        distance = float(np.linalg.norm(target - eye))
    tangent = size[1] / (2 * zoom * density * distance)
    return Camera(
        eye=vector(eye),
        target=vector(target),
        up=up_vector(up),
        fov_y=float(np.degrees(2 * np.arctan(tangent))),
    )


def covered_share(mesh: Mesh, camera: Camera, size: tuple[int, int]) -> float:
    """The share of a picture's pixels that a mesh covers, from a few thousand rays. size: pixels."""
    return float(trace(mesh, camera, _small(size)).covered.mean())


def _directions(count: int, shift: NDArray[np.float64]) -> Rays:
    """Unit vectors (N, 3), evenly spread as far as they are followed."""
    u, v = evenly(np.arange(count), shift).T
    height, turn = 2 * u - 1, 2 * np.pi * v
    out = np.sqrt(1 - height**2)
    return np.stack([out * np.cos(turn), height, out * np.sin(turn)], axis=1)


def _look(mesh: Mesh, direction: Rays, wanted: float, size: tuple[int, int], up: str) -> Camera | None:
    """A camera in a direction (3,) from the mesh that is covered as wanted, where there is one."""
    target = _middle(mesh, direction, size, up)
    if target is None:
        return None
    low, high = np.log(np.array([_NEAREST, _FARTHEST]) * mesh.bounds.radius)
    for _ in range(_HALVINGS):
        distance = np.exp((low + high) / 2)
        camera = Camera(eye=vector(target + distance * direction), target=vector(target), up=up_vector(up))
        error = covered_share(mesh, camera, size) - wanted
        if abs(error) <= _CLOSE:
            return camera
        low, high = (np.log(distance), high) if error > 0 else (low, np.log(distance))
    return None


def _middle(mesh: Mesh, direction: Rays, size: tuple[int, int], up: str) -> Rays | None:
    """The point of the mesh, absolute, that is nearest to the middle of a picture from afar.

    The picture is orthographic: so nothing is before the point all along the direction.
    """
    center = mesh.bounds.center
    camera = Camera(
        eye=vector(center + mesh.bounds.radius * direction),
        target=vector(center),
        up=up_vector(up),
        projection="orthographic",
    ).fit(mesh.bounds, size[0] / size[1])
    picture = trace(mesh, camera, _small(size))
    seen = np.argwhere(picture.covered)
    if not len(seen):
        return None
    nearest = np.square(seen + 0.5 - np.array(picture.covered.shape) / 2).sum(axis=1).argmin()
    return picture.positions()[nearest] + picture.origin


def _small(size: tuple[int, int]) -> tuple[int, int]:
    factor = min(1.0, np.sqrt(_PIXELS / (size[0] * size[1])))
    return max(1, round(size[0] * factor)), max(1, round(size[1] * factor))
