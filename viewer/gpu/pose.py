"""A pose on the GPU: a structure of arrays, each uploaded once and only when something reads it."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..bounds import Bounds
from ..errors import InputError
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..scan.range_view import RangeView
from . import gl
from .arrays import GpuArray, shared_arrays
from .context import Gpu, Workspace
from .range_samples import RangeSamples

# What one texel of each array is.
FORMATS = {
    "positions": gl.RGB32F,
    "normals": gl.RGB32F,
    "colors": gl.RGBA8,
    "ids": gl.R32UI,
    "radii": gl.R32F,
    "axes": gl.RGBA32F,
}
_RANGES = "samples"  # the name that samples of range views are uploaded by
M = TypeVar("M", bound=Workspace)


@dataclass
class Spent:
    """The work on a pose since its last picture.

    upload_ms, derive_ms: time, milliseconds. nbytes: of the arrays that came to the GPU. shared: names of
    arrays that other poses already had there.
    """

    upload_ms: float = 0.0
    derive_ms: float = 0.0
    nbytes: int = 0
    shared: tuple[str, ...] = ()

    def add(self, other: Spent) -> None:
        """Add other work."""
        self.upload_ms += other.upload_ms
        self.derive_ms += other.derive_ms
        self.nbytes += other.nbytes
        self.shared += other.shared


class PosePart(NamedTuple):
    """A run of a pose's points. first: the row that it begins with."""

    first: int
    pose: GpuPose


