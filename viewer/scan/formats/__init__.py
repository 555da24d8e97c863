"""The file formats of scans: one module a format, found by scanning this folder.

A format module declares

- `TITLE: str`, as messages name it, and `SUFFIXES: tuple[str, ...]`, lower case with the dot;
- `contents(path, frame) -> PointContents`: what the file says, of which `reading/cloud.py` makes points;
- or `read(path, frame=0) -> PointCloud`, or a tuple of RangeViews;
- where a file can hold more than one moment: `frame_count(path) -> int`, from the header alone, and
  `read_times(path)` (seconds, (T,) float64, or None);
- where it holds faces: `read_faces(path, frame=0) -> Iterator[Faces]`, in pieces, none where there are none;
- where it has no `contents`: `read_colors(path, frame) -> NDArray`, colours as stored, or None;
- where columns of frames or times may tell moments: `column_names(path) -> Sequence[str]`, from the header;
- where frames refer to others: `Frames(path)`, whose `read(frame)` remembers what the next one needs;
- where it states the unit of length: `read_unit(path) -> str`, from the header alone;
- where it can be written: `write(path, cloud)`, which may return a remark for the user, or
  `write_views(path, views)`, or, all poses in one file,
  `write_poses(path, poses, unit, **options)` and `check(path)`, which says whether it can be read again.

Each function that reads may have a parameter `decided`: the decisions about the scan, with the user's
corrections (`reading/sequence.py`).

A module may raise any exception: the functions below turn it into one InputError that names the file.
Modules whose name starts with an underscore are helpers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import EmptyFrame, InputError, Scan4DError, explained, shortened, unknown_name
from ...extensions import load_modules, names_in, package_of
from ...files import whole_file
from ..admission import admit
from ..contents import PointContents
from ..faces import Faces
from ..points import PointCloud
from ..pose import Pose, Scanned
from ..range_view import RangeView, in_one_unit, merge
from ..reading.axes import note_turned
from ..reading.cloud import assemble, stored_colors
from ..reading.hints import hint_for, hinted_suffix
from ..reading.orientation import note_orientation
from ..reading.record import Decision
from ..reading.sequence import Decided, ask
from ..reading.textures import PictureReaders, paint
from ..times import frame_in_words
from ._moments import MomentsOfCloud, may_hold_moments, moments_of_cloud
from ._pictures import picture_file, texture_colors

NOTES = {".txt", ".csv", ".tif", ".tiff"}  # beside frames of another kind these are notes, not frames
_MOMENTS = "moments"  # of a path, as the decisions share them
_LONGEST_MESSAGE = 400  # characters


def known_suffixes() -> list[str]:
    """Every suffix that can be read, sorted."""
    return sorted(_formats())


def is_known(suffix: str) -> bool:
    """Whether files of a suffix, in lower case, can be read."""
    return _format(suffix) is not None


def writable_suffixes(views: bool = False) -> list[str]:
    """Every suffix that can be written, sorted. views: those that take range views too."""
    writers = ["write", "write_views"] if views else ["write"]
    return sorted(
        suffix for suffix, module in _formats().items() if any(hasattr(module, name) for name in writers)
    )


def scan_suffixes() -> list[str]:
    """Every suffix of which one file can be written for all poses of a scan, sorted."""
    return sorted(suffix for suffix, module in _formats().items() if hasattr(module, "write_poses"))


def format_of(suffix: str) -> ModuleType:
    """The module that reads files of a suffix. Raises InputError where none does."""
    if (module := _format(suffix)) is None:
        raise unknown_name("file suffix", suffix, _formats())
    return module


def package_reading(path: Path) -> str:
    """Name and version of the package that reads a file of this suffix; "" for Scan4D itself."""
    module = _format(path.suffix.lower())
    return package_of(module.__name__) if module else ""


def frame_count(path: Path | str, decided: Decided | None = None) -> int:
    """How many moments the file holds; reads no more than its header. Raises InputError."""
    path = Path(path)
    module = _readable(path)
    with one_message(path, f"cannot be read as {module.TITLE}"):
        decided = decided or Decided()
        count = ask(module.frame_count, path, decided=decided) if hasattr(module, "frame_count") else 1
        moments = _moments(module, path, decided) if count == 1 else None
        return count if moments is None else len(moments)


def read_times(path: Path | str, decided: Decided | None = None) -> NDArray[np.float64] | None:
    """The times stored with the moments of the file, (T,) seconds, or None. Raises InputError."""
    path = Path(path)
    module = _readable(path)
    with one_message(path, f"cannot be read as {module.TITLE}"):
        decided = decided or Decided()
        stated = ask(module.read_times, path, decided=decided) if hasattr(module, "read_times") else None
        moments = _moments(module, path, decided) if stated is None else None
        return stated if moments is None else moments.times


def read_unit(path: Path | str, decided: Decided | None = None) -> str | None:
    """The name of the unit of length that the file states, which may be any text (see `usable_unit`); None
    if it states none. Raises InputError.
    """
    path = Path(path)
    module = _readable(path)
    with one_message(path, f"cannot be read as {module.TITLE}"):
        if not hasattr(module, "read_unit"):
            return None
        return ask(module.read_unit, path, decided=decided or Decided())


def read(path: Path | str, frame: int = 0, decided: Decided | None = None) -> Scanned:
    """One moment of a file as it is stored: points, at least one, or range views.

    decided: the decisions about the scan that it belongs to; None: the file stands alone.

    Raises InputError where the path is not a readable file of a known format, where the file is
    empty or damaged or has no such frame, and where no point of it has finite coordinates.
    """
    path = Path(path)
    module = _readable(path)
    decided = decided or Decided()
    frames = frame_count(path, decided)
    if not 0 <= frame < frames:
        raise InputError(
            f"has no pose {frame}", path, f"The file contains {frames} poses, and Scan4D counts them from 0"
        )
    where = path if frames == 1 else f"{path}, {frame_in_words(frame)}"
    with one_message(where, f"cannot be read as {module.TITLE}"):
        return _scanned(module, path, frame, decided)


def read_colors(path: Path | str, frame: int, decided: Decided) -> NDArray | None:
    """The colours of one moment of points as stored, (N, C), of any type; None where the format or the file
    has none. Raises InputError."""
    path = Path(path)
    module = _readable(path)
    with one_message(path, f"cannot be read as {module.TITLE}"):
        if hasattr(module, "read_colors"):
            return ask(module.read_colors, path, frame, decided=decided)
        found = ask(module.contents, path, frame, decided=decided) if hasattr(module, "contents") else None
        return stored_colors(found) if isinstance(found, PointContents) else None


def _scanned(module: ModuleType, path: Path, frame: int, decided: Decided) -> Scanned:
    """Read one moment by a module, with the decisions that every format shares."""
    may_split = hasattr(module, "column_names")
    if may_split and hasattr(module, "frame_count"):
        may_split = ask(module.frame_count, path, decided=decided) == 1
    moments = _moments(module, path, decided) if may_split else None
    return _whole(module, path, frame, decided) if moments is None else moments.at(frame)


def _whole(module: ModuleType, path: Path, frame: int, decided: Decided) -> Scanned:
    """Read one moment as a module has it."""
    hook = module.contents if hasattr(module, "contents") else module.read
    return _finished(module, path, ask(hook, path, frame, decided=decided), decided)


def _moments(module: ModuleType, path: Path, decided: Decided) -> MomentsOfCloud | None:
    """The moments that columns of a file of one moment tell; None where they tell none or cannot be read."""
    if not hasattr(module, "column_names"):
        return None

    def find() -> MomentsOfCloud | None:
        try:
            names = ask(module.column_names, path, decided=decided)
        except InputError:  # reading the points says why
            return None
        if not may_hold_moments(names, decided):
            return None
        cloud = _whole(module, path, 0, decided)
        return moments_of_cloud(cloud, decided) if isinstance(cloud, PointCloud) else None

    return decided.shared(_MOMENTS, path, find)


def _finished(module: ModuleType, path: Path, found: PointContents | Scanned, decided: Decided) -> Scanned:
    """The points or views that a module's answer comes to."""
    if isinstance(found, PointContents):
        paint(found, decided, PictureReaders(picture_file, texture_colors))
        scanned: Scanned = assemble(found, decided)
    else:
        scanned = found
    if isinstance(scanned, PointCloud):
        scanned = note_orientation(note_turned(scanned, decided), decided)
    decided.note(Decision("format", module.TITLE, "file", path.suffix.lower()))
    return _with_points(scanned)


