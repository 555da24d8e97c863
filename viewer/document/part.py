"""Parts of a document: what a tool keeps in it, declared where the tool is."""

from __future__ import annotations

from dataclasses import MISSING, fields, is_dataclass
from typing import Any, ClassVar

from .schema import check_declaration, check_storable


class Part:
    """Part of a document: all that one tool keeps in it.

    A subclass is a frozen dataclass whose fields all have defaults, declared with the name that files know it
    by; declaring it is all there is to do:

        @dataclass(frozen=True)
        class Notes(Part, name="notes"):
            all: tuple[Note, ...] = ()

    Fields are bool, int, float, str, None, tuple[...], Mapping[str, ...], and frozen dataclasses of these.
    They are written to files, and checked when kept and when read by what their types say; numbers and arrays
    of numpy are none of these. kinds: name -> subclass, of all that were declared.
    """

    kinds: ClassVar[dict[str, type[Part]]] = {}
    part_name: ClassVar[str]

    def __init_subclass__(cls, *, name: str, **others: Any) -> None:
        super().__init_subclass__(**others)
        known = Part.kinds.get(name)
        if known is not None and _full_name(known) != _full_name(cls):
            raise TypeError(f"two parts have the name '{name}': {_full_name(known)} and {_full_name(cls)}")
        cls.part_name = name
        Part.kinds[name] = cls

    @classmethod
    def check_declared(cls) -> None:
        """Check that it is declared as a part has to be; raises TypeError, which names the class and field.

        The class alone cannot tell while it is declared: what makes a dataclass of it comes after that.
        """
        name = cls.__name__
        if not is_dataclass(cls) or "__dataclass_fields__" not in vars(cls):
            raise TypeError(f"{name} is not a dataclass; declare it with @dataclass(frozen=True)")
        for field in fields(cls):
            if field.default is MISSING and field.default_factory is MISSING:
                raise TypeError(f"{name}.{field.name} has no default, but a scan without '{name}' needs one")
        check_declaration(cls, name)

    def check_storable(self, known: Part | None = None) -> None:
        """Check that it can be kept as it is; raises TypeError, which names the position: "notes.all[0]".

        known: one that was checked, of which this one is a change; only what is new is checked.
        """
        check_storable(self, self.part_name, known)


def _full_name(kind: type) -> str:
    return f"{kind.__module__}.{kind.__qualname__}"
