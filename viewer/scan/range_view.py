"""Range views: the measurement of one pod of a scanner, a depth for each pixel of a calibrated camera."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import EmptyFrame, InputError, unknown_name
from ..geometry import AXES, nearest_axis, vector
from ..rigid import is_rigid
from .colors import srgb8
from .grid_normals import normals_of_grid
from .lens import COUNTS, can_be_undone, distorted, undistorted
from .points import UNKNOWN_UNIT, PointCloud
from .units import conversion

DepthKind = Literal["z", "range", "height"]

_LEAST_UPRIGHT = 0.5  # the cosine of how far from an axis the pictures' common up may be
_RIGID = 1e-3  # how far a rotation may be from orthonormal: real trackers drift to 1e-4
_MASKED_IN = 0.01  # above which a number in a mask says that the depth is used (Farooq 2013, 4.3)
_LARGEST = 1e30  # number of a calibration; one over it is the least: the GPU counts in float32
_FIELD_OF_VIEW = 45.0  # degrees, where nothing tells it
_AT_ONCE = 1 << 17  # pixels worked on together
_MERGED_BYTES, _MERGING_BYTES = 52, 20 << 20  # that `merge` takes for a point, and beside all points


@dataclass(frozen=True, eq=False, kw_only=True)
class RangeView:
    """One pod's range image, texture, mask and calibration, as Scan4D's camera sees: right-handed, down -z.

    depth:           (H, W) float32, scan units, of one of three kinds; NaN or infinite: none
    kind:            z: view-space depth (-z); range: distance from the eye along the pixel's ray; both above
                     0, else none. height: -z under parallel projection, any number
    mask:            (H, W) bool, False where the depth is not to be used
    color:           (H, W, 3) float16, linear, or uint8, sRGB as pictures store it, or None
    confidence:      (H, W) float32, or None
    xy:              (H, W, 2) float32, x and y as measured, in camera space (scan units, y up), beside
                     which the calibration is good to some pixels only; not with range; or None
    fx, fy, cx, cy:  pinhole calibration in pixels; pixel centres at +0.5, row 0 is the top. Where depth is
                     height, fx and fy are pixels for a scan unit
    distortion:      the lens' 4, 5 or 8 coefficients, see `viewer/scan/lens.py`; none where depth is height
    world_to_camera: (4, 4) float64, a rotation and a translation, for column vectors
    name:            the pod's. unit: the name of the unit of length
    assumed:         what Scan4D assumed because no file states it, in words for the user; else empty

    With x = (column + 0.5 - cx) / fx and y = (cy - row - 0.5) / fy, less the lens' distortion, a pixel sees
    the point d (x, y, -1) in camera space where its depth d is z, d (x, y, -1) / |(x, y, -1)| where it is
    range, and (x, y, -d) where it is height.

    Raises InputError where shapes or types do not fit or the calibration is none.
    """

    depth: NDArray[np.float32]
    kind: DepthKind = "z"
    mask: NDArray[np.bool_]
    color: NDArray[np.float16] | NDArray[np.uint8] | None = None
    confidence: NDArray[np.float32] | None = None
    xy: NDArray[np.float32] | None = None
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()
    world_to_camera: NDArray[np.float64]
    name: str = ""
    unit: str = UNKNOWN_UNIT
    assumed: str = ""

    def __post_init__(self) -> None:
        shape = np.shape(self.depth)
        if len(shape) != 2 or 0 in shape:
            raise InputError(f"the depth of a range view has shape {shape}, expected (H, W)")
        for name, dtypes, expected in (
            ("depth", (np.float32,), shape),
            ("mask", (np.bool_,), shape),
            ("color", (np.float16, np.uint8), (*shape, 3)),
            ("confidence", (np.float32,), shape),
            ("xy", (np.float32,), (*shape, 2)),
            ("world_to_camera", (np.float64,), (4, 4)),
        ):
            array = getattr(self, name)
            if array is None and name in ("color", "confidence", "xy"):
                continue
            if not isinstance(array, np.ndarray) or array.dtype not in dtypes or array.shape != expected:
                found = f"{np.shape(array)} {getattr(array, 'dtype', type(array).__name__)}"
                types = " or ".join(str(np.dtype(dtype)) for dtype in dtypes)
                raise InputError(f"a range view's {name} is {found}, expected {expected} {types}")
        if self.kind not in (kinds := get_args(DepthKind)):
            raise unknown_name("kind of depth", self.kind, kinds)
        if self.kind == "range" and self.xy is not None:
            raise InputError(
                "a range view cannot store measured x and y together with distances from the scanner (range)",
                hint="Store z instead of the range",
            )
        numbers = np.array([self.fx, self.fy, self.cx, self.cy])
        if not ((np.abs(numbers) < _LARGEST).all() and (numbers[:2] > 1 / _LARGEST).all()):
            given = f"fx {self.fx:g}, fy {self.fy:g}, cx {self.cx:g}, cy {self.cy:g}"
            raise InputError(f"a range view's calibration cannot be used: {given}")
        self._check_distortion()
        if not is_rigid(self.world_to_camera, _RIGID):
            raise InputError("a range view's world_to_camera must be a rotation and a translation")

    @property
    def eye(self) -> NDArray[np.float64]:
        """Position of the pod in the world, (3,) float64."""
        return -self._camera_to_world() @ self.world_to_camera[:3, 3]

    @property
    def nbytes(self) -> int:
        """Bytes held by all arrays."""
        arrays = [getattr(self, field.name) for field in fields(self)]
        return sum(array.nbytes for array in arrays if isinstance(array, np.ndarray))

    def valid(self) -> NDArray[np.bool_]:
        """The pixels that see a point, (H, W)."""
        valid = self.mask & np.isfinite(self.depth)
        if self.kind != "height":
            valid &= self.depth > 0
        if self.xy is not None:
            valid &= np.isfinite(self.xy).all(axis=2)
        return valid

    def positions(self) -> NDArray[np.float64]:
        """World positions of the valid pixels in row order, (N, 3)."""
        from_eye = self._from_eye()
        from_eye += self.eye
        return from_eye

    def unproject(self, row: NDArray[np.integer], column: NDArray[np.integer]) -> NDArray[np.float64]:
        """World positions (N, 3) of valid pixels (N,), which `project` takes back to them."""
        return self._in_camera(row, column) @ self._camera_to_world().T + self.eye

    def cropped(self, rows: slice, columns: slice) -> RangeView:
        """Take the pixels of some rows and columns, slices without a step, as a view of their own."""
        images = ("depth", "mask", "color", "confidence", "xy")
        parts = {name: getattr(self, name) for name in images if getattr(self, name) is not None}
        top, left = rows.indices(len(self.depth))[0], columns.indices(self.depth.shape[1])[0]
        parts = {name: image[rows, columns] for name, image in parts.items()}
        return replace(self, **parts, cx=self.cx - left, cy=self.cy - top)

    def project(self, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Pixels (N, 2) in which the pod sees world points (N, 3), by its calibration: column and row with
        centres at +0.5; and depths (N,) of the view's kind. NaN where a point is not before the pod or its
        lens cannot show it. Pixels may lie outside the picture."""
        x, y, z = (points @ self.world_to_camera[:3, :3].T + self.world_to_camera[:3, 3]).T
        depth = -z
        if self.kind != "height":
            depth = np.where(depth > 0, depth, np.nan)
            x, y = x / depth, y / depth
            if self.kind == "range":
                depth = depth * np.sqrt(x * x + y * y + 1)
            if self.distortion:
                x, y = distorted(x, -y, self.distortion)
                y, depth = -y, np.where(np.isnan(x), np.nan, depth)
        return np.stack([self.cx + self.fx * x, self.cy - self.fy * y], axis=1), depth

    def normals(self) -> NDArray[np.float32]:
        """World normals of the valid pixels in row order, (N, 3), unit length, towards the pod.

        From the pixels around each on the same surface; see `normals_of_grid`.
        """
        depth, cells = np.where(self.valid(), self.depth, np.float32(np.nan)), None
        if self.kind == "range" or self.distortion or self.xy is not None:
            x, y = self._rays(*np.ogrid[: depth.shape[0], : depth.shape[1]])
            if self.kind == "range":
                depth = depth / np.sqrt(x * x + y * y + 1)
            if self.xy is not None:
                x, y = np.moveaxis(self.xy.astype(np.float64), 2, 0)
                if self.kind == "z":
                    with np.errstate(all="ignore"):
                        x, y = x / depth, y / depth
            cells = np.stack(np.broadcast_arrays(x * self.fx, -y * self.fy))
        focal, center = (self.fx, self.fy), (self.cx, self.cy)
        normals = normals_of_grid(depth, focal, center, self.kind == "height", cells)
        return (normals @ self._camera_to_world().T).astype(np.float32)

    def scaled(self, factor: float, unit: str) -> RangeView:
        """Multiply all lengths by a factor, which makes them lengths in this unit."""
        to_camera = self.world_to_camera.copy()
        to_camera[:3, 3] *= factor

        def longer(lengths: NDArray[np.float32]) -> NDArray[np.float32]:
            return (lengths * np.float64(factor)).astype(np.float32)

        pixel = factor if self.kind == "height" else 1.0  # where the calibration is in scan units
        return replace(
            self,
            depth=longer(self.depth),
            xy=None if self.xy is None else longer(self.xy),
            fx=self.fx / pixel,
            fy=self.fy / pixel,
            world_to_camera=to_camera,
            unit=unit,
        )

    def points(self, normals: bool = False) -> PointCloud:
        """The points of this view alone; see `merge`."""
        return merge([self], normals)

    def _camera_to_world(self) -> NDArray[np.floating]:
        return np.linalg.inv(self.world_to_camera[:3, :3])

    def _check_distortion(self) -> None:
        """Raise InputError where the lens' coefficients are none, or cannot be undone in the picture."""
        if not self.distortion:
            return
        shown = ", ".join(f"{value:g}" for value in self.distortion)
        if self.kind == "height":
            raise InputError(
                f"a range view of heights has no lens, but a lens distortion ({shown}) is stated"
            )
        if len(self.distortion) not in COUNTS or not np.isfinite(self.distortion).all():
            counts = "k1 k2 p1 p2 [k3 [k4 k5 k6]]"
            raise InputError(f"a range view's distortion is ({shown}), expected the numbers {counts}")
        height, width = self.depth.shape
        columns, rows = np.array([(0, 0), (width - 1, 0), (0, height - 1), (width - 1, height - 1)]).T
        x, y = self._seen(rows, columns)
        if not can_be_undone(x, -y, self.distortion):
            raise InputError(
                f"a range view's distortion ({shown}) maps different directions to the same pixel",
                hint="Check the coefficients and their order: k1 k2 p1 p2 k3 k4 k5 k6",
            )

    def _seen(self, row: NDArray, column: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Places in the picture, x to the right and y up: at depth 1, or of heights in scan units."""
        return (column + 0.5 - self.cx) / self.fx, (self.cy - row - 0.5) / self.fy

    def _rays(self, row: NDArray, column: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Places as `_seen` gives them, without the lens' distortion."""
        x, y = self._seen(row, column)
        if self.distortion:
            x, y = np.broadcast_arrays(x, y)
            x, y = undistorted(x, -y, self.distortion)
            y = -y
        return x, y

    def _from_eye(self) -> NDArray[np.float64]:
        """Offsets from the pod to the points of valid pixels in row order, along the world's axes, (N, 3)."""
        valid, turn = self.valid(), self._camera_to_world().T
        from_eye = np.empty((np.count_nonzero(valid), 3))
        done, height = 0, max(1, _AT_ONCE // valid.shape[1])
        for top in range(0, len(valid), height):
            row, column = np.nonzero(valid[top : top + height])
            from_eye[done : done + len(row)] = self._in_camera(row + top, column) @ turn
            done += len(row)
        return from_eye

    def _in_camera(self, row: NDArray[np.integer], column: NDArray[np.integer]) -> NDArray[np.float64]:
        """Places of valid pixels (N,) in camera space, (N, 3)."""
        depth = self.depth[row, column].astype(np.float64)
        if self.xy is not None:
            x, y = self.xy[row, column].astype(np.float64).T
        else:
            x, y = self._rays(row, column)
            if self.kind == "range":
                depth /= np.sqrt(x * x + y * y + 1)
            if self.kind != "height":
                x, y = x * depth, y * depth
        return np.stack([x, y, -depth], axis=1)


def assumed_pinhole(width: int, height: int) -> dict[str, Any]:
    """The camera of pictures of this size, 45 degrees across the longer edge, with `assumed` of RangeView."""
    focal = max(width, height) / (2 * math.tan(math.radians(_FIELD_OF_VIEW) / 2))
    shown = f"Scan4D found no camera and assumes a field of view of {_FIELD_OF_VIEW:g} degrees"
    return {"fx": focal, "fy": focal, "cx": width / 2, "cy": height / 2, "assumed": shown}


def mask_of(numbers: NDArray) -> NDArray[np.bool_]:
    """The mask that numbers of any type mean: True above 0.01."""
    return numbers > _MASKED_IN


def merge(views: Sequence[RangeView], normals: bool = False, origin: ArrayLike | None = None) -> PointCloud:
    """Points of all views, in view order and then in row order.

    ids count all pixels in that order, so each id names a pixel. Colours and the scalar `confidence` exist if
    every view has them; the scalar `view` is the number of the view. normals: whether to make them, see
    `RangeView.normals`. origin: as for `PointCloud.from_arrays`. One view's eye is the viewpoint. Raises
    InputError where no view sees a point.
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
    of_points = np.concatenate([view.normals() for view in views]) if normals else None
    return _cloud(views, valid, counts, points, ids, of_points, origin)


def merge_some(views: Sequence[RangeView], pixels: Sequence[NDArray[np.integer]]) -> PointCloud:
    """Merge what some of the valid pixels see, as `merge` does.

    pixels: of each view, their numbers in row order, ascending. Raises InputError where there is none.
    """
    cells = [np.divmod(some, view.depth.shape[1]) for view, some in zip(views, pixels, strict=True)]
    before = np.cumsum([0, *(view.depth.size for view in views)])[:-1]
    ids = np.concatenate([some + first for some, first in zip(pixels, before, strict=True)])
    points = np.concatenate([view.unproject(*cell) for view, cell in zip(views, cells, strict=True)])
    return _cloud(views, cells, [len(some) for some in pixels], points, ids.astype(np.uint32))


def _cloud(
    views: Sequence[RangeView],
    pixels: Sequence[Any],
    counts: Sequence[int],
    points: NDArray[np.float64],
    ids: NDArray[np.uint32],
    normals: NDArray[np.float32] | None = None,
    origin: ArrayLike | None = None,
) -> PointCloud:
    """The points (N, 3) of these ids with what the views have of them. pixels: of each view, to index its
    images with; counts: how many."""

    def of_points(name: str, made: Callable[[NDArray], NDArray] = np.asarray) -> NDArray | None:
        images = [getattr(view, name) for view in views]
        if any(image is None for image in images):
            return None
        return np.concatenate([made(image[some]) for image, some in zip(images, pixels, strict=True)])

    scalars = {"view": np.repeat(np.arange(len(views), dtype=np.uint16), counts)}
    confidence = of_points("confidence")
    cloud = PointCloud.from_arrays(
        points,
        normals=normals,
        colors=of_points("color", srgb8),
        scalars=scalars if confidence is None else scalars | {"confidence": confidence},
        origin=origin,
        viewpoint=views[0].eye if len(views) == 1 and views[0].kind != "height" else None,
        precise=False,  # depths are float32
    )
    if not len(cloud):
        what = "contains no points: no pixel inside the masks has a depth"
        raise EmptyFrame(what, hint=("Check the masks, and the unit and format of the depths"))
    return replace(cloud, ids=ids if cloud.ids is None else ids[cloud.ids])


def merged_normals(views: Sequence[RangeView], cloud: PointCloud) -> NDArray[np.float32]:
    """The normals of the points that `merge` makes of the views, (N, 3); see `RangeView.normals`."""
    normals = np.concatenate([view.normals() for view in views])
    if len(normals) == len(cloud):
        return normals
    assert cloud.ids is not None  # some were dropped
    seen = np.concatenate([view.valid().ravel() for view in views])
    return normals[np.isin(np.flatnonzero(seen), cloud.ids)]


def up_axis(views: Sequence[RangeView]) -> str | None:
    """The name of the axis of the world nearest to what is up in the pictures; None where they disagree."""
    if not views:
        return None
    up = np.mean([view.world_to_camera[1, :3] for view in views], axis=0)
    nearest = nearest_axis(vector(up))
    return nearest if up @ AXES[nearest] > _LEAST_UPRIGHT else None


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
