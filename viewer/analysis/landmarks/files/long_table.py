"""Landmarks as comma separated values, a row a landmark and frame: what `scan4d measure` writes.

Rows whose kind is not `landmark` are left out. Tables of other programs, long or wide, are read where the
first line names x, y and z, or NAME_x, NAME_y and NAME_z; commas, semicolons or tabs stand between.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ....csv_text import cell, to_text
from ...track import STATES, Known
from ..landmark_set import LandmarkSet
from ._tables import LONG_COLUMNS, has_columns, read_table

TITLE = "table of landmarks"
SUFFIXES = (".csv",)

owns = has_columns
read = read_table


def landmark_rows(landmarks: LandmarkSet) -> Iterator[list[object]]:
    """The rows below `LONG_COLUMNS`, frame by frame; what is not known is empty. Frames count from 1."""
    for row, frame in enumerate(landmarks.frames):
        for number, name in enumerate(landmarks.names):
            place = [cell(value) for value in landmarks.positions[row, number]]
            state = STATES[Known(int(landmarks.known[row, number]))]
            time, sigma = cell(landmarks.times[row]), cell(landmarks.sigmas[row, number])
            yield ["landmark", int(frame) + 1, time, name, *place, state, None, sigma, landmarks.unit or ""]


def write(path: Path, landmarks: LandmarkSet) -> None:
    """All frames, with states and uncertainties."""
    path.write_text(to_text([LONG_COLUMNS, *landmark_rows(landmarks)]), encoding="utf-8", newline="")
