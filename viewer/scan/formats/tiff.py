"""TIFF: heights over the ground (GeoTIFF), or one pod's depth without a calibration.

The ground of heights stands in the tags ModelPixelScale and ModelTiepoint, or ModelTransformation without a
rotation; GDAL_NODATA is the number where nothing is known. Of the GeoKeys, the model type tells degrees, the
raster type what the tie point is tied to, and the units those of the ground and the heights.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..points import UNKNOWN_UNIT
from ..range_view import RangeView
from ..reading.camera import decide_view
from ..reading.depths import measured_depths
from ..reading.ground import DEGREES, LENGTHS, decide_ground
from ..reading.sequence import Decided
from ..terrain import METRE, Ground, terrain_view
from ..units import conversion
from ._pictures import numbers_of_picture, opened_picture

TITLE = "TIFF"
SUFFIXES = (".tif", ".tiff")

_SCALE, _TIE, _TRANSFORMATION, _KEYS, _NO_DATA = 33550, 33922, 34264, 34735, 42113  # tags
_MODEL_TYPE, _RASTER_TYPE, _GROUND_UNIT, _HEIGHT_UNIT = 1024, 1025, 3076, 4099  # GeoKeys
_GEOGRAPHIC, _POINT = 2, 2  # of the first two
_UNITS = {9001: "m", 9002: "ft", 9003: "ft"}  # the foot of surveys is two millionths longer
_KEY_WORDS = 4  # of an entry in the directory of keys, and of its header


def read_unit(path: Path, decided: Decided) -> str | None:
    """The unit of the heights of a terrain, or None."""
    with opened_picture(path, ("TIFF",)) as image:
        tags = dict(image.tag_v2)  # type: ignore[attr-defined]
    if not _has_ground(tags) or _MODEL_TYPE in _geo_keys(tags):
        return _units(tags)[1] if _has_ground(tags) else None
    return read(path, 0, decided)[0].unit  # heights tell whether the ground is in degrees


def read(path: Path, frame: int, decided: Decided) -> tuple[RangeView, ...]:
    """The terrain or the depth as one view. Raises InputError for pictures in colour, too."""
    with opened_picture(path, ("TIFF",)) as image:
        tags = dict(image.tag_v2)  # type: ignore[attr-defined]
        numbers = numbers_of_picture(image)
    return (_terrain(numbers, tags, decided) if _has_ground(tags) else _depth(numbers, decided),)


def _depth(numbers: NDArray, decided: Decided) -> RangeView:
    height, width = numbers.shape
    return RangeView(
        depth=numbers.astype(np.float32),
        mask=measured_depths(numbers, decided),
        world_to_camera=np.eye(4),
        name="camera",
        **decide_view(None, (width, height), decided),
    )


def _has_ground(tags: dict[int, Any]) -> bool:
    return _TRANSFORMATION in tags or (_SCALE in tags and _TIE in tags)


def _terrain(heights: NDArray, tags: dict[int, Any], decided: Decided) -> RangeView:
    there = np.isfinite(heights)
    if (missing := _no_data(tags)) is not None:
        with np.errstate(over="ignore"):
            there &= heights != np.float64(missing).astype(heights.dtype)
    ground = _ground(tags)
    rows, columns = heights.shape
    span = float(np.ptp(heights[there])) if there.any() else 0.0
    stated = None
    if _MODEL_TYPE in _geo_keys(tags):
        stated = DEGREES if ground.degrees else LENGTHS
    size = ground.right * columns, ground.down * rows
    found = decide_ground(stated, (ground.left, ground.first), size, span, decided.corrections)
    decided.note(found)
    if found.value == DEGREES:
        ground = replace(ground, degrees=True, unit=_units(tags)[1] or METRE)
    else:
        ground = replace(ground, degrees=False)
    return terrain_view(heights, there, ground, "terrain")


def _ground(tags: dict[int, Any]) -> Ground:
    """The ground, in the unit of the heights where it is no degrees."""
    keys = _geo_keys(tags)
    if _TRANSFORMATION in tags:
        matrix = _floats(tags, _TRANSFORMATION, 16).reshape(4, 4)
        if matrix[0, 1] or matrix[1, 0]:
            raise InputError(
                "the rows of the picture do not go from west to east",
                hint="Resample the terrain to a grid whose rows go from west to east",
            )
        left, first, right, down = matrix[0, 3], matrix[1, 3], matrix[0, 0], matrix[1, 1]
    else:
        scale, tie = _floats(tags, _SCALE, 2), _floats(tags, _TIE, 6)
        right, down = scale[0], -scale[1]
        left, first = tie[3] - tie[0] * right, tie[4] - tie[1] * down
    if keys.get(_RASTER_TYPE) == _POINT:  # the positions are the middles of cells
        left, first = left - right / 2, first - down / 2
    degrees = keys.get(_MODEL_TYPE) == _GEOGRAPHIC
    of_ground, of_heights = _units(tags)
    unit = of_heights or (METRE if degrees else UNKNOWN_UNIT)
    longer = 1.0 if degrees or of_ground is None else conversion(of_ground, unit) or 1.0
    edges = (float(value * longer) for value in (left, first, right, down))
    return Ground(
        **dict(zip(("left", "first", "right", "down"), edges, strict=True)), degrees=degrees, unit=unit
    )


def _units(tags: dict[int, Any]) -> tuple[str | None, str | None]:
    """The units of the ground and of the heights; heights are in the ground's if no other unit is stated."""
    keys = _geo_keys(tags)
    of_ground = _UNITS.get(keys.get(_GROUND_UNIT, 0))
    if keys.get(_MODEL_TYPE) == _GEOGRAPHIC:
        return None, _UNITS.get(keys.get(_HEIGHT_UNIT, 0), METRE)
    return of_ground, _UNITS.get(keys.get(_HEIGHT_UNIT, 0), of_ground)


def _geo_keys(tags: dict[int, Any]) -> dict[int, int]:
    """The keys whose values are small numbers."""
    words = tags.get(_KEYS, ())
    if not isinstance(words, tuple) or not all(isinstance(word, int) for word in words):
        return {}
    entries = [words[start : start + _KEY_WORDS] for start in range(_KEY_WORDS, len(words), _KEY_WORDS)]
    return {entry[0]: entry[3] for entry in entries if len(entry) == _KEY_WORDS and entry[1] == 0}


def _no_data(tags: dict[int, Any]) -> float | None:
    try:
        return float(str(tags[_NO_DATA]).strip("\0 "))
    except (KeyError, ValueError):
        return None


def _floats(tags: dict[int, Any], tag: int, least: int) -> NDArray[np.float64]:
    """The numbers of a tag, which must be so many or more."""
    try:
        numbers = np.array(tags[tag], np.float64).ravel()
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if len(numbers) < least or not np.isfinite(numbers).all():
        raise InputError(f"the tag {tag} is not {least} finite numbers")
    return numbers
