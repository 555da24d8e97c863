"""Loops compiled by numba, kept on disk where that can be done.

They stand in modules named *_kernels, which are imported inside functions, as numba takes a while.
Threads are Python's (threads.py), over loops that let go of the interpreter.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from numbers import Number
from typing import Any, TypeVar, cast

from numba import njit
from numba.core.caching import FunctionCache, NullCache

from ...task import announce, over

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """The function compiled at its first call; meanwhile other threads go on.

    The result is kept beside the source, or in the user's cache folder where that cannot be written. Where
    neither can be, or the disk is full, each process compiles for itself. Either is announced.
    """
    dispatcher: Any = njit(nogil=True)(function)
    try:
        dispatcher._cache = _Kept(function)
    except RuntimeError:  # of numba, where no folder can be written
        dispatcher._cache = _NotKept()
    return cast(F, dispatcher)


class _Kept(FunctionCache):
    """A cache on disk of what was compiled: damaged files are none, unwritable ones are passed over.

    stamp: tells whether it is of this source; besides the file's own, that of what is imported from others,
    functions and numbers, as these are compiled in too and numba looks at the file alone.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        known = function.__globals__.items()
        numbers = {name: value for name, value in known if isinstance(value, Number)}
        used = {
            name: value._cache.stamp
            for name, value in known
            if isinstance(getattr(value, "_cache", None), _Kept) and value.__module__ != function.__module__
        }
        self.stamp = (self._impl.locator.get_source_stamp(), numbers, used)
        self._cache_file._source_stamp = self.stamp

    def load_overload(self, *args: Any) -> Any:
        try:
            found = super().load_overload(*args)
        except Exception:  # whatever unpickling damaged bytes may raise
            with suppress(OSError):
                self.flush()
            found = None
        if found is None:
            announce("Preparing once for this machine")
        return found

    def save_overload(self, *args: Any) -> None:
        over()  # numba asks to save each that was not found, once it is compiled
        with suppress(OSError):
            super().save_overload(*args)


class _NotKept(NullCache):
    """No place on any disk."""

    def load_overload(self, *_: Any) -> None:
        announce("Preparing")

    def save_overload(self, *_: Any) -> None:
        over()
