"""A pose on the GPU: a structure of arrays, each uploaded once and only when asked for."""

from __future__ import annotations

import time
import weakref
from collections import deque
from collections.abc import Callable, Hashable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import product
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..bounds import Bounds
from ..errors import InputError, unknown_name
from ..scan.colors import srgb8
from ..scan.points import PointCloud
from ..scan.range_view import RangeView
from . import gl
from .context import Gpu

# What one texel of each array is.
FORMATS = {
    "positions": gl.RGB32F,
    "normals": gl.RGB32F,
    "colors": gl.RGBA8,
    "ids": gl.R32UI,
    "radii": gl.R32F,
    "axes": gl.RGBA32F,
}
# Components and type of a texel of each image of a range view, and how texels are made of its values.
_IMAGES: dict[str, tuple[int, str, Callable[[NDArray], NDArray]]] = {
    "depth": (1, "f4", lambda depth: depth),
    "mask": (1, "f1", lambda mask: mask * np.uint8(255)),
    "color": (4, "f1", lambda color: _opaque(srgb8(color))),
    "confidence": (1, "f4", lambda confidence: confidence),
}
_VIEW = "view:"  # that the keys of images begin with
_SAMPLE = 1 << 13  # values that ranges look at
_SLICE = 1 << 22  # bytes uploaded at a time: a few milliseconds