def read_faces(path: Path | str, frame: int = 0, decided: Decided | None = None) -> Faces:
    """The faces between the points of one moment of a file, perhaps none.

    Raises InputError as `read` does, and where the faces are damaged.
    """
    path = Path(path)
    module = _readable(path)
    if not hasattr(module, "read_faces"):
        return Faces.joined([])
    with one_message(path, f"the faces cannot be read as {module.TITLE}"):
        held, taken, pieces = path.stat().st_size, 0, []
        for piece in ask(module.read_faces, path, frame, decided=decided or Decided()):
            taken += piece.nbytes
            admit(held, 2 * taken)  # in pieces, and joined
            pieces.append(piece)
        return Faces.joined(pieces)


def frames(path: Path | str, decided: Decided | None = None) -> Callable[[int], Scanned]:
    """A function that reads frames of one file as `read` does, several in less time. Raises InputError."""
    path = Path(path)
    module = _readable(path)
    shared = decided or Decided()
    if not hasattr(module, "Frames"):
        return lambda frame: read(path, frame, shared.at(frame))
    failed = f"cannot be read as {module.TITLE}"
    with one_message(path, failed):
        opened = ask(module.Frames, path, decided=shared)

    def read_frame(frame: int) -> Scanned:
        with one_message(f"{path}, {frame_in_words(frame)}", failed):
            return _finished(module, path, opened.read(frame), shared.at(frame))

    return read_frame


