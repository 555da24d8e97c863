"""What a command writes: never onto what it reads, and onto other files only where that is wanted."""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser
from collections.abc import Iterable, Sequence
from pathlib import Path

from ..errors import InputError, explained
from ..scan.inputs import found_among
from ._console import escaped


def add_force_argument(parser: ArgumentParser) -> None:
    """`--force`."""
    parser.add_argument("--force", action="store_true", help="replace existing files")


def add_output_argument(parser: ArgumentParser, text: str, metavar: str = "OUT") -> None:
    """`--output` with this help, and `--force`."""
    parser.add_argument("-o", "--output", dest="out", metavar=metavar, type=Path, required=True, help=text)
    add_force_argument(parser)


def claim(outputs: Sequence[Path], inputs: Iterable[Path], force: bool) -> None:
    """Raise InputError, before any work, where these files are not to be written.

    Refused are inputs of the command, under whatever name (links as well); and what is there already, unless
    force is set or a person at the terminal agrees. inputs: they need not be there.
    """
    for path in found_among(outputs, inputs):
        raise InputError(
            "is an input of this command, and Scan4D does not replace inputs", path, "Write to another file"
        )
    there = [path for path in outputs if _is_there(path)]
    if there and not force and not _agreed(there):
        hint = "--force replaces it" if len(there) == 1 else "--force replaces them"
        raise InputError(f"exists already{_and_more(there)}", there[0], hint)


def _is_there(path: Path) -> bool:
    """Whether something has this name. Raises InputError for a folder, and a name that cannot be."""
    try:
        os.lstat(path)
    except FileNotFoundError:
        return False
    except OSError as error:
        what, hint = explained(error)
        raise InputError(f"cannot be written: {what}", path, hint) from error
    if os.path.isdir(path):
        raise InputError("is a folder", path, "Name a file in it")
    return True


def _agreed(there: Sequence[Path]) -> bool:
    """Whether a person says that these are replaced; without a terminal nobody does."""
    if not (sys.stdin and sys.stdin.isatty() and sys.stderr and sys.stderr.isatty()):
        return False
    question = f"{escaped(str(there[0]))}: exists already{_and_more(there)}. Replace? [y/N] "
    print(question, end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def _and_more(there: Sequence[Path]) -> str:
    return f", and {len(there) - 1} more" if len(there) > 1 else ""
