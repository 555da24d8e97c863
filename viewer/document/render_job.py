"""Pictures and films made by `scan4d render --replay` in a process of its own.

Whoever starts it goes on meanwhile, sees how far it has come, and can cancel it: then nothing is left.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from ..errors import InputError, Scan4DError, explained
from ..files import printable
from ..folders import new_file, new_folder
from ..helper import start_python
from ..output.export import numbered
from ..task import Task
from ..unfinished import temporary_folder
from .recording import Recording, remote_location

_SAID = "scan4d: "  # before each line of warnings and errors
_PROGRAM = __name__.partition(".")[0]  # which a process of its own runs, as `python -m` does
_NICE = 5  # what waits for a person goes first


@dataclass(frozen=True)
class Made:
    """Result of a job. files: in order of their names. device: that drew. warnings: what was left out."""

    files: tuple[Path, ...]
    device: str
    warnings: tuple[str, ...]


def make(
    task: Task,
    recording: Recording,
    out: Path,
    fps: float | None,
    anonymous: bool,
    numbers: Sequence[int] | None = None,
    replaced: Collection[Path] = (),
) -> Made:
    """Make the pictures or the film of a recording; this waits for it.

    out: as `scan4d render -o` has it. fps: of an even film; None: the film shows each entry from its stamp
    until the next one's. anonymous: without the names and paths of scans.
    numbers: that the entries' files bear, each its own; from 0 where they are not given. replaced: files
    that may be. Files take their names when all are complete; where others have these by then, they are
    all called differently. Raises Cancelled, InputError where they cannot be written, Scan4DError with what
    the process said.
    """
    with _folder_beside(out) as folder:
        reported_once, made = folder / "recording.json", folder / "made"
        recording.save(reported_once)
        new_folder(made)
        arguments = ["render", "--replay", str(reported_once), "-o", str(made / out.name)]
        arguments += ["--progress", *(["--anonymous"] if anonymous else [])]
        arguments += [] if fps is None else ["--fps", f"{fps:.17g}"]
        scan = recording.entries[0].scan
        if scan is not None and remote_location(scan):  # which a recording may not ask for
            arguments += ["--", scan]
        device, code, text = _run(task, arguments, folder / "said", reported_once)
        for inner in (made, folder):  # as it says them, also where they are no UTF-8
            name = str(inner).encode(errors="backslashreplace").decode()
            text = text.replace(name, printable(str(out.parent)))
        lines = tuple(line.removeprefix(_SAID) for line in text.splitlines())
        if code:
            what = f"the process that draws the pictures ended with code {code}"
            raise Scan4DError(lines[-1] if code > 0 and lines else what)
        files = _moved(made, out, numbers or range(len(recording.entries)), replaced)
    return Made(files, device, lines)


def _moved(made: Path, out: Path, numbers: Sequence[int], replaced: Collection[Path]) -> tuple[Path, ...]:
    """Move the files out of the folder `made` and give them their names, in the order of their numbers."""
    drawn = {numbered(made / out.name, drawn_as): number for drawn_as, number in enumerate(numbers)}
    # A broken frame has no file, and all pictures of a film have one.
    numbers = [number for path, number in drawn.items() if path.exists()]
    names = (out if again == 1 else out.with_stem(f"{out.stem}_{again}") for again in count(1))
    free = next(name for name in names if not any(_is_taken(numbered(name, n), replaced) for n in numbers))
    files = []
    for path, number in drawn.items():
        if path.exists():
            files.append(numbered(free, number))
            os.replace(path, files[-1])
    return tuple(files)


def _is_taken(file: Path, replaced: Collection[Path]) -> bool:
    return os.path.lexists(file) and file not in replaced


@contextmanager
def _folder_beside(out: Path) -> Iterator[Path]:
    """A temporary folder on the disk that the files go to."""
    try:
        with temporary_folder(out.parent) as folder:
            yield folder
    except OSError as error:
        what, hint = explained(error)
        raise InputError(f"cannot be written: {what}", out, hint) from error


def _run(task: Task, arguments: list[str], said: Path, reported_once: Path) -> tuple[str, int, str]:
    """Run a command line of Scan4D and report its progress.

    said: a file for what it says on standard error. reported_once: what it reads at first, deleted then, as
    it names the scan. Returns the device that drew, the exit code, and what was said. Raises Cancelled.
    """
    program = f"from runpy import run_module; run_module({_PROGRAM!r}, run_name='__main__')"
    with (
        os.fdopen(new_file(said), "wb") as stream,
        start_python(program, *arguments, nice=_NICE, stdin=subprocess.DEVNULL, stderr=stream) as process,
    ):
        device = _follow(task, process, reported_once)
    return device, process.returncode, said.read_text("utf-8", errors="replace")


def _follow(task: Task, process: subprocess.Popen[bytes], reported_once: Path) -> str:
    """Report the progress of the process until it ends; the device that it names. Raises Cancelled."""
    device = ""
    try:
        with task.stopped_by(process.kill):
            for line in process.stdout or ():
                step = json.loads(line) if line.startswith(b"{") else {}
                if "device" in step:  # it has read all of its input
                    reported_once.unlink()
                    device = step["device"]
                if "drawn" in step:
                    task.report(step["drawn"] / step["of"])
            process.wait()
    finally:
        process.kill()  # where it still runs
    task.check()
    return device
