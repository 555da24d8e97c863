"""The calibration of a depth camera, from a small file beside its pictures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, get_args

import numpy as np

from ...errors import InputError, shortened, unknown_name
from ..range_view import DepthKind
from ._texts import object_of, rows_of

FILES = ("camera.json", "camera.txt")  # beside the pictures

_CENTER = 0.5  # of a pixel: in these files that of the first one is at 0, 0
_MATRIX = "intrinsic_matrix"  # by columns, as Open3D writes it
_FORM = "It should have fx, fy, cx and cy in pixels, and for depth pictures depth_scale and unit"


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """A pinhole, its lens, and what the numbers of its depth pictures mean.

    fx, fy, cx, cy, distortion, kind: as `RangeView` has them. unit: as the file states it, perhaps any text.
    depth_scale: how many of the numbers are one unit, for example 1000 for millimetres where the unit is m.
    width, height: of the pictures that it is for, None: of any.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()
    kind: DepthKind = "z"
    depth_scale: float = 1000.0
    unit: str = "m"
    width: int | None = None
    height: int | None = None

    def check_size(self, size: Sequence[int], where: Path) -> None:
        """Raise InputError where a picture of this size, width and height, is not what it is for."""
        stated = (self.width, self.height)
        if None not in stated and tuple(size) != stated:
            what = "has {} x {} pixels, but its calibration is for {} x {}".format(*size, *stated)
            raise InputError(what, where)


def of_pinhole(f: float, cx: float, cy: float, **others: Any) -> Calibration:
    """The calibration of a lens as a data set's page gives it: pixel centres at whole numbers."""
    return Calibration(fx=f, fy=f, cx=cx + _CENTER, cy=cy + _CENTER, **others)


PRIMESENSE = of_pinhole(525.0, 319.5, 239.5)


def calibration_file(names: Sequence[str]) -> str | None:
    """The name among those of a folder that is of a calibration's file, None where none is."""
    return next((name for name in FILES if name in names), None)


def calibration_beside(folder: Path, names: Sequence[str], default: Calibration) -> Calibration:
    """The calibration in the folder's file, or the default where it has none. Raises InputError."""
    name = calibration_file(names)
    return default if name is None else read_calibration(folder / name, default)


def read_calibration(path: Path, default: Calibration | None = None) -> Calibration:
    """The calibration in a file; the default gives what the file does not state. Raises InputError.

    JSON has the numbers by name, or Open3D's `intrinsic_matrix`; text has a 3 x 3 or a 4 x 4 matrix, or one
    line: fx fy cx cy and perhaps the coefficients of the distortion.
    """
    try:
        is_json = path.suffix.lower() == ".json"
        return _checked(_from_json(object_of(path)) if is_json else _from_text(rows_of(path)), default)
    except InputError as error:
        raise InputError(error.what, path, error.hint or _FORM) from error
    except ValueError as error:
        raise InputError(f"is not a calibration: {shortened(str(error))}", path, _FORM) from error


def calibration_of(stored: dict[str, Any], default: Calibration | None = None) -> Calibration:
    """The calibration in a JSON object; the default gives what it does not state. Raises InputError."""
    return _checked(_from_json(stored), default)


def _from_json(stored: dict[str, Any]) -> dict[str, Any]:
    """The known fields of a file."""
    stated = {field.name: stored[field.name] for field in fields(Calibration) if field.name in stored}
    if _MATRIX in stored:
        matrix = np.array(stored[_MATRIX], np.float64)
        if matrix.shape != (9,):
            raise InputError(f"{_MATRIX} has shape {matrix.shape}, expected 9 numbers, by columns")
        stated |= dict(zip(("fx", "fy", "cx", "cy"), matrix[[0, 4, 6, 7]].tolist(), strict=True))
    return stated


def _from_text(rows: Sequence[tuple[int, Sequence[str]]]) -> dict[str, Any]:
    numbers = [float(word) for _, row in rows for word in row]
    if [len(row) for _, row in rows] in ([3] * 3, [4] * 4):
        matrix = np.array(numbers).reshape(len(rows), -1)
        numbers = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]]
    if len(numbers) < 4:
        raise InputError(f"is not a calibration: it has {len(numbers)} numbers", hint=_FORM)
    return dict(zip(("fx", "fy", "cx", "cy"), numbers, strict=False)) | {"distortion": numbers[4:]}


def _checked(stated: dict[str, Any], default: Calibration | None) -> Calibration:
    """The calibration with these fields. Raises InputError that says what is wrong."""
    if missing := [name for name in ("fx", "fy", "cx", "cy") if name not in stated]:
        raise InputError(f"is not a calibration: it lacks {', '.join(missing)}", hint=_FORM)
    given = {**stated, "distortion": tuple(_number("distortion", each) for each in _listed(stated))}
    for name in ("fx", "fy", "cx", "cy", "depth_scale"):
        if name in given:
            given[name] = _number(name, given[name])
    if min(given["fx"], given["fy"]) <= 0:
        raise InputError(f"is not a calibration: fx is {given['fx']:g} and fy {given['fy']:g}", hint=_FORM)
    if len(given["distortion"]) not in (0, 4, 5, 8):
        raise InputError(f"has {len(given['distortion'])} coefficients of distortion, expected 4, 5 or 8")
    if given.get("depth_scale", 1) < 1:
        hint = (
            "depth_scale is the number of depth steps in one unit, such as 1000 for millimetres where "
            "the unit is m"
        )
        raise InputError(f"its depth_scale is {given['depth_scale']:g}", hint=hint)
    if "kind" in given and given["kind"] not in (kinds := get_args(DepthKind)):
        raise unknown_name("kind of depth", shortened(given["kind"]), kinds)
    if "unit" in given:
        given["unit"] = str(given["unit"])
    given["cx"], given["cy"] = given["cx"] + _CENTER, given["cy"] + _CENTER
    return Calibration(**given) if default is None else replace(default, **given)


def _listed(stated: dict[str, Any]) -> Sequence[Any]:
    values = stated.get("distortion", ())
    if not isinstance(values, list | tuple):
        raise InputError("its distortion is not a list of numbers")
    return values


def _number(name: str, value: Any) -> float:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (is_number and math.isfinite(value)):
        raise InputError(f"is not a calibration: {name} is {shortened(value)}", hint=_FORM)
    return float(value)
