"""The row of a pixel: a point, a sample of range views, or an octant. No other module tells them apart."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

from ..gpu import gl
from ..gpu.arrays import as_float32
from ..gpu.chunks import Chunks
from ..gpu.pose import GpuPose, PosePart
from ..gpu.range_samples import check_values
from ..scan.points import PointCloud
from ..scan.range_points import RangePoints
from ..scan.rays import Ray, rows_along
from ..view import View
from .counts import Counted, cloud_counted, samples_counted
from .laid_over import laid_over

_ENOUGH = 64  # samples near a place that tell of the surface there

Find = Callable[[NDArray], NDArray]  # values (n, ...) of rows (n,)


class PointRows:
    """Rows that are points of a pose, in the order of its arrays.

    pose: whose rows they are. scanned: the pose of the scan.
    """

    has_positions = True  # whether the GPU has their positions as texels
    is_photograph = False  # whether their colours have the light that they were taken in

    def __init__(self, pose: GpuPose) -> None:
        self.pose = self.scanned = pose

    @property
    def parts(self) -> tuple[PartRows, ...]:
        """Runs of the rows, where the arrays of the pose are in parts; empty where they are whole."""
        parts = self.pose.parts if self.pose.is_split else ()
        return tuple(PartRows(part) for part in parts)

    @property
    def octants(self) -> NDArray[np.uint32] | None:
        """The number of each row's octant, (n,); None where rows are none."""
        return None

    @property
    def count(self) -> int:
        """Number of rows."""
        return self.pose.count

    @property
    def point_count(self) -> int:
        """Number of rows that see a point."""
        return self.count

    def counted(self) -> Counted:
        """The points to count, for any thread."""
        return cloud_counted(self.pose.cloud)

    def near(self, view: View, margin: float, reach: float) -> NDArray[np.uint32] | None:
        """The rows in chunks that a view may show, see `Chunks.rows_in`; None: all may be."""
        return self.pose.cached(Chunks).rows_in(view, margin, reach)

    # --- on the GPU -------------------------------------------------------------------

    def defines(self, is_used: bool) -> dict[str, object]:
        """Macros for programs that include range/of_rows.glsl. is_used: whether they fetch by row with it."""
        return {"SAMPLES": 0}

    def bind(self, view: View) -> None:
        """Bind the buffers that range/of_rows.glsl reads."""

    def texels(self, name: str) -> gl.BufferTexture | None:
        """The attribute `color` or `normal` with a texel for each row; None if there is none."""
        return self.pose.find(f"{name}s")

    def fetches(self, name: str) -> bool:
        """Whether shaders compute the attribute `color` or `normal` of a row from other data."""
        return False

    def scalar_texels(self, name: str, zero: float) -> gl.BufferTexture:
        """A scalar of the scan, relative to zero, with a texel for each row."""
        return self.pose.packed(_scalar, name, zero)

    def layer_texels(self, values: NDArray, zero: float) -> gl.BufferTexture:
        """Numbers of a layer, relative to zero, with a texel for each row. The first call uploads them."""
        arrays = laid_over(self.pose, values).arrays
        if type(self) not in arrays:
            arrays[type(self)] = self.pose.new_array(lambda: self._by_row(values, zero))
        return arrays[type(self)].texels

    def _by_row(self, values: NDArray, zero: float) -> NDArray[np.float32]:
        """Numbers of the scan's points, (N,), relative to zero, in the order of the rows."""
        return as_float32(values, zero)

    def heights(self, axis: tuple[float, ...]) -> gl.BufferTexture:
        """The height along an axis, relative to the origin, with a texel for each row."""
        return self.pose.packed(_heights, axis, only=True)

    # --- on the CPU -------------------------------------------------------------------

    def of(self, name: str) -> Find | None:
        """Function that gives positions, normals, colors, ids or a scalar ('scalar:NAME') of rows; None if
        there are none."""
        scalar, pose = name.partition("scalar:")[2], self.pose
        if scalar:
            return lambda rows: pose.cloud.scalars[scalar][rows]
        return (lambda rows: getattr(pose.cloud, name)[rows]) if pose.has(name) else None

    def points(self, rows: NDArray) -> NDArray:
        """Rows of the scan's points that rows (n,) stand for."""
        return rows

    def point(self, row: int) -> int:
        """The row of the scan's point that a row stands for."""
        return int(self.points(np.array([row]))[0])

    def cloud_with(self, row: int, least: int) -> tuple[PointCloud, int]:
        """A cloud with the measured point of a row and at least so many of the nearest ones, and its row
        there."""
        return self.measured, self.point(row)

    @property
    def measured(self) -> PointCloud:
        """The points of the scan as measures use them, see `Pose.measured`."""
        pose = self.scanned.pose
        return self.scanned.stored if pose.measured is pose else pose.measured.cloud

    def frames(self, rows: NDArray) -> NDArray[np.uint8] | None:
        """How many frames the points are means of that rows (n,) stand for, (n,); None: none is a mean."""
        average = self.scanned.pose.average
        return None if average is None else average.counts[self.points(rows)]

    def file_points(self, rows: NDArray[np.intp], view: View) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Indices in the file (n,) and positions (n, 3), relative to the view's origin, of the points that
        rows stand for, as measures use them."""
        return self._of_scan(self.points(rows), view)

    def points_along(
        self, ray: Ray, reach: float, view: View, seen: Callable[[], NDArray[np.intp]]
    ) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Indices in the file (n,) and positions (n, 3), relative to the view's origin, of the points of the
        scan that are so near to a ray, whether they are seen or not.

        ray: relative to the view's origin. seen: gives the rows that pixels around show.
        """
        scan = self.measured
        moved = Ray(ray.start + (view.origin - scan.origin), ray.step)
        are_drawn = scan is self.scanned.stored
        some = self.scanned.cached(Chunks).rows_along(moved, reach) if are_drawn else None
        return self._of_scan(rows_along(scan, moved, reach, some), view)

    def _of_scan(self, points: NDArray[np.intp], view: View) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Indices in the file and positions of points of the scan, as `file_points` gives them."""
        scan = self.measured
        ids = points if scan.ids is None else scan.ids[points]
        return ids.astype(np.intp), scan.world(points) - view.origin


class PartRows(PointRows):
    """A run of the rows of a pose. first: the row that it begins with."""

    def __init__(self, part: PosePart) -> None:
        super().__init__(part.pose)
        self.first = part.first

    def _by_row(self, values: NDArray, zero: float) -> NDArray[np.float32]:
        return as_float32(values[self.first : self.first + self.count], zero)


class Octants(Protocol):
    """Octants that are drawn as points of a pose with the scan's origin."""

    @property
    def points(self) -> GpuPose:
        """The octants as points."""

    @property
    def rows(self) -> NDArray[np.uint32]:
        """(n,): the row of the scan's point by which each is known."""

    @property
    def octants(self) -> NDArray[np.uint32]:
        """(n,): the number of each, 0xFFFFFFFF for a row that is none."""


