"""Averages of frames: less noise where nothing moves.

A point of a frame becomes the mean of a run of frames: the frame itself and the frames before it, back to the
first in which the point was elsewhere. So an average depends only on frames k - N + 1 to k, however the user
came to frame k. Points move alone or with the points of their cell. A cell of neighbours shows a motion that
is far smaller than the noise of one point.

* Noise is how far points move against the mean of their cell from the frame before, so common motion does
  not count. Where that is far more than in most cells, neighbours move
  differently, and the usual noise counts. In range images, the usual noise grows as the surface turns away
  from the pod.
* A run ends at the frame in which a point lies too far from the mean of the run so far, or its cell does.
* If a cell drifts steadily within its run, none of its points is averaged.

A point whose run is one frame keeps its very bits.

Frames may hold other points of the surface, in no common order. Then the mean surface of each cell takes the
place of the point in the tests, and points move along the normal only.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import chain, islice
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..task import checkpoint
from .points import PointCloud
from .pose import Average, Matched, Pose
from .range_points import RangePoints
from .range_view import RangeView

if TYPE_CHECKING:
    from .averaging_kernels import CellGrid, Frames

MOST_FRAMES = 64
_OCCUPIED = 8.0, 16.0, 32.0  # points of a cell: at least, wanted and at most, on average
_PER_EXTENT = 2.4  # cells of a body or a sheet that is one edge long
_TRIALS = 4  # of the edges of cells
_BLOCK = 4  # pixels along each edge of a cell of a range image
_ALONE, _TOGETHER = 4.0, 4.5  # deviations beyond which a point or the mean of a cell has moved
_FEWEST = 4  # points of a cell whose mean counts
_SHRUNK = 16.0  # points with the usual noise that count for the noise of each cell
_STEEPEST = 10.0  # times the noise of a surface that faces the pod: 84 degrees, as in `Faults.deviation`
_UNUSUAL = 2.5  # times the usual noise, beyond which points of a cell move differently
_APART = 1.0  # spacings that rows of one place are apart at most, in most cells
_CUT = 1.4  # times the points of a cell that a plane through its middle has
_SAME_ROWS = 0.5  # share of the ids that two frames have in common at least
_PRESENT = 0.25  # of the points of a cell that another frame has there at least
_SHORTEST = 4  # frames of a run that motion ended; in a shorter one, points may still move
_ROUNDING = float(4 * np.finfo(np.float32).eps)
_SHARES = np.divide(1, np.maximum(np.arange(256), 1)).astype(np.float32)
_STEP = 0.5  # a level of a colour, which noise below one level rounds to


@dataclass(frozen=True)
class Averaging:
    """Averaging of the frames of a scan. frames: how many count at most; 0: none. is_measured: whether
    measures use averaged points too."""

    frames: int = 0
    is_measured: bool = False

    @property
    def is_on(self) -> bool:
        """Whether more than one frame counts."""
        return self.frames > 1


def averaged(pose: Pose, earlier: Iterable[Pose], averaging: Averaging) -> Pose:
    """The pose with each point at the mean of its run of frames.

    pose: as scanned. earlier: the poses before, the latest first; no more are read once all runs have ended.
    """
    made = _of_views(pose, earlier) if pose.views else _of_cloud(pose.cloud, earlier)
    average = Average(pose, averaging.frames, made.counts, made.matched, averaging.is_measured)
    return replace(pose, points=made.points, average=average)


class _Made(NamedTuple):
    """Averaged points, how many frames each is the mean of (of range views by pixel, 0 where there is no
    point), and by what frames were matched."""

    points: PointCloud | RangePoints
    counts: NDArray[np.uint8]
    matched: Matched


class _Runs:
    """The runs of N points, with three numbers each. labels: (N,) int32, the cell of each point, of so many
    cells. rounding: how far equal values may lie apart; infinite: all values count as equal. steepness: how
    many times the usual noise is to be expected in each cell, (M,), or in all."""

    def __init__(
        self,
        now: NDArray[np.float32],
        labels: NDArray[np.int32],
        cells: int,
        rounding: float,
        steepness: NDArray[np.float64] | float = 1.0,
    ) -> None:
        from .averaging_kernels import RunSums

        count = len(now)
        self.now, self.labels, self._cells, self._rounding = now, labels, cells, rounding
        self.run = RunSums(
            np.zeros((count, 3), np.float32), np.ones(count, np.uint8), np.ones(count, np.bool_)
        )
        self._squares = np.broadcast_to(np.square(steepness), cells)
        self.usual = 0.0  # variance of most cells: squared distances between two frames, by two
        self._variances: NDArray[np.float64] | None = None  # of each cell
        self._drifts = np.zeros((cells, 10))  # see `judge_cells`

    def add(
        self, number: int, then: NDArray[np.float32], shift: NDArray, is_there: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Let the points that have not moved take in an earlier frame; whether each did, (N,). number: how
        many frames before the current one."""
        from .averaging_kernels import Frames, end_cells, join_frame, judge_cells

        frames = Frames(self.now, then, np.asarray(shift, np.float32), is_there)
        if self._variances is None:
            self._variances = self._find_noise(frames)
        cells, joined = np.zeros((self._cells, 9), np.float32), np.empty(len(self.now), np.bool_)
        limits = (_ALONE**2 * self._variances).astype(np.float32)
        join_frame(frames, self.run, self.labels, limits, _SHARES, cells, joined)
        has_moved = np.empty(self._cells, np.bool_)
        if judge_cells(cells, self._variances, (_TOGETHER**2, _FEWEST), number, self._drifts, has_moved):
            end_cells(frames, self.run, self.labels, has_moved, joined)
        return joined

    def _find_noise(self, frames: Frames) -> NDArray[np.float64]:
        """The noise of each cell, (M,), and the usual noise, by the distances to another frame."""
        if np.isinf(self._rounding):
            return np.full(self._cells, np.inf)
        from .averaging_kernels import sum_steps

        cells = np.zeros((self._cells, 5), np.float32)
        sum_steps(frames, self.labels, cells)
        count = np.maximum(cells[:, 0], 1)
        spread = cells[:, 1] / count - np.einsum("ij,ij->i", cells[:, 2:], cells[:, 2:]) / count**2
        variances = np.maximum(spread, 0) * count / np.maximum(count - 1, 1) / 2
        known = (variances / self._squares)[cells[:, 0] >= _FEWEST]
        self.usual = float(np.median(known)) if len(known) else 0.0
        usual = self.usual * self._squares
        own = np.where(variances > _UNUSUAL**2 * usual, usual, variances)
        return (count * own + _SHRUNK * usual) / (count + _SHRUNK) + self._rounding**2

    def _end_moving(self) -> None:
        """Let points have runs of one frame where motion ended the runs after a few frames, and where a cell
        drifts steadily."""
        if self._variances is None or np.isinf(self._rounding):
            return
        counts, is_open = self.run.counts, self.run.is_open
        counts[~is_open & (counts < _SHORTEST)] = 1
        frames, t, tt, points = self._drifts[:, :4].T
        means, slopes = self._drifts[:, 4:7], self._drifts[:, 7:]
        with np.errstate(divide="ignore", invalid="ignore"):  # a cell without frames does not drift
            spread = tt - t**2 / (frames + 1)
            slopes = (slopes - (t / (frames + 1))[:, None] * means) / spread[:, None]
            variances = self._variances / (points / frames * spread)
            drifts = np.square(slopes).sum(axis=1) > _TOGETHER**2 * variances
        counts[(drifts & (frames >= 2))[self.labels]] = 1

    def means(self, still: NDArray[np.bool_] | None = None) -> NDArray[np.float32]:
        """The means, (N, 3), once all frames are there. still: the points that are averaged, (N,)."""
        from .averaging_kernels import write_means

        self._end_moving()
        if still is not None:
            self.run.counts[~still] = 1
        means = np.empty_like(self.now)
        write_means(self.now, self.run, means)
        return means


