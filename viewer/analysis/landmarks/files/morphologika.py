"""Morphologika 2.5: landmarks of individuals, or here of frames (O'Higgins and Jones 2006).

Sections in brackets: `[individuals]`, `[landmarks]` and `[dimensions]` count, `[names]` has a line for each
individual, `[rawpoints]` a line for each of its landmarks, below a line that begins with an apostrophe.
Landmarks have no names: those written here stand in such a line, the last.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from ....errors import InputError, shortened
from ..landmark_set import LandmarkNotes, LandmarkSet
from ._text import (
    at_line,
    count_of,
    digits_of,
    numbered_lines,
    own_frames,
    own_names,
    own_text,
    own_unit,
    own_values,
    three_numbers,
    without_states,
)

TITLE = "Morphologika"
SUFFIXES = (".morphologika", ".txt")

_SECTION = re.compile(r"\[\s*([a-z0-9 _]+?)\s*\]", re.IGNORECASE)
_COUNTS = ("individuals", "landmarks", "dimensions")
_LEFT_OUT = {
    "labels": "labels",
    "labelvalues": "labels",
    "groups": "groups",
    "wireframe": "lines",
    "polygons": "polygons",
}


def owns(head: str) -> bool:
    """Whether a text begins as such a file does."""
    return re.match(r"\s*\[\s*(individuals|landmarks|dimensions)\s*\]", head, re.IGNORECASE) is not None


def read(path: Path) -> LandmarkSet:
    """The individuals as frames, in their order. Raises InputError."""
    sections: dict[str, list[tuple[int, str]]] = {}
    current: list[tuple[int, str]] | None = None
    for line, text in numbered_lines(path):
        if match := _SECTION.fullmatch(text):
            name = match[1].lower().replace(" ", "")
            if name in sections:
                raise at_line(f"[{name}] appears twice", line)
            current = sections[name] = []
        elif current is None:
            raise at_line(
                f"the line '{shortened(text)}' does not belong to any section",
                line,
                "Start the file with [individuals]",
            )
        else:
            current.append((line, text))
    individuals, count, dimensions = (_count(sections, name) for name in _COUNTS)
    if dimensions not in (2, 3):
        raise InputError(f"has {dimensions} dimensions", hint="Scan4D reads 2 and 3")
    raw = sections.get("rawpoints", [])
    places = [(line, text) for line, text in raw if not text.startswith("'")]
    if len(places) != individuals * count:
        what = (
            f"contains {len(places)} positions, but according to [individuals] and [landmarks] there "
            f"should be {individuals} x {count}"
        )
        raise InputError(what, "[rawpoints]")
    own: dict[str, Any] = {}
    for _, text in raw:
        if text.startswith("'"):
            own |= own_values(text[1:].strip())
    flat = ["0"] if dimensions == 2 else []
    positions = [
        three_numbers([*re.split(r"[\s,;]+", text)[:dimensions], *flat], line) for line, text in places
    ]
    left_out = dict.fromkeys(_LEFT_OUT[name] for name in sections if name in _LEFT_OUT)
    remarks = [f"Scan4D leaves out these parts of the file: {' and '.join(left_out)}"] if left_out else []
    if flat:
        remarks.append("The landmarks in the file have only two coordinates: Scan4D sets z to 0")
    frames = _listed(own.get("frames"), individuals)
    names = own_names(own, count)
    if names is None:
        names = [str(number) for number in range(1, count + 1)]
    return LandmarkSet.of(
        names,
        np.array(positions).reshape(individuals, count, 3),
        times=_listed(own.get("times"), individuals),
        frames=None if frames is None else own_frames(frames.tolist()),
        notes=LandmarkNotes(own_unit(own), remarks=remarks),
    )


def _count(sections: dict[str, list[tuple[int, str]]], name: str) -> int:
    if not sections.get(name):
        raise InputError(f"the section [{name}] contains no number")
    line, text = sections[name][0]
    return count_of(text, line, f"[{name}]")


def _listed(values: Any, count: int) -> np.ndarray | None:
    """Numbers that a comment lists, where it has one for each frame."""
    if not (isinstance(values, list) and len(values) == count):
        return None
    fits = all(isinstance(value, int | float) and abs(value) < 1e15 for value in values)
    return np.array(values, np.float64) if fits else None


def write(path: Path, landmarks: LandmarkSet) -> str | None:
    """Each frame as an individual; positions that are not defined as NA."""
    positions = np.where(landmarks.is_defined[..., np.newaxis], landmarks.positions, np.nan)
    frames = [int(frame) + 1 for frame in landmarks.frames]
    own = {
        "names": landmarks.names,
        "unit": landmarks.unit,
        "frames": frames if landmarks.is_framed else None,
        "times": [float(time) for time in landmarks.times] if np.isfinite(landmarks.times).all() else None,
    }
    with open(path, "w", encoding="utf-8", newline="\n") as stream:
        for name, number in zip(_COUNTS, (len(frames), len(landmarks.names), 3), strict=True):
            stream.write(f"[{name}]\n{number}\n")
        stream.writelines(["[names]\n", *(f"frame_{frame:04d}\n" for frame in frames)])
        stream.write("[rawpoints]\n")
        for frame, places in zip(frames, positions, strict=True):
            stream.write(f"'frame_{frame:04d}\n")
            stream.writelines(" ".join(map(digits_of, place)) + "\n" for place in places)
        stream.write(f"'{own_text(own)}\n")  # the last: geomorph counts a line above each individual
    return without_states(landmarks, TITLE)
