"""What a user corrects in how Scan4D reads a scan: `--read KEY=VALUE`, and the dialogs of the window."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from ...errors import InputError, shortened, unknown_name
from ..points import ORIENTATIONS
from ..units import checked_unit
from .record import ROLES, Decision, holds_name

_LENS_COUNTS = (0, 4, 5, 8)  # of coefficients, see viewer/scan/lens.py
_MOST_LINES = 1 << 16
_MOST_POINTS = 100_000_000


def _one_of(*words: str) -> Callable[[str], str]:
    def parse(text: str) -> str:
        known = {word.lower(): word for word in words}
        if text.lower() not in known:
            raise ValueError
        return known[text.lower()]

    return parse


def _words(form: str, *words: str) -> Key:
    """A key whose values are these words."""
    return Key(_one_of(*words), form, words)


def _columns(text: str) -> tuple[str, ...]:
    roles = tuple(text.replace(",", " ").split())
    repeated = {role for role in roles if role != "-" and roles.count(role) > 1}
    if repeated or not {"x", "y", "z"} <= {*roles}:
        raise ValueError
    return roles


def _number(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError
    return number


def _positive(text: str) -> float:
    number = _number(text)
    if number <= 0:
        raise ValueError
    return number


def _lines(text: str) -> int:
    number = int(text)
    if not 0 <= number <= _MOST_LINES:
        raise ValueError
    return number


def _missing(text: str) -> str | float | tuple[float, float, float]:
    if text.lower() == "none":
        return "none"
    numbers = [_number(word) for word in text.replace(",", " ").split()]
    if len(numbers) == 3:
        return numbers[0], numbers[1], numbers[2]
    (number,) = numbers
    return number


def _camera(text: str) -> tuple[float, ...] | str:
    words = text.split(",")
    try:
        numbers = tuple(_number(word) for word in words)
    except ValueError:
        if len(words) >= 4:  # numbers, one of them spelt wrong
            raise
        return text
    if len(numbers) - 4 not in _LENS_COUNTS or min(numbers[:2]) <= 0:
        raise ValueError
    return numbers


def _axes(text: str) -> str:
    if text.lower() in ("lps", "ras", "unknown"):
        return text.lower() if text.lower() == "unknown" else text.upper()
    words = [word if word[:1] in "+-" else f"+{word}" for word in text.lower().replace(",", " ").split()]
    if len(words) != 3 or {word[1:] for word in words} != {"x", "y", "z"}:
        raise ValueError
    return " ".join(words)


def _texture(text: str) -> str:
    kind, colon, rest = text.lower().partition(":")
    if colon and kind == "dense":
        return f"dense:{_positive_count(rest)}"
    return _one_of("vertices", "dense", "none")(text)


def _positive_count(text: str) -> int:
    number = int(text)
    if not 0 < number <= _MOST_POINTS:
        raise ValueError
    return number


def _times(text: str) -> str:
    kind, colon, rest = text.partition(":")
    if colon and kind == "fps":
        return f"fps:{_positive(rest):g}"
    if colon and kind == "column" and not rest.strip():
        raise ValueError
    return text.lower() if text.lower() in ("names", "index") else text


@dataclass(frozen=True)
class Key:
    """A key that a user can correct. parse: the value from text, ValueError where it is none. form: what
    the text looks like, for messages and help. choices: common texts, for lists."""

    parse: Callable[[str], Any]
    form: str
    choices: tuple[str, ...] = ()


CORRECTED = {
    "columns": Key(_columns, f"a role for each column, with x, y and z, from {' '.join(ROLES)} or a name"),
    "separator": _words("blank, tab, comma, semicolon or bar", "blank", "tab", "comma", "semicolon", "bar"),
    "decimal": _words("'.' or ','", ".", ","),
    "skip": Key(_lines, "a number of lines"),
    "encoding": _words("utf-8, utf-16 or latin-1", "utf-8", "utf-16", "latin-1"),
    "colors": _words("the largest value 1, 255 or 65535, or none", "1", "255", "65535", "none"),
    "normals": _words("stored or none", "stored", "none"),
    "orientation": Key(
        _one_of(*ORIENTATIONS),
        "auto, quick or fine, each also with -flipped",
        ORIENTATIONS[1:],  # "auto" is what Scan4D does without a correction
    ),
    "missing": Key(_missing, "none, three numbers such as 0,0,0, or one number", ("none", "0,0,0")),
    "texture": Key(_texture, "vertices, dense, dense:500000 or none", ("vertices", "dense", "none")),
    "splats": _words("yes or no", "yes", "no"),
    "camera": Key(_camera, "fx,fy,cx,cy in pixels, optionally with 4, 5 or 8 lens coefficients; or a file"),
    "extrinsics": _words("to-camera or to-world", "to-camera", "to-world"),
    "depth-scale": Key(_positive, "the number of depth steps in one unit, above 0"),
    "depth-channel": Key(str, "a channel of the EXR file"),
    "axes": Key(
        _axes, "LPS, RAS, unknown, or three signed axes such as '+x -z +y'", ("LPS", "RAS", "unknown")
    ),
    "ground": _words("degrees or lengths", "degrees", "lengths"),
    "unit": Key(checked_unit, "a short word such as mm", ("mm", "cm", "m")),
    "frames": Key(
        str, "a pattern such as '*.ply', a list such as 'b.ply;a.ply', or for an array: rows, image or cloud"
    ),
    "take": Key(str, "a name, or all", ("all",)),
    "times": Key(_times, "names, index, fps:50, column:NAME, or a file", ("names", "index")),
}


@dataclass(frozen=True)
class Corrections(Mapping[str, Any]):
    """Corrections of a user: key -> parsed value.

    columns:       tuple of roles        separator, encoding, colors, normals, orientation, splats, axes,
                   ground: str
    decimal:       "." or ","            skip: int              depth-scale: float
    missing:       "none", a float, or (x, y, z)
    camera:        tuple (fx, fy, cx, cy, *lens), in pixels with the centre of the first one at (0, 0); or a
                   file's name
    depth-channel, extrinsics, unit, frames, take: str
    texture:       "none", "vertices", "dense", or "dense:500000", with the largest number of points
    times:         "names", "index", "fps:50", "column:NAME", or a file's name

    texts: key -> the text that the user gave, as documents store it.
    """

    texts: Mapping[str, str] = field(default_factory=dict)
    _values: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @classmethod
    def parse(cls, texts: Mapping[str, object]) -> Corrections:
        """Corrections from texts by key. Raises InputError for an unknown key and an unusable value."""
        stated = {key: str(text).strip() for key, text in texts.items()}
        return cls(stated, {key: _value(key, text) for key, text in stated.items()})

    def __getitem__(self, key: str) -> Any:
        return self._values[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __hash__(self) -> int:
        return hash(tuple(sorted(self.texts.items())))

    def amended(self, texts: Mapping[str, object]) -> Corrections:
        """Return these corrections with others, which win for keys of both. Raises InputError."""
        return Corrections.parse({**self.texts, **texts})

    def without_names(self) -> dict[str, str]:
        """The texts of those corrections that name no file, take, channel or column: such a name may tell
        whose scan it is."""
        return {key: text for key, text in self.texts.items() if not holds_name(key, self._values[key])}

    def decision(self, key: str, value: Any = None) -> Decision | None:
        """The user's decision about a key; None where the user leaves it open. value: what stands in the
        record instead of the parsed value."""
        if key not in self._values:
            return None
        own = self._values[key]
        plain = list(own) if isinstance(own, tuple) else own
        return Decision(key, plain if value is None else value, "user", "--read")


NOTHING_CORRECTED = Corrections()


def _value(key: str, text: str) -> Any:
    if key not in CORRECTED:
        raise unknown_name("correction", key, CORRECTED)
    try:
        if not text:
            raise ValueError
        return CORRECTED[key].parse(text)
    except (ValueError, OverflowError) as error:
        what = f"'{shortened(text)}' is not a possible value of {key}"
        raise InputError(what, hint=f"Give {CORRECTED[key].form}") from error


def parsed_pair(pair: str) -> tuple[str, str]:
    """Key and text of `KEY=VALUE`. Raises InputError where there is no sign between them, or no such key."""
    key, sign, text = pair.partition("=")
    if not sign:
        raise InputError(
            f"'{shortened(pair)}' does not have the form KEY=VALUE", hint="For example: decimal=,"
        )
    _value(key.strip(), text.strip())
    return key.strip(), text.strip()