# --- points --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Cells:
    """Cells of points. labels: (N,) int32, the cell of each point. spacing: of the points, about. farthest:
    the largest coordinate. grid: of cubic cells."""

    labels: NDArray[np.int32]
    count: int
    spacing: float
    farthest: float = 0.0
    grid: CellGrid | None = None

    @classmethod
    def of(cls, positions: NDArray[np.float32]) -> _Cells:
        """Cubic cells of a dozen points."""
        from .averaging_kernels import label_cells

        ends = np.array([(axis.min(), axis.max()) for axis in positions.T], np.float32)  # quicker than by row
        low, labels = ends[:, 0].copy(), np.empty(len(positions), np.int32)
        least, wanted, most = _OCCUPIED
        edge = float((ends[:, 1] - low).max()) * np.sqrt(_PER_EXTENT * wanted / len(positions)) or 1.0
        for _ in range(_TRIALS):
            grid = label_cells(positions, low, edge, labels)
            count = len(grid.codes)
            points = len(positions) / count
            if least <= points <= most:
                break
            edge *= np.sqrt(wanted / points)
        return cls(labels, count, edge / np.sqrt(_CUT * points), float(np.abs(ends).max()), grid)


def _of_cloud(cloud: PointCloud, earlier: Iterable[Pose]) -> _Made:
    """The averaged points of a cloud."""
    if len(cloud) < _FEWEST:
        return _Made(cloud, np.ones(len(cloud), np.uint8), "rows")
    cells, poses = _Cells.of(cloud.positions), iter(earlier)
    first = list(islice(poses, 1))
    return _by_rows(cloud, cells, chain(first, poses)) or _by_surface(cloud, cells, chain(first, poses))


