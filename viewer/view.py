"""What shaders know of the camera: float32, relative to an origin that is near what is seen."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .bounds import Bounds
from .camera import Camera
from .rigid import STILL, Rigid

_FAR = 2.0**14  # pixels: from there on float32 offsets are worth being taken from another origin
_STRAIGHT = 1 / 32  # of a pixel: rays that part by no more than this are drawn as parallel ones


@dataclass(frozen=True, eq=False)
class View:
    """A camera at a picture size, seen from an origin of a pose's positions.

    origin: (3,) float64, along the pose's axes, which are the world's unless it is moved.
    rotation: (3, 3) float64, from the pose's axes to view.
    translation: (3,) float64, from the origin to view space. scale: pixels per unit of x/-z (perspective) or
    of x (orthographic).
    near, far: what is outside is not drawn. reach: the depth that an orthographic depth
    buffer ends at. All depths count from a plane that lies so far before the eye: base, scan units. It is 0
    unless the view is `straightened`, so that float32 resolves depths by the scan's size rather than by how
    far it is away. shift: pixels right and down by which the picture is moved within its edges.
    """

    size: tuple[int, int]
    origin: NDArray[np.float64]
    rotation: NDArray[np.float64]
    translation: NDArray[np.float64]
    scale: float
    near: float
    far: float
    reach: float
    perspective: bool
    base: float = 0.0
    shift: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def of(
        cls,
        camera: Camera,
        size: tuple[int, int],
        origin: NDArray[np.float64],
        bounds: Bounds,
        world_from_pose: Rigid = STILL,
    ) -> View:
        """Combine camera, origin and the motion of the pose in float64, so that the GPU sees only
        small numbers. bounds: of the pose, where it is not moved."""
        to_view = camera.rotation()
        rotation = to_view if world_from_pose.is_identity else to_view @ world_from_pose.rotation
        (x, y, z), (ex, ey, ez) = world_from_pose.points(origin).tolist(), camera.eye
        perspective = camera.projection == "perspective"
        extent = 2 * math.tan(math.radians(camera.fov_y) / 2) if perspective else camera.view_height
        near, far = camera.clip_range()
        return cls(
            size=size,
            origin=origin,
            rotation=rotation,
            translation=to_view @ np.array([x - ex, y - ey, z - ez]),
            scale=size[1] / extent,
            near=near,
            far=far,
            reach=min(far, camera.reach(world_from_pose.bounds(bounds))),
            perspective=perspective,
        )

    def straightened(self, bounds: Bounds) -> View:
        """The view by parallel rays where these show nothing within the bounds elsewhere by more than 1/32
        pixel, as through a telephoto lens; else the view itself. bounds: of the pose where it is not
        moved."""
        half = math.hypot(*self.size) / 2  # pixels
        middle = float(self.depths(bounds.center - self.origin))
        radius = max(bounds.radius, half * middle / self.scale)  # splats may fill the picture
        bend = half * radius / (middle - radius) if middle > radius else math.inf
        base = middle - 4 * radius
        if not self.perspective or bend > _STRAIGHT or not self.near < base < self.far:
            return self
        return replace(
            self,
            translation=self.translation + np.array([0.0, 0.0, base]),
            scale=self.scale / middle,
            near=0.0,
            far=self.far - base,
            reach=min(self.far - base, 16 * radius),
            perspective=False,
            base=base,
        )

    @cached_property
    def center(self) -> NDArray[np.float64]:
        """Pixel coordinates, (2,), of the line of sight."""
        width, height = self.size
        return np.array([width / 2 + self.shift[0], height / 2 + self.shift[1]])

    @cached_property
    def key(self) -> tuple[object, ...]:
        """Equal for views that show the same."""
        shape = (self.size, self.shift, self.base, self.perspective)
        lens = (self.scale, self.near, self.far, self.reach)
        return (self.origin.tobytes(), self.rotation.tobytes(), self.translation.tobytes(), *shape, *lens)

    def project(self, positions: NDArray[np.floating]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Pixel coordinates (N, 2), row 0 at the top, and depths (N,), in float64.

        The plain twin of `project` in common/view.glsl. positions: (N, 3) relative to the origin.
        """
        view = positions @ self.rotation.T + self.translation
        depth = -view[:, 2]
        scale = self.scale / depth if self.perspective else self.scale
        pixels = np.empty((len(depth), 2))
        pixels[:, 0] = self.center[0] + view[:, 0] * scale
        pixels[:, 1] = self.center[1] - view[:, 1] * scale
        return pixels, depth

    def unproject(self, pixels: NDArray[np.floating], depth: NDArray[np.floating]) -> NDArray[np.float64]:
        """Positions (N, 3), relative to the origin, of pixel coordinates (N, 2) at depths (N,).

        The inverse of `project`, in float64.
        """
        scale = self.scale / depth if self.perspective else np.full(len(depth), self.scale)
        offsets = (pixels - self.center) * np.array([1, -1]) / scale[:, None]
        return (np.column_stack([offsets, -depth]) - self.translation) @ self.rotation

    def along(self, pixel: NDArray[np.floating]) -> NDArray[np.float64]:
        """The step (3,) on the ray through a position in the picture, (2,), by which depth grows by one."""
        ends = self.unproject(np.stack([pixel, pixel]), np.array([1.0, 2.0]))
        return ends[1] - ends[0]

    def depths(self, positions: NDArray[np.floating]) -> NDArray[np.float64]:
        """Depths (...) of points (..., 3), relative to the origin."""
        return -(positions @ self.rotation[2] + self.translation[2])

    def footprint(self, depth: ArrayLike) -> Any:
        """The edge of the square that a pixel covers at depths of any shape, scan units, float64."""
        depths = np.asarray(depth, np.float64)
        return (depths if self.perspective else np.ones_like(depths)) / self.scale

    def contains(self, positions: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Tell which points (N, 3), relative to the origin, are in the picture and its depth range; (N,)."""
        with np.errstate(divide="ignore", invalid="ignore"):  # a point in the eye's plane is out of range
            pixels, depth = self.project(positions)
        in_picture = ((pixels >= 0) & (pixels < self.size)).all(axis=1)
        return in_picture & (depth >= self.near) & (depth <= self.far)

    def holds(self, positions: NDArray[np.floating]) -> bool:
        """Whether all points (N, 3), relative to the origin, and so all between them, are in the picture and
        its depth range."""
        return bool(self.contains(positions).all())

    def may_show(
        self, low: NDArray[np.floating], high: NDArray[np.floating], margin: float = 0.0
    ) -> NDArray[np.bool_]:
        """Tell which boxes, (N, 3) corners relative to the origin, the picture and its depth range may reach
        into: none that it does is left out; (N,). margin: pixels beyond the picture's edges."""
        left, top = self.center + margin
        right, bottom = self.size - self.center + margin
        # Half-spaces a x + b y + c depth + d >= 0 of view space, whose common part is what is seen.
        sides = (
            (self.scale, 0, left),
            (-self.scale, 0, right),
            (0, -self.scale, top),
            (0, self.scale, bottom),
        )
        if self.perspective:
            planes = [(a, b, c, 0.0) for a, b, c in sides]
        else:
            planes = [(a, b, 0.0, c) for a, b, c in sides]
        planes += [(0, 0, 1, -self.near), (0, 0, -1, self.far)]
        walls = np.array(planes) * (1, 1, -1, 1)  # depth is -z
        normals, constants = walls[:, :3] @ self.rotation, walls[:, 3] + walls[:, :3] @ self.translation
        middles, halves = (low + high) / 2, (high - low) / 2
        nearest = middles @ normals.T + halves @ np.abs(normals).T + constants
        return nearest.min(axis=1) >= 0

    @property
    def eye(self) -> NDArray[np.float64]:
        """The origin of view space, (3,), along the pose's axes: in perspective, the position of the eye."""
        return self.origin - self.rotation.T @ self.translation

    def faces_away(self, positions: NDArray[np.floating], normals: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Tell which points (N, 3), relative to the origin, have a normal (N, 3) that points away from the
        eye; those without one do not."""
        with np.errstate(invalid="ignore"):  # NaN is none
            if not self.perspective:
                return normals @ self.rotation[2] < 0
            eye = -self.translation @ self.rotation
            return np.einsum("ij,ij->i", normals, eye - positions) < 0


def origin_near(
    camera: Camera, size: tuple[int, int], origin: NDArray[np.float64], world_from_pose: Rigid = STILL
) -> NDArray[np.float64]:
    """The origin, (3,), to count a pose's positions from, so that float32 offsets of what is seen are right
    to 1/1024 pixel: the pose's own, unless the camera looks so closely at something far from it.

    Then it is on a grid of 2^14 to 2^16 pixels at the camera's target, so that moving about there, and
    zooming by less than 4, keep it. It goes by nothing but the arguments: no picture turns on what was drawn
    before.
    """
    pixel = camera.view_height / size[1]
    grid = 4.0 ** math.ceil(math.log(pixel * _FAR, 4))
    target = camera.target
    if not world_from_pose.is_identity:
        target = world_from_pose.inverse.points(np.array(target)).tolist()
    if all(abs(to - at) <= grid / 2 for to, at in zip(target, origin.tolist(), strict=True)):
        return origin
    return origin + np.round((target - origin) / grid) * grid
