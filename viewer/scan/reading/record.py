"""The record of how Scan4D reads a scan: each decision with its source, and what it does not use."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

from ...errors import InputError, shortened, unknown_name
from ..times import frame_in_words
from ..units import is_length

Source = Literal["file", "neighbour", "folder", "user", "assumed"]

# The keys of the record in the order of the panel, with the names that it shows.
KEYS = {
    "format": "Format",
    "frames": "Frames",
    "take": "Take",
    "times": "Times",
    "encoding": "Encoding",
    "separator": "Separator",
    "decimal": "Decimal mark",
    "skip": "Lines to skip",
    "columns": "Columns",
    "colors": "Color range",
    "normals": "Normals",
    "orientation": "Normal orientation",
    "missing": "Not measured",
    "unit": "Unit",
    "axes": "Axes",
    "ground": "Ground",
    "camera": "Camera",
    "extrinsics": "Extrinsics",
    "depth-scale": "Depth scale",
    "depth-channel": "Depth channel",
    "texture": "Texture",
    "splats": "Gaussian splats",
}
ROLES = (  # of columns; a column with another role is a number by the name that it has
    "x", "y", "z", "nx", "ny", "nz", "r", "g", "b", "a", "intensity", "radius", "number", "row", "column",
    "frame", "time", "id", "label", "-",
)  # fmt: skip
_SOURCES = {"file": "the file", "neighbour": "a file beside it", "folder": "file names"}  # without a name
_WORDS = {  # as people read them: values of keys
    "times": {"names": "file names", "index": "25 frames per second, without gaps", "stored": "stored"},
    "decimal": {".": "point", ",": "comma"},
    "separator": {
        "blank": "blanks",
        "tab": "tabs",
        "comma": "commas",
        "semicolon": "semicolons",
        "bar": "bars",
    },
    "unit": {"units": "not known"},
    "orientation": {
        "auto": "Automatic",  # the list of every decision has this word
        "quick": "Quick",
        "fine": "Fine",
        "auto-flipped": "Automatic, flipped",
        "quick-flipped": "Quick, flipped",
        "fine-flipped": "Fine, flipped",
        "viewpoint": "Towards the scanner",
    },
    "axes": {"unknown": "not known"},
    "take": {"all": "all, as one scan"},
}
_FPS = "fps:"
_SHORT = ("format", "columns", "decimal", "colors", "normals", "missing", "camera", "texture", "splats")
_LISTED = 12  # entries of a list that a line shows


@dataclass(frozen=True)
class Decision:
    """One answer about how Scan4D reads a scan.

    key:          one of `KEYS`
    value:        plain JSON: text, number, list or object; None where the question does not arise
    source:       "file": the file says so. "neighbour": another file beside it does. "folder": the names of
                  the files do. "user": the user does. "assumed": nothing does
    where:        what says so: "info.txt", "comment SPACE=RAS", "--read"; "from" in JSON
    why:          one sentence, shown as a tooltip
    alternatives: texts that `--read KEY=…` takes, the likeliest first; only where assumed
    changes_numbers: whether another answer changes what is measured. Together with "assumed" it is the mark
    """

    key: str
    value: Any
    source: Source = "file"
    where: str = ""
    why: str = ""
    alternatives: tuple[str, ...] = ()
    changes_numbers: bool = False

    def __post_init__(self) -> None:
        if self.key not in KEYS:
            raise unknown_name("decision", self.key, KEYS)
        if self.source not in get_args(Source):
            raise unknown_name("source of a decision", self.source, get_args(Source))

    @property
    def is_marked(self) -> bool:
        """Whether it is an assumption that can change a number."""
        return self.source == "assumed" and self.changes_numbers and self.value is not None

    @property
    def label(self) -> str:
        """The name that the panel shows."""
        return KEYS[self.key]

    @property
    def shown(self) -> str:
        """The value as people read it."""
        return words_of_value(self.key, self.value)

    @property
    def shown_source(self) -> str:
        """The source as people read it: "from info.txt", "assumed", "set by you"."""
        if self.source == "user":
            return "set by you"
        if self.source == "assumed":
            return "assumed"
        return f"from {self.where or _SOURCES[self.source]}"

    def to_json(self) -> dict[str, Any]:
        """Plain values; the key is not among them."""
        return {
            "value": self.value,
            "source": self.source,
            "from": self.where,
            "why": self.why,
            "alternatives": list(self.alternatives),
        }


@dataclass(frozen=True)
class Aside:
    """A file that the scan does not use. why: "copy of f002.ply", "another take: take2_", "reference"."""

    file: str
    why: str


@dataclass(frozen=True)
class Contradiction:
    """A frame that does not fit a decision about the whole scan. what: one clause that says how."""

    frame: int
    key: str
    what: str


@dataclass(frozen=True)
class Take:
    """One of several scans in a folder. name: "take1". pattern: of its files, such as "take1_*.ply". frames:
    how many."""

    name: str
    pattern: str
    frames: int


@dataclass(frozen=True)
class Reading:
    """How Scan4D reads a scan.

    decisions: key -> Decision, all of `KEYS` in their order; the value is None where nothing is decided
    aside:     files that the scan does not use
    unused:    what the file holds and Scan4D does not use, such as "45 harmonics of degree 1 to 3"
    takes:     the scans that a folder holds; empty where it is one
    contradictions: frames that do not fit the decisions, as far as Scan4D has read them
    """

    decisions: Mapping[str, Decision] = field(default_factory=dict)
    aside: tuple[Aside, ...] = ()
    unused: tuple[str, ...] = ()
    takes: tuple[Take, ...] = ()
    contradictions: tuple[Contradiction, ...] = ()

    def __post_init__(self) -> None:
        if unknown := [key for key in self.decisions if key not in KEYS]:
            raise unknown_name("decision", unknown[0], KEYS)
        every = {key: self.decisions.get(key) or Decision(key, None) for key in KEYS}
        object.__setattr__(self, "decisions", every)

    def __getitem__(self, key: str) -> Decision:
        return self.decisions[key]

    @classmethod
    def of(cls, *decisions: Decision) -> Reading:
        """A record of these decisions."""
        return cls().with_(*decisions)

    def with_(self, *decisions: Decision) -> Reading:
        """The record with these decisions in place of those of the same keys."""
        return replace(self, decisions={**self.decisions, **{one.key: one for one in decisions}})

    @property
    def assumed(self) -> tuple[str, ...]:
        """The keys of the assumptions that can change a number."""
        return tuple(key for key, one in self.decisions.items() if one.is_marked)

    def short(self) -> list[str]:
        """Return the decisions about the file's contents, one text each, for one line."""
        shown = [self.decisions[key] for key in _SHORT if self.decisions[key].value not in (None, "")]
        return [one.shown if one.key == "format" else f"{one.label.lower()} {one.shown}" for one in shown]

    def marks(self) -> list[str]:
        """The assumptions that can change a number, one text each."""
        return [f"{KEYS[key].lower()} {self.decisions[key].shown}" for key in self.assumed]

    def lines(self, verbose: bool = False) -> list[tuple[str, str]]:
        """Labels and texts for a terminal. verbose: every decision, with its source and its alternatives."""
        if not verbose:
            rows = [("read as", "; ".join(self.short())), ("assumed", "; ".join(self.marks()))]
            return [row for row in rows if row[1]]
        made = [one for one in self.decisions.values() if one.value is not None]
        return [
            *((one.label.lower(), _in_full(one)) for one in made),
            *(("take", f"{take.name}: {take.frames} frames, {take.pattern}") for take in self.takes),
            *(("left aside", f"{aside.file}: {aside.why}") for aside in self.aside),
            *(("not used", text) for text in self.unused),
            *(("contradiction", f"{frame_in_words(one.frame)}: {one.what}") for one in self.contradictions),
        ]

    def without_names(self) -> Reading:
        """The record without names that a user or a file gave, which may name a person: of files, takes,
        columns, channels and units. Sources and numbers stay."""
        decisions = {
            key: replace(one, value=_without_names(key, one.value), where="", alternatives=(), why="")
            for key, one in self.decisions.items()
        }
        return Reading(decisions)

    def to_json(self) -> dict[str, Any]:
        """Plain values, as `scan4d info --json` prints them and documents store them."""
        return {
            "decisions": {key: one.to_json() for key, one in self.decisions.items()},
            "assumed": list(self.assumed),
            "aside": [{"file": one.file, "why": one.why} for one in self.aside],
            "unused": list(self.unused),
            "takes": [{"name": t.name, "pattern": t.pattern, "frames": t.frames} for t in self.takes],
            "contradictions": [
                {"frame": one.frame, "key": one.key, "what": one.what} for one in self.contradictions
            ],
        }

    @classmethod
    def from_json(cls, data: Any) -> Reading:
        """The record of `to_json`; keys that this version does not know are left out. Raises InputError.

        Which assumptions can change a number is in "assumed".
        """
        try:
            marked = set(data.get("assumed", ()))
            decisions = {
                key: Decision(
                    key, one["value"], one["source"], one["from"], one["why"], tuple(one["alternatives"]),
                    key in marked,
                )
                for key, one in data["decisions"].items()
                if key in KEYS
            }  # fmt: skip
            return cls(
                decisions,
                tuple(Aside(one["file"], one["why"]) for one in data["aside"]),
                tuple(str(text) for text in data["unused"]),
                tuple(Take(one["name"], one["pattern"], int(one["frames"])) for one in data["takes"]),
                tuple(
                    Contradiction(int(one["frame"]), one["key"], one["what"])
                    for one in data["contradictions"]
                ),
            )
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise InputError(f"is not a record of how Scan4D read a scan: {shortened(data)}") from error


