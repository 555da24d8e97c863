"""Values of flags that several commands take. Each raises ArgumentTypeError for text that is none."""

from __future__ import annotations

import re
from argparse import ArgumentTypeError


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


def seed(text: str) -> int:
    """A whole number of at least 0."""
    if not (text.isascii() and text.isdecimal() and len(text) < 20):
        raise ArgumentTypeError(f"'{text}' is not a seed. Give a number such as 7")
    return int(text)
