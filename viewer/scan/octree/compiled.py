"""Loops compiled by numba, kept on disk where that can be done."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar, cast

from numba import njit
from numba.core.caching import FunctionCache

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """The function compiled at its first call; meanwhile other threads go on.

    The result is kept beside the source, or in the user's cache folder where that cannot be written. Where
    neither can be, or the disk is full, each process compiles for itself.
    """
    dispatcher = njit(nogil=True)(function)
    with suppress(RuntimeError):  # of numba, where no folder can be written
        dispatcher._cache = _Kept(function)  # type: ignore[attr-defined]
    return cast(F, dispatcher)


class _Kept(FunctionCache):
    """What was compiled, on disk: a damaged file is none, one that cannot be written is passed over."""

    def load_overload(self, *args: Any) -> Any:
        try:
            return super().load_overload(*args)
        except Exception:  # whatever unpickling damaged bytes may raise
            with suppress(OSError):
                self.flush()
            return None

    def save_overload(self, *args: Any) -> None:
        with suppress(OSError):
            super().save_overload(*args)