def _by_rows(cloud: PointCloud, cells: _Cells, earlier: Iterable[Pose]) -> _Made | None:
    """The averaged points of a cloud whose rows are the same points in all frames, else None."""
    runs = _Runs(cloud.positions, cells.labels, cells.count, _ROUNDING * cells.farthest)
    colors = None if cloud.colors is None else _of_numbers(cloud.colors, cells, _STEP)
    normals = None if cloud.normals is None else _of_numbers(cloud.normals, cells, np.inf)
    for number, pose in enumerate(earlier, 1):
        checkpoint()
        then = pose.cloud
        rows = _common_rows(cloud, then)
        if rows is None and number == 1:
            return None
        if rows is None:
            break
        joined = runs.add(number, rows.of(then.positions), then.origin - cloud.origin, rows.is_there)
        if number == 1 and cloud.topology is None and np.sqrt(runs.usual) > _APART * cells.spacing:
            return None
        if colors is not None and then.colors is not None:
            colors.add(number, rows.of(then.colors), np.zeros(3), joined)
        if normals is not None and then.normals is not None:
            normals.add(number, rows.of(then.normals), np.zeros(3), joined)
        if not runs.run.is_open.any():
            break
    means = runs.means()
    changed: dict[str, Any] = {"positions": means}
    still = runs.run.counts > 1
    if cloud.remainders is not None:
        changed["remainders"] = np.where(still[:, None], np.float32(0), cloud.remainders)
    if colors is not None:
        changed["colors"] = _with_levels(cloud.colors, colors.means(still))
    if normals is not None:
        changed["normals"] = _unit(normals.means(still), still)
    return _Made(replace(cloud, **changed), runs.run.counts, "rows")


def _by_surface(cloud: PointCloud, cells: _Cells, earlier: Iterable[Pose]) -> _Made:
    """The averaged points of a cloud if other frames have other points of the surface.

    In a cell that stands still, each point moves along the normal to the mean of the surfaces of the frames.
    Colours stay as scanned.
    """
    from .averaging_kernels import fit_cells, move_to_surface, smooth_planes, sum_moments

    assert cells.grid is not None
    sums = np.zeros((cells.count, 10), np.float32)
    sum_moments(cloud.positions, np.zeros(3, np.float32), cells.grid, sums)
    planes = np.empty((cells.count, 7))
    fit_cells(sums.astype(np.float64), planes)
    known = planes[np.isfinite(planes[:, 6]), 6]
    usual = float(np.median(known)) if len(known) else 0.0
    is_plane = planes[:, 6] <= _UNUSUAL**2 * usual
    variances = np.where(is_plane, planes[:, 6], usual) + (_ROUNDING * cells.farthest / cells.grid.edge) ** 2
    pooled, frames, is_open = sums.astype(np.float64), np.ones(cells.count, np.uint8), is_plane.copy()
    for pose in earlier:
        checkpoint()
        then = np.zeros_like(sums)
        shift = (pose.cloud.origin - cloud.origin).astype(np.float32)
        sum_moments(pose.cloud.positions, shift, cells.grid, then)
        apart = _along(planes, then) - _along(planes, pooled)
        is_there = then[:, 0] >= np.maximum(_FEWEST, _PRESENT * sums[:, 0])
        with np.errstate(divide="ignore"):
            limits = _TOGETHER**2 * variances * (1 / then[:, 0] + 1 / pooled[:, 0])
        is_open &= ~is_there | (np.square(apart) <= limits)
        joins = is_open & is_there
        pooled[joins] += then[joins]
        frames[joins] += 1
        if not is_open.any():
            break
    frames[~is_open & (frames < _SHORTEST)] = 1
    pooled[frames == 1] = sums[frames == 1]
    near = np.empty((cells.count, 27), np.int32)
    smooth = smooth_planes(cells.grid, pooled, near)
    counts = frames[cells.labels]
    limits = _ALONE * np.sqrt(variances)
    moved = move_to_surface(cloud.positions, cells.labels, cells.grid, smooth, near, limits, counts)
    return _Made(replace(cloud, positions=moved), counts, "surface")


