"""Blocks: a frozen dataclass of numbers as a uniform block, GLSL and bytes from one declaration."""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cache
from typing import Any, ClassVar, Protocol, get_type_hints

import moderngl

from .bindings import UniformBlock

Vec4 = tuple[float, float, float, float]
Mat4 = tuple[Vec4, Vec4, Vec4, Vec4]  # columns
_FREE = "4x"  # a word that holds nothing, for `struct`
# Annotation of a field -> its GLSL type, a word of it for `struct`, how many, what its offset is a multiple
# of.
_KINDS: dict[Any, tuple[str, str, int, int]] = {
    bool: ("bool", "I", 1, 1),
    int: ("int", "i", 1, 1),
    float: ("float", "f", 1, 1),
    tuple[float, float]: ("vec2", "f", 2, 2),
    tuple[int, int]: ("ivec2", "i", 2, 2),
    Vec4: ("vec4", "f", 4, 4),
    Mat4: ("mat4", "f", 16, 4),
}
_NUMBERS = [glsl for glsl, _, count, _ in _KINDS.values() if count == 1]


class Values(Protocol):
    """An instance of a frozen dataclass whose numbers a shader reads."""

    __dataclass_fields__: ClassVar[dict[str, Any]]


@dataclass(frozen=True)
class Member:
    """A number or several in a block.

    kind: its GLSL type. help: what its declaration says of it.
    """

    kind: str
    name: str
    help: str


@dataclass(frozen=True)
class Block:
    """A dataclass as a std140 block (OpenGL 4.3, 7.6.2.2).

    layout: what it is in memory. numbers_of: gives the numbers of an instance, in order.
    """

    declaration: type[Values]
    members: tuple[Member, ...]
    layout: struct.Struct
    numbers_of: Callable[[Values], Sequence[float]]

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
        numbers = self.numbers_of(values)
        try:
            return self.layout.pack(*numbers)
        except OverflowError:  # a float beyond float32, which ctypes makes infinite, in ten times the time
            return self.layout.pack(
                *(ctypes.c_float(n).value if isinstance(n, float) else n for n in numbers)
            )


def _in_float32(number: float) -> float:
    return ctypes.c_float(number).value


@cache
def block_of(declaration: type[Values]) -> Block:
    """The block of a dataclass: its numbers in their order; fields that are words are for the CPU alone.

    A number is a bool, int, float, or a tuple of two, of four floats (`Vec4`), of four columns (`Mat4`).
    Raises TypeError for any other field, and where there is no number.
    """
    hints = get_type_hints(declaration)
    members: list[Member] = []
    words: list[str] = []
    for field in fields(declaration):
        kind = hints[field.name]
        if kind is str:
            continue
        if kind not in _KINDS:
            raise TypeError(f"{declaration.__qualname__}.{field.name}: a uniform block cannot hold {kind}")
        glsl, word, count, multiple = _KINDS[kind]
        members.append(Member(glsl, field.name, field.metadata.get("help", "")))
        words += [_FREE] * (-len(words) % multiple) + [word] * count
    if not members:
        raise TypeError(f"{declaration.__qualname__} has no number")
    words += [_FREE] * (-len(words) % 4)
    return Block(declaration, tuple(members), struct.Struct("=" + "".join(words)), _flat(members))


def _flat(members: Sequence[Member]) -> Callable[[Values], Sequence[float]]:
    """A function that gives the numbers of these members of an instance, in order.

    A picture calls such functions some dozens of times. So each is compiled from its own line of Python,
    like the methods of a dataclass.
    """
    columns = {"mat4": [f"[{number}]" for number in range(4)]}
    parts = [
        f"{'' if member.kind in _NUMBERS else '*'}values.{member.name}{column}"
        for member in members
        for column in columns.get(member.kind, [""])
    ]
    return eval(f"lambda values: ({', '.join(parts)},)")


class BlockBuffer:
    """The values of one block on the GPU."""

    def __init__(self, ctx: moderngl.Context, declaration: type[Values], binding: UniformBlock) -> None:
        self._block, self._binding = block_of(declaration), binding
        self._held = b""
        self._values: Values | None = None
        self._buffer = ctx.buffer(reserve=self._block.layout.size)

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
