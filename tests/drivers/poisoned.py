"""A pytest plugin for drivers that hand out empty memory, as Mesa's do: it begins as any others left it.

PYTHONPATH=tests/drivers python -m pytest -p poisoned tests/gpu tests/backends

What reads what nobody wrote then fails here as it does on hardware.
"""

from __future__ import annotations

from functools import wraps
from typing import Any

import moderngl
import numpy as np

_LEFT = np.random.default_rng(0).bytes(1 << 16)


def _left(size: int) -> bytes:
    """So many bytes as are left."""
    return (_LEFT * (size // len(_LEFT) + 1))[:size]


def _soil(buffer: moderngl.Buffer) -> None:
    whole, rest = divmod(buffer.size, len(_LEFT))
    for n in range(whole):
        buffer.write(_LEFT, offset=n * len(_LEFT))
    if rest:
        buffer.write(_left(rest), offset=whole * len(_LEFT))


def pytest_configure() -> None:
    """Soil what is reserved from now on."""
    reserve, orphan, texture = moderngl.Context.buffer, moderngl.Buffer.orphan, moderngl.Context.texture

    @wraps(reserve)
    def soiled(self: moderngl.Context, data: Any = None, *args: Any, **kwargs: Any) -> moderngl.Buffer:
        buffer = reserve(self, data, *args, **kwargs)
        if data is None:
            _soil(buffer)
        return buffer

    @wraps(orphan)
    def orphaned(self: moderngl.Buffer, *args: Any, **kwargs: Any) -> None:
        orphan(self, *args, **kwargs)
        _soil(self)

    @wraps(texture)
    def soiled_texture(
        self: moderngl.Context, size: tuple[int, int], components: int, data: Any = None, **kwargs: Any
    ) -> moderngl.Texture:
        made = texture(self, size, components, data, **kwargs)
        if data is None:
            made.write(_left(size[0] * size[1] * components * int(made.dtype[1])), alignment=1)
        return made

    moderngl.Context.buffer = soiled  # type: ignore[method-assign]
    moderngl.Context.texture = soiled_texture  # type: ignore[method-assign]
    moderngl.Buffer.orphan = orphaned  # type: ignore[method-assign]
