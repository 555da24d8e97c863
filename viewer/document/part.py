"""Parts of a document: what a tool keeps in it, declared where the tool is."""

from __future__ import annotations

from typing import Any, ClassVar


class Part:
    """Part of a document: all that one tool keeps in it.

    A subclass is a frozen dataclass whose fields all have defaults, declared with the name that files know it
    by; declaring it is all there is to do:

        @dataclass(frozen=True)
        class Notes(Part, name="notes"):
            all: tuple[Note, ...] = ()

    Fields are numbers, texts, booleans, None, tuples, mappings from texts, and frozen dataclasses of these.
    They are written to files and checked when read by what their types say. kinds: name -> subclass, of all
    that were declared.
    """

    kinds: ClassVar[dict[str, type[Part]]] = {}
    part_name: ClassVar[str]

    def __init_subclass__(cls, *, name: str, **others: Any) -> None:
        super().__init_subclass__(**others)
        known = Part.kinds.get(name)
        assert known is None or known.__qualname__ == cls.__qualname__, f"two parts are called '{name}'"
        cls.part_name = name
        Part.kinds[name] = cls