class OctantRows(PointRows):
    """Rows of a pose of octants."""

    def __init__(self, octants: Octants, scanned: GpuPose) -> None:
        super().__init__(octants.points)
        self.scanned, self._octants = scanned, octants

    @property
    def octants(self) -> NDArray[np.uint32]:
        return self._octants.octants

    def _by_row(self, values: NDArray, zero: float) -> NDArray[np.float32]:
        return as_float32(values[self._octants.rows], zero)

    def points(self, rows: NDArray) -> NDArray:
        return self._octants.rows[rows]


class SampleRows(PointRows):
    """Rows that are pixels of a pose's range views, view after view and line after line, whether they see a
    point or not.

    Their numbers are the ids of the points, and no points are merged for them. Colours are those of the
    pixels, normals those of the planes through the samples around.
    """

    has_positions = False
    is_photograph = True

    def __init__(self, pose: GpuPose) -> None:
        """Raises InputError if the pose has no range views."""
        super().__init__(pose)
        self._samples: RangePoints = pose.pose.range_points

    @property
    def count(self) -> int:
        return int(self._samples.firsts[-1])

    @property
    def point_count(self) -> int:
        return self._samples.count

    def counted(self) -> Counted:
        return samples_counted(self._samples)

    def near(self, view: View, margin: float, reach: float) -> None:
        return None

    def defines(self, is_used: bool) -> dict[str, object]:
        return {"SAMPLES": 1, **self.pose.samples.defines} if is_used else {"SAMPLES": 0}

    def bind(self, view: View) -> None:
        self.pose.samples.bind(view)

    def texels(self, name: str) -> None:
        return None

    def fetches(self, name: str) -> bool:
        return name == "normal" or self.pose.overview.colors is not None

    def scalar_texels(self, name: str, zero: float) -> gl.BufferTexture:
        check_values(self.pose.gpu, sum(view.depth.size for view in self.pose.views))
        return self.pose.packed(_sample_scalar, name, zero, of=self._samples)

    def _by_row(self, values: NDArray, zero: float) -> NDArray[np.float32]:
        return self._samples.by_sample(as_float32(values, zero))

    def heights(self, axis: tuple[float, ...]) -> gl.BufferTexture:
        return self.pose.samples.heights(axis, self.pose.origin)

    def of(self, name: str) -> Find | None:
        scalar = name.partition("scalar:")[2]
        is_there = bool(scalar) or (name != "ids" and getattr(self.pose.overview, name) is not None)
        return partial(self._samples.of_samples, scalar or name) if is_there else None

    def points(self, rows: NDArray) -> NDArray:
        return np.searchsorted(cast(NDArray, self.scanned.stored.ids), rows)

    def point(self, row: int) -> int:
        return self._samples.row_of(row)

    def cloud_with(self, row: int, least: int) -> tuple[PointCloud, int]:
        samples = self.pose.pose.measured.range_points
        offset = samples.of_samples("positions", np.array([row]))[0]
        cloud = samples.around(offset + samples.overview.origin, least)
        found = cloud.row_of(row)
        assert found is not None
        return cloud, found

    def file_points(self, rows: NDArray[np.intp], view: View) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        samples = self.pose.pose.measured.range_points
        away = samples.overview.origin - view.origin
        return rows, samples.of_samples("positions", rows) + away

    def frames(self, rows: NDArray) -> NDArray[np.uint8] | None:
        average = self.pose.pose.average
        return None if average is None else average.counts[rows]

    def points_along(
        self, ray: Ray, reach: float, view: View, seen: Callable[[], NDArray[np.intp]]
    ) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """The points that pixels around show, and those near the ray's start: no others are at hand."""
        rows, points = self.file_points(seen(), view)
        near = self.pose.pose.measured.range_points.around(ray.start + view.origin, _ENOUGH)
        assert near.ids is not None
        ids = np.concatenate([rows, near.ids.astype(np.intp)])
        points = np.concatenate([points, near.world() - view.origin])
        once = np.unique(ids, return_index=True)[1]
        return ids[once], points[once]


def _scalar(cloud: PointCloud, name: str, zero: float) -> NDArray[np.float32]:
    return as_float32(cloud.scalars[name], zero)


def _sample_scalar(samples: RangePoints, name: str, zero: float) -> NDArray[np.float32]:
    return as_float32(samples.all_samples(name), zero)


def _heights(cloud: PointCloud, axis: tuple[float, ...]) -> NDArray[np.float32]:
    return cloud.positions @ np.array(axis, np.float32)
