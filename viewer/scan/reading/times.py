"""When each frame happens: a times.csv, a stated rate, times in the file, or the names of the files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, shortened
from ..times import DEFAULT_FPS
from .corrections import NOTHING_CORRECTED, Corrections
from .names import are_dates, frame_counts, small_stamps, stamped_seconds
from .record import Decision
from .times_table import read_times_csv

KEY = "times"
NAMES, INDEX, STORED = "names", "index", "stored"
_COLUMN = "column:"
_FPS = "fps:"


class Times(NamedTuple):
    """Seconds of all frames, (T,) float64, and where they come from. is_measured: whether a table states
    them."""

    seconds: NDArray[np.float64]
    decision: Decision
    is_measured: bool = False


def decide(
    labels: Sequence[str],
    folder: Path | None = None,
    *,
    count: int | None = None,
    table: Path | None = None,
    stored: NDArray[np.float64] | None = None,
    fps: float | None = None,
    corrections: Corrections = NOTHING_CORRECTED,
) -> Times:
    """The times of frames with these names, the first of: what the user states, the table, `fps`, the times
    stored in the file, real times in the names, and 25 frame numbers a second.

    count: of the frames, where they have no names of their own. folder: of files that the user names.
    table: a times.csv. stored: (T,) seconds. Raises InputError where the table or a correction is unusable.
    """
    stated = corrections.get(KEY)
    if stated is not None and not (stated.startswith(_COLUMN) and stored is not None):
        return _as_stated(labels, folder, stated, count)
    if stated is not None:
        return Times(_array(stored), Decision(KEY, stated, "user", "--read"))
    if table is not None:
        return _of_table(table, labels)
    if fps is not None:
        return Times(counted_times(labels, fps, count), Decision(KEY, f"{_FPS}{fps:g}", "user", "--fps"))
    if stored is not None:
        return Times(_array(stored), Decision(KEY, STORED, "file"))
    stamps = stamped_seconds(labels)
    if stamps is not None:
        return Times(_array(stamps), Decision(KEY, NAMES, "folder", why="The names of the files are times"))
    return _assumed(labels, count)


def _of_table(table: Path, labels: Sequence[str]) -> Times:
    found = read_times_csv(table, labels)
    decision = Decision(KEY, table.name, "neighbour", table.name, found.why)
    if found.doubt:
        decision = Decision(
            KEY, table.name, "assumed", table.name, found.doubt, (INDEX, f"{_FPS}30"), changes_numbers=True
        )
    return Times(found.seconds, decision, is_measured=True)


def _assumed(labels: Sequence[str], count: int | None) -> Times:
    """25 frame numbers a second, or frames."""
    seconds = counted_times(labels, count=count)
    if len(seconds) < 2:
        return Times(seconds, Decision(KEY, None, "file"))
    counted = "frame numbers" if frame_counts(labels) else "frames"
    why = f"No file states the times of the frames. Scan4D assumes {DEFAULT_FPS:g} {counted} per second"
    if are_dates(labels):
        why = f"The file names are dates without times. Scan4D assumes {DEFAULT_FPS:g} frames per second"
    others = (NAMES,) if times_in_names(labels) is not None else ()
    others = (*others, INDEX) if counted == "frame numbers" else others
    alternatives = (*others, f"{_FPS}30", f"{_FPS}50")
    return Times(
        seconds,
        Decision(
            KEY, f"{_FPS}{DEFAULT_FPS:g}", "assumed", why=why, alternatives=alternatives, changes_numbers=True
        ),
    )


def _as_stated(labels: Sequence[str], folder: Path | None, stated: str, count: int | None) -> Times:
    decision = Decision(KEY, stated, "user", "--read")
    if stated == NAMES:
        seconds = times_in_names(labels)
        if seconds is None:
            hint = "Use fps:25, index, or the name of a file with times"
            raise InputError(
                "the file names do not contain times that increase from frame to frame", hint=hint
            )
        return Times(seconds, decision)
    if stated == INDEX:
        return Times(np.arange(len(labels) if count is None else count) / DEFAULT_FPS, decision)
    if stated.startswith(_FPS):
        return Times(counted_times(labels, float(stated.removeprefix(_FPS)), count), decision)
    if stated.startswith(_COLUMN):
        raise InputError(
            f"the scan has no column for '{shortened(stated)}'",
            hint="Use 'column:NAME' only for a table with all frames",
        )
    path = Path(stated) if folder is None or Path(stated).is_absolute() else folder / stated
    return Times(read_times_csv(path, labels).seconds, decision, is_measured=True)


def counted_times(
    labels: Sequence[str], fps: float = DEFAULT_FPS, count: int | None = None
) -> NDArray[np.float64]:
    """(T,) seconds from the first frame on, at `fps` frame numbers a second.

    A number missing from the labels leaves a gap; labels without frame numbers count 0, 1, 2... count: of the
    frames, where they have no names of their own.
    """
    if count is not None and len(labels) != count:
        return np.arange(count) / fps
    numbers = frame_counts(labels) or range(len(labels))
    return np.array([number - numbers[0] for number in numbers], np.float64) / fps


def times_in_names(labels: Sequence[str]) -> NDArray[np.float64] | None:
    """(T,) seconds from the first frame on where names are real times, or differ in one number of milli-,
    micro- or nanoseconds, whichever makes steps of a film. None where there is no such number."""
    found = stamped_seconds(labels)
    found = small_stamps(labels) if found is None else found
    return None if found is None else _array(found)


def _array(seconds: object) -> NDArray[np.float64]:
    return np.asarray(seconds, np.float64)
