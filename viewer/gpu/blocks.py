"""Blocks: a frozen dataclass of numbers as a uniform block, GLSL and bytes from one declaration."""

from __future__ import annotations

import ctypes
import struct
from dataclasses import dataclass, fields
from functools import cache
from itertools import chain
from typing import Any, ClassVar, Protocol, get_type_hints

import moderngl

from .bindings import UniformBlock

Vec4 = tuple[float, float, float, float]
Mat4 = tuple[Vec4, Vec4, Vec4, Vec4]  # columns
_INT, _UINT, _FLOAT = ctypes.c_int32, ctypes.c_uint32, ctypes.c_float
_LETTERS = {_INT: "i", _UINT: "I", _FLOAT: "f"}  # of `struct`
# Annotation of a field -> its GLSL type, what a word of it is, how many, what its offset is a multiple of.
_KINDS: dict[Any, tuple[str, Any, int, int]] = {
    bool: ("bool", _UINT, 1, 1),
    int: ("int", _INT, 1, 1),
    float: ("float", _FLOAT, 1, 1),
    tuple[float, float]: ("vec2", _FLOAT, 2, 2),
    tuple[int, int]: ("ivec2", _INT, 2, 2),
    Vec4: ("vec4", _FLOAT, 4, 4),
    Mat4: ("mat4", _FLOAT, 16, 4),
}


class Values(Protocol):
    """An instance of a frozen dataclass whose numbers a shader reads."""

    __dataclass_fields__: ClassVar[dict[str, Any]]


@dataclass(frozen=True)
class Member:
    """A number or several in a block.

    kind: its GLSL type. help: what its declaration says of it. gap: words that are left free before it.
    """

    kind: str
    name: str
    help: str
    gap: int


@dataclass(frozen=True)
class Block:
    """A dataclass as a std140 block (OpenGL 4.3, 7.6.2.2). words, layout: what it is in memory."""

    declaration: type[Values]
    members: tuple[Member, ...]
    words: type[ctypes.Structure]
    layout: struct.Struct

    @property
    def name(self) -> str:
        """Module and name of the dataclass."""
        return f"{self.declaration.__module__}.{self.declaration.__qualname__}"

    def glsl(self, name: str) -> str:
        """GLSL that shaders include. name: one of `UniformBlock`, in lower case."""
        lines = [f"layout(std140, binding = {UniformBlock[name.upper()]}) uniform {name.title()} {{"]
        lines += [f"    {m.kind} {m.name};{m.help and f'  // {m.help}'}" for m in self.members]
        return "\n".join([*lines, "};"])

    def pack(self, values: Values) -> bytes:
        """The values as the GPU reads them; floats beyond its range are infinite there."""
        numbers: list[float] = []
        for member in self.members:
            if member.gap:
                numbers += (0,) * member.gap
            value = getattr(values, member.name)
            if member.kind == "mat4":
                numbers += chain.from_iterable(value)
            elif isinstance(value, tuple):
                numbers += value
            else:
                numbers.append(value)
        try:
            return self.layout.pack(*numbers)
        except OverflowError:  # a float beyond float32, which ctypes makes infinite, in ten times the time
            return bytes(self.words(*numbers))


@cache
def block_of(declaration: type[Values]) -> Block:
    """The block of a dataclass: its numbers in their order; fields that are words are for the CPU alone.

    A number is a bool, int, float, or a tuple of two, of four floats (`Vec4`), of four columns (`Mat4`).
    Raises TypeError for any other field, and where there is no number.
    """
    hints = get_type_hints(declaration)
    members: list[Member] = []
    words: list[Any] = []
    for field in fields(declaration):
        kind = hints[field.name]
        if kind is str:
            continue
        if kind not in _KINDS:
            raise TypeError(f"{declaration.__qualname__}.{field.name}: a uniform block cannot hold {kind}")
        glsl, word, count, multiple = _KINDS[kind]
        gap = -len(words) % multiple
        members.append(Member(glsl, field.name, field.metadata.get("help", ""), gap))
        words += [_UINT] * gap + [word] * count
    if not members:
        raise TypeError(f"{declaration.__qualname__} has no number")
    letters = "".join(_LETTERS[word] for word in words)
    words += [_UINT] * (free := -len(words) % 4)
    named = [(f"word_{number}", word) for number, word in enumerate(words)]
    kind = type("Words", (ctypes.Structure,), {"_fields_": named})
    return Block(declaration, tuple(members), kind, struct.Struct(f"={letters}{4 * free}x"))


class BlockBuffer:
    """The values of one block on the GPU."""

    def __init__(self, ctx: moderngl.Context, declaration: type[Values], binding: UniformBlock) -> None:
        self._block, self._binding = block_of(declaration), binding
        self._held = b""
        self._values: Values | None = None
        self._buffer = ctx.buffer(reserve=ctypes.sizeof(self._block.words))

    def write(self, values: Values) -> None:
        """Make these the values; nothing is sent where they have not changed."""
        if values is self._values:
            return
        self._values = values
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
