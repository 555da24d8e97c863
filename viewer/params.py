"""Parameters are declared once: a frozen dataclass whose fields say all that others need.

From one declaration come the widgets, `--set key=value`, the JSON in recordings, the table
in the docs, the tests and the benchmark's sweep.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, TypedDict, TypeVar, Unpack

from .errors import InputError, shortened, unknown_name

T = TypeVar("T")
# What an edit changes: the picture alone, what a backend derives for a pose, or speed and not the picture.
AFFECTS = ("draw", "derive", "speed")
_LARGEST = 3.4e38  # of a float32
_TRUE, _FALSE = ("true", "yes", "on", "1"), ("false", "no", "off", "0")


@dataclass(frozen=True)
class Condition:
    """Condition on another parameter: it has to be one of these values, or, with `negated`, none of them."""

    parameter: str
    values: tuple[Any, ...]
    negated: bool = False

    def holds(self, values: object) -> bool:
        """Whether it does, of an instance of the declaration."""
        return (getattr(values, self.parameter) in self.values) is not self.negated


@dataclass(frozen=True)
class Obstacle:
    """Another switch of the same declaration that, while it is off, may leave a parameter without a visible
    effect on range views. switch: its name. why: the reason, which follows "The picture did not change:"."""

    switch: str
    why: str


@dataclass(frozen=True)
class Parameter:
    """One parameter as its declaration has it.

    type: bool, int, float or str. low, high: inclusive limits of a number. choices: the
    words a str may be; empty: any. sweep: the values a benchmark tries. affects: what an edit
    changes (`AFFECTS`). optional: None ("auto" in text) is allowed. unit: of a number, empty: none.
    group: the heading that it stands under, empty: none. when: all that has to hold for it to matter.
    key: switches it on the keyboard, empty: nothing. Only a switch can have one: a bool, or a str with two
    choices, which is on with the first. short: the title of a switch on the toolbar, empty: it is not there.
    obstacle: why a switch may have no visible effect. deprecated: former names, which are still read.
    title: the name in words. words: choice -> what people call it, where that is another word. basic: whether
    it is for everybody; the others are for those who look for them.
    """

    name: str
    title: str
    type: type
    default: Any
    help: str
    low: float | None
    high: float | None
    choices: tuple[str, ...]
    sweep: tuple[Any, ...]
    affects: str
    optional: bool
    unit: str
    group: str
    when: tuple[Condition, ...]
    key: str
    short: str
    obstacle: Obstacle | None
    deprecated: tuple[str, ...]
    words: Mapping[str, str]
    basic: bool

    @property
    def states(self) -> tuple[Any, ...]:
        """The values of a switch, (on, off); empty for a parameter that is no switch."""
        if self.type is bool:
            return True, False
        return self.choices if len(self.choices) == 2 else ()

    @property
    def switch_title(self) -> str:
        """The title of a switch, which says what it does while it is on."""
        if self.type is bool:
            return self.title
        return f"{self.title} {self.words.get(self.choices[0], self.choices[0])}"

    def is_on(self, values: object) -> bool:
        """Whether a switch is on, in an instance of the declaration."""
        return getattr(values, self.name) == self.states[0]

    def switched(self, values: T) -> T:
        """An instance of the declaration with this switch in its other state."""
        other = self.states[self.is_on(values)]
        return dataclasses.replace(values, **{self.name: other})  # type: ignore[type-var]

    def matters(self, values: object) -> bool:
        """Whether its value matters beside the other values of the same declaration."""
        return all(condition.holds(values) for condition in self.when)

    def parse(self, value: object) -> Any:
        """The value of this parameter from text or a plain value; raises InputError."""
        if self.optional and (value is None or value == "auto"):
            return None
        result = _READERS[self.type](value)
        if result is None:
            what = f"'{shortened(value)}' is not {_KINDS[self.type]}"
            raise InputError(what, self.name, self.help)
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
            "when": [{**dataclasses.asdict(one), "values": list(one.values)} for one in self.when],
            "deprecated": list(self.deprecated),
        }


class Declared(TypedDict, total=False):
    """Arguments of `param` beside the default and the help: the fields of `Parameter`, each with a default.

    type: needed if the default is None. title: if that is not the name in words. when, unless: names of other
    parameters -> the values with which this parameter matters, or does not.
    """

    low: float | None
    high: float | None
    choices: tuple[str, ...]
    sweep: tuple[Any, ...]
    affects: str
    type: type
    unit: str
    group: str
    when: Mapping[str, tuple[Any, ...]] | None
    unless: Mapping[str, tuple[Any, ...]] | None
    key: str
    short: str
    obstacle: Obstacle | None
    deprecated: tuple[str, ...]
    title: str
    words: Mapping[str, str]
    basic: bool


_DEFAULTS: dict[str, Any] = {
    "low": None, "high": None, "choices": (), "sweep": (), "affects": "draw", "unit": "", "group": "",
    "key": "", "short": "", "obstacle": None, "deprecated": (), "title": "", "words": {}, "basic": False,
}  # fmt: skip


def param(default: Any, help: str = "", **declared: Unpack[Declared]) -> Any:
    """A dataclass field that is a parameter, as `Parameter` says."""
    facts: dict[str, Any] = {**_DEFAULTS, "type": default.__class__, **declared}
    conditions = _conditions(facts.pop("when", None), negated=False)
    conditions += _conditions(facts.pop("unless", None), negated=True)
    metadata = {"help": help, "optional": default is None, "when": tuple(conditions), **facts}
    return dataclasses.field(default=default, metadata=metadata)


def radius_scale_param(**declared: Unpack[Declared]) -> Any:
    """The parameter `radius_scale` of a backend that draws splats."""
    usual: dict[str, Any] = {"low": 0.01, "high": 100, "sweep": (0.5, 1.0, 2.0), **declared}
    return param(1.0, "Factor on the radius of splats", **usual)


def _conditions(values: Mapping[str, tuple[Any, ...]] | None, negated: bool) -> list[Condition]:
    return [Condition(name, several, negated) for name, several in (values or {}).items()]


def describe(cls: type) -> tuple[Parameter, ...]:
    """The parameters that a dataclass declares, in order. Raises TypeError where the declaration is wrong."""
    return _described(cls)


@cache
def _described(cls: Hashable) -> tuple[Parameter, ...]:
    assert isinstance(cls, type)
    known = {field.name for field in dataclasses.fields(Parameter)}
    for field in dataclasses.fields(cls):
        where = f"{cls.__qualname__}.{field.name}"
        if "help" not in field.metadata:
            raise TypeError(f"{where} is not declared with param(...)")
        if not field.metadata["help"]:
            raise TypeError(f"{where} has no help: declare it with param(default, 'what it does')")
        if (type_ := field.metadata["type"]) not in _READERS:
            raise TypeError(f"{where} has the type {type_.__name__}, but must be a bool, int, float or str")
        if (affects := field.metadata["affects"]) not in AFFECTS:
            raise TypeError(f"{where} affects '{affects}', but can affect only {', '.join(AFFECTS)}")
        if unknown := sorted(field.metadata.keys() - known):
            raise TypeError(f"{where}: param has no argument {', '.join(unknown)}")
    declared = tuple(
        Parameter(
            name=f.name, default=f.default, **{**f.metadata, "title": f.metadata["title"] or in_words(f.name)}
        )
        for f in dataclasses.fields(cls)
    )
    by_name = {parameter.name: parameter for parameter in declared}
    for parameter in declared:
        if problem := _problem(parameter, by_name):
            raise TypeError(f"{cls.__qualname__}.{parameter.name} {problem}")
    return declared


def _problem(parameter: Parameter, by_name: Mapping[str, Parameter]) -> str:
    """The mistake in a declaration, empty where there is none. by_name: all of the dataclass."""
    others = {name: other for name, other in by_name.items() if name != parameter.name}
    if problem := _problem_of_switch(parameter, others):
        return problem
    for old in parameter.deprecated:
        if old in by_name or any(old in other.deprecated for other in others.values()):
            return f"has the former name '{old}', which is also a name or former name of another parameter"
    for condition in parameter.when:
        if condition.parameter not in others:
            known = ", ".join(others)
            return (
                f"depends on '{condition.parameter}', which is not the name of another parameter. Known: "
                f"{known}"
            )
    try:
        parameter.parse(parameter.default)
        for word in parameter.words:
            parameter.parse(word)
        for condition in parameter.when:
            for value in condition.values:
                others[condition.parameter].parse(value)
    except InputError as error:
        return f"has an invalid default or condition: {error}"
    return ""


def _problem_of_switch(parameter: Parameter, others: Mapping[str, Parameter]) -> str:
    """The mistake in what a declaration says of a switch, empty where there is none."""
    if parameter.key and not parameter.states:
        return "has a keyboard shortcut, but only a parameter with two values can have one"
    if parameter.key and parameter.key in (other.key for other in others.values()):
        return f"has the key '{parameter.key}', which another parameter also has"
    if parameter.short and not parameter.key:
        return "has a place on the toolbar, but only a parameter with a keyboard shortcut can have one"
    obstacle = parameter.obstacle
    if obstacle and (obstacle.switch not in others or not others[obstacle.switch].key):
        return f"names '{obstacle.switch}' as an obstacle, which is not a switch with a key"
    return ""


def in_words(name: str) -> str:
    """An identifier as the panel has it."""
    return name.replace("_", " ").capitalize()


def switches(values: object) -> dict[str, Parameter]:
    """The parameters that a key switches on and off, by name, where they matter beside the others."""
    return {p.name: p for p in describe(type(values)) if p.key and p.matters(values)}


def parse(cls: type[T], values: Mapping[str, object], kind: str = "parameter") -> T:
    """An instance of a declaration from names and text or plain values; raises InputError."""
    declared = {p.name: p for p in describe(cls)}
    current = renamed(cls, values)
    for name in current:
        if name not in declared:
            raise unknown_name(kind, name, list(declared))
    return cls(**{name: declared[name].parse(value) for name, value in current.items()})


def renamed(cls: type, values: Mapping[str, T]) -> dict[str, T]:
    """The values by the names that a declaration has now, where they are given by former ones."""
    former = {old: p.name for p in describe(cls) for old in p.deprecated}
    now = {old: name for old, name in former.items() if name not in values}
    return {now.get(name, name): value for name, value in values.items()}


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
_KINDS = {bool: "true or false", int: "a whole number", float: "a usable number", str: "a text"}
