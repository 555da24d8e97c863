"""A pose: one moment of a scan."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..bounds import Bounds
from ..camera import Camera
from ..errors import InputError
from .points import PointCloud, strided
from .range_points import RangePoints
from .range_view import RangeView
from .reading.orientation import complete
from .reading.sequence import Decided
from .sides import FoundSides
from .spacing import ENOUGH, roughness, typical_spacing
from .upright import Upright, guess_up

Scanned = PointCloud | tuple[RangeView, ...]  # what a frame holds
Matched = Literal["rows", "pixels", "surface"]  # by what points of two frames are the same

_TELEPHOTO = 0.5  # degrees from bottom to top, below which rays may be as good as parallel


class Life:
    """A token that a pose shares with itself at other times. Its GPU data live as long as the token."""

    __slots__ = ("__weakref__",)


@dataclass(frozen=True, eq=False)
class Average:
    """How a pose was averaged over frames, see `averaging`.

    raw: the pose as scanned. frames: how many frames count at most. counts: (N,) uint8, how many frames each
    point is the mean of, by row of the cloud, or by sample of the range views (0: it sees no point).
    matched: by what the frames were matched; "surface": their points have no common order. is_measured:
    whether measures use the averaged points.
    """

    raw: Pose
    frames: int
    counts: NDArray[np.uint8]
    matched: Matched
    is_measured: bool = False

    @cached_property
    def share(self) -> float:
        """The share of the points that stand still and are averaged, 0 to 1."""
        points = np.count_nonzero(self.counts)
        return np.count_nonzero(self.counts > 1) / points if points else 0.0

    @cached_property
    def usual(self) -> int:
        """The median number of frames of the points that stand still; 1 where none does."""
        still = self.counts[self.counts > 1]
        return int(np.median(still)) if len(still) else 1


class ScanKey:
    """A token that the poses of a scan share.

    decided: how Scan4D reads the scan; None: the pose stands alone. It stays in this process.
    """

    __slots__ = ("__weakref__", "decided", "sides")

    def __init__(self, decided: Decided | None = None) -> None:
        self.decided = decided
        self.sides: FoundSides | None = None  # of the pose with the most doubtful ones so far

    def __reduce__(self) -> tuple[type[ScanKey], tuple[()]]:
        """Another process has no record of decisions."""
        return ScanKey, ()

    def note_sides(self, found: FoundSides | None) -> None:
        """Put into the record how Scan4D found the sides of estimated normals; None: it did not have to."""
        if self.decided is None or found is None:
            return
        if self.sides is None or found.doubtful > self.sides.doubtful:
            self.sides = found
            complete(self.decided, found)


@dataclass(frozen=True, eq=False)
class Pose:
    """One moment of a scan, on the CPU.

    index: its number on the timeline. time: seconds. label: the file or frame it came from. points: its
    points, or those of the range views where it was scanned as such. average: how they were averaged over
    frames, None where they are as scanned. life: see `Life`. scan: of its scan, see `ScanKey`.

    Merging the points of range views takes time and memory. It happens when something first reads `cloud`;
    the `overview` needs no merging.
    """

    index: int
    time: float
    label: str
    points: PointCloud | RangePoints
    average: Average | None = None
    scan: ScanKey = field(default_factory=ScanKey, repr=False)
    life: Life = field(default_factory=Life, init=False, repr=False)

    @classmethod
    def of(cls, index: int, time: float, label: str, scanned: Scanned, scan: ScanKey | None = None) -> Pose:
        """The pose of what a frame holds. Raises InputError where range views see nothing."""
        points = scanned if isinstance(scanned, PointCloud) else RangePoints.of(scanned)
        return cls(index, time, label, points, scan=scan or ScanKey())

    @property
    def raw(self) -> Pose:
        """The pose as scanned."""
        return self if self.average is None else self.average.raw

    @property
    def measured(self) -> Pose:
        """The pose that measures use: as scanned, unless the user measures on averaged points."""
        return self if self.average is None or self.average.is_measured else self.average.raw

    @property
    def cloud(self) -> PointCloud:
        """All points. The first call merges those of range views, on any thread, and caches them."""
        return self.points if isinstance(self.points, PointCloud) else self.points.cloud

    @property
    def is_merged(self) -> bool:
        """Whether `cloud` exists already."""
        return isinstance(self.points, PointCloud) or self.points.is_merged

    @property
    def views(self) -> tuple[RangeView, ...]:
        """The range views of the scan; none if it holds only points."""
        return () if isinstance(self.points, PointCloud) else self.points.views

    @property
    def range_points(self) -> RangePoints:
        """The points of the range views. Raises InputError if there are none."""
        if isinstance(self.points, PointCloud):
            raise InputError("the scan has no range views")
        return self.points

    @property
    def upright(self) -> Upright:
        """Guess of what is up, see `guess_up`; found once, in some milliseconds."""
        return self.overview.remember(guess_up, views=self.views)

    @property
    def overview(self) -> PointCloud:
        """A cloud with the origin and the attributes of `cloud`, to find facts by: of range views some
        thousands of the points, spread evenly; else `cloud` itself."""
        return self.points if isinstance(self.points, PointCloud) else self.points.overview

    @property
    def count(self) -> int:
        """Number of points; of range views, of the pixels that see one."""
        return len(self.points) if isinstance(self.points, PointCloud) else self.points.count

    @property
    def dropped(self) -> int:
        """Number of points left out of `cloud`; 0 before it exists."""
        return self.cloud.dropped if self.is_merged else 0

    @property
    def origin(self) -> NDArray[np.float64]:
        """The origin that positions are relative to, (3,) scan units."""
        return self.overview.origin

    @property
    def bounds(self) -> Bounds:
        """The box around the body of the points, see `PointCloud.bounds`; of the `overview`. Raises
        InputError where there is no point."""
        return self.overview.bounds()

    def drawn_bounds(self, camera: Camera | None = None) -> Bounds:
        """The robust bounds; a box of two units if there is no point. Through a telephoto lens, the bounds of
        all points and their splats: there, no point may be drawn at another depth than its own."""
        if not len(self.overview):
            return Bounds(self.origin - 1, self.origin + 1)
        if camera is None or camera.fov_y > _TELEPHOTO or not isinstance(self.points, PointCloud):
            return self.bounds
        return self.points.whole_bounds().grown(self.points.longest_reach())

    @property
    def sample(self) -> NDArray[np.float64]:
        """Some of the positions, (M, 3), relative to the origin: for ranges."""
        return strided(self.overview.positions).astype(np.float64)

    @property
    def spacing(self) -> float:
        """The typical distance between neighbouring points, scan units, see `typical_spacing`."""
        return typical_spacing(self.points) if isinstance(self.points, PointCloud) else self.points.spacing

    @property
    def roughness(self) -> float:
        """How far points lie off the planes through their neighbours, scan units, see `spacing.roughness`."""
        return roughness(self.points) if isinstance(self.points, PointCloud) else self.points.roughness

    def around(self, position: NDArray[np.float64], least: int = ENOUGH) -> PointCloud:
        """A cloud that has at least so many of the points nearest to a position, (3,) scan units: all, or
        those that range views see in pixels round it."""
        return self.points if isinstance(self.points, PointCloud) else self.points.around(position, least)

    @property
    def nbytes(self) -> int:
        """Bytes held by its arrays, with those of the pose as scanned: more once points are merged."""
        if self.average is None:
            return self.points.nbytes
        raw = self.average.raw
        is_shared = isinstance(self.points, PointCloud) and isinstance(raw.points, PointCloud)
        own = self.points.bytes_beside(raw.points) if is_shared else self.points.nbytes  # type: ignore[union-attr, arg-type]
        return own + self.average.counts.nbytes + raw.nbytes

    def __getstate__(self) -> dict[str, Any]:
        """All that another process needs, which is not the pose as scanned."""
        return {**self.__dict__, "average": None}

    def with_cloud(self, cloud: PointCloud) -> Pose:
        """Put a cloud that has more attributes of the same points in place of `cloud`."""
        points = cloud if isinstance(self.points, PointCloud) else self.points.with_cloud(cloud)
        return replace(self, points=points)

    def at(self, time: float) -> Pose:
        """Move it to another time, seconds; what is on the GPU of it stays."""
        average = self.average and replace(self.average, raw=self.average.raw.at(time))
        moved = replace(self, time=time, average=average)
        object.__setattr__(moved, "life", self.life)
        return moved
