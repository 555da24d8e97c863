"""A pose on the GPU: a structure of arrays, each uploaded once and only when asked for."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import Any, TypeVar

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..bounds import Bounds
from ..errors import InputError, unknown_name
from ..geometry import up_vector
from ..scan.points import PointCloud
from . import gl
from .context import Gpu

T = TypeVar("T")
# What one texel of each array is.
FORMATS = {
    "positions": gl.RGB32F,
    "normals": gl.RGB32F,
    "colors": gl.RGBA8,
    "ids": gl.R32UI,
    "radii": gl.R32F,
    "axes": gl.RGBA32F,
}
_SAMPLE = 1 << 13  # values that ranges look at
_SLICE = 1 << 22  # bytes uploaded at a time: a few milliseconds


class GpuPose:
    """The arrays of one point cloud as buffer textures, indexed by row.

    A row is a point's place in the cloud's arrays; `cloud.ids` gives its index in the file.
    `stored` is the cloud as the scan has it, `cloud` the same with what was estimated since;
    whatever is chosen automatically looks at `stored`, so that it does not change by history.
    """

    def __init__(self, gpu: Gpu, cloud: PointCloud) -> None:
        self.gpu = gpu
        self._arrays: dict[str, gl.BufferTexture] = {}
        self._uploads: dict[str, _Upload] = {}  # that have begun
        if len(cloud) > gpu.max_points:
            raise InputError(
                f"{len(cloud):,} points in one pose; this driver takes {gpu.max_points:,}",
                hint="Split the scan or thin it out",
            )
        self.stored = self.cloud = cloud
        self.uploaded_bytes = 0
        self._spent = {"upload": 0.0, "derive": 0.0}
        self._facts: dict[str, Any] = {}

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
        """The same; None where the scan has no such attribute and none was estimated."""
        return None if getattr(self.cloud, name) is None else self.array(name)

    def upload(self, names: Iterable[str], budget_ms: float = np.inf) -> bool:
        """Upload what is missing of these arrays, in slices until the time is over; whether all is there."""
        missing = [name for name in names if name not in self._arrays]
        if not missing:
            return True
        with self.preparing("upload"):
            end = time.perf_counter() + budget_ms / 1e3
            return all(self._upload(name, end) for name in missing)

    def packed(self, name: str, pack: Callable[[], NDArray], texel_format: int = gl.R32F) -> gl.BufferTexture:
        """The pose's arrays arranged in another way, which `pack` does at the first call for this name.

        Counted, kept and deleted with the arrays.
        """
        key = f"packed:{name}"
        if key not in self._arrays:
            with self.preparing("upload"):
                upload = _Upload(self.gpu, pack())
                upload.go_on(np.inf)
                self._keep(key, upload.buffer, texel_format)
        return self._arrays[key]

    def _upload(self, name: str, end: float) -> bool:
        """Go on with an array until that time of the performance counter; whether it is there."""
        if name not in self._uploads:
            self._uploads[name] = _Upload(self.gpu, self._values(name))
        if not self._uploads[name].go_on(end):
            return False
        self._keep(name, self._uploads.pop(name).buffer, FORMATS.get(name, gl.R32F))
        return True

    def _keep(self, name: str, buffer: moderngl.Buffer, texel_format: int) -> None:
        self._arrays[name] = gl.BufferTexture(buffer, texel_format)
        self.uploaded_bytes += buffer.size

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

    def remember(self, key: str, make: Callable[[], T]) -> T:
        """What `make` returned the first time for this key: small facts about the pose."""
        if key not in self._facts:
            self._facts[key] = make()
        return self._facts[key]

    def scalar_range(self, name: str) -> tuple[float, float]:
        """The 2 % and 98 % quantiles of a scalar's finite values."""
        return self.remember(f"range of {name}", lambda: robust_range(_strided(self.scalar(name))))

    def value_zero(self, source: str, up: str) -> float:
        """What "depth", "height" along an axis or a scalar is relative to on the GPU. It is taken off in
        float64, so that heights and times far from zero keep their steps."""
        if source == "height":
            return float(self.cloud.origin @ up_vector(up))
        return 0.0 if source == "depth" else self.scalar_range(source)[0]

    def heights(self, up: str) -> gl.BufferTexture:
        """The height of each point along `up`, relative to the origin; for what cannot go by positions."""
        axis = np.array(up_vector(up), np.float32)
        return self.packed(f"heights along {up}", lambda: self.cloud.positions @ axis)

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
        self.gpu.discard(*self._arrays.values(), *(upload.buffer for upload in self._uploads.values()))


class _Upload:
    """An array on its way to the GPU."""

    def __init__(self, gpu: Gpu, values: NDArray) -> None:
        # A buffer of no bytes is not allowed; an empty pose gets one texel that nothing reads.
        data = values if values.size else np.zeros(4, np.float32)
        self._bytes = np.ascontiguousarray(data).reshape(-1).view(np.uint8)
        self._done = 0
        self.buffer = gpu.ctx.buffer(reserve=len(self._bytes))

    def go_on(self, end: float) -> bool:
        """Upload slices until that time of the performance counter, at least one; whether all is there."""
        while self._done < len(self._bytes):
            self.buffer.write(self._bytes[self._done : self._done + _SLICE], offset=self._done)
            self._done += _SLICE
            if time.perf_counter() > end:
                break
        return self._done >= len(self._bytes)


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