class GpuPose:
    """The arrays of one point cloud as buffer textures, indexed by row, and the images of its range views.

    A row is a point's place in the cloud's arrays; `cloud.ids` gives its index in the file.
    `stored` is the cloud as the scan has it, `cloud` the same with what was estimated since;
    whatever is chosen automatically looks at `stored`, so that it does not change by history.
    """

    def __init__(self, gpu: Gpu, cloud: PointCloud, views: tuple[RangeView, ...] = ()) -> None:
        self.gpu = gpu
        self._arrays: dict[Hashable, gl.BufferTexture] = {}  # by name; what is packed, by how
        self._images: dict[str, moderngl.Texture] = {}
        self._uploads: dict[str, _Upload] = {}  # that have begun
        if len(cloud) > gpu.max_points:
            raise InputError(
                f"{len(cloud):,} points in one pose; this driver takes {gpu.max_points:,}",
                hint="Split the scan or thin it out",
            )
        self.stored = self.cloud = cloud
        self.views = views
        self.uploaded_bytes = 0
        self._spent = {"upload": 0.0, "derive": 0.0}
        self._layers: dict[int, Layer] = {}
        self._height_axis: tuple[float, ...] | None = None

    @property
    def bounds(self) -> Bounds:
        """The robust bounds of the cloud; a box of two units where there is no point."""
        cloud = self.stored
        return cloud.bounds() if len(cloud) else Bounds(cloud.origin - 1, cloud.origin + 1)

    def array(self, name: str) -> gl.BufferTexture:
        """positions, normals, colors, radii, axes, ids, or 'scalar:NAME'; uploaded at the first call."""
        self.upload([name])
        return self._arrays[name]

    def find(self, name: str) -> gl.BufferTexture | None:
        """The attribute on the GPU; None where the scan has none such and none was estimated."""
        return None if getattr(self.cloud, name) is None else self.array(name)

    def image(self, view: int, name: str) -> moderngl.Texture:
        """depth (float, as read), mask (0 or 1), color (RGBA8, sRGB), confidence (float) of the range view of
        this number, row 0 at the top, without filtering; uploaded at the first call. Raises InputError where
        the view has none, or is larger than the driver's images."""
        key = _image_key(view, name)
        self.upload([key])
        return self._images[key]

    def names_of(self, needs: Iterable[str]) -> list[str]:
        """The arrays and images that a backend with these needs reads, of those that are there."""
        names = [name for name in needs if name != "views" and getattr(self.cloud, name) is not None]
        if "views" not in needs:
            return ["positions", *names]
        images = product(enumerate(self.views), _IMAGES)
        there = [_image_key(i, name) for (i, view), name in images if getattr(view, name) is not None]
        return [*names, *there]

    def upload(self, names: Iterable[str], budget_ms: float = np.inf) -> bool:
        """Upload what is missing of these arrays, in slices until the time is over; whether all is there."""
        missing = [name for name in names if name not in self._arrays and name not in self._images]
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
                upload = _array_upload(self.gpu, pack(self.cloud, *args))
                upload.go_on(np.inf)
                self._keep_array(key, upload, texel_format)
        return self._arrays[key]

    def _upload(self, name: str, end: float) -> bool:
        """Go on with an array or image until that time of the performance counter; whether it is there."""
        if name not in self._uploads:
            self._uploads[name] = self._begin(name)
        if not self._uploads[name].go_on(end):
            return False
        upload = self._uploads.pop(name)
        if isinstance(upload.target, moderngl.Texture):
            self._images[name] = upload.target
            self.uploaded_bytes += upload.nbytes
        else:
            self._keep_array(name, upload, FORMATS.get(name, gl.R32F))
        return True

    def _begin(self, name: str) -> _Upload:
        if not name.startswith(_VIEW):
            return _array_upload(self.gpu, self._values(name))
        number, image = name.removeprefix(_VIEW).split(":")
        return _image_upload(self.gpu, self.views[int(number)], image)

    def _keep_array(self, key: Hashable, upload: _Upload, texel_format: int) -> None:
        self._arrays[key] = gl.BufferTexture(upload.target, texel_format)
        self.uploaded_bytes += upload.nbytes

    def _values(self, name: str) -> NDArray:
        if name.startswith("scalar:"):
            scalar = name.removeprefix("scalar:")
            return as_float32(self.scalar(scalar), self.scalar_range(scalar)[0])
        values: NDArray | None = getattr(self.cloud, name)
        if values is None:
            hint = (
                "Give the look when rendering, which estimates what is missing" if name == "normals" else None
            )
            raise InputError(f"the scan has no {name}", hint=hint)
        return values

    def scalar(self, name: str) -> NDArray:
        """The named scalar, (N,); raises InputError that lists the known ones."""
        if name not in self.cloud.scalars:
            raise unknown_name("scalar", name, list(self.cloud.scalars))
        return self.cloud.scalars[name]

    def scalar_range(self, name: str) -> tuple[float, float]:
        """The 2 % and 98 % quantiles of a scalar's finite values."""
        self.scalar(name)  # raises for one that is not there
        return self.cloud.remember(_scalar_range, name)

    def layer(self, values: NDArray) -> Layer:
        """Numbers of the scan's points that are not part of it, (N,): kept, where they are uploaded, for as
        long as somebody holds this array."""
        for key in [key for key, layer in self._layers.items() if layer.values() is None]:
            gone = self._layers.pop(key)
            if gone.texels is not None:
                self.uploaded_bytes -= gone.texels.buffer.size
                self.gpu.discard(gone.texels)
        if id(values) not in self._layers:
            self._layers[id(values)] = Layer(weakref.ref(values), robust_range(_strided(values)))
        return self._layers[id(values)]

    def layer_texels(self, values: NDArray, zero: float, rows: NDArray[np.uint32] | None) -> gl.BufferTexture:
        """Texels of a layer, relative to zero, uploaded at the first call. rows: those of the layer that this
        pose's points stand for; None where they are the scan's."""
        layer = self.layer(values)
        if layer.texels is None:
            with self.preparing("upload"):
                upload = _array_upload(self.gpu, as_float32(values if rows is None else values[rows], zero))
                upload.go_on(np.inf)
                layer.texels = gl.BufferTexture(upload.target, gl.R32F)
                self.uploaded_bytes += upload.nbytes
        return layer.texels

    def heights(self, axis: tuple[float, ...]) -> gl.BufferTexture:
        """The height of each point along an axis, relative to the origin; for what cannot go by positions."""
        if self._height_axis not in (None, axis):  # of the last axis alone: it turns with the pose
            gone = self._arrays.pop((_heights, self._height_axis))
            self.uploaded_bytes -= gone.buffer.size
            self.gpu.discard(gone)
        self._height_axis = axis
        return self.packed(_heights, axis)

    @cached_property
    def sample(self) -> NDArray[np.float64]:
        """Some of the positions, (M, 3), relative to the origin: for ranges."""
        return _strided(self.cloud.positions).astype(np.float64)

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

    def __del__(self) -> None:
        begun = (upload.target for upload in self._uploads.values())
        layers = (layer.texels for layer in self._layers.values())
        self.gpu.discard(*self._arrays.values(), *self._images.values(), *layers, *begun)


