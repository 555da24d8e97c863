"""Range views: what one pod of a scanner measured, a depth for each pixel of a calibrated camera."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..rigid import is_rigid
from .colors import srgb8_from_linear
from .grid_normals import normals_of_grid
from .points import UNKNOWN_UNIT, PointCloud
from .units import conversion

_RIGID = 1e-3  # how far a rotation may be from orthonormal: real trackers drift to 1e-4
_AT_ONCE = 1 << 17  # pixels worked on together
_MERGED_BYTES, _MERGING_BYTES = 52, 20 << 20  # that `merge` takes for a point, and beside all points


@dataclass(frozen=True, eq=False, kw_only=True)
class RangeView:
    """One pod's range image, texture, mask and calibration, as Scan4D's camera sees: right-handed, down -z.

    depth:           (H, W) float32, view-space depth (-z) in scan units; NaN, infinite or <= 0: none
    mask:            (H, W) bool, False where the depth is not to be used
    color:           (H, W, 3) float16, linear, or None
    confidence:      (H, W) float32, or None
    fx, fy, cx, cy:  pinhole calibration in pixels; pixel centres at +0.5, row 0 is the top
    world_to_camera: (4, 4) float64, a rotation and a translation, for column vectors
    name:            the pod's. unit: the name of the unit of length

    Raises InputError where shapes or types do not fit or the calibration is none.
    """

    depth: NDArray[np.float32]
    mask: NDArray[np.bool_]
    color: NDArray[np.float16] | None = None
    confidence: NDArray[np.float32] | None = None
    fx: float
    fy: float
    cx: float
    cy: float
    world_to_camera: NDArray[np.float64]
    name: str = ""
    unit: str = UNKNOWN_UNIT

    def __post_init__(self) -> None:
        shape = np.shape(self.depth)
        if len(shape) != 2 or 0 in shape:
            raise InputError(f"the depth of a range view has shape {shape}, expected (H, W)")
        for name, dtype, expected in (
            ("depth", np.float32, shape),
            ("mask", np.bool_, shape),
            ("color", np.float16, (*shape, 3)),
            ("confidence", np.float32, shape),
            ("world_to_camera", np.float64, (4, 4)),
        ):
            array = getattr(self, name)
            if array is None and name in ("color", "confidence"):
                continue
            if not isinstance(array, np.ndarray) or array.dtype != dtype or array.shape != expected:
                found = f"{np.shape(array)} {getattr(array, 'dtype', type(array).__name__)}"
                raise InputError(f"a range view's {name} is {found}, expected {expected} {np.dtype(dtype)}")
        if not (np.isfinite([self.fx, self.fy, self.cx, self.cy]).all() and self.fx > 0 and self.fy > 0):
            given = f"fx {self.fx:g}, fy {self.fy:g}, cx {self.cx:g}, cy {self.cy:g}"
            raise InputError(f"a range view's calibration is unusable: {given}")
        if not is_rigid(self.world_to_camera, _RIGID):
            raise InputError("a range view's world_to_camera is not a rotation and a translation")

    @property
    def eye(self) -> NDArray[np.float64]:
        """The pod's place in the world, (3,) float64."""
        return -self._camera_to_world() @ self.world_to_camera[:3, 3]

    @property
    def nbytes(self) -> int:
        """Bytes held by all arrays."""
        arrays = [getattr(self, field.name) for field in fields(self)]
        return sum(array.nbytes for array in arrays if isinstance(array, np.ndarray))

    def valid(self) -> NDArray[np.bool_]:
        """The pixels that see a point, (H, W)."""
        return self.mask & np.isfinite(self.depth) & (self.depth > 0)

    def positions(self) -> NDArray[np.float64]:
        """World positions of the valid pixels in row order, (N, 3)."""
        from_eye = self._from_eye()
        from_eye += self.eye
        return from_eye

    def normals(self) -> NDArray[np.float32]:
        """World normals of the valid pixels in row order, (N, 3), unit length, towards the pod.

        From the pixels around each on the same surface; see `normals_of_grid`.
        """
        depth = np.where(self.valid(), self.depth, np.float32(np.nan))
        normals = normals_of_grid(depth, (self.fx, self.fy), (self.cx, self.cy))
        return (normals @ self._camera_to_world().T).astype(np.float32)

    def scaled(self, factor: float, unit: str) -> RangeView:
        """Multiply all lengths by a factor, which makes them lengths in this unit."""
        to_camera = self.world_to_camera.copy()
        to_camera[:3, 3] *= factor
        depth = (self.depth * np.float64(factor)).astype(np.float32)
        return replace(self, depth=depth, world_to_camera=to_camera, unit=unit)

    def points(self, normals: bool = False) -> PointCloud:
        """The points of this view alone; see `merge`."""
        return merge([self], normals)

    def _camera_to_world(self) -> NDArray[np.floating]:
        return np.linalg.inv(self.world_to_camera[:3, :3])

    def _from_eye(self) -> NDArray[np.float64]:
        """Offsets from the pod to the points of valid pixels in row order, along the world's axes, (N, 3)."""
        valid, turn = self.valid(), self._camera_to_world().T
        from_eye = np.empty((np.count_nonzero(valid), 3))
        done, height = 0, max(1, _AT_ONCE // valid.shape[1])
        for top in range(0, len(valid), height):
            row, column = np.nonzero(valid[top : top + height])
            depth = self.depth[top : top + height][row, column].astype(np.float64)
            x = (column + 0.5 - self.cx) / self.fx * depth
            y = (self.cy - (row + top) - 0.5) / self.fy * depth
            from_eye[done : done + len(row)] = np.stack([x, y, -depth], axis=1) @ turn
            done += len(row)
        return from_eye


def merge(views: Sequence[RangeView], normals: bool = False) -> PointCloud:
    """The points that all views see, in view order and then in row order.

    ids count all pixels in that order, so they tell the pixel. Colours and the scalar `confidence` are
    there where every view has them; the scalar `view` is the number of the view. normals: whether to
    make them, see `RangeView.normals`. Raises InputError where no view sees a point.
    """
    valid = [view.valid() for view in views]
    counts = [int(np.count_nonzero(pixels)) for pixels in valid]
    starts, pixels_before = np.cumsum([0, *counts]), np.cumsum([0, *(pixels.size for pixels in valid)])
    points, ids = np.empty((starts[-1], 3)), np.empty(starts[-1], np.uint32)
    for view, pixels, start, end, before in zip(
        views, valid, starts[:-1], starts[1:], pixels_before, strict=False
    ):
        points[start:end] = view.positions()
        ids[start:end] = np.flatnonzero(pixels) + before

    def of_points(name: str, made: Callable[[NDArray], NDArray] = np.asarray) -> NDArray | None:
        images = [getattr(view, name) for view in views]
        if any(image is None for image in images):
            return None
        return np.concatenate([made(image[pixels]) for image, pixels in zip(images, valid, strict=True)])

    scalars = {"view": np.repeat(np.arange(len(views), dtype=np.uint16), counts)}
    confidence = of_points("confidence")
    cloud = PointCloud.from_arrays(
        points,
        normals=np.concatenate([view.normals() for view in views]) if normals else None,
        colors=of_points("color", srgb8_from_linear),
        scalars=scalars if confidence is None else scalars | {"confidence": confidence},
    )
    if not len(cloud):
        raise InputError("holds no points: no pixel inside the masks has a depth")
    return replace(cloud, ids=ids if cloud.ids is None else ids[cloud.ids])


def merged_normals(views: Sequence[RangeView], cloud: PointCloud) -> NDArray[np.float32]:
    """The normals of the points that `merge` makes of the views, (N, 3); see `RangeView.normals`."""
    normals = np.concatenate([view.normals() for view in views])
    if len(normals) == len(cloud):
        return normals
    assert cloud.ids is not None  # some were dropped
    seen = np.concatenate([view.valid().ravel() for view in views])
    return normals[np.isin(np.flatnonzero(seen), cloud.ids)]


def in_one_unit(views: Sequence[RangeView], unit: str) -> tuple[RangeView, ...]:
    """The views with their lengths in a unit, where both are known lengths; the others as they are."""
    factors = [conversion(view.unit, unit) for view in views]
    return tuple(
        view if factor is None or view.unit == unit else view.scaled(factor, unit)
        for view, factor in zip(views, factors, strict=True)
    )


def memory_of_merging(views: Sequence[RangeView]) -> int:
    """Bytes that views and what `merge` makes of them take at most at a time, without normals."""
    points = sum(int(np.count_nonzero(view.valid())) for view in views)
    images = sum(view.nbytes + view.mask.size for view in views)
    return images + points * _MERGED_BYTES + _MERGING_BYTES
