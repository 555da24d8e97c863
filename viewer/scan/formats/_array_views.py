"""Range views from named arrays: depth, an organised grid of points, or the heights of a terrain.

`viewer/scan/reading/range_arrays.py` decides which arrays belong together, and has their names and shapes.

| array | what it is |
|---|---|
| `depth` | of the kind that `kind` states (z, range, height), any real; whole numbers: 0 is none |
| `depth_scale` | how many of its numbers are one unit; 1 where it is missing |
| `xyz` | instead: points in an image's axes, or with x right, y up and z towards the scanner |
| `elevation` | instead: heights of a terrain, in metres or the unit that `unit` states |
| `color` | sRGB on any scale, perhaps of another size |
| `mask`, `confidence` | above 0.01: use the depth; any real |
| `intrinsics` or `K`, or `fx` `fy` `cx` `cy` | pixels, the centre of the first one at 0, 0 |
| `width` `height` | of the pictures that these are for |
| `distortion` | as OpenCV has it |
| `pose`, or `world_to_camera` or `extrinsics` | to the world, or back, in an image's axes |
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
from ..reading.camera import decide_of_arrays, note_fitted
from ..reading.colors import settled_scale
from ..reading.depths import lying_over, measured_depths
from ..reading.ground import DEGREES, decide_ground
from ..reading.range_arrays import RangeArrays, StatedArrays, stated_arrays, stated_pose
from ..reading.sequence import Decided
from ..terrain import METRE, Ground, terrain_view
from ..units import usable_unit

_EDGES = ("xmin", "xmax", "ymin", "ymax")
_MOST_RATIO = 40  # of memory to the file: what is masked packs well
_BYTES = {"depth": 16, "elevation": 24, "xyz": 140}  # of memory for a pixel of a view, beside what is stored
_ROWS = 64  # of colours worked on together
_AS_THEY_ARE = (slice(None), slice(None))
_UPSIDE_DOWN = (slice(None, None, -1), slice(None))

_Turned = tuple[slice, slice]  # rows and columns of a view in those of its file


def view_of_arrays(images: RangeArrays, held: int, frame: int, decided: Decided) -> RangeView:
    """The range view of a frame of a file of `held` bytes. Raises InputError."""
    shares = {role: _share(images, role) for role in images.partners}
    share = frame if images.frames > 1 else None
    stored = images.source.memory(share)
    stored += sum(
        images.partners[role].memory(frame if of_frame else None) for role, of_frame in shares.items()
    )
    admit(held, stored + math.prod(images.size) * _BYTES[images.kind], _MOST_RATIO)
    made = {role: _partner(images, role, frame if of_frame else None) for role, of_frame in shares.items()}
    said = stated_arrays(images, frame)
    make = {"depth": _of_depth, "xyz": _of_grid, "elevation": _of_terrain}[images.kind]
    view, turned = make(_numbers(images.source, share), images, said, frame, decided)
    changes: dict[str, Any] = {}
    if "mask" in made:
        changes["mask"] = view.mask & mask_of(made["mask"][turned])
    if "color" in made and (color := lying_over(made["color"], view.depth, "colours", decided)) is not None:
        changes["color"] = np.ascontiguousarray(_colors(color, decided)[turned])
    if "confidence" in made:
        changes["confidence"] = made["confidence"][turned].astype(np.float32)
    return replace(view, **changes)


def colors_of_arrays(images: RangeArrays, frame: int) -> NDArray | None:
    """The colours of a frame as stored, (N, C); None where there are none. Raises InputError."""
    if "color" not in images.partners:
        return None
    stored = _partner(images, "color", frame if _share(images, "color") else None)
    return stored.reshape(-1, stored.shape[-1] if stored.ndim == 3 else 1)


def unit_of_arrays(images: RangeArrays, held: int, decided: Decided) -> str | None:
    """The name of the unit of length of the views of a file of `held` bytes, or None. Raises InputError.

    This reads the heights of a terrain to find out whether its ground is in degrees.
    """
    if images.kind == "elevation" and "unit" not in images.arrays:
        return view_of_arrays(images, held, 0, decided).unit
    stated = stated_arrays(images, 0).fields.get("unit")
    return None if stated is None else str(stated)


def _share(images: RangeArrays, role: str) -> bool:
    """Whether a partner has an entry for each frame. Raises InputError where its shape does not fit."""
    array = images.partners[role]
    shape = array.shape
    is_color = role == "color"
    inner = shape[1:] if images.frames > 1 and shape[:1] == (images.frames,) and len(shape) > 2 else shape
    is_each = len(inner) < len(shape)
    if is_each and is_color and len(shape) == 3 and shape[-1] in (3, 4):  # of all frames, with so many rows
        inner, is_each = shape, False
    fits = inner[:2] == images.size and len(inner) == 2
    if is_color:
        fits = len(inner) == 2 or (len(inner) == 3 and inner[2] in (1, 3, 4))
    if not fits:
        source = images.source
        of_source = f"but '{source.name}' has shape {source.shape}"
        if is_color:
            of_source = "expected (H, W), (H, W, 3) or (H, W, 4)"
        raise InputError(f"array '{array.name}' has shape {shape}, {of_source}")
    return is_each


def _partner(images: RangeArrays, role: str, share: int | None) -> NDArray:
    return _numbers(images.partners[role], share)


def _of_depth(
    stored: NDArray, images: RangeArrays, said: StatedArrays, frame: int, decided: Decided
) -> tuple[RangeView, _Turned]:
    scale, camera = _camera(stored, said, decided)
    depth = stored.astype(np.float32)
    if scale != 1:
        depth /= np.float32(scale)
    view = RangeView(
        depth=depth,
        mask=measured_depths(stored, decided, () if stored.dtype.kind == "f" else (0,)),
        **camera,
        world_to_camera=UPRIGHT if (stated := _world_to_camera(images, frame, decided)) is None else stated,
        name="camera",
        unit=_unit(said) or UNKNOWN_UNIT,
    )
    return view, _AS_THEY_ARE


def _of_grid(
    grid: NDArray, images: RangeArrays, said: StatedArrays, frame: int, decided: Decided
) -> tuple[RangeView, _Turned]:
    if grid.dtype.kind != "f":
        raise InputError(f"array '{images.source.name}' is of type {grid.dtype}, expected floats")
    unit, stated = _unit(said) or UNKNOWN_UNIT, _world_to_camera(images, frame, decided)
    view = view_of_camera(grid, UPRIGHT if stated is None else stated, "camera", unit)
    if view is not None:
        note_fitted(view, decided)
        return view, _AS_THEY_ARE
    to_grid = np.eye(4) if stated is None else IMAGE_AXES @ stated
    view = view_of_grid(grid, to_grid, "scanner", unit)
    if is_seen_from_behind(view, to_grid):
        return view_of_grid(grid[_UPSIDE_DOWN], to_grid, "scanner", unit), _UPSIDE_DOWN
    return view, _AS_THEY_ARE


def _of_terrain(
    heights: NDArray, images: RangeArrays, said: StatedArrays, frame: int, decided: Decided
) -> tuple[RangeView, _Turned]:
    (rows, columns), arrays = heights.shape, images.arrays
    if all(name in arrays for name in _EDGES):
        left, end, first, last = (_number(arrays, name) for name in _EDGES)
        right, down = (end - left) / columns, (last - first) / rows
    elif "dx" in arrays and "dy" in arrays:
        left, first, right, down = 0.0, 0.0, abs(_number(arrays, "dx")), -abs(_number(arrays, "dy"))
    else:
        raise InputError(
            "has heights, but no ground coordinates",
            hint="Add the arrays dx and dy, or xmin, xmax, ymin and ymax",
        )
    there = np.isfinite(heights)
    span = float(np.ptp(heights[there])) if there.any() else 0.0
    size = right * columns, down * rows
    found = decide_ground(None, (left, first), size, span, decided.corrections)
    decided.note(found)
    degrees = found.value == DEGREES
    unit = _unit(said) or (METRE if degrees else UNKNOWN_UNIT)
    ground = Ground(left=left, first=first, right=right, down=down, degrees=degrees, unit=unit)
    return terrain_view(heights, there, ground, "terrain"), ground.turned


def _camera(stored: NDArray, said: StatedArrays, decided: Decided) -> tuple[float, dict[str, Any]]:
    """The scale of depth, and the camera as fields of a view; an assumed camera if no array states one."""
    kind, lens = str(said.fields.get("kind", "z")), said.fields.get("distortion", ())
    size, is_whole = (stored.shape[1], stored.shape[0]), stored.dtype.kind != "f"
    if said.has_pinhole or kind == "height":
        camera = decide_of_arrays(said.cameras, size, decided, is_whole).camera
        return camera.depth_scale, camera.of_view
    without = StatedArrays(said.fields | {"fx": 1.0, "fy": 1.0, "cx": 0.0, "cy": 0.0}, ())
    (stated,) = without.cameras  # for what it says besides
    camera = decide_of_arrays((), size, decided, is_whole, stated.depth_scale).camera
    found = camera.of_view | {"kind": cast(DepthKind, kind), "distortion": tuple(lens)}
    return camera.depth_scale, found


def _world_to_camera(images: RangeArrays, frame: int, decided: Decided) -> NDArray[np.float64] | None:
    stated = stated_pose(images, frame, decided)
    if stated is None:
        return None
    return from_world_to_camera(stated.matrix) if stated.is_to_camera else from_camera_to_world(stated.matrix)


def _unit(said: StatedArrays) -> str | None:
    return usable_unit(said.fields.get("unit"))


def _colors(stored: NDArray, decided: Decided) -> NDArray[np.uint8]:
    """sRGB, (H, W, 3), of grey or colour with or without alpha."""
    if stored.dtype != np.uint8:
        stored = _in_bytes(stored, decided)
    colors = stored if stored.ndim == 3 else stored[..., None]
    return colors[..., :3] if colors.shape[2] >= 3 else colors.repeat(3, axis=2)


def _in_bytes(stored: NDArray, decided: Decided) -> NDArray[np.uint8]:
    """Colours on the scale of the scan in 8 bit, a few rows at a time."""
    values = stored.reshape(-1, stored.shape[-1] if stored.ndim == 3 else 1)
    full = settled_scale(values, decided, decided.other_colors)
    made = np.empty(stored.shape, np.uint8)
    for top in range(0, len(stored), _ROWS):
        rows = np.nan_to_num(stored[top : top + _ROWS].astype(np.float64)) * (255 / full)
        made[top : top + _ROWS] = np.rint(np.clip(rows, 0, 255))
    return made


def _numbers(array: Any, share: int | None) -> NDArray:
    if array.dtype.kind not in "fiub":
        raise InputError(f"array '{array.name}' is of type {array.dtype}, expected numbers")
    values = array.read(share)
    return values.astype(values.dtype.newbyteorder("="), copy=False)


def _number(arrays: Mapping[str, Any], name: str) -> float:
    array = arrays[name]
    if math.prod(array.shape) != 1 or array.dtype.kind not in "fiu":
        raise InputError(f"array '{name}' is {array.shape} {array.dtype}, expected 1 numbers")
    return float(array.read().ravel()[0])
