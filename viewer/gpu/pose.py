"""A pose on the GPU: a structure of arrays, each uploaded once and only when asked for."""

from __future__ import annotations

import time
import weakref
from collections import deque
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, TypeVar

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..bounds import Bounds
from ..camera import Camera
from ..errors import InputError, unknown_name
from ..scan.points import PointCloud, strided
from ..scan.pose import Pose
from ..scan.range_points import RangePoints
from ..scan.range_view import RangeView
from ..scan.ranges import robust_range
from . import gl
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
_TELEPHOTO = 0.5  # degrees from bottom to top, below which rays may be as good as parallel
M = TypeVar("M", bound=Workspace)

_SLICE = 1 << 22  # bytes uploaded at a time: a few milliseconds


class GpuPose:
    """The arrays of a pose's points as buffer textures, indexed by row, and the samples of its range views.

    A row is a point's place in the cloud's arrays; `cloud.ids` gives its index in the file.
    `stored` is the cloud as the scan has it, `cloud` the same with what was estimated since;
    whatever is chosen automatically looks at `stored`, so that it does not change by history. Points of
    range views are merged when either is first read. pose: as it was given.
    """

    def __init__(self, gpu: Gpu, pose: Pose) -> None:
        self.gpu = gpu
        self.pose = pose
        self._arrays: dict[Hashable, gl.BufferTexture] = {}  # by name; what is packed, by how
        self._shared: dict[str, SharedArray] = {}  # what holds those of them that poses may have in common
        self._samples: RangeSamples | None = None
        self._uploads: dict[str, _Upload] = {}  # that have begun
        self._estimated: PointCloud | None = None
        self._uploaded_bytes = 0
        self._uploads_of_late = Uploaded()
        self._spent = {"upload": 0.0, "derive": 0.0}
        self._layers: dict[int, Layer] = {}
        self._made: dict[Callable[..., Any], Workspace] = {}
        self._origin = pose.origin

    @cached_property
    def stored(self) -> PointCloud:
        """The points as the scan has them. Raises InputError for more than the driver takes."""
        if self.pose.count > self.gpu.max_points:
            raise InputError(
                f"has {self.pose.count:,} points in one pose, but this driver can handle only "
                f"{self.gpu.max_points:,}",
                hint="Split the scan or thin it out",
            )
        return self.pose.cloud

    @property
    def cloud(self) -> PointCloud:
        """The points with what was estimated of them."""
        return self._estimated or self.stored

    def add_estimates(self, arrays: Mapping[str, Any]) -> None:
        """Take in attributes that the scan lacks, by name."""
        self._estimated = replace(self.cloud, **arrays)

    @property
    def estimated_bytes(self) -> int:
        """Bytes on the CPU of what was estimated."""
        return 0 if self._estimated is None else self._estimated.nbytes - self.stored.nbytes

    @property
    def views(self) -> tuple[RangeView, ...]:
        """The pose's range views."""
        return self.pose.views

    @property
    def range_points(self) -> RangePoints:
        """The points of the range views. Raises InputError where there are none."""
        if isinstance(self.pose.points, PointCloud):
            raise InputError("the scan has no range views")
        return self.pose.points

    @property
    def overview(self) -> PointCloud:
        """The pose's cloud that tells origin and attributes."""
        return self.pose.overview

    @property
    def origin(self) -> NDArray[np.float64]:
        """The origin that positions on the GPU are relative to, (3,) scan units: the pose's, unless the view
        that was drawn last has another one."""
        return self._origin

    def center(self, origin: NDArray[np.float64]) -> None:
        """Have positions on the GPU count from this origin, (3,), from now on: where it is another one, they
        are uploaded anew, and what was packed of them."""
        if (origin == self._origin).all():
            return
        self._origin = origin
        self._uploads.pop("positions", None)
        for key in [key for key in self._arrays if key == "positions" or isinstance(key, tuple)]:
            self._drop_array(key)

    @property
    def _centered(self) -> PointCloud:
        """The cloud as the GPU has it: relative to its origin."""
        if (self._origin == self.cloud.origin).all():
            return self.cloud
        return self.cloud.centered(self._origin)

    @property
    def uploaded_bytes(self) -> int:
        """Bytes that it holds on the GPU."""
        samples = self._samples
        made = sum(each.nbytes for each in self._made.values())
        shared = sum(each.nbytes for each in self._shared.values())
        return self._uploaded_bytes + shared + made + (samples.nbytes if samples and samples.complete else 0)

    @property
    def counted_bytes(self) -> int:
        """Bytes that it holds on the GPU, and of what it shares with other poses its part: what adds up."""
        others = (each.nbytes - each.nbytes // len(each.holders) for each in self._shared.values())
        return self.uploaded_bytes - sum(others)

    @property
    def bounds(self) -> Bounds:
        """The pose's robust bounds; a box of two units where there is no point."""
        return drawn_bounds(self.pose)

    def array(self, name: str) -> gl.BufferTexture:
        """positions, normals, colors, radii, axes, ids, or 'scalar:NAME', with a texel for each row; or
        'sample:NAME', the scalar with a texel for each sample of range views. Uploaded at the first call."""
        self.upload([name])
        return self._arrays[name]

    def find(self, name: str) -> gl.BufferTexture | None:
        """The attribute on the GPU; None where the scan has none such and none was estimated."""
        return None if getattr(self.cloud, name) is None else self.array(name)

    @property
    def samples(self) -> RangeSamples:
        """The samples of the range views; uploaded, and their pyramids made, at the first call. Raises
        InputError where there is no range view, or the driver takes no so many samples."""
        self.upload([_RANGES])
        assert self._samples is not None
        return self._samples

    def names_of(self, needs: Iterable[str]) -> list[str]:
        """The arrays that a backend with these needs reads, of those that are there, or "samples"."""
        names = [name for name in needs if name != "views" and getattr(self.cloud, name) is not None]
        if "views" not in needs:
            return ["positions", *names]
        return [*names, _RANGES]

    def upload(self, names: Iterable[str], budget_ms: float = np.inf) -> bool:
        """Upload what is missing of these arrays, in slices until the time is over; whether all is there."""
        missing = [name for name in names if name not in self._arrays]
        if self._samples is not None and self._samples.complete:
            missing = [name for name in missing if name != _RANGES]
        if not missing:
            return True
        with self.preparing("upload"):
            end = time.perf_counter() + budget_ms / 1e3
            return all(self._upload(name, end) for name in missing)

    def packed(
        self, pack: Callable[..., NDArray], *args: Hashable, texel_format: int = gl.R32F
    ) -> gl.BufferTexture:
        """Another arrangement of the pose's arrays, which `pack` makes of its cloud and the arguments at the
        first call for these. Counted, kept and deleted with the arrays."""
        key = (pack, *args)
        if key not in self._arrays:
            with self.preparing("upload"):
                upload = _array_upload(self.gpu, pack(self._centered, *args))
                upload.go_on(np.inf)
                self._store_array(key, upload, texel_format)
        return self._arrays[key]

    def cached(self, make: Callable[[GpuPose], M]) -> M:
        """Make, once, what a backend finds of this pose's points on the GPU. Counted, kept and deleted with
        the arrays."""
        if make not in self._made:
            self._made[make] = make(self)
        return self._made[make]  # type: ignore[return-value]

    def _upload(self, name: str, end: float) -> bool:
        """Go on with an array or the samples until that time of the performance counter; whether it is
        there."""
        if name == _RANGES:
            return self._upload_samples(end)
        values = self._values(name) if name not in self._uploads else None
        if values is not None and self._take_shared(name, values):
            return True
        if values is not None:
            self._uploads[name] = _array_upload(self.gpu, values)
        if not self._uploads[name].go_on(end):
            return False
        upload, texel_format = self._uploads.pop(name), FORMATS.get(name, gl.R32F)
        if name in FORMATS and upload.values is getattr(self.cloud, name):
            self._arrays[name] = gl.BufferTexture(upload.target, texel_format)
            self._share(name, _shared_arrays(self.gpu).add(name, upload.values, self._arrays[name]))
            self._uploads_of_late.nbytes += upload.nbytes
        else:
            self._store_array(name, upload, texel_format)
        return True

    def _take_shared(self, name: str, values: NDArray) -> bool:
        """Take an array that another pose has brought to the GPU, where there is one; whether there is."""
        shared = _shared_arrays(self.gpu).find(name, values)
        if shared is None:
            return False
        self._arrays[name] = shared.texels
        self._share(name, shared)
        self._uploads_of_late.shared += (name,)
        return True

    def adopt(self, passed: GpuPose) -> None:
        """Take the arrays that a pose has on the GPU which goes, where this one has the same: else they would
        go with it."""
        for name, shared in passed._shared.items():
            is_same = name != "positions" and shared.values is getattr(self.pose.overview, name)
            if is_same and name not in self._arrays:
                self._take_shared(name, shared.values)

    def _share(self, name: str, shared: SharedArray) -> None:
        shared.holders.add(self)
        self._shared[name] = shared

    def _upload_samples(self, end: float) -> bool:
        if self._samples is None:
            self._samples = RangeSamples(self.gpu, self.range_points.views)
        return self._samples.upload(end)

    def _store_array(self, key: Hashable, upload: _Upload, texel_format: int) -> None:
        self._arrays[key] = gl.BufferTexture(upload.target, texel_format)
        self._count_upload(upload)

    def _count_upload(self, upload: _Upload) -> None:
        self._uploaded_bytes += upload.nbytes
        self._uploads_of_late.nbytes += upload.nbytes

    def _drop_array(self, key: Hashable) -> None:
        texels = self._arrays.pop(key)
        if isinstance(key, str) and key in self._shared:
            self._shared.pop(key).holders.discard(self)
        else:
            self._uploaded_bytes -= texels.buffer.size
            self.gpu.discard(texels)

    def _values(self, name: str) -> NDArray:
        kind, _, scalar = name.partition(":")
        if scalar:
            zero = self.scalar_range(scalar)[0]
            stored = self.scalar(scalar) if kind == "scalar" else self.range_points.all_samples(scalar)
            return as_float32(stored, zero)
        values: NDArray | None = getattr(self._centered if name == "positions" else self.cloud, name)
        if values is None:
            hint = (
                "Pass the look to the rendering call, which then estimates missing data"
                if name == "normals"
                else None
            )
            raise InputError(f"the scan has no {name}", hint=hint)
        return values

    def scalar(self, name: str) -> NDArray:
        """The named scalar, (N,); raises InputError that lists the known ones."""
        self._check_scalar(name)
        return self.cloud.scalars[name]

    def _check_scalar(self, name: str) -> None:
        if name not in self.overview.scalars:
            raise unknown_name("scalar", name, list(self.overview.scalars))

    def scalar_range(self, name: str) -> tuple[float, float]:
        """The 2 % and 98 % quantiles of a scalar's finite values."""
        self._check_scalar(name)
        return self.overview.remember(_scalar_range, name)

    def layer(self, values: NDArray) -> Layer:
        """Numbers of the scan's points that are not part of it, (N,): kept, where they are uploaded, for as
        long as somebody holds this array."""
        for key in [key for key, layer in self._layers.items() if layer.values() is None]:
            gone = self._layers.pop(key)
            self._uploaded_bytes -= sum(texels.buffer.size for texels in gone.texels.values())
            self.gpu.discard(*gone.texels.values())
        if id(values) not in self._layers:
            self._layers[id(values)] = Layer(weakref.ref(values), robust_range(strided(values)))
        return self._layers[id(values)]

    def layer_texels(
        self, values: NDArray, zero: float, rows: NDArray[np.uint32] | None = None, by_sample: bool = False
    ) -> gl.BufferTexture:
        """Texels of a layer, relative to zero, uploaded at the first call. rows: those of the layer that this
        pose's points stand for; None where they are the scan's. by_sample: a texel for each sample of range
        views rather than for each point."""
        layer = self.layer(values)
        if by_sample not in layer.texels:
            with self.preparing("upload"):
                made = as_float32(values if rows is None else values[rows], zero)
                upload = _array_upload(self.gpu, self.range_points.by_sample(made) if by_sample else made)
                upload.go_on(np.inf)
                layer.texels[by_sample] = gl.BufferTexture(upload.target, gl.R32F)
                self._count_upload(upload)
        return layer.texels[by_sample]

    def heights(self, axis: tuple[float, ...], by_sample: bool = False) -> gl.BufferTexture:
        """The height of each point along an axis, relative to the origin, for what cannot go by positions;
        by_sample: of each sample of range views. The last axis' alone is kept: it turns with the pose."""
        key = (_heights, axis, by_sample)
        for gone in [name for name in self._arrays if isinstance(name, tuple) and name[0] is _heights]:
            if gone != key:
                self._drop_array(gone)
        if by_sample and key not in self._arrays:
            samples = self.samples
            with self.preparing("upload"):
                self._arrays[key] = samples.heights(np.array(axis), self.origin)
                self._uploaded_bytes += self._arrays[key].buffer.size
        return self._arrays[key] if by_sample else self.packed(_heights, axis, by_sample)

    @property
    def sample(self) -> NDArray[np.float64]:
        """Some of the positions, (M, 3), relative to the origin: for ranges."""
        return self.pose.sample + (self.pose.origin - self.origin)

    @contextmanager
    def preparing(self, kind: str) -> Iterator[None]:
        """Count what runs inside as time spent on "upload" or "derive"."""
        start = time.perf_counter()
        yield
        self.add_ms(kind, (time.perf_counter() - start) * 1e3)

    def add_ms(self, kind: str, ms: float) -> None:
        """Count time spent on "upload" or "derive"."""
        self._spent[kind] += ms

    def take_ms(self, kind: str) -> float:
        """How long "upload" or "derive" took since the last call."""
        taken, self._spent[kind] = self._spent[kind], 0.0
        return taken

    def take_uploaded(self) -> Uploaded:
        """Take note of what arrays came to the GPU since the last call, and which were there already."""
        taken, self._uploads_of_late = self._uploads_of_late, Uploaded()
        return taken

    def __del__(self) -> None:
        begun = (upload.target for upload in self._uploads.values())
        layers = (texels for layer in self._layers.values() for texels in layer.texels.values())
        own = (texels for key, texels in self._arrays.items() if key not in self._shared)
        self.gpu.discard(*own, *self._made.values(), *layers, *begun, self._samples)


@dataclass
class Uploaded:
    """Arrays that came to the GPU. nbytes: of them. shared: names of those that other poses had there."""

    nbytes: int = 0
    shared: tuple[str, ...] = ()


class SharedArray:
    """An array on the GPU for the poses that have the same one, for as long as any of them does.

    values: what it was made of, which poses hold by themselves.
    """

    def __init__(self, gpu: Gpu, values: NDArray, texels: gl.BufferTexture) -> None:
        self._gpu, self.values, self.texels = gpu, values, texels
        self.nbytes = texels.buffer.size
        self.holders: weakref.WeakSet[GpuPose] = weakref.WeakSet()

    def __del__(self) -> None:
        self._gpu.discard(self.texels)


class SharedArrays:
    """The arrays on the GPU by those that they were made of: by the object, as what is equal in frames of a
    scan is made one when it is read (`PointCloud.sharing`)."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._known: weakref.WeakValueDictionary[tuple[str, int], SharedArray] = weakref.WeakValueDictionary()

    def find(self, name: str, values: NDArray) -> SharedArray | None:
        """That of an array, if it is there under this name."""
        return self._known.get((name, id(values)))  # which no other object has while this one is held

    def add(self, name: str, values: NDArray, texels: gl.BufferTexture) -> SharedArray:
        """Take in what was uploaded of an array."""
        shared = self._known[name, id(values)] = SharedArray(self._gpu, values, texels)
        return shared


def _shared_arrays(gpu: Gpu) -> SharedArrays:
    return gpu.cached(SharedArrays)


def drawn_bounds(pose: Pose, camera: Camera | None = None) -> Bounds:
    """The pose's robust bounds, or through a telephoto lens those of all of its points and their splats, none
    of which may be drawn elsewhere for that; a box of two units where there is no point."""
    if not len(pose.overview):
        return Bounds(pose.origin - 1, pose.origin + 1)
    if camera is None or camera.fov_y > _TELEPHOTO or not isinstance(pose.points, PointCloud):
        return pose.bounds
    return pose.points.whole_bounds().grown(pose.points.longest_reach())


@dataclass(eq=False)
class Layer:
    """Numbers that lie over a pose: one object for each array of them.

    range: their 2 % and 98 % quantiles. texels: on the GPU, of points (False) and of samples (True), where
    they are asked for.
    """

    values: weakref.ref[NDArray]
    range: tuple[float, float]
    texels: dict[bool, gl.BufferTexture] = field(default_factory=dict)


@dataclass
class _Upload:
    """A buffer on its way to the GPU: of which values, what it will be, and what is to be done, a slice a
    step."""

    values: NDArray
    target: moderngl.Buffer
    nbytes: int
    steps: deque[Callable[[], object]]

    def go_on(self, end: float) -> bool:
        """Upload slices until that time of the performance counter, at least one; whether all is there."""
        while self.steps:
            self.steps.popleft()()
            if time.perf_counter() > end:
                break
        return not self.steps


def _array_upload(gpu: Gpu, values: NDArray) -> _Upload:
    # A buffer of no bytes is not allowed; an empty pose gets one texel that nothing reads.
    data = values if values.size else np.zeros(4, np.float32)
    words = np.ascontiguousarray(data).reshape(-1).view(np.uint8)
    buffer = gpu.buffer(reserve=len(words))
    slices = range(0, len(words), _SLICE)
    steps = (partial(buffer.write, words[start : start + _SLICE], offset=start) for start in slices)
    return _Upload(values, buffer, len(words), deque(steps))


def _scalar_range(cloud: PointCloud, name: str) -> tuple[float, float]:
    return robust_range(strided(cloud.scalars[name]))


def _heights(cloud: PointCloud, axis: tuple[float, ...], _: bool) -> NDArray[np.float32]:
    return cloud.positions @ np.array(axis, np.float32)


def as_float32(values: NDArray, zero: float = 0.0) -> NDArray[np.float32]:
    """Numbers relative to `zero` as the GPU holds them; those beyond its range are infinite there."""
    with np.errstate(over="ignore"):
        return (values - zero).astype(np.float32)
