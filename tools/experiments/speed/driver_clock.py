"""How long calls of the driver take: what is left of a frame's time is the CPU's own work."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Any

import moderngl

from viewer.gpu import gl

_CLASSES = (
    moderngl.Buffer, moderngl.ComputeShader, moderngl.Program, moderngl.Context, moderngl.VertexArray,
    moderngl.Texture, moderngl.Framebuffer, moderngl.Uniform,
)  # fmt: skip
_PLAIN = {"__init__", "__new__", "__repr__", "__eq__", "__hash__", "__class_getitem__", "__del__"}


class DriverClock:
    """Adds up the time of calls. seconds: in the driver, with moderngl. calls: how many."""

    def __init__(self) -> None:
        self.seconds, self.calls, self._depth = 0.0, 0, 0

    def timed(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, whose calls count, unless one runs within another."""

        @wraps(function)
        def call(*args: Any, **kwargs: Any) -> Any:
            self._depth += 1
            start = time.perf_counter()
            try:
                return function(*args, **kwargs)
            finally:
                self._depth -= 1
                if not self._depth:
                    self.seconds += time.perf_counter() - start
                    self.calls += 1

        return call


@contextmanager
def driver_clock() -> Iterator[DriverClock]:
    """Time the calls of moderngl and of `viewer/gpu/gl.py` meanwhile."""
    clock = DriverClock()
    changed: list[tuple[Any, str, Any]] = []

    def change(owner: Any, name: str, value: Any) -> None:
        changed.append((owner, name, getattr(owner, name)))
        setattr(owner, name, value)

    classes = [*_CLASSES, *(each for _, each in inspect.getmembers(gl, inspect.isclass) if _is_of_gl(each))]
    for owner in classes:
        for name, function in list(vars(owner).items()):
            if inspect.isfunction(function) and name not in _PLAIN:
                change(owner, name, clock.timed(function))
            elif isinstance(function, property) and owner in _CLASSES:
                getter, setter = (each and clock.timed(each) for each in (function.fget, function.fset))
                change(owner, name, property(getter, setter))
    for name, function in inspect.getmembers(gl, inspect.isfunction):
        if _is_of_gl(function) and not name.startswith(("kept_", "divided_", "debug_")):
            change(gl, name, clock.timed(function))
    try:
        yield clock
    finally:
        for owner, name, value in reversed(changed):
            setattr(owner, name, value)


def _is_of_gl(each: Any) -> bool:
    return each.__module__ == gl.__name__
