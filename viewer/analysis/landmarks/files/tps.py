"""TPS: landmarks of specimens, or here of frames, as tpsDig and geomorph have them (Rohlf 2015).

`LM3=` counts the places of a specimen in three dimensions, `LM=` in two; then come their coordinates, and
`IMAGE=`, `ID=`, `SCALE=`. Landmarks have no names: those written here stand in a comment.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ....errors import InputError
from ..landmark_set import LandmarkNotes, LandmarkSet
from ._text import (
    at_line,
    count_of,
    digits_of,
    number_of,
    numbered_lines,
    own_frames,
    own_names,
    own_number,
    own_text,
    own_unit,
    own_values,
    three_numbers,
    without_states,
)

TITLE = "TPS"
SUFFIXES = (".tps",)

_KEY = re.compile(r"([A-Za-z][A-Za-z0-9_]*)\s*=\s*(.*)")


@dataclass
class _Specimen:
    """Lines between one LM= and the next. points: (L, 3), flat. own: of the comment written here."""

    line: int
    points: list[list[float]]
    is_flat: bool
    scale: float = 1.0
    own: dict[str, Any] = field(default_factory=dict)


def read(path: Path) -> LandmarkSet:
    """The specimens as frames, in their order. Raises InputError."""
    specimens: list[_Specimen] = []
    curves = 0
    lines = numbered_lines(path)
    row = 0
    while row < len(lines):
        line, text = lines[row]
        row += 1
        match = _KEY.fullmatch(text)
        if match is None:
            raise at_line(
                "the line is neither KEY=VALUE nor one of the positions after LM=",
                line,
                "Check the number after LM= or LM3=",
            )
        key, value = match[1].upper(), match[2].strip()
        if key in ("LM", "LM3"):
            count = count_of(value, line, f"{key}=")
            points, row = _points(lines, row, count, line, key == "LM")
            specimens.append(_Specimen(line, points, key == "LM"))
        elif key == "POINTS":
            row += count_of(value, line, "POINTS=")
        elif key == "CURVES":
            curves += count_of(value, line, "CURVES=")
        elif key == "SCALE" and specimens:
            specimens[-1].scale = number_of(value, line)
            if not specimens[-1].scale > 0:
                raise at_line(f"the scale is '{value}', but must be above 0", line)
        elif key == "COMMENT" and specimens:
            specimens[-1].own |= own_values(value)
    if not specimens:
        raise InputError("holds no specimen", hint="A specimen begins with LM= or LM3=")
    return _frames(specimens, curves)


def _points(
    lines: list[tuple[int, str]], row: int, count: int, line: int, is_flat: bool
) -> tuple[list[list[float]], int]:
    """The coordinates of a specimen, and the row after them. A place in two dimensions has z = 0."""
    if count > len(lines) - row:
        raise at_line(
            f"announces {count} landmarks, but the file has only {len(lines) - row} more lines", line
        )
    points: list[list[float]] = []
    for number, text in lines[row : row + count]:
        words = text.split()
        if "=" in text:
            what = f"announces {count} landmarks, but only {len(points)} follow"
            raise at_line(what, line)
        points.append(three_numbers([*words[:2], "0"] if is_flat and len(words) >= 2 else words, number))
    return points, row + count


def _frames(specimens: list[_Specimen], curves: int) -> LandmarkSet:
    count = max(len(specimen.points) for specimen in specimens)
    for number, specimen in enumerate(specimens, 1):
        if len(specimen.points) not in (0, count):
            what = f"specimen {number} has {len(specimen.points)} landmarks, but another specimen has {count}"
            raise at_line(what, specimen.line)
    missing = [[math.nan] * 3] * count
    positions = np.array([specimen.points or missing for specimen in specimens]).reshape(-1, count, 3)
    positions *= np.array([specimen.scale for specimen in specimens])[:, np.newaxis, np.newaxis]
    own = specimens[0].own
    remarks = []
    if curves:
        remarks.append(f"Scan4D does not read the {curves} curves of the file")
    if any(specimen.is_flat for specimen in specimens):
        remarks.append("The landmarks in the file have only two coordinates: Scan4D sets z to 0")
    names = own_names(own, count)
    if names is None:
        names = [str(number) for number in range(1, count + 1)]
    return LandmarkSet.of(
        names,
        positions,
        times=np.array([own_number(specimen.own, "time") for specimen in specimens]),
        frames=own_frames([own_number(specimen.own, "frame") for specimen in specimens]),
        notes=LandmarkNotes(own_unit(own), remarks=remarks),
    )


def write(path: Path, landmarks: LandmarkSet) -> str | None:
    """Each frame as a specimen; positions that are not defined as NA."""
    positions = np.where(landmarks.is_defined[..., np.newaxis], landmarks.positions, np.nan)
    with open(path, "w", encoding="utf-8", newline="\n") as stream:
        for row, places in enumerate(positions):
            stream.write(f"LM3={len(places)}\n")
            stream.writelines(" ".join(map(digits_of, place)) + "\n" for place in places)
            frame, time = int(landmarks.frames[row]) + 1, float(landmarks.times[row])
            own = {
                "frame": frame if landmarks.is_framed else None,
                "time": time if math.isfinite(time) else None,
                "unit": landmarks.unit if row == 0 else None,
                "names": landmarks.names if row == 0 else None,
            }
            stream.write(f"ID=frame_{frame:04d}\nCOMMENT={own_text(own)}\n")
    return without_states(landmarks, TITLE)
