"""Landmarks of 3D Slicer: markups as JSON, schema 1.0.0 to 1.0.4 (`.mrk.json`).

https://github.com/Slicer/Slicer/tree/main/Modules/Loadable/Markups/Resources/Schema. Control points of all
markups in a file are landmarks, whatever the markup is drawn as. What the schema has no field for (the
frame, tracked places, uncertainty) stands in members named `scan4d`, which it allows.
"""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np

from ....errors import InputError, shortened
from ....files import parsed_json
from ....scan.units import conversion, plain_unit
from ...track import STATES, Known
from ..landmark_set import LandmarkNotes, LandmarkSet
from ._text import own_frames, own_number, read_all

TITLE = "3D Slicer markups"
SUFFIXES = (".mrk.json",)
AXES = "LPS"
ONE_MOMENT = True

_SCHEMA = (
    "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/"
    "markups-schema-v1.0.3.json#"
)
_READ = re.compile(r"markups-schema-v1\.\d+\.\d+\.json#*$", re.IGNORECASE)
_CODED_AXES = {"0": "RAS", "1": "LPS"}  # as old scenes have them
_STATES = {"undefined": Known.PENDING, "preview": Known.PENDING, "defined": Known.PLACED}
_CODED_STATES = {"0": "undefined", "1": "preview", "2": "defined"}
_OWN = "scan4d"
_OWN_STATES = (Known.GAP, Known.TRACKED, Known.CARRIED)
_UNIT = "mm"  # in which 3D Slicer is


def read(path: Path) -> LandmarkSet:
    """The control points of all markups. Raises InputError."""
    try:
        data = parsed_json(read_all(path))
    except ValueError as error:
        raise InputError(f"is not JSON ({error})") from error
    if not isinstance(data, dict) or not isinstance(data.get("markups"), list):
        raise InputError(
            "contains no list 'markups' with landmarks",
            hint="Save the landmarks again in 3D Slicer as a .mrk.json file",
        )
    schema = data.get("@schema", _SCHEMA)
    if not isinstance(schema, str) or not _READ.search(schema):
        raise InputError(f"has the schema '{shortened(schema)}', but Scan4D reads only markups of version 1")
    parts = [_markup(markup, f"markup {number}") for number, markup in enumerate(data["markups"], 1)]
    parts = [part for part in parts if part["names"]]
    if not parts:
        raise InputError("holds no landmarks")
    if len({part["axes"] for part in parts}) > 1 or len({part["unit"] for part in parts}) > 1:
        raise InputError(
            "the markups of the file have different coordinate systems or units",
            hint="In 3D Slicer, save each markup to its own file",
        )
    own = _own(data)
    unit = _word(own["unit"]) if "unit" in own else parts[0]["unit"]
    return LandmarkSet.of(
        [name for part in parts for name in part["names"]],
        np.concatenate([part["positions"] for part in parts])[np.newaxis],
        known=np.concatenate([part["known"] for part in parts])[np.newaxis],
        sigmas=np.concatenate([part["sigmas"] for part in parts])[np.newaxis],
        times=np.array([own_number(own, "time")]),
        frames=own_frames([own_number(own, "frame")]),
        notes=LandmarkNotes(
            unit,
            [text for part in parts for text in part["about"]],
            parts[0]["axes"],
            [text for part in parts for text in part["remarks"]],
        ),
    )


def _markup(markup: Any, where: str) -> dict[str, Any]:
    """Names, positions, states, uncertainties, descriptions, axes and unit of one markup."""
    if not isinstance(markup, dict):
        raise InputError("is not a JSON object", where)
    points = markup.get("controlPoints", [])
    if not isinstance(points, list):
        raise InputError("controlPoints is not a list", where)
    count = len(points)
    positions = np.full((count, 3), np.nan)
    known, sigmas = np.full(count, Known.PENDING, np.uint8), np.full(count, np.nan)
    names, about, lost, previews = [], [], [], []
    for row, point in enumerate(points):
        at = f"{where}, control point {row + 1}"
        if not isinstance(point, dict):
            raise InputError("is not a JSON object", at)
        names.append(_word(point.get("label")))
        about.append(_word(point.get("description")))
        status = _word(point.get("positionStatus", "defined"))
        status = _CODED_STATES.get(status, status).lower()
        if status not in _STATES:
            raise InputError(
                f"unknown positionStatus '{shortened(status)}'", at, "Known: " + ", ".join(_STATES)
            )
        known[row] = _STATES[status]
        own = _own(point)
        known[row] = next((one for one in _OWN_STATES if STATES[one] == own.get("state")), known[row])
        sigmas[row] = own_number(own, "sigma")
        if status == "undefined":
            continue
        positions[row] = _position(point.get("position"), at)
        if status == "defined" and not np.isfinite(positions[row]).all():
            known[row] = Known.PENDING
            lost.append(names[-1])
        if known[row] == Known.PENDING and np.isfinite(positions[row]).all():
            previews.append(names[-1])
    remarks = []
    if lost:
        remarks.append(
            f"The file marks {len(lost)} points as defined, but gives them no position, such as "
            f"'{shortened(lost[0])}'"
        )
    if previews:
        are = "point is a preview" if len(previews) == 1 else "points are previews"
        remarks.append(
            f"{len(previews)} {are} that nobody has confirmed in 3D Slicer, such as "
            f"'{shortened(previews[0])}'"
        )
    name = _word(markup.get("name"))
    if len(points) == 1 and not names[0]:
        names[0] = name
    return {
        "names": names,
        "positions": positions,
        "known": known,
        "sigmas": sigmas,
        "about": about,
        "remarks": remarks,
        "axes": _axes(markup.get("coordinateSystem", "LPS"), where),
        "unit": _unit(markup.get("coordinateUnits", _UNIT), where),
    }


