"""Bindings: which number each thing that a shader reads or writes is bound to, by meaning."""

from __future__ import annotations

from enum import IntEnum, unique


@unique
class UniformBlock(IntEnum):
    """Binding points of uniform blocks."""

    VIEW = 0  # the camera
    POINTS = 1  # a range of points, for one way of instancing
    PARAMS = 2  # the values that a primitive or a backend gives its shaders
