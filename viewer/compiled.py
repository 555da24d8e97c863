"""Functions that numba compiles. The machine code is cached on disk where a folder can be written.

Kernels stand in modules named *_kernels. Other modules import them inside functions, as numba takes a
while to import. Kernels release the interpreter's lock, so that Python's threads (`threads.py`) run them
side by side.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from numbers import Number
from typing import Any, TypeVar, cast

from numba import njit
from numba.core.caching import FunctionCache, IndexDataCacheFile, NullCache
from numba.core.runtime import rtsys

from .task import announce, over

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compile a function at its first call. Other threads go on meanwhile.

    Numba stores the result beside the source, or in the user's cache folder if it cannot write there. If it
    can write neither, or the disk is full, each process compiles for itself. A task announces either.
    """
    return _cached(function, njit(nogil=True)(function))


def inlined(function: F) -> F:
    """Compile a function as `compiled` does, and put its code into each compiled function that calls it.

    For small pieces of inner loops: a call would pass each array of a NamedTuple as seven numbers.
    """
    return _cached(function, njit(nogil=True, forceinline=True)(function))


def _cached(function: F, dispatcher: Any) -> F:
    """A compiled function with its cache on disk, or with none."""
    try:
        dispatcher._cache = _DiskCache(function)
    except RuntimeError:  # of numba, where no folder can be written
        dispatcher._cache = _NoCache()
    return cast(F, dispatcher)


class _DiskCache(FunctionCache):
    """The cache of a function on disk. It ignores damaged files, and folders that it cannot write.

    stamp: identifies the source. Numba looks at the file alone. The stamp also holds the numbers of the
    module and the stamps of imported kernels, which are compiled in as well.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        known = function.__globals__.items()
        numbers = {name: value for name, value in known if isinstance(value, Number)}
        used = {
            name: value._cache.stamp
            for name, value in known
            if isinstance(getattr(value, "_cache", None), _DiskCache)
            and value.__module__ != function.__module__
        }
        self.stamp = (self._impl.locator.get_source_stamp(), numbers, used)
        self._cache_file = _CacheFile(self._cache_path, self._impl.filename_base, self.stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            # Numba's own method first loads all that it compiles with, for a second.
            rtsys.initialize(target_context)
            with self._guard_against_spurious_io_errors():
                found = self._load_overload(sig, target_context)
        except Exception:  # whatever unpickling damaged bytes may raise
            with suppress(OSError):
                self.flush()
            found = None
        if found is None:
            announce("Compiling code for this computer, which happens only once")
        return found

    def save_overload(self, *args: Any) -> None:
        over()  # numba asks to save each that was not found, once it is compiled
        with suppress(OSError):
            super().save_overload(*args)


class _CacheFile(IndexDataCacheFile):
    """Numba's files of a function: an index, and a file of machine code for each signature.

    Numba writes the index first, and numbers the other files. So after a change of the source, a process can
    find the new index beside the old machine code. Two processes can also give one number to two signatures.
    Here each file of machine code says what it is for, and no process runs the code of something else.
    """

    def save(self, key: Any, data: Any) -> None:
        super().save(key, (self._source_stamp, key, data))

    def load(self, key: Any) -> Any:
        """The machine code; None where there is none, or other code."""
        stamp, own, data = super().load(key) or (None, None, None)
        return data if (stamp, own) == (self._source_stamp, key) else None


class _NoCache(NullCache):
    """No cache: no folder can be written."""

    def load_overload(self, *_: Any) -> None:
        announce("Preparing")

    def save_overload(self, *_: Any) -> None:
        over()