def _along(planes: NDArray[np.float64], sums: NDArray[np.floating]) -> NDArray[np.float64]:
    """How far the mean points of cells lie off planes, (M,); 0 where there is no point."""
    means = sums[:, 1:4] / np.maximum(sums[:, :1], 1)
    return np.einsum("ij,ij->i", means - planes[:, :3], planes[:, 3:6])


def _of_numbers(values: NDArray, cells: _Cells, rounding: float) -> _Runs:
    return _Runs(np.ascontiguousarray(values[:, :3], np.float32), cells.labels, cells.count, rounding)


def _with_levels(colors: NDArray[np.uint8] | None, means: NDArray[np.float32]) -> NDArray[np.uint8]:
    assert colors is not None
    changed = colors.copy()
    changed[:, :3] = _levels(means)
    return changed


def _levels(values: NDArray[np.float32]) -> NDArray[np.uint8]:
    return np.floor(values + 0.5).astype(np.uint8)


def _unit(normals: NDArray[np.float32], still: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Normals of unit length where points stand still; the others as they are."""
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(still[:, None] & (lengths > 0), normals / np.maximum(lengths, _ROUNDING), normals)


@dataclass(frozen=True)
class _Rows:
    """Rows of an earlier frame's points. at: (N,), None where they are those of the current frame. is_there:
    (N,) bool, whether the frame has the point."""

    at: NDArray[np.intp] | None
    is_there: NDArray[np.bool_]

    def of(self, values: NDArray) -> NDArray[np.float32]:
        """The first three values of the rows, (N, 3)."""
        taken = values[:, :3] if self.at is None else values[self.at, :3]
        return np.ascontiguousarray(taken, np.float32)


def _common_rows(now: PointCloud, then: PointCloud) -> _Rows | None:
    """The rows of the same points in an earlier frame, by their indices in the file; None where the frames
    have not enough in common."""
    if now.topology != then.topology:
        return None
    if now.ids is None and then.ids is None:
        return _Rows(None, np.ones(len(now), np.bool_)) if len(now) == len(then) else None
    if not len(then):
        return None
    ours, theirs = (np.arange(len(one)) if one.ids is None else one.ids for one in (now, then))
    at = np.minimum(np.searchsorted(theirs, ours), len(theirs) - 1)
    is_there = theirs[at] == ours
    return _Rows(at, is_there) if np.count_nonzero(is_there) >= _SAME_ROWS * len(now) else None


# --- range images --------------------------------------------------------------------------------


def _of_views(pose: Pose, earlier: Iterable[Pose]) -> _Made:
    """The averaged range views of a pose."""
    images = [_Image(view) for view in pose.views]
    for number, then in enumerate(earlier, 1):
        checkpoint()
        if len(then.views) != len(images):
            break
        for image, view in zip(images, then.views, strict=True):
            image.add(number, view)
        if not any(image.depths.run.is_open.any() for image in images):
            break
    views = tuple(image.averaged() for image in images)
    return _Made(RangePoints.of(views), np.concatenate([image.counts for image in images]), "pixels")


class _Image:
    """The runs of the pixels of a range view."""

    def __init__(self, view: RangeView) -> None:
        self._view, self._valid = view, view.valid().ravel()
        height, width = view.depth.shape
        rows, columns = np.arange(height) // _BLOCK, np.arange(width) // _BLOCK
        across = int(columns[-1]) + 1
        labels = (rows[:, None] * across + columns).ravel().astype(np.int32)
        cells = _Cells(labels, across * (int(rows[-1]) + 1), 1.0)
        numbers = _numbers(view, self._valid)
        largest = max(numbers.max(initial=0), -numbers.min(initial=0))
        self.depths = _Runs(numbers, labels, cells.count, _ROUNDING * largest, _steepness(view))
        self.depths.run.is_open[:] = self._valid
        self._colors: _Runs | None = None
        if view.color is not None:
            step = _STEP if view.color.dtype == np.uint8 else 0.0
            self._colors = _of_numbers(view.color.reshape(-1, 3), cells, step)

    def add(self, number: int, then: RangeView) -> None:
        """Take in the same view of an earlier frame; one that has another calibration ends all runs."""
        if not _is_same_camera(self._view, then):
            self.depths.run.is_open[:] = False
            return
        seen = then.valid().ravel()
        is_there = seen & self._valid
        joined = self.depths.add(number, _numbers(then, seen), np.zeros(3), is_there)
        if self._colors is not None and then.color is not None:
            color = np.ascontiguousarray(then.color.reshape(-1, 3), np.float32)
            self._colors.add(number, color, np.zeros(3), joined)

    def averaged(self) -> RangeView:
        """The view with its averages."""
        view, numbers = self._view, self.depths.means()
        still = self.depths.run.counts > 1
        changed: dict[str, Any] = {
            "depth": np.where(still, numbers[:, -1], view.depth.ravel()).reshape(view.depth.shape)
        }
        if view.xy is not None:
            xy = np.where(still[:, None], numbers[:, :2], view.xy.reshape(-1, 2))
            changed["xy"] = xy.reshape(view.xy.shape)
        if view.color is not None and self._colors is not None:
            means = self._colors.means(still)
            levels = _levels(means) if view.color.dtype == np.uint8 else means.astype(np.float16)
            changed["color"] = levels.reshape(view.color.shape)
        return replace(view, **changed)

    @property
    def counts(self) -> NDArray[np.uint8]:
        """How many frames each pixel is the mean of, (H * W,); 0 where it sees no point."""
        return np.where(self._valid, self.depths.run.counts, np.uint8(0))


def _steepness(view: RangeView) -> NDArray[np.float64]:
    """How many times deeper the noise of each cell is than where the surface faces the pod, (M,): one over
    the cosine of the incidence, by the mean depths of the cells around.

    Of the two sides of a cell, the flatter one counts: at an outline, that is the cell's own surface.
    """
    edges = [(0, -size % _BLOCK) for size in view.depth.shape]
    valid = np.pad(view.valid(), edges)
    depth = np.where(valid, np.pad(view.depth, edges), 0)
    shape = (valid.shape[0] // _BLOCK, _BLOCK, valid.shape[1] // _BLOCK, _BLOCK)
    counts = valid.reshape(shape).sum(axis=(1, 3))
    sums = depth.reshape(shape).sum(axis=(1, 3), dtype=np.float64)
    means = np.divide(sums, counts, out=np.full(counts.shape, np.nan), where=counts > 0)
    squares = np.zeros(means.shape)
    with np.errstate(over="ignore", invalid="ignore"):  # of depths beyond all measure
        for axis, focal in enumerate((view.fy, view.fx)):
            apart = _BLOCK / focal * (1.0 if view.kind == "height" else means)
            steps = np.abs(np.diff(means, axis=axis))
            ends = [(int(axis == 0), 0), (int(axis == 1), 0)]
            before = np.pad(steps, ends, constant_values=np.nan)
            after = np.pad(steps, [end[::-1] for end in ends], constant_values=np.nan)
            squares += np.nan_to_num(np.square(np.fmin(before, after) / apart), nan=0.0)
    return np.minimum(np.sqrt(1 + squares), _STEEPEST).ravel()


def _numbers(view: RangeView, valid: NDArray[np.bool_]) -> NDArray[np.float32]:
    """The numbers that a view measures, (H * W, 3): x and y, 0 where they are not measured, and depth; 0
    where it sees no point."""
    measured = np.zeros((view.depth.size, 3), np.float32)
    np.copyto(measured[:, 2], view.depth.ravel(), where=valid)
    if view.xy is not None:
        np.copyto(measured[:, :2], view.xy.reshape(-1, 2), where=valid[:, None])
    return measured


def _is_same_camera(view: RangeView, other: RangeView) -> bool:
    names = ("kind", "fx", "fy", "cx", "cy", "distortion")
    return (
        view.depth.shape == other.depth.shape
        and (view.xy is None) == (other.xy is None)
        and all(getattr(view, name) == getattr(other, name) for name in names)
        and np.array_equal(view.world_to_camera, other.world_to_camera)
    )
