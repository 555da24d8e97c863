"""What a command says while it works: warnings and progress, on standard error."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


def warn(text: str) -> None:
    """One line on standard error, above a progress bar if there is one."""
    if "tqdm" in sys.modules:
        sys.modules["tqdm"].tqdm.write(f"scan4d: {text}", file=sys.stderr)
    else:
        print(f"scan4d: {text}", file=sys.stderr)


@contextmanager
def progress(total: int) -> Iterator[Callable[[], object]]:
    """A function to call after each of `total` steps; a bar shows them where someone watches.

    It appears after a second, and only in a terminal.
    """
    if not sys.stderr.isatty():
        yield lambda: None
        return
    from tqdm import tqdm

    with tqdm(total=total, delay=1, leave=False) as bar:
        yield bar.update
