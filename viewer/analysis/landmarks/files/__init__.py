"""The file formats of landmarks: one module a format, found by scanning this folder.

A format module declares

- `TITLE: str`, as messages name it, and `SUFFIXES: tuple[str, ...]`, lower case with the dots;
- `read(path) -> LandmarkSet`, in the coordinates and the unit of the file, which it tells;
- where it can be written: `write(path, landmarks) -> str | None`, which may return a remark for the user;
- `AXES`, "LPS" or "RAS", where the coordinates of written files have to be such;
- `ONE_MOMENT = True` where a file holds one moment: a series of them is a file a frame, in whose name `%04d`
  stands for the number of the frame, from 1;
- where files of its suffixes may be something else: `owns(head: str) -> bool`, of the first characters.

A module may raise any exception: the functions below turn it into one InputError that names the file.
Modules whose name starts with an underscore are helpers.

Coordinates of a scan are taken for LPS, unless a caller says otherwise: 3D Slicer takes meshes and clouds
for LPS too where they do not tell, so that landmarks which were placed there lie here on the same places.
Formats that tell no axes are in those of the scan.
"""

from __future__ import annotations

import pkgutil
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np

from ....errors import InputError, explained, shortened
from ....files import open_plain, whole_file
from ....scan.formats import one_message
from ....scan.reading.numbers import decoded
from ....task import checkpoint
from ...track import Known
from ..landmark_set import LandmarkSet, check_cells

AXES = ("LPS", "RAS")
_HEAD = 4096  # bytes that tell a format
_FARTHEST = 1e15  # of a coordinate, and of its standard deviation, scan units
_NUMBER = re.compile(r"%(0\d)?d")  # in the name of a series


def landmark_suffixes(written: bool = False) -> list[str]:
    """Every suffix of landmarks that can be read, or written, sorted."""
    modules = _modules()
    return sorted(suffix for suffix, module in modules if not written or hasattr(module, "write"))


def is_landmark_file(path: Path | str) -> bool:
    """Whether a file holds landmarks: by its suffix and, where scans may have that one, by its start."""
    path = Path(path)
    module = _module_of(path)
    if module is None:
        return False
    try:
        with open_plain(path) as stream:
            head = decoded(stream.read(_HEAD))
    except OSError:
        return False
    return not hasattr(module, "owns") or module.owns(head)


def holds_one_moment(path: Path | str) -> bool:
    """Whether what is written under a name is one moment: by its format, unless the name is of a series."""
    path = Path(path)
    return getattr(_module_of(path), "ONE_MOMENT", False) and _NUMBER.search(path.name) is None


def read_landmarks(path: Path | str, unit: str | None = None, axes: str = "LPS") -> LandmarkSet:
    """The landmarks of a file, or of a series of files of one moment each ("smile_%04d.mrk.json").

    unit: of the scan, to which lengths are converted; None keeps those of the file. axes: of the scan, of
    `AXES`; what a file has in the others is turned. `remarks` of the set says what was left out, changed or
    taken for granted. Raises InputError, with the line where there is one, for what cannot be read, and where
    no landmark is in it.
    """
    path = Path(path)
    if _NUMBER.search(path.name):
        return _joined([_read(file, unit, axes, frame) for frame, file in _files_of(path)], path)
    return _read(path, unit, axes, None)


def write_landmarks(path: Path | str, landmarks: LandmarkSet, axes: str = "LPS") -> str | None:
    """Write landmarks in the format that the suffix names, each file in one step.

    A format that holds one moment takes several as a series, a file a frame, whose name has `%04d` in it.
    axes: of the scan. Returns a remark on what the format cannot hold, None where all is kept. Raises
    InputError for a suffix that is not known or written, and where it cannot be written.
    """
    path = Path(path)
    module = _module_of(path)
    if module is None or not hasattr(module, "write"):
        known = ", ".join(landmark_suffixes(written=True))
        raise InputError(
            f"Scan4D cannot write landmarks to a '{_suffix_of(path)}' file", path, f"Known: {known}"
        )
    if not path.parent.is_dir():
        raise InputError(f"there is no folder '{path.parent}'", path, "Create it first")
    if getattr(module, "AXES", axes) != axes:
        landmarks = landmarks.turned()
    if not _NUMBER.search(path.name):
        if len(landmarks) > 1 and getattr(module, "ONE_MOMENT", False):
            hint = f"Write one file per frame, such as '{_series_name(path)}', or use .c3d or .csv"
            raise InputError(
                f"{module.TITLE} files contain a single frame, but the landmarks have {len(landmarks)} "
                "frames",
                path,
                hint,
            )
        return _write(module, path, landmarks)
    remark = None
    for row, frame in enumerate(landmarks.frames):
        checkpoint(row / len(landmarks))
        remark = _write(module, _file_of(path, int(frame)), landmarks.at(row))
    return remark


def _write(module: ModuleType, path: Path, landmarks: LandmarkSet) -> str | None:
    failed = f"cannot be written as {module.TITLE}", "Choose another format"
    with one_message(path, *failed), whole_file(path) as temporary:
        remark: str | None = module.write(temporary, landmarks)
        return remark