@dataclass(eq=False)
class Layer:
    """Numbers that lie over a pose: one object for each array of them.

    range: their 2 % and 98 % quantiles. texels: on the GPU, None before.
    """

    values: weakref.ref[NDArray]
    range: tuple[float, float]
    texels: gl.BufferTexture | None = None


@dataclass
class _Upload:
    """A buffer or texture on its way to the GPU: what it will be, and what is to be done, a slice a step."""

    target: Any
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
    buffer = gpu.ctx.buffer(reserve=len(words))
    slices = range(0, len(words), _SLICE)
    steps = (partial(buffer.write, words[start : start + _SLICE], offset=start) for start in slices)
    return _Upload(buffer, len(words), deque(steps))


def _image_upload(gpu: Gpu, view: RangeView, name: str) -> _Upload:
    values: NDArray | None = getattr(view, name)
    components, dtype, texels = _IMAGES[name]
    height, width = view.depth.shape
    if values is None:
        raise InputError(f"the range view '{view.name}' has no {name}")
    if max(width, height) > gl.max_image_edge():
        most = gl.max_image_edge()
        raise InputError(f"a range view of {width}x{height} pixels; this driver takes {most:,} along an edge")
    texture = gpu.ctx.texture((width, height), components, dtype=dtype, alignment=1)
    texture.filter, texture.repeat_x, texture.repeat_y = (moderngl.NEAREST, moderngl.NEAREST), False, False
    row_bytes = width * components * int(dtype[1])
    rows = max(1, _SLICE // row_bytes)

    def write(top: int) -> None:
        part = slice(top, min(top + rows, height))
        place = (0, top, width, part.stop - top)
        texture.write(np.ascontiguousarray(texels(values[part])), viewport=place, alignment=1)

    return _Upload(texture, row_bytes * height, deque(partial(write, top) for top in range(0, height, rows)))


def _image_key(view: int, name: str) -> str:
    return f"{_VIEW}{view}:{name}"


def _opaque(rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.pad(rgb, ((0, 0), (0, 0), (0, 1)), constant_values=255)


def _scalar_range(cloud: PointCloud, name: str) -> tuple[float, float]:
    return robust_range(_strided(cloud.scalars[name]))


def _heights(cloud: PointCloud, axis: tuple[float, ...]) -> NDArray[np.float32]:
    return cloud.positions @ np.array(axis, np.float32)


def _strided(values: NDArray) -> NDArray:
    return values[:: max(1, len(values) // _SAMPLE)]


def as_float32(values: NDArray, zero: float = 0.0) -> NDArray[np.float32]:
    """Numbers relative to `zero` as the GPU holds them; those beyond its range are infinite there."""
    with np.errstate(over="ignore"):
        return (values - zero).astype(np.float32)


def robust_range(values: NDArray) -> tuple[float, float]:
    """The 2 % and 98 % quantiles of the finite values (N,), as float64; (0, 1) where there is none."""
    finite = values.astype(np.float64)
    finite = finite[np.isfinite(finite)]
    if not len(finite):
        return 0.0, 1.0
    low, high = (float(v) for v in np.quantile(finite, [0.02, 0.98]))
    return (low, high) if high > low else (float(finite.min()), float(finite.max()))
