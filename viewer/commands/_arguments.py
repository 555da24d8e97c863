"""Values of flags that several commands take. Each raises ArgumentTypeError for text that is none."""

from __future__ import annotations

import math
import re
from argparse import ArgumentTypeError, Namespace
from collections.abc import Collection, Iterable


def size(text: str) -> tuple[int, int]:
    """Width and height in pixels, of text such as 1920x1280."""
    match = re.fullmatch("0*([1-9][0-9]{0,8})[xX]0*([1-9][0-9]{0,8})", text)
    if not match:
        raise ArgumentTypeError(f"'{text}' is not a size. Give width and height, such as 1920x1280")
    return int(match[1]), int(match[2])


def count(text: str) -> int:
    """A whole number of at least 1."""
    if not text.isdecimal() or int(text) < 1:
        raise ArgumentTypeError(f"'{text}' is not a number of at least 1")
    return int(text)


def numbers(text: str, counts: Collection[int] | None, what: str) -> tuple[float, ...]:
    """Finite numbers with commas between. counts: how many there may be; None: any number. what: they are."""
    try:
        found = tuple(float(part) for part in text.split(","))
    except ValueError:
        found = ()
    if len(found) not in (counts or [len(found) or 1]) or not all(map(math.isfinite, found)):
        raise ArgumentTypeError(f"'{text}' is not {what}")
    return found


def given(args: Namespace, names: Iterable[str]) -> list[str]:
    """The arguments that the user has given, as the command line writes them: `--size`."""
    values = {name: getattr(args, name) for name in names}
    # By identity: 0 is a value, which equals False.
    return [f"--{name}" for name, it in values.items() if it is not None and it is not False and it != []]


def seed(text: str) -> int:
    """A whole number of at least 0."""
    if not (text.isascii() and text.isdecimal() and len(text) < 20):
        raise ArgumentTypeError(f"'{text}' is not a usable seed. Give a whole number such as 7")
    return int(text)
