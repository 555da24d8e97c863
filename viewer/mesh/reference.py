"""Reference pictures: what a camera truly sees of a scene, by casting a ray through each pixel's centre."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..errors import InputError
from ..scan.points import NOTHING
from ..view import View
from .scene import Hits, Rays, Scene, distance_to_ball
from .triangles import Mesh

_CHUNK = 1 << 18  # rays cast at a time
# A hit may come before its own point by so many radii of the scene: points are rounded to float32. A round
# shape comes farther before such a point where it is slanted; faces that hold the point are left out.
_ROUNDED = 2 * float(np.finfo(np.float32).eps)
_ROUNDED_ON_SHAPES = 16 * _ROUNDED

_SAME = 4  # footprints between depths that are of one surface


@dataclass(frozen=True, eq=False)
class Reference:
    """The exact first hit at each pixel's centre, with the channels of a Surface. Row 0 is the top.

    view: what it was seen from, relative to origin (3,).
    depth: (H, W) float64, scan units along the view axis; +inf where nothing is.
    normal: (H, W, 3) float32, world space, unit length. color: (H, W, 3) float32, linear.
    id: (H, W) uint32, the face. Normal and colour are 0, the id 0xFFFFFFFF where nothing is.
    """

    view: View
    origin: NDArray[np.float64]
    depth: NDArray[np.float64]
    normal: NDArray[np.float32]
    color: NDArray[np.float32]
    id: NDArray[np.uint32]

    @property
    def covered(self) -> NDArray[np.bool_]:
        """(H, W), where something is."""
        return np.isfinite(self.depth)

    def arrays(self) -> dict[str, NDArray]:
        """The channels by the names of `Surface.arrays`."""
        return {
            "color": self.color,
            "normal": self.normal,
            "depth": self.depth,
            "coverage": self.covered.astype(np.float32),
            "value": np.full(self.depth.shape, np.nan, np.float32),
            "id": self.id,
            "level": np.where(self.covered, 0, 255).astype(np.uint8),
        }

    def positions(self) -> Rays:
        """(N, 3) float64, the hits relative to the origin, in the order of the covered pixels."""
        starts, steps = pixel_rays(self.view, np.flatnonzero(self.covered))
        return starts + self.depth[self.covered][:, None] * steps

    def incidence(self) -> NDArray[np.float64]:
        """The cosine between the surface's normal and the ray, (H, W), 0 to 1; 0 where nothing is."""
        _, rays = pixel_rays(self.view, np.flatnonzero(self.covered))
        along = np.abs((rays * self.normal[self.covered]).sum(axis=1)) / np.linalg.norm(rays, axis=1)
        cosine = np.zeros(self.depth.shape)
        cosine[self.covered] = np.minimum(along, 1)
        return cosine


def trace(scene: Scene, camera: Camera, size: tuple[int, int]) -> Reference:
    """The reference picture of a scene. size: (width, height), pixels.

    What is nearer than the camera's near plane or behind its far plane is not there, as for a backend.
    Raises InputError for a size that is no picture.
    """
    width, height = size
    if width < 1 or height < 1:
        raise InputError(f"a picture cannot have {width}x{height} pixels")
    view = View.of(camera, size, scene.origin, scene.bounds)
    parts = []
    for start in range(0, width * height, _CHUNK):
        pixels = np.arange(start, min(start + _CHUNK, width * height))
        parts.append(_cast(scene, *pixel_rays(view, pixels), view.near, view.far))
    depth, normal, color, face = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("distance", "normal", "color", "face")
    )
    return Reference(
        view=view,
        origin=scene.origin,
        depth=depth.reshape(height, width),
        normal=normal.astype(np.float32).reshape(height, width, 3),
        color=color.astype(np.float32).reshape(height, width, 3),
        id=face.reshape(height, width),
    )


def first_hits(
    scene: Scene, camera: Camera, size: tuple[int, int], places: NDArray[np.floating]
) -> NDArray[np.float64]:
    """The surface that is first met at places of a picture, anywhere in its pixels: (N, 3), absolute; NaN
    where nothing is. places: (N, 2), pixels from the left and from the top. size: (width, height), pixels."""
    view = View.of(camera, size, scene.origin, scene.bounds)
    across = (places - view.center) * np.array([1, -1]) / view.scale
    starts, steps = _rays(view, across)
    depth = _cast(scene, starts, steps, view.near, view.far).distance
    there = np.isfinite(depth)
    return np.where(
        there[:, None], starts + np.where(there, depth, 0)[:, None] * steps + scene.origin, np.nan
    )


