"""Numbers of frames, their order by name, and their rate."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

TIMES_FILE = "times.csv"
# Names of tables of times that other programs write; Scan4D uses them where they can be read.
_STEMS, _SUFFIXES = ("times", "timestamps", "timestamp"), (".csv", ".txt", ".tsv")
OTHER_TIMES_FILES = tuple(
    name
    for stem in _STEMS
    for suffix in _SUFFIXES
    for name in (stem + suffix, stem.capitalize() + suffix, (stem + suffix).upper())
    if name != TIMES_FILE
)
DEFAULT_FPS = 25.0
FPS_LIMITS = 1e-6, 1e6  # of frame rates


def frame_in_words(index: int) -> str:
    """A frame as every text tells it, counted from 1; poses, of the command line and Python, count from 0."""
    return f"frame {index + 1}"


def is_times_file(name: str) -> bool:
    """Whether a file of this name is a table of times, not a frame."""
    return name == TIMES_FILE or name in OTHER_TIMES_FILES


def natural_key(name: str) -> tuple[list[str | int], str]:
    """Sorts names as a person would: 2 before 10, capitals beside small letters."""
    return _split(name.casefold()), name


def typical_rate(times: NDArray[np.float64]) -> float:
    """Frames a second, by the median step of (T,) times in seconds; the default for one frame."""
    steps = np.diff(times)
    return 1 / float(np.median(steps)) if len(steps) else DEFAULT_FPS


def _split(name: str) -> list[str | int]:
    """Text and numbers in turn, text first: "a10.ply" is ["a", 10, ".ply"]."""
    return [int(part) if position % 2 else part for position, part in enumerate(re.split("([0-9]+)", name))]
