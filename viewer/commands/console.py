"""What a command says while it works: warnings and progress, on standard error."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count


def warn(text: str) -> None:
    """One line on standard error, above a progress bar if there is one."""
    if "tqdm" in sys.modules:
        sys.modules["tqdm"].tqdm.write(f"scan4d: {text}", file=sys.stderr)
    else:
        print(f"scan4d: {text}", file=sys.stderr)


def say(**values: object) -> None:
    """One line of JSON on standard output, at once."""
    print(json.dumps(values), flush=True)


@contextmanager
def progress(total: int, as_lines: bool = False) -> Iterator[Callable[[], object]]:
    """A function to call after each of `total` steps; a bar shows them where someone watches.

    It appears after a second, and only in a terminal. as_lines: for programs, a `say` for each step instead.
    """
    if as_lines:
        steps = count(1)
        yield lambda: say(drawn=next(steps), of=total)
        return
    if not sys.stderr.isatty():
        yield lambda: None
        return
    from tqdm import tqdm

    with tqdm(total=total, delay=1, leave=False) as bar:
        yield bar.update
