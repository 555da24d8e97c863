"""Pictures and films made by `scan4d render --replay` in a process of its own.

Whoever starts it goes on meanwhile, sees how far it has come, and can cancel it: then nothing is left.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from .errors import InputError, Scan4DError
from .export import numbered
from .helper import start_python
from .recording import Recording
from .task import Task

_SAID = "scan4d: "  # before each line of warnings and errors
_NICE = 5  # what waits for a person goes first


@dataclass(frozen=True)
class Made:
    """What came of it. files: in order of their names. device: that drew. warnings: what was left out."""

    files: tuple[Path, ...]
    device: str
    warnings: tuple[str, ...]


def make(
    task: Task,
    recording: Recording,
    out: Path,
    fps: float,
    anonymous: bool,
    numbers: Sequence[int] | None = None,
) -> Made:
    """Make the pictures or the film of a recording; this waits for it.

    out: as `scan4d render -o` has it. fps: of a film. anonymous: without the names and paths of scans.
    numbers: that the entries' files bear, each its own; from 0 where they are not given.
    Files take their names when all are complete, and replace those that have them. Raises
    Cancelled, InputError where they cannot be written, Scan4DError with what the process said.
    """
    with _folder_beside(out) as folder:
        recording.save(folder / "recording.json")
        made = folder / "made"
        made.mkdir()
        arguments = ["render", "--replay", str(folder / "recording.json"), "-o", str(made / out.name)]
        arguments += ["--fps", f"{fps:.17g}", "--progress", *(["--anonymous"] if anonymous else [])]
        device, code, text = _run(task, arguments, folder / "said")
        told = text.replace(str(made), str(out.parent)).splitlines()
        lines = tuple(line.removeprefix(_SAID) for line in told)
        if code:
            what = f"its process ended with code {code}"
            raise Scan4DError(lines[-1] if code > 0 and lines else what)
        files = tuple(_moved(made, out, range(len(recording.entries)) if numbers is None else numbers))
    return Made(files, device, lines)


def _moved(made: Path, out: Path, numbers: Iterable[int]) -> Iterator[Path]:
    """Move the files out of the folder `made` and give them their names, in the order of their numbers."""
    for drawn_as, number in enumerate(numbers):
        drawn, file = numbered(made / out.name, drawn_as), numbered(out, number)
        if drawn.exists():  # a broken frame has none, and all pictures of a film have one
            os.replace(drawn, file)
            yield file


@contextmanager
def _folder_beside(out: Path) -> Iterator[Path]:
    """A temporary folder on the disk that the files go to."""
    try:
        with TemporaryDirectory(prefix=".scan4d_", dir=out.parent) as folder:
            yield Path(folder)
    except OSError as error:
        what = f"cannot be written: {error.strerror or error}"
        raise InputError(what, out, "Check its folder, free space and permissions") from error


def _run(task: Task, arguments: list[str], said: Path) -> tuple[str, int, str]:
    """Run a command line of Scan4D and report its progress.

    said: a file for what it says on standard error. Returns the device that drew, the exit code, and what
    was said. Raises Cancelled.
    """
    code = "import sys; from viewer.cli import main; sys.exit(main(sys.argv[1:]))"
    with (
        open(said, "wb") as stream,
        start_python(code, *arguments, nice=_NICE, stdin=subprocess.DEVNULL, stderr=stream) as process,
    ):
        device = _follow(task, process)
    return device, process.returncode, said.read_text("utf-8", errors="replace")


def _follow(task: Task, process: subprocess.Popen[bytes]) -> str:
    """Report the progress of the process until it ends; the device that it names. Raises Cancelled."""
    device = ""
    try:
        with task.stopped_by(process.kill):
            for line in process.stdout or ():
                step = json.loads(line) if line.startswith(b"{") else {}
                device = step.get("device", device)
                if "drawn" in step:
                    task.report(step["drawn"] / step["of"])
            process.wait()
    finally:
        process.kill()  # where it still runs
    task.check()
    return device
