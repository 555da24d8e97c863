"""MTL: the materials of OBJ files, as far as their colours go: `newmtl`, `Kd` and `map_Kd`."""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path, PureWindowsPath
from unicodedata import normalize

from ...errors import InputError
from ..admission import opened
from ..contents import Material
from ._columns import bounded_lines

_NUMBERS_OF = {"-s": 3, "-o": 3, "-t": 3, "-mm": 2}  # options of map_Kd -> numbers behind them, at most
_MOST_MATERIALS = 4096


def read_materials(path: Path) -> dict[str, Material]:
    """The materials of a file by name. Raises InputError."""
    found: dict[str, Material] = {}
    name = None
    with opened(path) as stream:
        for keyword, rest in _statements(bounded_lines(stream)):
            if keyword == "newmtl":
                if len(found) >= _MOST_MATERIALS:
                    raise InputError(f"has more than {_MOST_MATERIALS:,} materials", path)
                name = rest
                found[name] = Material()
            elif name is not None and keyword == "kd":
                found[name] = replace(found[name], color=_color(rest.split()))
            elif name is not None and keyword == "map_kd":
                found[name] = _with_picture(found[name], rest, path.parent)
    return found


def _with_picture(material: Material, rest: str, folder: Path) -> Material:
    """The material with the picture that `map_Kd` states: options, then a name that may contain blanks."""
    options: dict[str, list[str]] = {}
    while rest.startswith("-") and len(words := rest.split(maxsplit=1)) == 2:
        option, rest = words
        most = _NUMBERS_OF.get(option.lower(), 1)
        values = options[option.lower()] = []
        while len(values) < most and len(words := rest.split(maxsplit=1)) == 2:
            if most > 1 and not _is_number(words[0]):
                break
            values.append(words[0])
            rest = words[1]
    if not (name := rest.strip("\"' ")) or name in (".", ".."):
        return material
    return replace(
        material,
        image=file_beside(folder, name),
        scale=_pair(options.get("-s", []), 1.0),
        offset=_pair(options.get("-o", []), 0.0),
        is_clamped="on" in map(str.lower, options.get("-clamp", [])),
    )


def _pair(words: Sequence[str], usual: float) -> tuple[float, float]:
    numbers = [float(word) for word in words[:2]]
    u, v = [*numbers, *[usual] * 2][:2]
    return (u, v) if isfinite(u) and isfinite(v) else (usual, usual)


def file_beside(folder: Path, name: str) -> Path:
    """The file that a name in a mesh means: from its folder, else of that name in it, in any case.

    Absolute names of other machines, and those that lead out of the folder, count by their last part.
    Names that are no UTF-8 are Latin-1.
    """
    name = name.encode("utf-8", "surrogateescape").decode("latin-1") if _is_escaped(name) else name
    parts = PureWindowsPath(name.replace("/", "\\").replace("\0", ""))  # damaged files hold zeros
    names = [part for part in parts.parts if part != "."]
    if not parts.is_absolute() and not parts.drive and ".." not in names:
        inside = folder
        for each in names:
            inside = _in_any_case(inside, each)
        if inside.exists():
            return inside
    return _in_any_case(folder, parts.name)


def _in_any_case(folder: Path, name: str) -> Path:
    """The file of this name in a folder; else of one with other capitals, or accents stored otherwise."""
    exact = folder / name
    if exact.exists() or not folder.is_dir():
        return exact
    wanted = _folded(name)
    return next((other for other in sorted(folder.iterdir()) if _folded(other.name) == wanted), exact)


def _folded(name: str) -> str:
    return normalize("NFC", name).casefold()


def _is_escaped(text: str) -> bool:
    return any("\udc80" <= letter <= "\udcff" for letter in text)


def _statements(lines: Iterator[bytes]) -> Iterator[tuple[str, str]]:
    """Keyword in lower case, and the rest of its line."""
    for line in lines:
        text = line.removeprefix(BOM_UTF8).decode("utf-8", "surrogateescape")
        keyword, _, rest = text.strip().replace("\t", " ").partition(" ")
        if keyword and not keyword.startswith("#"):
            yield keyword.lower(), rest.strip()


def _color(words: Sequence[str]) -> tuple[float, float, float] | None:
    try:
        red, green, blue = (min(max(float(word), 0.0), 1.0) for word in words[:3])
    except ValueError:
        return None
    return red, green, blue


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
