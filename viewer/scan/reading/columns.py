"""What the columns of a table are: by their names, by the suffix of the file, or by their values."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..units import is_length, plain_unit
from .corrections import NOTHING_CORRECTED, Corrections
from .record import Decision

KEY = "columns"

# --- names --------------------------------------------------------------------------------------

_AXES, _PARTS = ("x", "y", "z"), ("red", "green", "blue", "alpha")
_POSITION_BASES = (
    "points", "point", "position", "positions", "pos", "coordinates", "coordinate", "coords", "coord",
    "vertices", "vertex", "location", "loc", "xyz", "koordinate", "koordinaten", "koord", "punkt", "wert",
    "coordonnee", "coordonnees", "coordinata", "coordenada", "p",
)  # fmt: skip
_NORMAL_BASES = ("normals", "normal", "n", "norm", "pointnormals", "vertexnormals", "normale")
_COLOR_BASES = ("rgb", "rgba", "colors", "color", "colours", "colour", "col", "diffuse", "vertexcolors")
_PLANE = (
    ("easting", "northing"), ("east", "north"), ("e", "n"), ("rechtswert", "hochwert"), ("rechts", "hoch"),
    ("ostwert", "nordwert"), ("ost", "nord"), ("abscisse", "ordonnee"), ("est", "nord"),
)  # fmt: skip
_HEIGHTS = ("elevation", "height", "hohe", "hoehe", "hauteur", "altitude", "altezza")


def _of_bases(bases: Iterable[str], *ends: Sequence[str]) -> list[tuple[str, ...]]:
    return [tuple(f"{base}_{part}" for part in end) for base in bases for end in ends]


# What programs call the columns of one attribute, as `plain_name` returns it; the first complete set counts.
_POSITIONS = [
    *_of_bases(_POSITION_BASES, _AXES, "012"),
    ("posx", "posy", "posz"), ("coordx", "coordy", "coordz"),
    *((*plane, height) for plane in _PLANE for height in ("z", *_HEIGHTS, "up", "h", "u")),
    *(("x", "y", height) for height in _HEIGHTS),
    ("x0", "y0", "z0"), ("x0", "x1", "x2"),
]  # fmt: skip
_NORMALS = [*_of_bases(_NORMAL_BASES, _AXES, "012"), ("normalx", "normaly", "normalz")]
_COLORS = [
    ("rf", "gf", "bf", "af"),
    ("rf", "gf", "bf"),
    *_of_bases(_COLOR_BASES, "rgba", "rgb", _PARTS, _PARTS[:3], "0123", "012"),
    ("rot", "grun", "blau"), ("rot", "gruen", "blau"), ("rouge", "vert", "bleu"),
]  # fmt: skip
# The names that `cloud_from_columns` knows, and whether a file has them.
_KNOWN = {
    _AXES: [_AXES],
    ("nx", "ny", "nz"): [("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z")],
    _PARTS: [_PARTS[:3], ("r", "g", "b"), ("diffuse_red", "diffuse_green", "diffuse_blue")],
}
_ALIASES = {_AXES: _POSITIONS, ("nx", "ny", "nz"): _NORMALS, _PARTS: _COLORS}
_LENGTHS = {
    "radius",
    *_AXES,
    *(name for names in _POSITIONS for name in names),
}  # names that may end with _mm

_FRAMES = {"frame", "frames", "frame_id", "frameid", "frame id", "frame_no", "frame no", "frame_number",
           "framenumber", "frame number", "frame_index", "frameindex", "frame index", "frame #",
           "frame_nr", "frame nr", "bild", "bild nr", "bildnr", "bildnummer", "trame"}  # fmt: skip
_TIMES = {"time", "times", "t", "timestamp", "timestamps", "time_stamp", "seconds", "sec", "zeit", "temps",
          "zeitstempel", "tiempo", "elapsed_time", "relative_time", "sekunden", "secs",
          "time step", "timestep", "time_step"}  # fmt: skip
_IDS = {"id", "ids", "point_id", "pointid", "point id", "vertex_id", "marker_id", "marker", "point_number",
        "pointnumber", "point number", "point_index", "track_id", "point", "punkt"}  # fmt: skip
_LABELS = {"label", "name", "landmark", "marker", "description"}

_IN_BRACKETS = re.compile(r"\s*[\[({<]\s*([^\])}>]*?)\s*[\])}>]$")
_BEHIND = re.compile(r"(?:\s*/\s*|\s+in\s+|\s*[-,]\s*)(\w+)$")
_SUFFIX = re.compile(r"(.+?)[ _](\w+)|([xyz])([nµμuck]m|mm)")
_CAPITAL = re.compile(r"(?<=[a-z])(?=[A-Z]$)")  # before the component of "coordsX"
_AXIS_FIRST = re.compile(r"([xyz])[ _-]?(\w+)")
_COMPONENT = re.compile(r"(.+?)\s*(?:[:_. \[]+)([0-3xyzrgba]|red|green|blue|alpha)\]?")
_SECONDS = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}


class PlainName(NamedTuple):
    """The name of a column without what programs add. unit: that it states, any text; None: none."""

    name: str
    unit: str | None


def plain_name(name: str) -> PlainName:
    """The name of a column in lower case, without quotes, marks of comments and units: "x" for `"X [mm]"`.

    The number of a component follows `_`, whatever a program writes: "points_0" for `Points:0`, `Points[0]`.
    """
    text = name.strip().strip("\"'").lstrip("#/%!;*_' \t").rstrip("#.: ")
    text = unicodedata.normalize("NFKD", _CAPITAL.sub("_", text).casefold())
    text = "".join(letter for letter in text if not unicodedata.combining(letter))
    unit = None
    if (match := _IN_BRACKETS.search(text)) and match.start() and not match[1].isdecimal():
        text, unit = text[: match.start()], plain_unit(match[1]) or None
    elif (match := _BEHIND.search(text)) and match.start() and _is_unit(match[1]):
        text, unit = text[: match.start()], plain_unit(match[1])
    elif (match := _SUFFIX.fullmatch(text)) and _is_unit(word := match[2] or match[4]):
        base = _component_form(match[1] or match[3])
        if base in _LENGTHS or base in _TIMES:
            return PlainName(base, plain_unit(word))
    return PlainName(_component_form(text.strip()), unit)


def _is_unit(word: str) -> bool:
    return is_length(plain_unit(word)) or word in _SECONDS


def _component_form(text: str) -> str:
    match = _AXIS_FIRST.fullmatch(text)
    if match and match[2] in _POSITION_BASES + _NORMAL_BASES:
        return f"{match[2]}_{match[1]}"
    match = _COMPONENT.fullmatch(text)
    return f"{match[1]}_{match[2]}" if match else text


def canonical_names(names: Sequence[str]) -> list[str]:
    """The names of columns, with x, y, z, nx, ny, nz, red, green, blue and alpha for what programs call so.

    Names stay as they are where a file has those of one attribute already.
    """
    result = [*names]
    lower = {name.strip().lower() for name in names}
    plain = [plain_name(name).name for name in names]
    index = {name: at for at, name in reversed([*enumerate(plain)])}
    for attribute, known in _KNOWN.items():
        if any(lower >= {*own} for own in known):
            continue
        choices = [*known, *_ALIASES[attribute]]
        if known[0] == _PARTS[:3]:
            choices = [_PARTS, ("r", "g", "b", "a"), *choices]
        chosen = next((choice for choice in choices if all(name in index for name in choice)), ())
        for name, target in zip(chosen, attribute, strict=False):
            result[index[name]] = target
    return result


def decide_named(names: Sequence[str]) -> Decision:
    """The roles of named columns: a list, one for each, of its own name where it has no role."""
    canonical = canonical_names(names)
    roles = [_ROLE_OF.get(name.lower(), name) for name in canonical]
    others = [name for name, own in zip(names, canonical, strict=True) if name != own]
    return Decision(KEY, roles, why=f"The file names the columns {', '.join(names[:20])}." if others else "")


def has_positions(names: Sequence[str]) -> bool:
    """Whether columns of these names hold x, y and z."""
    return {*_AXES} <= {name.strip().lower() for name in canonical_names(names)}


def unit_in_names(names: Sequence[str]) -> str | None:
    """The unit of length in the names of x, y and z, such as "mm" of `x [mm]`; None where they differ."""
    units = units_in_names(names)
    return units.pop() if len(units) == 1 else None


def units_in_names(names: Sequence[str]) -> set[str | None]:
    """All units in the names of x, y and z; None stands for a name without one."""
    return {
        plain_name(name).unit
        for name, canonical in zip(names, canonical_names(names), strict=True)
        if canonical.lower() in _AXES
    }


# --- columns without names ----------------------------------------------------------------------

_NAME_OF = {
    "r": "red",
    "g": "green",
    "b": "blue",
    "a": "alpha",
}  # roles that columns of clouds call otherwise
_ROLE_OF = {
    **{name: name for name in ("x", "y", "z", "nx", "ny", "nz", "r", "g", "b", "a", "radius", "intensity")},
    **{name: role for role, name in _NAME_OF.items()},
    **{f"normal_{axis}": f"n{axis}" for axis in _AXES},
}
_NORMAL, _RGB = ["nx", "ny", "nz"], ["r", "g", "b"]
_BY_SUFFIX = {
    ".xyzrgb": [*_AXES, *_RGB], ".txyzrgb": [*_AXES, *_RGB], ".xyzn": [*_AXES, *_NORMAL],
    ".xyznrgb": [*_AXES, *_NORMAL, *_RGB], ".xyzi": [*_AXES, "intensity"],
}  # fmt: skip
_UNIT_SHARE, _UNIT_WITHIN = 0.99, 1e-3  # rows of normals, and how far their length is from 1
_SAMPLE = 1 << 16  # rows whose lengths and decimals are looked at
_LEAST = 3  # rows that count 1, 2, 3
_SINCE_1970 = 1e9  # seconds, and more of smaller units
_LEAST_INCREASING = 10  # rows that make an increasing column a number or a time
_RELATED = 0.5  # correlation of a row or column of a grid with a coordinate


def decide(
    table: NDArray[np.float64], suffix: str = "", corrections: Corrections = NOTHING_CORRECTED
) -> Decision:
    """The roles of the columns of a table without names, (N, C): a list, one for each.

    Roles are those of `corrections.ROLES`, and `column_8` for the eighth where it has none. suffix: of the
    file, in lower case with the dot. Raises InputError where the user states another number of roles.
    """
    width = table.shape[1]
    if (stated := corrections.decision(KEY)) is not None:
        if len(stated.value) != width:
            what = f"has {width} columns, but --read columns= names {len(stated.value)}"
            raise InputError(what, hint="Give a role for each column, and '-' for each column to leave out")
        return stated
    by_suffix = _BY_SUFFIX.get(suffix)
    if by_suffix is not None and width >= len(by_suffix):
        fronts = [front for front, _ in _fronts(table) if len(front) + len(by_suffix) == width]
        roles = [*(fronts[0] if fronts else ()), *by_suffix]
        roles += _left_over(width, roles)
        return Decision(KEY, roles, "file", suffix, f"The suffix {suffix} states the columns.")
    finite = np.isfinite(table).all(axis=1)
    found = _candidates(table if finite.all() else table[finite], suffix == ".pts")
    roles = found[0].roles
    if width == 3:
        return Decision(KEY, roles, "file", why="Three columns are x, y and z.")
    others = tuple(" ".join(one.roles) for one in found[1:] if one.roles != roles)
    return Decision(
        KEY, roles, "assumed", "", found[0].why, tuple(dict.fromkeys(others)), changes_numbers=True
    )


def names_of(roles: Sequence[str]) -> list[str]:
    """The names that columns of these roles have in a cloud."""
    return [_NAME_OF.get(role, role) for role in roles]


class _Candidate(NamedTuple):
    roles: list[str]
    why: str
    is_complete: bool  # whether every column is one of a known attribute


def _candidates(table: NDArray[np.float64], intensity_first: bool) -> list[_Candidate]:
    """The roles that columns may have, the likeliest first."""
    plain = _behind([], table, intensity_first)
    found = [plain]
    for front, why in _fronts(table):
        behind = _behind(front, table, intensity_first)
        candidate = _Candidate(behind.roles, why, behind.is_complete)
        is_less = plain.is_complete and not behind.is_complete
        is_less = is_less or (front == ["time"] and table[0, 0] < _SINCE_1970)  # or x of a line of points
        found.insert(len(found) if is_less else 0, candidate)
    if table.shape[1] == 6:
        first = found[0].roles
        if first[3:] == _NORMAL or first[3:] == _RGB:
            other = _RGB if first[3:] == _NORMAL else _NORMAL
            found.append(_Candidate([*_AXES, *other], "", True))
    if table.shape[1] == 7 and {*found[0].roles[3:]} == {*_RGB, "intensity"}:
        is_first = found[0].roles[3] == "intensity"
        others = [*_RGB, "intensity"] if is_first else ["intensity", *_RGB]
        found.append(_Candidate([*_AXES, *others], "", True))
    found.append(_Candidate([*_AXES, *_left_over(table.shape[1], [*_AXES])], "", False))
    return found


def _fronts(table: NDArray[np.float64]) -> Iterator[tuple[list[str], str]]:
    """Roles that may stand before x, y and z, each with the reason."""
    count, width = table.shape
    if count < _LEAST or width < 4:
        return
    first = table[:, 0]
    if first[0] in (0, 1) and first[1] - first[0] == 1 and (np.diff(first) == 1).all():
        if not any((first == table[:, at]).all() for at in range(1, width)):
            yield (
                ["number"],
                (f"The first column numbers the rows: {first[0]:g}, {first[1]:g}, {first[2]:g} and so on."),
            )
    elif width >= 5 and _is_grid(table):
        yield ["row", "column"], "The first two columns number the rows and columns of a grid."
    elif count >= _LEAST_INCREASING and _increases(first) and not _is_profile(table[:, 1:4]):
        is_whole = bool((first == np.rint(first)).all())
        yield ["number" if is_whole else "time"], "The first column increases from row to row."


def _increases(column: NDArray[np.float64]) -> bool:
    return bool((np.diff(column) > 0).all())


def _is_profile(three: NDArray[np.float64]) -> bool:
    """Whether the three columns behind an increasing one may be y, z and another of one line of points."""
    return any((column == column[0]).all() or _increases(column) or _increases(-column) for column in three.T)


def _is_grid(table: NDArray[np.float64]) -> bool:
    """Whether the first two of five or more columns count a grid, which the next ones follow."""
    pair = table[:, :2]
    if (pair[:_LEAST] != np.rint(pair[:_LEAST])).any() or (pair != np.rint(pair)).any() or (pair < 0).any():
        return False
    ordered = any(
        (np.diff(major) >= 0).all() and (np.diff(minor)[np.diff(major) == 0] > 0).all()
        for major, minor in (pair.T, pair.T[::-1])
    )
    if not ordered or (pair == pair[0]).all(axis=0).any():
        return False
    with np.errstate(all="ignore"):
        related = np.abs(np.asarray(np.corrcoef(table[:, :5].T))[:2, 2:]) > _RELATED
    return bool(related.any(axis=1).all() and related.any(axis=0).sum() >= 2)


def _behind(front: list[str], table: NDArray[np.float64], intensity_first: bool) -> _Candidate:
    """x, y and z behind the columns in front, and then blocks of colours and normals."""
    width = table.shape[1]
    roles = [*front, *_AXES]
    roles += ["intensity"][: intensity_first and width > len(roles) and width != 6]
    whys, is_complete = [], True
    missing = {"r", "nx", "intensity"} - {*roles}
    while (at := len(roles)) < width:
        three = table[:, at : at + 3]
        kind, why = (None, "") if three.shape[1] < 3 else _block(three, width - len(front))
        if kind == "r" and _is_shifted(table[:, at : at + 4]):
            kind = None
        if kind in missing:
            roles += _RGB if kind == "r" else _NORMAL
            whys.append(why)
            is_complete = is_complete and why not in _WEAK
        elif roles[-1] == "b" and any((three[:, 0] == full).all() for full in (1, 255)):
            roles.append("a")
        else:
            is_complete = is_complete and "intensity" in missing and at + 1 == width
            roles.append("intensity" if "intensity" in missing else f"column_{at + 1}")
        missing -= {*roles[at:]}
    return _Candidate(roles, " ".join(dict.fromkeys(whys)), is_complete)


_WEAK = (
    "Scan4D takes three columns of positive and negative numbers as normals.",
    "Scan4D takes three columns of numbers up to 1 as normals.",
)  # of any length


def _block(three: NDArray[np.float64], width: int) -> tuple[str | None, str]:
    """The kind of three columns, "r", "nx" or None, and why. width: of the table."""
    if not len(three):
        return None, ""
    some_rows = three[:: max(1, len(three) // _SAMPLE)]
    length = np.sqrt(np.einsum("ij,ij->i", some_rows, some_rows))
    some = length > 0
    if some.any() and (np.abs(length[some] - 1) <= _UNIT_WITHIN).mean() >= _UNIT_SHARE and some.mean() > 0.5:
        return "nx", "Three columns contain vectors of length 1, which are normals."
    low, high = three.min(), three.max()
    is_whole = bool((some_rows == np.rint(some_rows)).all())
    if low >= 0 and high <= 255 and is_whole and high > 0:
        return "r", "Scan4D takes three columns of whole numbers up to 255 as colours."
    if low >= 0 and high <= 1 and not is_whole:
        return "r", "Scan4D takes three columns of numbers from 0 to 1 as colours."
    if low >= 0 and 1.001 < high <= 65535 and width == 6 and (is_whole or high <= 255):
        return "r", "Scan4D takes three columns without negative numbers as colours."
    if np.abs(three).max() <= 1.001 or width == 6:
        return "nx", _WEAK[0] if low < 0 else _WEAK[1]
    return None, ""


def _is_shifted(four: NDArray[np.float64]) -> bool:
    """Whether the first of four columns is 0 everywhere and the other three are colours."""
    if four.shape[1] < 4 or not len(four) or four[:, 0].any():
        return False
    return _block(four[:, 1:], 0)[0] == "r" and not any((four[:, 3] == full).all() for full in (1, 255))


def _left_over(width: int, roles: Sequence[str]) -> list[str]:
    """The roles behind those that are found: one intensity, then columns by number."""
    rest = [f"column_{at + 1}" for at in range(len(roles), width)]
    return ["intensity", *rest[1:]] if rest and "intensity" not in roles else rest


# --- several moments in one table ---------------------------------------------------------------


class Moments(NamedTuple):
    """The moments of a table.

    order: (N,) rows, moment by moment. starts: (T + 1,) into `order`. times: (T,) seconds; None: not stated.
    ids: (N,) uint32 of the rows in `order`, increasing in each moment; None where the table has none.
    why: one sentence.
    """

    order: NDArray[np.int64]
    starts: NDArray[np.int64]
    times: NDArray[np.float64] | None
    numbers: NDArray[np.float64]
    ids: NDArray[np.uint32] | None
    why: str


class MomentColumns(NamedTuple):
    """The columns of a table that could tell its moments, by index; None where there is none."""

    frame: int | None
    time: int | None
    id: int | None
    seconds: float | None  # of one step of the time; None: not stated

    @property
    def can_split(self) -> bool:
        """Whether there is a column of frames or times."""
        return self.frame is not None or self.time is not None


def moment_columns(names: Sequence[str]) -> MomentColumns:
    """The columns of frames, times and ids, by their names."""
    plain = [plain_name(name) for name in names]

    def first(known: set[str]) -> int | None:
        return next((at for at, one in enumerate(plain) if one.name in known), None)

    time = first(_TIMES)
    unit = None if time is None else plain[time].unit
    return MomentColumns(first(_FRAMES), time, first(_IDS), _SECONDS.get(unit or ""))


def moments_of(
    frame: NDArray[np.float64] | None,
    time: NDArray[np.float64] | None,
    id: NDArray[np.float64] | None,
    seconds: float | None = None,
) -> Moments | None:
    """The moments of a table by its columns of frames or times, each (N,); None where it is one moment.

    Frames are whole numbers, and there are more points than frames. Laser scanners store a time for each
    point: so times count only where each moment has as many points, or has each id once.
    seconds: of one step of the time, where its name states the unit.
    """
    key = frame if frame is not None else time
    if key is None or len(key) < 4 or not np.isfinite(key).all():
        return None
    if frame is not None and (frame != np.rint(frame)).any():
        return None
    numbers, moment = np.unique(key, return_inverse=True)
    counts = np.bincount(moment)
    if len(numbers) < 2 or len(key) < 2 * len(numbers):
        return None
    ids = _usable_ids(id, moment)
    if frame is None and ids is None and (counts != counts[0]).any():
        return None
    order = np.lexsort((np.arange(len(key)) if ids is None else ids, moment))
    starts = np.concatenate([[0], np.cumsum(counts)])
    stated = _seconds(time, order[starts[:-1]], seconds)
    return Moments(
        order.astype(np.int64),
        starts.astype(np.int64),
        stated,
        numbers,
        None if ids is None else ids[order],
        f"The table has {len(key)} rows with {len(numbers)} different "
        f"{'times' if frame is None else 'frames'}.",
    )


def _usable_ids(id: NDArray[np.float64] | None, moment: NDArray[np.integer]) -> NDArray[np.uint32] | None:
    """The ids of points where they are whole numbers and each stands once in a moment."""
    if id is None or not np.isfinite(id).all():
        return None
    if (id != np.rint(id)).any() or (id < 0).any() or (id >= 2**32 - 1).any():
        return None
    pairs = np.unique(np.stack([moment, id], axis=1), axis=0)
    return id.astype(np.uint32) if len(pairs) == len(id) else None


def _seconds(
    time: NDArray[np.float64] | None, first: NDArray[np.int64], seconds: float | None
) -> NDArray[np.float64] | None:
    """The times of moments, (T,) seconds, from the first row of each; None where they do not increase."""
    if time is None:
        return None
    times = time[first]
    steps = np.diff(times)
    if not np.isfinite(times).all() or (steps <= 0).any():
        return None
    if seconds is None:
        units = (1.0, 1e-3, 1e-6, 1e-9)
        seconds = next((unit for unit in units if np.median(steps) * unit <= 10), 1.0)
    return np.asarray(times * seconds)
