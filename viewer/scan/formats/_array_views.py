"""Range views from named arrays: depth, an organised grid of points, or the heights of a terrain.

| array | what it is |
|---|---|
| `depth` (H, W) | of the kind that `kind` states (z, range, height), any real; whole numbers: 0 is none |
| `depth_scale` | how many of its numbers are one unit; 1 where it is missing |
| `xyz` (H, W, 3) | instead: points in an image's axes, or with x right, y up and z towards the scanner |
| `elevation` (H, W) | instead: heights of a terrain, in metres or the unit that `unit` states |
| `color` (H, W), (H, W, 3 or 4) | sRGB on any scale |
| `mask` (H, W), `confidence` (H, W) | above 0.01: use the depth; any real |
| `intrinsics` or `K` (3, 3), or `fx` `fy` `cx` `cy` | pixels, the centre of the first one at 0, 0 |
| `distortion` (4,), (5,) or (8,) | as OpenCV has it |
| `pose`, or `world_to_camera`, (4, 4) | from the camera to the world, or back, in an image's axes |
| `unit` | of length |
| `dx` `dy`; `xmin` `xmax` `ymin` `ymax` | of a terrain: a cell's sides; outer edges, ymin of the first row |

An image's axes are x to the right, y down and z ahead.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..admission import admit
from ..grids import is_seen_from_behind, view_of_camera, view_of_grid
from ..image_poses import IMAGE_AXES, UPRIGHT, from_camera_to_world, from_world_to_camera
from ..points import UNKNOWN_UNIT
from ..range_view import DepthKind, RangeView, mask_of
from ..reading.camera import CENTER, decide_view, note_fitted
from ..reading.colors import settled_scale
from ..reading.depths import measured_depths
from ..reading.ground import DEGREES, decide_ground
from ..reading.sequence import Decided
from ..terrain import METRE, Ground, terrain_view
from ..units import usable_unit
from ._stored import StoredArray

_IMAGES = ("depth", "xyz", "elevation")  # of which one makes a view
_MATRICES = ("intrinsics", "K")
_PINHOLE = ("fx", "fy", "cx", "cy")
_EDGES = ("xmin", "xmax", "ymin", "ymax")
_MOST_RATIO = 40  # of memory to the file: what is masked packs well
_BYTES = {"depth": 16, "elevation": 24, "xyz": 140}  # of memory for a pixel of a view, beside what is stored
_ROWS = 64  # of colours worked on together
_LONGEST = 1024  # numbers, or bytes of a word, where few are expected
_AS_THEY_ARE = (slice(None), slice(None))
_UPSIDE_DOWN = (slice(None, None, -1), slice(None))

_Arrays = Mapping[str, StoredArray]
_Turned = tuple[slice, slice]  # rows and columns of a view in those of its file


def makes_views(arrays: _Arrays) -> bool:
    """Whether there is an array that makes a range view."""
    return _source(arrays) is not None


def _source(arrays: _Arrays) -> str | None:
    """The array that makes one; a list of points is none."""
    return next((name for name in _IMAGES if name in arrays and arrays[name].shape[1:] != (3,)), None)


def view_of_arrays(arrays: _Arrays, held: int, decided: Decided) -> RangeView:
    """The range view of the arrays of a file of `held` bytes. Raises InputError."""
    source = _source(arrays)
    assert source is not None
    shape, deep = arrays[source].shape, (3,) if source == "xyz" else ()
    if len(shape) < 2 or 0 in shape or shape[2:] != deep:
        raise InputError(f"array '{source}' has shape {shape}, expected (H, W{', 3' if deep else ''})")
    images = [name for name in (source, "color", "mask", "confidence") if name in arrays]
    for name in images:
        image = arrays[name].shape
        if image[:2] != shape[:2] or (name != source and image[2:] and name != "color"):
            raise InputError(f"array '{name}' has shape {image}, but '{source}' has shape {shape}")
    stored = sum(arrays[name].memory() for name in images)
    admit(held, stored + shape[0] * shape[1] * _BYTES[source], _MOST_RATIO)
    make = {"depth": _of_depth, "xyz": _of_grid, "elevation": _of_terrain}[source]
    view, turned = make(_numbers(arrays[source]), arrays, decided)
    changes: dict[str, Any] = {}
    if "mask" in images:
        changes["mask"] = view.mask & mask_of(_numbers(arrays["mask"])[turned])
    if "color" in images:
        changes["color"] = np.ascontiguousarray(_colors(_numbers(arrays["color"]), decided)[turned])
    if "confidence" in images:
        changes["confidence"] = _numbers(arrays["confidence"])[turned].astype(np.float32)
    return replace(view, **changes)


def unit_of_arrays(arrays: _Arrays, held: int, decided: Decided) -> str | None:
    """The name of the unit of length of the view of a file of `held` bytes, or None. Raises InputError.

    This reads the heights of a terrain to find out whether its ground is in degrees.
    """
    if "unit" in arrays or _source(arrays) != "elevation":
        return _stated_unit(arrays)
    return view_of_arrays(arrays, held, decided).unit


def _unit(arrays: _Arrays) -> str | None:
    return usable_unit(_stated_unit(arrays))


def _stated_unit(arrays: _Arrays) -> str | None:
    return _word(arrays, "unit", "") if "unit" in arrays else None


def _of_depth(stored: NDArray, arrays: _Arrays, decided: Decided) -> tuple[RangeView, _Turned]:
    scale = _number(arrays, "depth_scale", 1.0)
    if not (np.isfinite(scale) and scale > 0):
        raise InputError(
            f"its depth_scale is {scale:g}", hint="depth_scale is the number of depth steps in one unit"
        )
    depth = stored.astype(np.float32)
    if scale != 1:
        depth /= np.float32(scale)
    kind = cast(DepthKind, _word(arrays, "kind", "z"))
    view = RangeView(
        depth=depth,
        mask=measured_depths(stored, decided, () if stored.dtype.kind == "f" else (0,)),
        **_camera(arrays, depth.shape[0], depth.shape[1], kind, decided),
        world_to_camera=UPRIGHT if (stated := _world_to_camera(arrays)) is None else stated,
        name="camera",
        unit=_unit(arrays) or UNKNOWN_UNIT,
    )
    return view, _AS_THEY_ARE


def _of_grid(grid: NDArray, arrays: _Arrays, decided: Decided) -> tuple[RangeView, _Turned]:
    if grid.dtype.kind != "f":
        raise InputError(f"array 'xyz' is of type {grid.dtype}, expected floats")
    unit, stated = _unit(arrays) or UNKNOWN_UNIT, _world_to_camera(arrays)
    view = view_of_camera(grid, UPRIGHT if stated is None else stated, "camera", unit)
    if view is not None:
        note_fitted(view, decided)
        return view, _AS_THEY_ARE
    to_grid = np.eye(4) if stated is None else IMAGE_AXES @ stated
    view = view_of_grid(grid, to_grid, "scanner", unit)
    if is_seen_from_behind(view, to_grid):
        return view_of_grid(grid[_UPSIDE_DOWN], to_grid, "scanner", unit), _UPSIDE_DOWN
    return view, _AS_THEY_ARE


def _of_terrain(heights: NDArray, arrays: _Arrays, decided: Decided) -> tuple[RangeView, _Turned]:
    rows, columns = heights.shape
    if all(name in arrays for name in _EDGES):
        left, end, first, last = (_number(arrays, name) for name in _EDGES)
        right, down = (end - left) / columns, (last - first) / rows
    elif "dx" in arrays and "dy" in arrays:
        left, first, right, down = 0.0, 0.0, abs(_number(arrays, "dx")), -abs(_number(arrays, "dy"))
    else:
        raise InputError("has heights but no ground coordinates", hint="Add dx and dy, or xmin to ymax")
    there = np.isfinite(heights)
    span = float(np.ptp(heights[there])) if there.any() else 0.0
    size = right * columns, down * rows
    found = decide_ground(None, (left, first), size, span, decided.corrections)
    decided.note(found)
    degrees = found.value == DEGREES
    unit = _unit(arrays) or (METRE if degrees else UNKNOWN_UNIT)
    ground = Ground(left=left, first=first, right=right, down=down, degrees=degrees, unit=unit)
    return terrain_view(heights, there, ground, "terrain"), ground.turned


def _camera(arrays: _Arrays, height: int, width: int, kind: DepthKind, decided: Decided) -> dict[str, Any]:
    """The camera and the kind of depth, as fields of a view; an assumed camera if no array states one."""
    lens = tuple(_vector(arrays, "distortion").tolist()) if "distortion" in arrays else ()
    if stated := next((name for name in _MATRICES if name in arrays), None):
        matrix = _vector(arrays, stated, 9).reshape(3, 3)
        fx, fy, cx, cy = matrix[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
    elif missing := [name for name in _PINHOLE if name not in arrays]:
        if len(missing) < len(_PINHOLE) or kind == "height":
            raise InputError(f"its calibration lacks {', '.join(missing)}")
        return decide_view(None, (width, height), decided) | {"kind": kind, "distortion": lens}
    else:
        fx, fy, cx, cy = (_number(arrays, name) for name in _PINHOLE)
    pinhole = {"fx": fx, "fy": fy, "cx": cx + CENTER, "cy": cy + CENTER}
    camera = pinhole | {"kind": kind, "distortion": lens}
    return decide_view(camera, (width, height), decided, stated or "fx, fy, cx, cy") | {"kind": kind}


def _world_to_camera(arrays: _Arrays) -> NDArray[np.float64] | None:
    for name, made in (("pose", from_camera_to_world), ("world_to_camera", from_world_to_camera)):
        if name in arrays:
            return made(_vector(arrays, name, 16).reshape(4, 4))
    return None


def _colors(stored: NDArray, decided: Decided) -> NDArray[np.uint8]:
    """sRGB, (H, W, 3), of grey or colour with or without alpha."""
    if stored.ndim > 3 or stored.shape[2:] not in ((), (1,), (3,), (4,)):
        raise InputError(f"array 'color' has shape {stored.shape}, expected (H, W), (H, W, 3) or (H, W, 4)")
    if stored.dtype != np.uint8:
        stored = _in_bytes(stored, decided)
    colors = stored if stored.ndim == 3 else stored[..., None]
    return colors[..., :3] if colors.shape[2] >= 3 else colors.repeat(3, axis=2)


def _in_bytes(stored: NDArray, decided: Decided) -> NDArray[np.uint8]:
    """Colours on the scale of the scan in 8 bit, a few rows at a time."""
    full = settled_scale(stored.reshape(-1, stored.shape[-1] if stored.ndim == 3 else 1), decided)
    made = np.empty(stored.shape, np.uint8)
    for top in range(0, len(stored), _ROWS):
        rows = np.nan_to_num(stored[top : top + _ROWS].astype(np.float64)) * (255 / full)
        made[top : top + _ROWS] = np.rint(np.clip(rows, 0, 255))
    return made


def _numbers(array: StoredArray) -> NDArray:
    if array.dtype.kind not in "fiub":
        raise InputError(f"array '{array.name}' is of type {array.dtype}, expected numbers")
    values = array.read()
    return values.astype(values.dtype.newbyteorder("="), copy=False)


def _vector(arrays: _Arrays, name: str, length: int | None = None) -> NDArray[np.float64]:
    """The numbers of a small array, one after the other."""
    array = arrays[name]
    count = math.prod(array.shape)
    if count > _LONGEST or count != (length or count) or array.dtype.kind not in "fiu":
        raise InputError(f"array '{name}' is {array.shape} {array.dtype}, expected {length or 'few'} numbers")
    return array.read().ravel().astype(np.float64)


def _number(arrays: _Arrays, name: str, default: float = math.nan) -> float:
    return float(_vector(arrays, name, 1)[0]) if name in arrays else default


def _word(arrays: _Arrays, name: str, default: str) -> str:
    if name not in arrays:
        return default
    array = arrays[name]
    if array.dtype.kind not in "US" or math.prod(array.shape) != 1 or array.nbytes > _LONGEST:
        raise InputError(f"array '{name}' is {array.shape} {array.dtype}, expected a word")
    word = array.read().ravel()[0]
    return word.decode("utf-8", "replace") if isinstance(word, bytes) else str(word)
