"""Fiducials of 3D Slicer before it wrote JSON (`.fcsv`): rows of commas below comments that tell the axes."""

from __future__ import annotations

import csv
import math
import re
from io import StringIO
from pathlib import Path

import numpy as np

from ....errors import shortened
from ...track import Known
from ..landmark_set import LandmarkNotes, LandmarkSet
from ._text import at_line, numbered_lines, three_numbers

TITLE = "3D Slicer fiducials"
SUFFIXES = (".fcsv",)

_AXES = {"0": "RAS", "RAS": "RAS", "1": "LPS", "LPS": "LPS"}
_COLUMNS = "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID,positionStatus,autoCreated"
_STATES = {"0": Known.PENDING, "1": Known.PENDING, "2": Known.PLACED, "": Known.PLACED}


def read(path: Path) -> LandmarkSet:
    """The fiducials of the list. Raises InputError."""
    axes, columns = "RAS", _COLUMNS.split(",")
    names, about, positions, known = [], [], [], []
    for line, text in numbered_lines(path):
        if text.startswith("#"):
            comment = re.fullmatch(r"#\s*(\w+)\s*=\s*(.*)", text)
            key, value = (comment[1].lower(), comment[2].strip()) if comment else ("", "")
            if key == "coordinatesystem":
                if value.upper() not in _AXES:
                    hint = "Known: RAS (0) and LPS (1)"
                    raise at_line(f"unknown coordinate system '{shortened(value)}'", line, hint)
                axes = _AXES[value.upper()]
            elif key == "columns":
                named = [name.strip() for name in value.split(",")]
                rest = (name for name in _COLUMNS.split(",") if "id" in named and name not in named)
                columns = [*named, *rest]
            continue
        try:
            (row,) = csv.reader(StringIO(text))
        except csv.Error as error:
            raise at_line(f"Scan4D cannot read this row of the table: {error}", line) from error
        values = dict(zip(columns, row, strict=False))
        if not {"x", "y", "z"} <= values.keys():
            raise at_line(f"has only {len(row)} values, too few for a landmark", line)
        position = three_numbers([values["x"], values["y"], values["z"]], line)
        state = _STATES.get(values.get("positionStatus", "").strip())
        if state is None:
            raise at_line(
                f"unknown positionStatus '{shortened(values['positionStatus'])}'", line, "Known: 0, 1, 2"
            )
        is_undefined = values.get("positionStatus", "").strip() == "0"
        positions.append([math.nan] * 3 if is_undefined else position)
        known.append(state)
        names.append(values.get("label", ""))
        about.append(values.get("desc", ""))
    grid = np.array(known, np.uint8)[np.newaxis]
    return LandmarkSet.of(names, np.array([positions]), known=grid, notes=LandmarkNotes("mm", about, axes))
