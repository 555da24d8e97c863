"""A driver that does nothing: what then is left of a frame's time is the CPU's own work."""

from __future__ import annotations

from collections import Counter, defaultdict, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import moderngl
from numpy.typing import NDArray

from viewer.gpu import gl
from viewer.gpu.staging import Staging

# Calls that give nothing back. All others of a frame are few, and stay as they are.
_ORDERS: dict[Any, tuple[str, ...]] = {
    moderngl.Buffer: ("write", "bind_to_storage_buffer", "bind_to_uniform_block"),
    moderngl.ComputeShader: ("run", "run_indirect"),
    moderngl.Context: ("__enter__", "copy_buffer", "memory_barrier", "finish", "enable", "disable"),
    moderngl.VertexArray: ("render", "render_indirect"),
    moderngl.Texture: ("use",),
    moderngl.Framebuffer: ("use", "clear"),
    moderngl.Uniform: ("write",),
    gl: ("clear_words", "record_time"),
    gl.BufferTexture: ("bind",),
    gl.Raster: ("clear", "copy_to"),
    gl.Sums: ("clear", "clear_depth"),
    gl.Target: ("bind_images",),
}


class Driver:
    """The driver of a context, as an experiment sees it. calls: of it so far, by name."""

    def __init__(self, staging: Staging) -> None:
        self.calls: Counter[str] = Counter()
        self._staging = staging
        self._read: defaultdict[tuple[int, int, int], deque[NDArray]] = defaultdict(deque)

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Count calls meanwhile, and remember what is read."""
        read = self._staging.read
        self._read.clear()

        def remembered(buffer: moderngl.Buffer, nbytes: int, offset: int) -> NDArray:
            self.calls["read"] += 1
            found = read(buffer, nbytes, offset)
            self._read[buffer.glo, nbytes, offset].append(found)
            return found

        def counting(name: str, order: Callable[..., Any]) -> Callable[..., Any]:
            def call(*args: Any, **kwargs: Any) -> Any:
                self.calls[name] += 1
                return order(*args, **kwargs)

            return call

        with _changed(counting, self._staging, remembered):
            yield

    @contextmanager
    def idle(self) -> Iterator[None]:
        """Do nothing meanwhile. Reads give what they gave while the same pictures were watched, in turn. What
        was written comes to the GPU in the end, since nobody writes the same again."""
        read = self._staging.read
        written: dict[tuple[Any, int], Any] = {}

        def later(name: str, _: Callable[..., Any]) -> Callable[..., Any]:
            return note if name == "write" else _nothing

        def note(target: Any, data: Any, offset: int = 0) -> None:
            written[target, offset] = data

        def known(buffer: moderngl.Buffer, nbytes: int, offset: int) -> NDArray:
            found = self._read[buffer.glo, nbytes, offset]
            if not found:
                return read(buffer, nbytes, offset)
            found.rotate(-1)
            return found[-1]

        with _changed(later, self._staging, known):
            yield
        for (target, offset), data in written.items():
            if hasattr(target.mglo, "write"):  # not where it was deleted since
                target.write(data, *([offset] if offset else []))


def _nothing(*args: Any, **kwargs: Any) -> None:
    return None


@contextmanager
def _changed(
    change: Callable[[str, Callable[..., Any]], Callable[..., Any]],
    staging: Staging,
    read: Callable[..., NDArray],
) -> Iterator[None]:
    """Take other functions for the driver's meanwhile, and another one to read buffers."""
    orders = [(owner, name) for owner, names in _ORDERS.items() for name in names]
    before = [getattr(owner, name) for owner, name in orders]
    for (owner, name), order in zip(orders, before, strict=True):
        setattr(owner, name, change(name, order))
    staging.read = read  # type: ignore[method-assign]
    try:
        yield
    finally:
        del staging.read  # which hid that of the class
        for (owner, name), order in zip(orders, before, strict=True):
            setattr(owner, name, order)