def _read(path: Path, unit: str | None, axes: str, frame: int | None) -> LandmarkSet:
    """The landmarks of one file. frame: that its name tells, from 0."""
    module = _readable_module(path)
    with _one_message_of(path, module):
        found: LandmarkSet = module.read(path)
        if frame is not None and len(found) > 1:
            raise InputError(
                f"contains {len(found)} frames, but each file of a series must contain one frame"
            )
    if found.axes not in (None, axes):
        found = found.turned()
    found = found.in_unit(unit)
    if (np.abs(found.positions) > _FARTHEST).any():
        raise InputError(f"has coordinates larger than {_FARTHEST:g}", path, "Check the unit of the file")
    if (np.abs(found.sigmas) > _FARTHEST).any():
        raise InputError(
            f"has standard deviations larger than {_FARTHEST:g}", path, "Check the unit of the file"
        )
    return found if frame is None else replace(found, frames=np.array([frame]), is_framed=True)


@contextmanager
def _one_message_of(path: Path, module: ModuleType) -> Iterator[None]:
    """One message for whatever goes wrong; a line that it tells stands behind the name of the file."""
    with one_message(path, f"cannot be read as {module.TITLE}"):
        try:
            yield
        except InputError as error:
            raise InputError(
                error.what, ", ".join(map(str, filter(None, (path, error.where)))), error.hint
            ) from None


def _joined(parts: list[LandmarkSet], path: Path) -> LandmarkSet:
    """The sets of single frames as one; a landmark is a gap where a file has it not."""
    names = list(dict.fromkeys(name for part in parts for name in part.names))
    check_cells(len(parts), len(names))
    about = {
        name: text for part in reversed(parts) for name, text in zip(part.names, part.about, strict=True)
    }
    shape = len(parts), len(names)
    positions, sigmas = np.full((*shape, 3), np.nan), np.full(shape, np.nan)
    known = np.full(shape, Known.GAP, np.uint8)
    column = {name: number for number, name in enumerate(names)}
    units = {part.unit for part in parts}
    if len(units) > 1:
        raise InputError(f"the files of the series have different units: {', '.join(map(str, units))}", path)
    for row, part in enumerate(parts):
        columns = [column[name] for name in part.names]
        positions[row, columns], known[row, columns] = part.positions[0], part.known[0]
        sigmas[row, columns] = part.sigmas[0]
    return LandmarkSet(
        tuple(names),
        positions,
        known,
        sigmas,
        np.array([part.times[0] for part in parts]),
        np.array([part.frames[0] for part in parts]),
        True,
        parts[0].unit,
        tuple(about[name] for name in names),
        parts[0].axes,
        tuple(dict.fromkeys(text for part in parts for text in part.remarks)),
    )


# --- names of files -----------------------------------------------------------------------------


def _file_of(path: Path, frame: int) -> Path:
    """The file of a series that holds a frame, which counts from 0."""
    match = _NUMBER.search(path.name)
    assert match is not None
    return path.with_name(path.name[: match.start()] + match.group() % (frame + 1) + path.name[match.end() :])


def _series_name(path: Path) -> str:
    """Name of a series, for one that was to be a single file."""
    suffix = _suffix_of(path)
    return f"{path.name[: len(path.name) - len(suffix)]}_%04d{suffix}"


def _files_of(path: Path) -> list[tuple[int, Path]]:
    """The files of a series in their order, each after the index of its frame. Raises InputError for none."""
    match = _NUMBER.search(path.name)
    assert match is not None
    head, tail = re.escape(path.name[: match.start()]), re.escape(path.name[match.end() :])
    try:
        names = [each.name for each in path.parent.iterdir()]
    except OSError as error:
        what, hint = explained(error)
        raise InputError(what, path.parent, hint) from error
    found = ((re.fullmatch(f"{head}([0-9]{{1,9}}){tail}", name), name) for name in names)
    files = {int(number[1]): path.with_name(name) for number, name in found if number and int(number[1])}
    if not files:
        raise InputError("no file matches this name", path, "Number the files of a series from 1")
    return [(number - 1, files[number]) for number in sorted(files)]


@cache
def _modules() -> tuple[tuple[str, ModuleType], ...]:
    """Each suffix with its format, the longest suffixes first."""
    names = [m.name for m in pkgutil.iter_modules(__path__) if not m.name.startswith("_")]
    modules = [import_module(f"{__name__}.{name}") for name in names]
    pairs = [(suffix, module) for module in modules for suffix in module.SUFFIXES]
    return tuple(sorted(pairs, key=lambda pair: -len(pair[0])))


def _module_of(path: Path) -> ModuleType | None:
    name = path.name.lower()
    return next((module for suffix, module in _modules() if name.endswith(suffix)), None)


def _suffix_of(path: Path) -> str:
    """The suffix of a format, or else the last one."""
    name = path.name.lower()
    return next((suffix for suffix, _ in _modules() if name.endswith(suffix)), path.suffix)


def _readable_module(path: Path) -> ModuleType:
    """The format of a plain file that exists and is not empty."""
    try:
        with open_plain(path) as stream:
            is_empty = not stream.read(1)
    except OSError as error:
        what, hint = explained(error)
        raise InputError(what, path, hint) from error
    module = _module_of(path)
    if module is None:
        known = ", ".join(landmark_suffixes())
        raise InputError(
            f"Scan4D does not read landmarks from '{shortened(path.suffix)}' files", path, f"Known: {known}"
        )
    if is_empty:
        raise InputError("is empty (0 bytes)", path, "Copy or export the file again")
    return module