def coarser(path: Path | str) -> Callable[[int], Iterator[PointCloud]]:
    """A function that gives coarser clouds of a frame while it is being read; none of most formats."""
    module = _readable(Path(path))
    return partial(module.coarser, Path(path)) if hasattr(module, "coarser") else lambda frame: iter(())


def _with_points(scanned: Scanned) -> Scanned:
    if isinstance(scanned, PointCloud) and not len(scanned):
        what = f"none of the {scanned.dropped} points has finite coordinates"
        raise EmptyFrame(what if scanned.dropped else "holds no points")
    return scanned


def read_points(path: Path | str, frame: int = 0) -> PointCloud:
    """The points of one moment of a file; those of range views merged, in the unit of the first of them.

    Raises InputError as `read`.
    """
    scanned = read(path, frame)
    if isinstance(scanned, PointCloud):
        return scanned
    with one_message(path, "cannot be turned into points"):
        return merge(in_one_unit(scanned, scanned[0].unit))


def write(path: Path | str, cloud: PointCloud, views: Sequence[RangeView] = ()) -> str | None:
    """Write the points in the format that the suffix names, in one step.

    views: the range views behind the points, which a format of range views takes in their stead.
    The file takes its name only when it is complete; whatever goes wrong, a former file of that name
    stays as it was and nothing else remains. Returns a remark where other programs may not read it. Raises
    InputError for an unknown suffix, a failed write, and where a format of range views gets none.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in (known := writable_suffixes(views=True)):
        raise InputError(f"cannot write '{suffix}' files", path, f"Known: {', '.join(known)}")
    module = _formats()[suffix]
    if not (views or hasattr(module, "write")):
        hint = f"Points can be written as {', '.join(writable_suffixes())}"
        raise InputError(f"{module.TITLE} stores range views, but this scan has none", path, hint)
    with _writing(path, module) as temporary:
        if hasattr(module, "write"):
            remark: str | None = module.write(temporary, cloud)
            return remark
        module.write_views(temporary, views)
        return None


def write_poses(path: Path | str, poses: Iterable[Pose], unit: str, **options: Any) -> None:
    """Write all poses into one file of a format of `scan_suffixes`, in one step. options: the format's own.

    Raises InputError as `write` does, and what reading the poses raises.
    """
    path = Path(path)
    module = _formats()[path.suffix.lower()]
    with _writing(path, module) as temporary:
        module.write_poses(temporary, poses, unit, **options)


def check(path: Path | str) -> None:
    """Raise InputError where a file of `write_poses` takes more memory to be read than readers may take."""
    path = Path(path)
    module = _readable(path)
    with one_message(path, f"cannot be read as {module.TITLE}"):
        module.check(path)


@contextmanager
def _writing(path: Path, module: ModuleType) -> Iterator[Path]:
    """A temporary path that becomes `path` only if the block ends well; what goes wrong is one message."""
    if not path.parent.is_dir():
        raise InputError(f"there is no folder '{path.parent}'", path, "Create it first")
    failed = f"cannot be written as {module.TITLE}"
    with one_message(path, failed, "Choose another format"), whole_file(path) as temporary:
        yield temporary


@cache
def _format(suffix: str) -> ModuleType | None:
    """The module that reads files of a suffix, or None.

    Scan4D asks its own module of that name first, so that it need not import the others.
    """
    if not suffix:
        return None
    name = suffix.removeprefix(".")
    if name in _own_names():
        module = import_module(f"{__name__}.{name}")
        if suffix in module.SUFFIXES:
            return module
    return _formats().get(suffix)


@cache
def _own_names() -> list[str]:
    return names_in(__path__)


@cache
def _formats() -> dict[str, ModuleType]:
    found: dict[str, ModuleType] = {}

    def add(_: str, module: ModuleType) -> None:
        if not hasattr(module, "SUFFIXES"):
            if not hasattr(module, "find"):
                raise InputError(
                    "the module defines neither SUFFIXES nor find", hint="See viewer/scan/formats/__init__.py"
                )
            return  # for folders: see viewer/scan/range_folders
        if not isinstance(module.SUFFIXES, tuple):
            raise InputError(f"SUFFIXES is a {type(module.SUFFIXES).__name__}, expected a tuple of suffixes")
        reads = "contents" if hasattr(module, "contents") else "read"
        if missing := [name for name in ("TITLE", reads) if not hasattr(module, name)]:
            raise InputError(
                f"the module defines SUFFIXES, but no {' and no '.join(missing)}", hint="Add what is missing"
            )
        for suffix in module.SUFFIXES:
            if not (isinstance(suffix, str) and suffix.startswith(".") and suffix == suffix.lower()):
                hint = f"Write '.{suffix.lower().removeprefix('.')}'" if isinstance(suffix, str) else None
                raise InputError(
                    f"the suffix {suffix!r} must begin with a dot and be in lower case", hint=hint
                )
        if taken := [suffix for suffix in module.SUFFIXES if suffix in found]:
            raise InputError(f"{found[taken[0]].TITLE} already reads '{taken[0]}'", hint="Use other suffixes")
        found.update(dict.fromkeys(module.SUFFIXES, module))

    load_modules("readers", __name__, __path__, add)
    return found


def _readable(path: Path) -> ModuleType:
    """The format of a file that exists and is not empty."""
    try:
        status = path.stat()
    except OSError as error:
        what, hint = explained(error)
        raise InputError(what, path, hint) from error
    if path.is_dir():
        raise InputError("is a folder, not a file", path, "Name a file in it")
    if not path.is_file():
        raise InputError(
            "is a device or a pipe, not a file", path, "Copy the data of the device or pipe into a file"
        )
    suffix = path.suffix.lower()
    if (module := _format(suffix)) is None:
        # a suffix that is close is another format
        hint = hint_for(hinted_suffix(path.name), known_suffixes())
        raise InputError(f"unknown file suffix '{shortened(suffix)}'", path, hint)
    if status.st_size == 0:
        raise InputError("is empty (0 bytes)", path, "Copy or export the file again")
    return module


@contextmanager
def one_message(
    where: object, failed: str, hint: str = "Check that the file is complete, or export it again"
) -> Iterator[None]:
    """Turn whatever goes wrong inside into an InputError that says where.

    Odd numbers in a file (NaN, overflow in a conversion) are data, so numpy does not complain of them.
    """
    try:
        with np.errstate(all="ignore"):
            yield
    except Scan4DError as error:
        kind = EmptyFrame if isinstance(error, EmptyFrame) else InputError
        raise kind(_bounded(error.what), error.where or where, error.hint or hint) from error
    except MemoryError as error:
        raise InputError(f"{failed}: not enough memory", where, "Close other programs") from error
    except OSError as refused:
        what, advice = explained(refused, hint)
        raise InputError(f"{failed}: {what}", where, advice) from refused
    except Exception as error:
        raise InputError(_bounded(f"{failed}: {str(error) or type(error).__name__}"), where, hint) from error


def _bounded(what: str) -> str:
    """A message that may quote a file, at a length that can be read."""
    return what if len(what) <= _LONGEST_MESSAGE else what[:_LONGEST_MESSAGE] + " ..."
