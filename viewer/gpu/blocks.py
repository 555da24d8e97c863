"""Blocks: a frozen dataclass of numbers as a uniform block, GLSL and bytes from one declaration."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, fields
from functools import cache
from typing import Any, ClassVar, Protocol, get_type_hints

import moderngl

from .bindings import UniformBlock

Vec4 = tuple[float, float, float, float]
Mat4 = tuple[Vec4, Vec4, Vec4, Vec4]  # columns
_VEC4 = ctypes.c_float * 4
# Annotation of a field -> its GLSL type, its words, and what its place is a multiple of, bytes.
_KINDS: dict[Any, tuple[str, Any, int]] = {
    bool: ("bool", ctypes.c_uint32, 4),
    int: ("int", ctypes.c_int32, 4),
    float: ("float", ctypes.c_float, 4),
    tuple[float, float]: ("vec2", ctypes.c_float * 2, 8),
    tuple[int, int]: ("ivec2", ctypes.c_int32 * 2, 8),
    Vec4: ("vec4", _VEC4, 16),
    Mat4: ("mat4", _VEC4 * 4, 16),
}


class Values(Protocol):
    """An instance of a frozen dataclass whose numbers a shader reads."""

    __dataclass_fields__: ClassVar[dict[str, Any]]


@dataclass(frozen=True)
class Block:
    """A dataclass as a std140 block (OpenGL 4.3, 7.6.2.2).

    declaration: the dataclass. members: (GLSL type, name, what is said of it). words: how they lie in memory.
    """

    declaration: type[Values]
    members: tuple[tuple[str, str, str], ...]
    words: type[ctypes.Structure]

    @property
    def name(self) -> str:
        """Where the dataclass stands."""
        return f"{self.declaration.__module__}.{self.declaration.__qualname__}"

    def glsl(self, name: str) -> str:
        """What shaders include. name: one of `UniformBlock`, in lower case."""
        lines = [f"layout(std140, binding = {UniformBlock[name.upper()]}) uniform {name.title()} {{"]
        lines += [f"    {kind} {member};{help and f'  // {help}'}" for kind, member, help in self.members]
        return "\n".join([*lines, "};"])

    def pack(self, values: Values) -> bytes:
        """The values as the GPU reads them; floats beyond its range are infinite there."""
        return bytes(self.words(**{name: getattr(values, name) for _, name, _ in self.members}))


@cache
def block_of(declaration: type[Values]) -> Block:
    """The block of a dataclass: its numbers in their order; fields that are words are for the CPU alone.

    A number is a bool, int, float, or a tuple of two, of four floats (`Vec4`), of four columns (`Mat4`).
    Raises TypeError for any other field, and where there is no number.
    """
    hints = get_type_hints(declaration)
    members: list[tuple[str, str, str]] = []
    words: list[tuple[str, Any]] = []
    size = 0

    def place(multiple: int) -> None:
        nonlocal size
        if gap := -size % multiple:
            words.append((f"_{size}", ctypes.c_uint8 * gap))
            size += gap

    for field in fields(declaration):
        kind = hints[field.name]
        if kind is str:
            continue
        if kind not in _KINDS:
            raise TypeError(f"{declaration.__qualname__}.{field.name}: a block holds no {kind}")
        glsl, word, multiple = _KINDS[kind]
        place(multiple)
        words.append((field.name, word))
        size += ctypes.sizeof(word)
        members.append((glsl, field.name, field.metadata.get("help", "")))
    if not members:
        raise TypeError(f"{declaration.__qualname__} has no number")
    place(16)
    structure = type(declaration.__name__, (ctypes.Structure,), {"_fields_": words})
    return Block(declaration, tuple(members), structure)


class BlockBuffer:
    """The values of one block on the GPU."""

    def __init__(self, ctx: moderngl.Context, declaration: type[Values], binding: UniformBlock) -> None:
        self._block, self._binding = block_of(declaration), binding
        self._held = b""
        self._buffer = ctx.buffer(reserve=ctypes.sizeof(self._block.words))

    def write(self, values: Values) -> None:
        """Make these the values; nothing is sent where they have not changed."""
        packed = self._block.pack(values)
        if packed != self._held:
            self._buffer.write(packed)
            self._held = packed

    def bind(self) -> None:
        """Make it the one that shaders read."""
        self._buffer.bind_to_uniform_block(self._binding)

    def release(self) -> None:
        """Delete it."""
        self._buffer.release()