class GpuPose:
    """The arrays of a pose's points as buffer textures, indexed by row, and the samples of its range views.

    A row is the index of a point in the cloud's arrays; `cloud.ids` gives its index in the file.
    `stored` is the cloud as the scan has it, `cloud` the same with what was estimated since.
    Automatic choices look at `stored`, so that they do not depend on what happened before. The first read of
    either merges the points of range views.

    A GpuPose has more than 30 methods because it answers for a cloud: octants, which only the GPU has, give
    the same facts without reading their arrays.

    pose: as it was given. spent: the work since the last picture, which the frame takes. origin: what
    positions on the GPU are relative to, (3,) scan units: the pose's origin, or that of the view drawn last.
    """

    def __init__(self, gpu: Gpu, pose: Pose) -> None:
        self.gpu = gpu
        self.pose = pose
        self.origin = pose.origin
        self.spent = Spent()
        self._arrays: dict[str, GpuArray] = {}
        self._packed: dict[tuple[Hashable, ...], GpuArray] = {}  # by function and arguments
        self._uploads: dict[str, GpuArray] = {}  # arrays that are not complete yet
        self._samples: RangeSamples | None = None
        self._estimated: PointCloud | None = None
        self._parts: tuple[PosePart, ...] = ()
        self._made: dict[Callable[..., Any], Workspace] = {}

    @cached_property
    def stored(self) -> PointCloud:
        """The points as the scan has them."""
        return self.pose.cloud

    @property
    def is_split(self) -> bool:
        """Whether it has more points than a buffer texture has texels: then only its `parts` have arrays."""
        return self.pose.count > self.gpu.max_points

    @property
    def parts(self) -> tuple[PosePart, ...]:
        """Runs of the points, each a pose of its own with as many as a buffer texture takes."""
        if not self._parts:
            self._parts = tuple(
                PosePart(
                    first,
                    GpuPose(self.gpu, replace(self.pose, points=self.cloud.between(first, first + most))),
                )
                for most in (self.gpu.max_points,)
                for first in range(0, len(self.cloud), most)
            )
            for part in self._parts:
                part.pose.center(self.origin)
        return self._parts

    @property
    def cloud(self) -> PointCloud:
        """The points with what was estimated of them."""
        return self._estimated or self.stored

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.cloud)

    def has(self, name: str) -> bool:
        """Whether the scan has this array of `PointCloud`, or it was estimated."""
        return getattr(self.cloud, name) is not None

    def add_estimates(self, arrays: Mapping[str, Any]) -> None:
        """Add attributes that the scan lacks, by name."""
        self._parts = ()
        self._estimated = replace(self.cloud, **arrays)

    @property
    def estimated_bytes(self) -> int:
        """Bytes of the estimates on the CPU."""
        return 0 if self._estimated is None else self._estimated.nbytes - self.stored.nbytes

    @property
    def views(self) -> tuple[RangeView, ...]:
        """The pose's range views."""
        return self.pose.views

    @property
    def overview(self) -> PointCloud:
        """A cloud with the pose's origin and attributes, without merging, see `Pose.overview`."""
        return self.pose.overview

    @property
    def bounds(self) -> Bounds:
        """The pose's robust bounds; a box of two units if there is no point."""
        return self.pose.drawn_bounds()

    @property
    def whole_bounds(self) -> Bounds:
        """The box around all points. Raises InputError where there is no point."""
        return self.cloud.whole_bounds()

    @property
    def reaches(self) -> tuple[float, float]:
        """How far splats reach, scan units: see `PointCloud.reaches`."""
        return self.cloud.reaches()

    @property
    def sample(self) -> NDArray[np.float64]:
        """Some of the positions, (M, 3), relative to the origin: for ranges."""
        return self.pose.sample + (self.pose.origin - self.origin)

    def center(self, origin: NDArray[np.float64]) -> None:
        """Count positions on the GPU from this origin, (3,). If it is another one, positions and packed
        arrays are uploaded again."""
        if origin is self.origin or (origin == self.origin).all():
            return
        self.origin = origin
        for part in self._parts:
            part.pose.center(origin)
        self._uploads.pop("positions", None)
        self._arrays.pop("positions", None)
        self._packed.clear()

    @property
    def _centered(self) -> PointCloud:
        """The cloud relative to the origin of positions on the GPU."""
        return self.cloud if (self.origin == self.cloud.origin).all() else self.cloud.centered(self.origin)

    # --- bytes and times --------------------------------------------------------------

    @property
    def uploaded_bytes(self) -> int:
        """Bytes on the GPU."""
        return self._bytes_of(lambda array: array.nbytes)

    @property
    def counted_bytes(self) -> int:
        """Bytes on the GPU; of arrays that it shares with other poses, its part. Parts add up."""
        return self._bytes_of(lambda array: array.nbytes // len(array.holders))

    def _bytes_of(self, nbytes: Callable[[GpuArray], int]) -> int:
        samples = self._samples.nbytes if self._samples is not None and self._samples.complete else 0
        made = sum(each.nbytes for each in self._made.values())
        made += sum(part.pose._bytes_of(nbytes) for part in self._parts)
        return samples + made + sum(map(nbytes, chain(self._arrays.values(), self._packed.values())))

    @contextmanager
    def preparing(self, kind: str) -> Iterator[None]:
        """Count the time that runs inside as spent on "upload" or "derive"."""
        start = time.perf_counter()
        yield
        name = f"{kind}_ms"
        setattr(self.spent, name, getattr(self.spent, name) + (time.perf_counter() - start) * 1e3)

    def take_spent(self) -> Spent:
        """The work since the last call."""
        taken, self.spent = self.spent, Spent()
        for part in self._parts:
            taken.add(part.pose.take_spent())
        return taken

    # --- arrays -----------------------------------------------------------------------

    def array(self, name: str) -> gl.BufferTexture:
        """positions, normals, colors, radii, axes or ids, with a texel for each row. The first call uploads
        it. Raises InputError if the scan has none and none was estimated."""
        if name not in self._arrays:
            self.upload([name])
        return self._arrays[name].texels

    def find(self, name: str) -> gl.BufferTexture | None:
        """The array on the GPU; None if the scan has none and none was estimated."""
        return self.array(name) if self.has(name) else None

    @property
    def samples(self) -> RangeSamples:
        """The samples of the range views. The first call uploads them and makes their pyramids. Raises
        InputError if there is no range view, or the driver does not take so many samples."""
        self.upload([_RANGES])
        assert self._samples is not None
        return self._samples

    def names_of(self, needs: Iterable[str]) -> list[str]:
        """The arrays to upload for pictures that read these, of those that are there, or "samples"."""
        names = [name for name in needs if name != "views" and self.has(name)]
        return [*names, _RANGES] if "views" in needs else ["positions", *names]

    def upload(self, names: Iterable[str], budget_ms: float = np.inf) -> bool:
        """Upload what is missing of these arrays, in slices until the time is over; whether all is there."""
        if self.is_split and _RANGES not in (names := list(names)):
            end = time.perf_counter() + budget_ms / 1e3
            return all(
                part.pose.upload(names, max(1e3 * (end - time.perf_counter()), 0.0)) for part in self.parts
            )
        missing = [name for name in names if name not in self._arrays]
        if self._samples is not None and self._samples.complete:
            missing = [name for name in missing if name != _RANGES]
        if not missing:
            return True
        with self.preparing("upload"):
            end = time.perf_counter() + budget_ms / 1e3
            return all(self._upload(name, end) for name in missing)

    def packed(
        self,
        pack: Callable[..., NDArray],
        *args: Hashable,
        texel_format: int = gl.R32F,
        of: Any = None,
        only: bool = False,
    ) -> gl.BufferTexture:
        """Another arrangement of the pose's points: `pack(cloud, *args)`, made and uploaded at the first call
        for these arguments. of: what `pack` reads instead of the cloud. only: drop those for other arguments.
        """
        key = (pack, of, *args)
        if key not in self._packed:
            for gone in [other for other in self._packed if only and other[0] is pack]:
                del self._packed[gone]
            self._packed[key] = self.new_array(
                lambda: pack(self._centered if of is None else of, *args), texel_format
            )
        return self._packed[key].texels

    def new_array(self, make: Callable[[], NDArray], texel_format: int = gl.R32F) -> GpuArray:
        """Upload an array for the caller to hold, and count this as work on the pose."""
        with self.preparing("upload"):
            array = GpuArray(self.gpu, make(), texel_format)
            array.write()
            self._hold(array)
            array.values = None  # only shared arrays hold these
        return array

    def cached(self, make: Callable[[GpuPose], M]) -> M:
        """Make `make(pose)` once. The pose counts and releases the result."""
        if make not in self._made:
            self._made[make] = make(self)
        return self._made[make]  # type: ignore[return-value]

    def adopt(self, passed: GpuPose) -> None:
        """Take the arrays that this pose has in common with one that goes: else they would go with it."""
        for name, array in passed._arrays.items():
            values = getattr(self.overview, name)
            is_same = name != "positions" and values is not None and values is array.values
            if is_same and name not in self._arrays:
                self._take_shared(name, values)

    def _upload(self, name: str, end: float) -> bool:
        """Go on with an array or the samples until that time of the performance counter; whether it is
        there."""
        if name == _RANGES:
            if self._samples is None:
                self._samples = RangeSamples(self.gpu, self.pose.range_points.views)
            return self._samples.upload(end)
        if name not in self._uploads:
            values = self._values(name)
            if self._take_shared(name, values):
                return True
            self._uploads[name] = GpuArray(self.gpu, values, FORMATS[name])
        if not self._uploads[name].write(end):
            return False
        array = self._arrays[name] = self._uploads.pop(name)
        self._hold(array)
        if array.values is getattr(self.cloud, name):
            shared_arrays(self.gpu)[name, id(array.values)] = array
        else:
            array.values = None
        return True

    def _hold(self, array: GpuArray) -> None:
        array.holders.add(self)
        self.spent.nbytes += array.nbytes

    def _take_shared(self, name: str, values: NDArray) -> bool:
        """Take an array that another pose has brought to the GPU; whether there is one."""
        # While the entry holds the values, no other object has their id.
        array = shared_arrays(self.gpu).get((name, id(values)))
        if array is None:
            return False
        self._arrays[name] = array
        array.holders.add(self)
        self.spent.shared += (name,)
        return True

    def _values(self, name: str) -> NDArray:
        values: NDArray | None = getattr(self._centered if name == "positions" else self.cloud, name)
        if values is None:
            hint = (
                "Pass the look to the rendering call, which then estimates missing data"
                if name == "normals"
                else None
            )
            raise InputError(f"the scan has no {name}", hint=hint)
        return values

    def __del__(self) -> None:
        self.gpu.discard(*self._made.values(), self._samples)