def words_of_value(key: str, value: Any) -> str:
    """A value of a key as people read it: "25 frames per second" of the times "fps:25"."""
    if isinstance(value, str):
        if key == "times" and value.startswith(_FPS):
            return f"{value.removeprefix(_FPS)} frames per second"
        return _WORDS.get(key, {}).get(value, value)
    if key == "camera" and isinstance(value, Mapping):
        value = {name: one for name, one in value.items() if (name, one) != ("kind", "z")}
    return shown_value(value)


def shown_value(value: Any) -> str:
    """A value of a decision as people read it: "x y z", "fx 290, fy 290", "yes"."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, Mapping):
        filled = {key: one for key, one in value.items() if one not in (None, "", [], ())}
        return ", ".join(f"{key} {shown_value(one)}" for key, one in filled.items())
    if isinstance(value, Iterable) and not isinstance(value, str):
        texts = [shown_value(one) for one in value]
        more = [f"and {len(texts) - _LISTED} more"] if len(texts) > _LISTED else []
        return " ".join([*texts[:_LISTED], *more])
    return str(value)


def _in_full(decision: Decision) -> str:
    """A decision with its source, its reason and its alternatives, on one line."""
    source = decision.shown_source
    if decision.source in ("assumed", "user") and decision.where:
        source += f", {decision.where}"
    parts = [f"{decision.shown} ({source})", decision.why]
    if decision.alternatives:
        parts.append("Alternatives: " + ", ".join(decision.alternatives))
    return ". ".join(part.rstrip(".") for part in parts if part)


def holds_name(key: str, value: Any) -> bool:
    """Whether a value of a decision or a correction is, or contains, a name that a user or a file gave."""
    if key == "columns" and not isinstance(value, str):
        return not {*(value or ())} <= {*ROLES}
    if key == "unit":
        return value is not None and not is_length(value)
    if key == "camera":
        return isinstance(value, str)
    if key == "times" and isinstance(value, str):
        return value not in ("names", "index") and not value.startswith("fps:")
    if key == "frames":
        return value not in ("rows", "image", "cloud")
    return key in ("columns", "take", "times", "texture", "depth-channel") and isinstance(value, str)


def _without_names(key: str, value: Any) -> Any:
    """A value without names that a user or a file gave."""
    if key == "columns" and isinstance(value, (list, tuple)):
        return [role if role in ROLES else "scalar" for role in value]
    if isinstance(value, Mapping):
        return {name: one for name, one in value.items() if not isinstance(one, str) or name == "kind"}
    return None if holds_name(key, value) else value
