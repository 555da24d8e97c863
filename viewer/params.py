"""Parameters are declared once: a frozen dataclass whose fields say all that others need.

From one declaration come the widgets, `--set key=value`, the JSON in recordings, the table
in the docs, the tests and the benchmark's sweep.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from .errors import InputError, shortened, unknown_name

T = TypeVar("T")
AFFECTS = ("draw", "derive", "shader", "target")
_LARGEST = 3.4e38  # of a float32
_TRUE, _FALSE = ("true", "yes", "on", "1"), ("false", "no", "off", "0")


@dataclass(frozen=True)
class Parameter:
    """One parameter as its declaration has it.

    type: bool, int, float or str. low, high: inclusive limits of a number. choices: the
    words a str may be; empty: any. sweep: the values a benchmark tries. affects: what has
    to be made anew when it changes. optional: None ("auto" in text) is allowed.
    """

    name: str
    type: type
    default: Any
    help: str
    low: float | None
    high: float | None
    choices: tuple[str, ...]
    sweep: tuple[Any, ...]
    affects: str
    optional: bool

    def parse(self, value: object) -> Any:
        """The value of this parameter from text or a plain value; raises InputError."""
        if self.optional and (value is None or value == "auto"):
            return None
        result = _READERS[self.type](value)
        if result is None:
            raise InputError(f"'{shortened(value)}' is no {self.type.__name__}", self.name, self.help)
        if self.choices and result not in self.choices:
            raise unknown_name(self.name, result, self.choices)
        if (self.low is not None and result < self.low) or (self.high is not None and result > self.high):
            raise InputError(f"{shortened(result)} is outside {self.low} to {self.high}", self.name)
        return result

    def to_json(self) -> dict[str, Any]:
        """The declaration as a JSON object."""
        return {
            **dataclasses.asdict(self),
            "type": self.type.__name__,
            "choices": list(self.choices),
            "sweep": list(self.sweep),
        }


def param(
    default: Any,
    help: str,
    *,
    low: float | None = None,
    high: float | None = None,
    choices: tuple[str, ...] = (),
    sweep: tuple[Any, ...] = (),
    affects: str = "draw",
    type: type | None = None,
) -> Any:
    """A dataclass field that is a parameter. type: needed where the default is None."""
    assert affects in AFFECTS
    return dataclasses.field(
        default=default,
        metadata={
            "help": help,
            "low": low,
            "high": high,
            "choices": choices,
            "sweep": sweep,
            "affects": affects,
            "type": type or default.__class__,
            "optional": default is None,
        },
    )


def describe(cls: type) -> list[Parameter]:
    """The parameters that a dataclass declares, in order."""
    return [Parameter(name=f.name, default=f.default, **f.metadata) for f in dataclasses.fields(cls)]


def parse(cls: type[T], values: Mapping[str, object], kind: str = "parameter") -> T:
    """An instance of a declaration from names and text or plain values; raises InputError."""
    declared = {p.name: p for p in describe(cls)}
    for name in values:
        if name not in declared:
            raise unknown_name(kind, name, list(declared))
    return cls(**{name: declared[name].parse(value) for name, value in values.items()})


def _bool(value: object) -> bool | None:
    if isinstance(value, bool):
        return value
    word = value.lower() if isinstance(value, str) else "1" if value == 1 else "0" if value == 0 else ""
    return True if word in _TRUE else False if word in _FALSE else None


def _int(value: object) -> int | None:
    if isinstance(value, (str, int)) and not isinstance(value, bool):
        try:
            return int(value)
        except ValueError:
            return None
    return int(value) if isinstance(value, float) and value.is_integer() else None


def _float(value: object) -> float | None:
    """Only those that shaders can hold."""
    if not isinstance(value, (str, int, float)) or isinstance(value, bool):
        return None
    try:
        number = float(value)
    except (ValueError, OverflowError):
        return None
    return number if abs(number) <= _LARGEST else None


def _str(value: object) -> str | None:
    return value if isinstance(value, str) else None


_READERS: dict[type, Callable[[object], Any]] = {bool: _bool, int: _int, float: _float, str: _str}
