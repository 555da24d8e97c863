"""MTL: the materials of OBJ files, as far as their colours go: `newmtl`, `Kd` and `map_Kd`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PureWindowsPath

from ...errors import InputError
from ..admission import opened
from ._columns import text_lines

_NUMBERS_OF = {"-s": 3, "-o": 3, "-t": 3, "-mm": 2}  # options of map_Kd -> numbers behind them, at most
_MOST_MATERIALS = 4096
WHITE = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Material:
    """A material. color: diffuse, 0..1. image: of its colours, None where it has none."""

    color: tuple[float, float, float] = WHITE
    image: Path | None = None


def read_materials(path: Path) -> dict[str, Material]:
    """The materials of a file by name. Raises InputError."""
    found: dict[str, Material] = {}
    name = None
    with opened(path) as stream:
        for keyword, rest in _statements(text_lines(stream)):
            if keyword == "newmtl":
                if len(found) >= _MOST_MATERIALS:
                    raise InputError(f"has more than {_MOST_MATERIALS:,} materials", path)
                name = rest
                found[name] = Material()
            elif name is not None and keyword == "kd":
                found[name] = replace(found[name], color=_color(rest.split()))
            elif name is not None and keyword == "map_kd":
                found[name] = replace(found[name], image=picture_beside(path.parent, _file_name(rest)))
    return found


def picture_beside(folder: Path, name: str) -> Path:
    """The file that a name in a mesh means: from its folder, else of that name in it, in any case.

    Absolute names of other machines, and those that lead out of the folder, count by their last part.
    """
    parts = PureWindowsPath(name.replace("/", "\\"))
    if (
        not parts.is_absolute()
        and ".." not in parts.parts
        and (inside := folder.joinpath(*parts.parts)).exists()
    ):
        return inside
    beside = folder / parts.name
    if not beside.exists() and folder.is_dir():
        same = (other for other in folder.iterdir() if other.name.casefold() == parts.name.casefold())
        return next(same, beside)
    return beside


def _statements(lines: Iterator[str]) -> Iterator[tuple[str, str]]:
    """Keyword in lower case, and the rest of its line."""
    for line in lines:
        keyword, _, rest = line.strip().replace("\t", " ").partition(" ")
        if keyword and not keyword.startswith("#"):
            yield keyword.lower(), rest.strip()


def _color(words: Sequence[str]) -> tuple[float, float, float]:
    try:
        red, green, blue = (min(max(float(word), 0.0), 1.0) for word in words[:3])
    except ValueError:
        return WHITE
    return red, green, blue


def _file_name(rest: str) -> str:
    """The name behind the options of a map; it may contain blanks."""
    words = rest.split(" ")
    while words and words[0].startswith("-") and len(words) > 1:
        most = _NUMBERS_OF.get(words.pop(0).lower(), 1)
        while most and len(words) > 1 and (most == 1 or _is_number(words[0])):
            words.pop(0)
            most -= 1
            if most and not _is_number(words[0]):
                break
    return " ".join(words).strip("\"' ")


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
