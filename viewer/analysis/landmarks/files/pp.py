"""Picked points of MeshLab (`.pp`): XML with an element a point, which has its coordinates and its name."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from ....errors import InputError
from ...track import Known
from ..landmark_set import LandmarkNotes, LandmarkSet, check_cells
from ._text import number_of, read_all

TITLE = "picked points of MeshLab"
SUFFIXES = (".pp",)

_INACTIVE = {"0", "false"}


def read(path: Path) -> LandmarkSet:
    """The points; those that are not active are gaps. Raises InputError."""
    text = read_all(path)
    if "<!ENTITY" in text:
        hint = "Save the points again in MeshLab"
        raise InputError("defines XML entities, which Scan4D does not read", hint=hint)
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise InputError(f"is not XML: {error}", hint="Save the points again in MeshLab") from error
    points = list(root.iter("point"))
    check_cells(1, len(points))
    names, positions, known = [], [], []
    for number, point in enumerate(points, 1):
        position = [number_of(point.get(axis, "").replace(",", "."), number) for axis in "xyz"]
        is_active = point.get("active", "1").strip().lower() not in _INACTIVE
        is_placed = is_active and all(map(math.isfinite, position))
        names.append(point.get("name") or str(number))
        positions.append(position if is_placed else [math.nan] * 3)
        known.append(Known.PLACED if is_placed else Known.PENDING)
    if not names:
        raise InputError("holds no landmarks")
    grid = np.array(known, np.uint8)[np.newaxis]
    return LandmarkSet.of(names, np.array([positions]), known=grid, notes=LandmarkNotes())
