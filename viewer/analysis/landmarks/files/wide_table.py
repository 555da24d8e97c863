"""Landmarks as comma separated values, a row a frame: three columns a landmark, NAME_x, NAME_y and NAME_z."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ....csv_text import cell, to_text
from ..landmark_set import LandmarkSet
from ._tables import has_columns, read_table
from ._text import without_states

TITLE = "wide table of landmarks"
SUFFIXES = (".wide.csv",)

owns = has_columns
read = read_table


def write(path: Path, landmarks: LandmarkSet) -> str | None:
    """All frames; what is not defined is empty."""
    positions = np.where(landmarks.is_defined[..., np.newaxis], landmarks.positions, np.nan)
    rows: list[list[object]] = [
        ["frame", "time", "unit", *(f"{name}_{axis}" for name in landmarks.names for axis in "xyz")]
    ]
    for row, frame in enumerate(landmarks.frames):
        cells = [cell(value) for value in positions[row].ravel()]
        rows.append([int(frame) + 1, cell(landmarks.times[row]), landmarks.unit or "", *cells])
    path.write_text(to_text(rows), encoding="utf-8", newline="")
    return without_states(landmarks, "A wide table")