def visible(
    scene: Scene, positions: NDArray[np.floating], camera: Camera, tolerance: float | None = None
) -> NDArray[np.bool_]:
    """Tell which points nothing of the scene hides from the camera's eye, (N,).

    positions: (N, 3), relative to the scene's origin. tolerance: how far a hit may lie before the point,
    scan units; None: 2 float32 epsilons (2.4e-7) of the radius of a mesh's bounds, 32 of shapes'. A face
    of a mesh within 2 of the point holds it, and does not hide it, however it is slanted. Points behind the
    eye are not visible; the edges of the picture, near and far do not count.
    """
    if tolerance is None:
        tolerance = (_ROUNDED if isinstance(scene, Mesh) else _ROUNDED_ON_SHAPES) * scene.bounds.radius
    view = View.of(camera, (1, 1), scene.origin, scene.bounds)
    seen = np.zeros(len(positions), bool)
    for start in range(0, len(positions), _CHUNK):
        points = positions[start : start + _CHUNK].astype(np.float64)
        local = points @ view.rotation.T + view.translation
        ahead = np.flatnonzero(-local[:, 2] > 0)
        if not len(ahead):
            continue
        depth = -local[ahead, 2]
        across = local[ahead, :2] / (depth[:, None] if view.perspective else 1)
        starts, steps = _rays(view, across)
        limit = depth - tolerance / np.linalg.norm(steps, axis=1)
        if isinstance(scene, Mesh):
            hidden = _hidden(scene, starts, steps, points[ahead], limit)
        else:
            hidden = _cast(scene, starts, steps, 0.0, np.inf).distance < limit
        seen[start + ahead] = ~hidden
    return seen


def visible_pixels(scene: Scene, picture: Reference, cameras: Sequence[Camera]) -> NDArray[np.bool_]:
    """Tell which pixels of a picture, (H, W), show what at least one of the cameras sees as well."""
    points = picture.positions() + (picture.origin - scene.origin)
    seen = np.zeros(picture.covered.shape, bool)
    seen[picture.covered] = np.any([visible(scene, points, camera) for camera in cameras], axis=0)
    return seen


def _hidden(
    mesh: Mesh, starts: Rays, steps: Rays, points: Rays, limit: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether faces hide points (N, 3) at the ends of rays: they are met, in float64, before a depth (N,).

    A face that holds the point is left out: the ray meets it there and nowhere else, but where it is slanted,
    rounding finds it anywhere along the ray.
    """
    hidden = np.zeros(len(points), bool)

    def passed_by(rays: NDArray[np.intp], faces: NDArray[np.uint32]) -> NDArray[np.bool_]:
        """Note what hides; which faces, though they hold no point, are not met at all."""
        met = mesh.meet(faces, starts[rays], steps[rays])
        others = mesh.distances(faces, points[rays]) > _ROUNDED * mesh.bounds.radius
        hidden[rays[others & (met < limit[rays])]] = True
        return others & np.isinf(met)

    entries = _entries(mesh, starts, steps)
    rays, faces = mesh.crossings(starts + entries[:, None] * steps, steps)
    edges = passed_by(rays, faces) & ~hidden[rays]
    if edges.any():  # what lies across them may be met
        passed_by(np.repeat(rays[edges], 3), mesh.neighbors[faces[edges]].ravel())
    return hidden


def both_see(
    first: Reference, second: Reference, moved: Rays | None = None
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The pixels of two pictures that show the same surface points: two lists of indices into H * W.

    moved: where the hits of the first picture are at the moment of the second, (N, 3) relative to the
    second's origin, in the order of the covered pixels; None: where they were. A point is seen in the
    second where the depth there is within four pixel footprints of its own.
    """
    if moved is None:
        moved = first.positions() + (first.origin - second.origin)
    view, source = second.view, np.flatnonzero(first.covered)
    inside = view.contains(moved)
    source, moved = source[inside], moved[inside]
    pixels, depth = view.project(moved)
    column, row = np.floor(pixels).astype(np.intp).T
    there = second.depth[row, column]
    same = np.abs(there - depth) <= _SAME * view.footprint(depth)
    return source[same], (row * view.size[0] + column)[same]


def pixel_rays(view: View, pixels: NDArray[np.integer]) -> tuple[Rays, Rays]:
    """Rays through the centres of pixels (N,), indices into H * W: starts and steps, (N, 3) each.

    Relative to the view's origin; start + t * step has depth t.
    """
    row, column = np.divmod(pixels, view.size[0])
    across = np.stack([column + 0.5 - view.center[0], view.center[1] - row - 0.5], axis=1)
    return _rays(view, across / view.scale)


def _rays(view: View, across: NDArray[np.float64]) -> tuple[Rays, Rays]:
    """Rays through view space (x, y) (N, 2): at depth 1 in perspective, anywhere else."""
    ahead = np.zeros((len(across), 3))
    ahead[:, 2] = -1
    flat = np.pad(across, ((0, 0), (0, 1)))
    starts, steps = (np.zeros_like(flat), flat + ahead) if view.perspective else (flat, ahead)
    return (starts - view.translation) @ view.rotation, steps @ view.rotation


def _cast(scene: Scene, starts: Rays, steps: Rays, near: float, far: float) -> Hits:
    """The first hits between two depths; distances are depths."""
    entry = np.maximum(_entries(scene, starts, steps), near)
    hits = scene.cast(starts + entry[:, None] * steps, steps)
    hits.distance[:] += entry
    beyond = hits.distance > far
    hits.distance[beyond], hits.face[beyond] = np.inf, NOTHING
    hits.normal[beyond], hits.color[beyond] = 0, 0
    return hits


def _entries(scene: Scene, starts: Rays, steps: Rays) -> NDArray[np.float64]:
    """Depths at which rays enter the ball around a scene, (N,); 0 from inside it."""
    center, radius = scene.bounds.center - scene.origin, scene.bounds.radius
    return distance_to_ball(starts - center, steps, 1.01 * radius)
