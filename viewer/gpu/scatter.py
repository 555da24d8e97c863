"""Scatter: a compute shader sends items to cells and keeps the best per cell."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from . import gl
from .blocks import Values
from .compact import IndexList
from .context import Gpu, Program

_NO_KEY = 0x7F800000  # +inf as float bits: a key buffer of depths reads as floats
_NO_ITEM = 0xFFFFFFFF


def scatter(
    gpu: Gpu,
    cells: str,
    count: int,
    keys: gl.BufferTexture,
    best: gl.BufferTexture,
    bind: Callable[[Program], None],
    defines: Mapping[str, object] | None = None,
    params: Values | None = None,
    listed: IndexList | None = None,
) -> None:
    """Send `count` items to cells: the least key per cell, then the lowest item that has it.

    cells: the shader file that names an item's cells and key (it calls `visit`). keys,
    best: one R32UI texel a cell; cells that nothing hit hold +inf bits and 0xFFFFFFFF.
    bind: sets what `cells` reads. params: what it finds in `<params>`.
    listed: filled with the cells that were hit.
    """
    gl.clear_words(keys.buffer, _NO_KEY)
    gl.clear_words(best.buffer, _NO_ITEM)
    if listed is not None:
        listed.clear()
    for number, name in enumerate(("depth", "id", "list") if listed is not None else ("depth", "id")):
        defined = {"PASS": number, **(defines or {})}
        program = gpu.compute("scatter/scatter.comp", defined, {"cells": cells}, params)
        with gpu.timers.measure(name):
            keys.buffer.bind_to_storage_buffer(0)
            keys.bind(10)
            best.buffer.bind_to_storage_buffer(1)
            best.bind(11)
            if listed is not None:
                listed.bind()
            bind(program)
            gpu.dispatch(program, count)