def _own(data: dict[str, Any]) -> dict[str, Any]:
    """Values that the schema has no field for, of an object that was written here."""
    own = data.get(_OWN)
    return own if isinstance(own, dict) else {}


def _word(value: Any) -> str:
    return str(value) if isinstance(value, str | int) and not isinstance(value, bool) else ""


def _position(value: Any, where: str) -> list[float]:
    """Three numbers, NaN for one that is none; a point without a position has it as null or as ""."""
    if value in (None, "", []):
        return [math.nan] * 3
    fits = isinstance(value, list) and len(value) == 3
    if not fits or not all(isinstance(one, int | float) and not isinstance(one, bool) for one in value):
        raise InputError(f"position is {shortened(value)}, but must be three numbers", where)
    return [float(one) if abs(one) < 1e300 else math.nan for one in value]


def _axes(value: Any, where: str) -> str:
    """The name of the coordinate system, also of the numbers that stand for it in old files."""
    name = _CODED_AXES.get(_word(value), _word(value)).upper()
    if name not in _CODED_AXES.values():
        raise InputError(f"unknown coordinateSystem {shortened(value)}", where, "Known: LPS, RAS")
    return name


def _unit(value: Any, where: str) -> str:
    """A unit as a word, or as a code of a scheme with its meaning: ["mm", "UCUM", "millimeter"]."""
    word = value[0] if isinstance(value, list) and value else value
    if not isinstance(word, str):
        raise InputError(f"unknown coordinateUnits {shortened(value)}", where, "Known: mm, um")
    return "µm" if word == "um" else plain_unit(word)


def write(path: Path, landmarks: LandmarkSet) -> None:
    """One moment as a markup of points, in millimetres where the unit is a known length."""
    factor = conversion(landmarks.unit or "", _UNIT)
    own: dict[str, Any] = {}
    if landmarks.is_framed:
        own["frame"] = int(landmarks.frames[0]) + 1
    if math.isfinite(landmarks.times[0]):
        own["time"] = float(landmarks.times[0])
    if factor is None:
        own["unit"] = landmarks.unit
    markup = {
        "type": "Fiducial",
        "coordinateSystem": AXES,
        **({"coordinateUnits": _UNIT} if factor else {}),
        "locked": False,
        "fixedNumberOfControlPoints": False,
        "labelFormat": "%N-%d",
        "lastUsedControlPointNumber": len(landmarks.names),
        "controlPoints": [_point(landmarks, number, factor or 1.0) for number in range(len(landmarks.names))],
    }
    text = json.dumps({"@schema": _SCHEMA, "markups": [markup], **({_OWN: own} if own else {})}, indent=1)
    path.write_text(text + "\n", encoding="utf-8")


def _point(landmarks: LandmarkSet, number: int, factor: float) -> dict[str, Any]:
    known, position = landmarks.known[0, number], landmarks.positions[0, number] * factor
    is_there = bool(np.isfinite(position).all())
    status = "defined" if known >= Known.TRACKED else "preview" if is_there else "undefined"
    own: dict[str, Any] = {}
    if known in _OWN_STATES:
        own["state"] = STATES[Known(int(known))]
    if math.isfinite(sigma := float(landmarks.sigmas[0, number]) * factor):
        own["sigma"] = sigma
    return {
        "id": str(number + 1),
        "label": landmarks.names[number],
        "description": landmarks.about[number],
        "associatedNodeID": "",
        "position": [float(one) for one in position] if is_there else [0.0, 0.0, 0.0],
        "orientation": [-1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0],
        "selected": True,
        "locked": False,
        "visibility": True,
        "positionStatus": status,
        **({_OWN: own} if own else {}),
    }
