"""Scatter: a compute shader sends items to cells and keeps the best per cell."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from . import gl
from .bindings import Storage, Texture
from .blocks import Values
from .compact import IndexList
from .constants import NO_DEPTH, NOTHING
from .context import Gpu, Program


@dataclass(frozen=True)
class Visits:
    """Which cells items go to, of which there may be any number: pixels, tiles, sectors, ...

    cells: the shader file that says so; its `scatter(i)` calls `visit(cell, key, item)` for each cell that
    the i-th of `count` items goes to. bind: sets what that file reads. defines: its macros. params: what it
    finds in `<params>`.
    """

    cells: str
    count: int
    bind: Callable[[Program], None]
    defines: Mapping[str, object] = field(default_factory=dict)
    params: Values | None = None

    def send(self, gpu: Gpu, target: str, bind: Callable[[Program], None], **defines: int) -> None:
        """Send the items to their cells. target: the shader file that says what becomes of a visit; bind:
        sets what that one reads and writes."""
        parts = {"target": target, "cells": self.cells}
        program = gpu.compute("scatter/scatter.comp", {**defines, **self.defines}, parts, self.params)
        bind(program)
        self.bind(program)
        gpu.dispatch(program, self.count)


def scatter(
    gpu: Gpu,
    visits: Visits,
    keys: gl.BufferTexture,
    best: gl.BufferTexture,
    listed: IndexList | None = None,
) -> None:
    """Keep the least key of those that visit a cell, then the lowest item that has it.

    visits: their keys are below +inf bits. keys, best: one R32UI texel a cell; +inf bits and 0xFFFFFFFF where
    nothing went. listed: filled with the cells that were hit.
    """
    gl.clear_words(keys.buffer, NO_DEPTH)  # a key buffer of depths reads as floats
    gl.clear_words(best.buffer, NOTHING)
    if listed is not None:
        listed.clear()

    def bind(_: Program) -> None:
        keys.buffer.bind_to_storage_buffer(Storage.KEYS)
        keys.bind(Texture.KEYS)
        best.buffer.bind_to_storage_buffer(Storage.BEST)
        best.bind(Texture.BEST)
        if listed is not None:
            listed.bind()

    for number, name in enumerate(("depth", "id", "list") if listed is not None else ("depth", "id")):
        with gpu.timers.measure(name):
            visits.send(gpu, "scatter/best.glsl", bind, PASS=number)
