"""Small files beside depth pictures that state their camera, in the forms that recorders write.

| form | written by |
|---|---|
| JSON: `fx fy cx cy`, or a matrix | Open3D, RealSense, Record3D, Polycam, ARKit |
| JSON of the raw calibration of an Azure Kinect | k4arecorder |
| YAML: `camera_matrix` with `data`, or `Camera.fx` | ROS, OpenCV, ORB-SLAM |
| lines `name = value`, `name: value` or `name,value` | ScanNet, 7-Scenes, RealSense |
| a 3 x 3, 3 x 4 or 4 x 4 matrix; or `fx fy cx cy` and perhaps the lens | ScanNet, Stray Scanner, TUM, ETH3D |
| `cameras.txt`: an id, a model, a size and parameters a line | COLMAP |

A file may state several cameras: one a mode of the sensor, or one a size of picture. Scan4D lists the depth
camera before the colour camera. Nothing here reads a file.
"""

from __future__ import annotations

import fnmatch
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, shortened, unknown_name
from ...files import parsed_json
from ..contents import StatedCamera
from ..range_view import DepthKind

FORM = "A camera file has fx, fy, cx and cy in pixels, and for depth pictures depth_scale and unit"
PINHOLE = ("fx", "fy", "cx", "cy")

# Patterns of names, the better file first. Only the first group must hold a camera: the other names are
# common, so a file of another content is no error.
OWN_NAMES = ("camera-intrinsics.txt", "camera.json", "camera.txt")
_SURE_NAMES = (
    "camera_intrinsics.json", "camera_intrinsic.json", "camera-intrinsics.json", "intrinsic_depth.txt",
    "depth_intrinsic*.json", "depth_intrinsic*.txt", "intrinsic.json", "intrinsics.json", "intrinsic.txt",
    "intrinsics.txt", "intrinsics.csv", "intrinsics.yaml", "intrinsics.yml", "camera_matrix.csv",
    "depth_camera_info.yaml", "camera_info.yaml", "camera.yaml", "camera.yml", "k.txt",
)  # fmt: skip
_OTHER_NAMES = (
    "info.txt", "_info.txt", "*_info.txt", "scene*.txt", "calib*.json", "calib*.yaml", "calib*.yml",
    "calib*.txt", "cameras.txt", "metadata.json", "metadata", "transforms.json", "*depth*metadata*.csv",
    "*metadata*depth*.csv", "*depth*metadata*.txt", "*metadata*depth*.txt", "*_metadata.csv",
    "*_metadata.txt", "cam_params.json", "*intrinsic*.json", "*intrinsic*.txt", "*camera*.json",
)  # fmt: skip
FOLDERS = ("intrinsic", "intrinsics")  # which may hold these files instead

_STRAY_SIZE = (1920, 1440)  # of the film that camera_matrix.csv belongs to, which holds no size
_ALIASES = {
    "fx": ("fx", "focalx", "focallengthx", "flx", "fxpx"),
    "fy": ("fy", "focaly", "focallengthy", "fly", "fypx"),
    "f": ("f", "focal", "focallength"),
    "cx": ("cx", "ppx", "principalx", "principalpointx", "mx", "centerx"),
    "cy": ("cy", "ppy", "principaly", "principalpointy", "my", "centery"),
    "matrix": (
        "k", "matrix", "cameramatrix", "intrinsicmatrix", "intrinsics", "intrinsic", "cameraintrinsics",
        "cameraintrinsic", "calibrationintrinsic", "intrinsicsmatrix",
    ),
    "width": ("width", "w", "imagewidth", "resolutionx", "cols"),
    "height": ("height", "h", "imageheight", "resolutiony", "rows"),
    "size": ("size", "resolution", "imagesize"),
    "distortion": (
        "distortion", "coeffs", "coefficients", "d", "distortioncoefficients", "distortioncoeffs",
        "distcoeffs",
    ),
    "depth_scale": ("depthscale", "depthunits", "depthshift", "depthfactor", "depthmapfactor", "factordepth"),
    "kind": ("kind",),
    "unit": ("unit",),
    "model": ("model", "distortionmodel", "distorsion"),
}  # fmt: skip
_PREFIXES = ("mcalibrationdepth", "mdepth", "depth", "camera1", "camera", "cam", "m")
_COLOR = 2  # in the order of cameras: the last
_LENS_NAMES = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
_FIELD_OF = {name: name for name in _LENS_NAMES} | {
    alias: field for field, aliases in _ALIASES.items() for alias in aliases
}
_COLOR_WORDS = re.compile(r"colou?r|rgb", re.IGNORECASE)
_FISHEYE = ("equidistant", "fisheye", "kannala", "thinprism", "omni", "ftheta")
_COUNTS = (0, 4, 5, 8)  # of lens coefficients
_COLMAP = {  # the places of fx fy cx cy, and of the lens
    "SIMPLE_PINHOLE": "f cx cy", "PINHOLE": "fx fy cx cy", "SIMPLE_RADIAL": "f cx cy k1",
    "RADIAL": "f cx cy k1 k2", "OPENCV": "fx fy cx cy k1 k2 p1 p2",
    "FULL_OPENCV": "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6",
}  # fmt: skip
_KINECT_MODES = (  # sizes of the depth pictures of an Azure Kinect, of the binned sensor, and the crop
    ((640, 576), (1024, 1024), (192, 180)),
    ((320, 288), (512, 512), (96, 90)),
    ((512, 512), (512, 512), (0, 0)),
    ((1024, 1024), (1024, 1024), (0, 0)),
)
_KINECT_COLOR = ((1280, 720), (1920, 1080), (2560, 1440), (3840, 2160), (2048, 1536), (4096, 3072))
_KINECT_LENS = (4, 5, 13, 12, 6, 7, 8, 9)  # where k1 k2 p1 p2 k3 k4 k5 k6 stand among its parameters


def camera_names(names: Iterable[str]) -> list[str]:
    """The names among those of a folder that may state its camera, the better file first.

    Files of the colour camera come last.
    """
    found = [
        (bool(_COLOR_WORDS.search(name)), rank, name)
        for name in names
        for rank, pattern in enumerate((*OWN_NAMES, *_SURE_NAMES, *_OTHER_NAMES))
        if fnmatch.fnmatchcase(name.lower(), pattern)
    ]
    return list(dict.fromkeys(name for *_, name in sorted(found)))


def must_state_a_camera(name: str) -> bool:
    """Whether a file of this name can be nothing else."""
    return any(fnmatch.fnmatchcase(name.lower(), pattern) for pattern in (*OWN_NAMES, *_SURE_NAMES))


def stated_cameras(name: str, text: str) -> tuple[StatedCamera, ...]:
    """The cameras that the text of a file states, the likeliest first, at least one.

    Raises InputError, without the file's name, where it states none.
    """
    text = text.removeprefix("\ufeff")
    try:
        found = tuple(_cameras(name, text))
    except (ValueError, OverflowError) as error:
        raise InputError(f"is not a calibration: {shortened(str(error))}", hint=FORM) from error
    if not found:
        raise InputError("is not a calibration: it states no camera", hint=FORM)
    by_scale = next((one.depth_scale for one in found if one.depth_scale is not None), None)
    return tuple(
        replace(one, where=name, depth_scale=by_scale if one.depth_scale is None else one.depth_scale)
        for one in found
    )


def camera_of(stored: Mapping[str, Any], where: str = "") -> StatedCamera:
    """The camera that an object states by the names of its fields. Raises InputError where it states none."""
    return replace(_checked(_fields(stored)), where=where)


def cameras_of(stored: Mapping[str, Any], where: str = "") -> tuple[StatedCamera, ...]:
    """The cameras that an object states by the names of its fields, at least one, that of depth first. Raises
    InputError where it states none."""
    return tuple(replace(one, where=where) for one in _of_object(stored))


def _cameras(name: str, text: str) -> Iterator[StatedCamera]:
    suffix = name.lower().rpartition(".")[2] if "." in name else ""
    if suffix == "json" or text.lstrip()[:1] == "{":
        try:
            stored = parsed_json(text)
        except ValueError as error:
            raise InputError(f"is not JSON: {shortened(str(error))}") from error
        if not isinstance(stored, dict):
            raise InputError("is not a JSON object")
        yield from _of_object(stored)
    elif suffix in ("yaml", "yml"):
        yield from _of_object(_parsed_yaml(text))
    else:
        yield from _of_text(name, text)


def _of_text(name: str, text: str) -> Iterator[StatedCamera]:
    lines = [line.strip() for line in text.splitlines()]
    rows = [line for line in lines if line and not line.startswith(("#", "//", "%"))]
    words = [[word for word in re.split(r"[\s,;\[\]()]+", row) if word] for row in rows]
    if any(len(row) > 4 and row[1] in _COLMAP for row in words):
        yield from (_of_colmap(row) for row in words if len(row) > 4 and row[1] in _COLMAP)
    elif named := _named_values(rows):
        yield from _of_object(named)
    else:
        numbers = [[float(word) for word in row] for row in words]
        if name.lower().endswith(".pincam"):  # of ARKitScenes: the size comes first
            (row,) = numbers
            yield _checked(dict(zip(("width", "height", *PINHOLE), row, strict=True)))
        elif name.lower() == "camera_matrix.csv":
            yield replace(_of_numbers(numbers), width=_STRAY_SIZE[0], height=_STRAY_SIZE[1])
        else:
            yield _of_numbers(numbers)


def _named_values(rows: Sequence[str]) -> dict[str, Any]:
    """Values by name of lines such as `fx = 290` and `PPx,159.5`; none where a line begins with a number."""
    found: dict[str, Any] = {}
    if len(rows) == 2 and (table := _head_and_row(*rows)):
        return table
    for row in rows:
        match = re.match(r"([A-Za-z_][\w .\-()]*?)\s*[=:,;\t]\s*(.*)$", row) or re.match(
            r"([A-Za-z_]\w*)\s+(.*)$", row
        )
        if match is None:
            continue
        name, rest = match.groups()
        words = [word for word in re.split(r"[\s,;\[\]]+", rest) if word]
        try:
            numbers = [float(word) for word in words]
        except ValueError:
            found.setdefault(name, rest)
            continue
        if numbers:
            found.setdefault(name, numbers[0] if len(numbers) == 1 else numbers)
    return found


def _head_and_row(head: str, row: str) -> dict[str, Any]:
    """The numbers of a row below as many names; none where it is no such table."""
    names, words = (re.findall(r"[^\s,;]+", line) for line in (head, row))
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        return {}
    is_table = len(names) == len(numbers) and all(re.match(r"[A-Za-z_]", name) for name in names)
    return dict(zip(names, numbers, strict=True)) if is_table else {}


def _of_colmap(row: Sequence[str]) -> StatedCamera:
    names = _COLMAP[row[1]].split()
    numbers = dict(zip(names, map(float, row[4:]), strict=False))
    camera = _checked({"width": float(row[2]), "height": float(row[3])} | _lens_joined(numbers))
    return _from_corner(camera)


def _of_numbers(rows: Sequence[Sequence[float]]) -> StatedCamera:
    numbers = [number for row in rows for number in row]
    is_matrix = [len(row) for row in rows] in ([3] * 3, [4] * 4, [4] * 3)
    is_in_a_row = len(numbers) in (9, 12, 16) and not numbers[1] and numbers[0] > 0 and len(rows) == 1
    if is_matrix or (is_in_a_row and numbers[8 if len(numbers) == 9 else 10] == 1):
        return _checked(_pinhole_of(np.array(numbers).reshape(4 if len(numbers) == 16 else 3, -1)))
    if len(numbers) < 4:
        raise InputError(f"is not a calibration: it has {len(numbers)} numbers", hint=FORM)
    return _checked(dict(zip(PINHOLE, numbers, strict=False)) | {"distortion": numbers[4:]})


def _of_object(stored: Mapping[str, Any]) -> Iterator[StatedCamera]:
    """The cameras of a JSON object: in its own fields, and in the objects inside it."""
    if isinstance(stored.get("CalibrationInformation"), dict):
        yield from _of_kinect(stored["CalibrationInformation"])
        return
    of_color = {key: value for key, value in stored.items() if _COLOR_WORDS.search(key)}
    fields = _fields({key: value for key, value in stored.items() if key not in of_color})
    scale = {"depth_scale": fields["depth_scale"]} if "depth_scale" in fields else {}
    cameras = [(0, fields)] if _has_pinhole(fields) else []
    inner = [(_order(key), scale | of_key) for key, of_key in _inner(stored) if _has_pinhole(of_key)]
    cameras += sorted(inner, key=lambda one: one[0])
    flat = {_COLOR_WORDS.sub("", key): value for key, value in of_color.items()}
    if _has_pinhole(of_colors := _fields(flat)):
        cameras.append((_COLOR, scale | of_colors))
    for order, stated in cameras or [(0, fields)]:
        camera = replace(_checked(stated), is_color=order == _COLOR)
        yield _from_corner(camera) if "fl_x" in stored else camera


def _inner(stored: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """The fields of all objects inside an object, with the names that lead to them.

    An object that gives the object around it a camera, such as `intrinsics`, is passed over.
    """
    for key, value in stored.items():
        if field_of(key) is not None and not _COLOR_WORDS.search(key) and _has_pinhole(_fields(value)):
            continue
        for one in value if isinstance(value, list) else [value]:
            if isinstance(one, dict):
                yield f"{path} {key}", _fields(one)
                yield from _inner(one, f"{path} {key}")


def _order(path: str) -> int:
    """Depth cameras first, colour cameras last."""
    if _COLOR_WORDS.search(path):
        return _COLOR
    return 0 if re.search(r"depth|ir|left", path, re.IGNORECASE) else 1


def _has_pinhole(fields: Mapping[str, Any]) -> bool:
    return "fx" in fields or "f" in fields


def _of_kinect(stored: Mapping[str, Any]) -> Iterator[StatedCamera]:
    """The depth camera of an Azure Kinect in each of its modes, then the colour camera in each of its own.

    Its numbers are parts of the sensor's width and height, from its corner.
    """
    cameras = [one for one in stored.get("Cameras", ()) if isinstance(one, dict)]
    for is_color, purpose in ((False, "Depth"), (True, "PhotoVideo")):
        one = next((camera for camera in cameras if str(camera.get("Purpose")).endswith(purpose)), None)
        if one is None:
            continue
        numbers = _numbers("ModelParameters", (one.get("Intrinsics") or {}).get("ModelParameters"))
        if len(numbers) < 14:
            raise InputError(f"is not a calibration: it has {len(numbers)} ModelParameters, expected 14")
        cx, cy, fx, fy = numbers[:4]
        lens = tuple(numbers[at] for at in _KINECT_LENS)
        for size, (width, height), (left, top) in _kinect_modes(is_color):
            pinhole = {
                "fx": fx * width, "fy": fy * height,
                "cx": cx * width - left - 0.5, "cy": cy * height - top - 0.5,
            }  # fmt: skip
            camera = _checked(pinhole | {"width": size[0], "height": size[1], "distortion": lens})
            yield replace(camera, is_color=is_color, depth_scale=1000.0, unit="m")


def _kinect_modes(is_color: bool) -> Iterator[tuple[tuple[int, int], tuple[int, int], tuple[int, int]]]:
    if not is_color:
        yield from _KINECT_MODES
        return
    for width, height in _KINECT_COLOR:  # all of them are as wide as the sensor, which is 4 : 3
        whole = width * 3 // 4
        yield (width, height), (width, whole), (0, (whole - height) // 2)


def field_of(key: str) -> str | None:
    """The field of a camera that a name means, None where it means none: `ppx` is cx."""
    word = re.sub(r"[^a-z0-9]", "", key.lower())
    shorter = [word, word.removesuffix("depth"), word.removesuffix("px")]
    shorter += [word[len(prefix) :] for prefix in _PREFIXES if word.startswith(prefix)]
    return next((_FIELD_OF[short] for short in shorter if short in _FIELD_OF), None)


def _fields(stored: Any) -> dict[str, Any]:
    """The known fields of an object by their own names: fx, fy, cx, cy, width, … ; lens coefficients in
    their order. A matrix gives the pinhole, unless the object states it by number as well."""
    if not isinstance(stored, Mapping):
        return {}
    found: dict[str, Any] = {}
    for key, value in stored.items():
        field = field_of(key)
        if field in _LENS_NAMES and not isinstance(value, int | float):
            continue  # KITTI's P1 is a matrix
        if field is not None:
            found.setdefault(field, value)
    matrix = found.pop("matrix", None)
    if matrix is not None:
        found = _of_matrix(matrix) | found
    if isinstance(size := found.pop("size", None), list) and len(size) == 2:
        found = {"width": size[0], "height": size[1]} | found
    if isinstance(found.get("distortion"), dict):
        inner = found.pop("distortion")
        found |= {"distortion": inner["data"]} if "data" in inner else _fields(inner)
    return _lens_joined(found)


def _lens_joined(found: dict[str, Any]) -> dict[str, Any]:
    """Single coefficients of a lens as one list; the focal length of both axes as two."""
    joined = {name: value for name, value in found.items() if name not in _LENS_NAMES}
    if single := [name for name in _LENS_NAMES if name in found]:
        last = max(_LENS_NAMES.index(name) for name in single)
        count = next(count for count in _COUNTS if count > last)
        joined.setdefault("distortion", [found.get(name, 0.0) for name in _LENS_NAMES[:count]])
    if "f" in joined:
        focal = joined.pop("f")
        joined.setdefault("fx", focal)
        joined.setdefault("fy", focal)
    return joined


def _of_matrix(value: Any) -> dict[str, Any]:
    """The pinhole of what stands under the name of a matrix: numbers in any nesting, an object of its
    fields, or an object with `data`."""
    if isinstance(value, Mapping):
        return _pinhole_of(value["data"]) if "data" in value else _fields(value)
    return _pinhole_of(value)


def _pinhole_of(value: Any) -> dict[str, Any]:
    """fx, fy, cx and cy of a matrix of 9, 12 or 16 numbers, or of themselves.

    A matrix may be stored by rows or by columns: its zeros tell.
    """
    try:
        numbers = np.array(value, np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.size == 4 and numbers.ndim == 1:
        return dict(zip(PINHOLE, numbers.tolist(), strict=True))
    if numbers.size not in (9, 12, 16):
        raise InputError(f"the matrix has shape {numbers.shape}, expected 9 numbers, or 12 or 16")
    matrix = numbers.reshape((4, 4) if numbers.size == 16 else (3, -1))
    if _is_by_columns(matrix):
        matrix = matrix.T
    return dict(zip(PINHOLE, matrix[[0, 1, 0, 1], [0, 1, 2, 2]].tolist(), strict=True))


def _is_by_columns(matrix: NDArray[np.float64]) -> bool:
    """Whether the last row of a matrix holds what belongs into its third column."""
    return bool(matrix.shape[0] == matrix.shape[1] and matrix[2, :2].any() and not matrix[:2, 2].any())


def _from_corner(camera: StatedCamera) -> StatedCamera:
    """The camera of a program that counts pixels from the corner of the first one."""
    return replace(camera, cx=camera.cx - 0.5, cy=camera.cy - 0.5)


def _checked(stated: Mapping[str, Any]) -> StatedCamera:
    """The camera of these fields. Raises InputError that says what is wrong."""
    if missing := [name for name in PINHOLE if name not in stated]:
        raise InputError(f"is not a calibration: it lacks {', '.join(missing)}", hint=FORM)
    fx, fy, cx, cy = (_number(name, stated[name]) for name in PINHOLE)
    if min(fx, fy) <= 0:
        raise InputError(f"is not a calibration: fx is {fx:g} and fy {fy:g}", hint=FORM)
    scale = stated.get("depth_scale")
    return StatedCamera(
        fx=fx,
        fy=fy,
        cx=cx,
        cy=cy,
        distortion=_lens(stated),
        kind=_kind(stated["kind"]) if "kind" in stated else None,
        depth_scale=_depth_scale(scale) if "depth_scale" in stated else None,
        unit=str(stated["unit"]) if "unit" in stated else None,
        width=_pixels("width", stated.get("width")),
        height=_pixels("height", stated.get("height")),
    )


def _lens(stated: Mapping[str, Any]) -> tuple[float, ...]:
    """The coefficients of the lens; none where all are 0. Raises InputError."""
    values = stated.get("distortion", ())
    if not isinstance(values, list | tuple):
        values = _words_of_lens(values)
    lens = tuple(_number("distortion", value) for value in values)
    model = re.sub(r"[^a-z]", "", str(stated.get("model", "")).lower())
    if not any(lens):
        return ()
    if any(word in model for word in _FISHEYE):
        raise InputError(
            f"the lens model is {shortened(stated['model'])}, whose distortion Scan4D cannot correct"
        )
    while len(lens) > max(_COUNTS) and lens[-1] == 0:
        lens = lens[:-1]
    if len(lens) not in _COUNTS:
        raise InputError(f"has {len(lens)} distortion coefficients, expected 4, 5 or 8")
    return lens


def _words_of_lens(value: Any) -> Sequence[Any]:
    """A name of a model is no list of coefficients, and no error."""
    if isinstance(value, str):
        return ()
    raise InputError("the distortion must be a list of numbers")


def _kind(value: Any) -> DepthKind:
    if value not in (kinds := get_args(DepthKind)):
        raise unknown_name("kind of depth", shortened(value), kinds)
    kind: DepthKind = value
    return kind


def _depth_scale(value: Any) -> float:
    """Steps in one unit; a number below 1 is the length of a step, as RealSense states it."""
    scale = _number("depth_scale", value)
    if scale <= 0:
        hint = (
            "depth_scale is the number of depth steps in one unit, such as 1000 for millimetres where "
            "the unit is m"
        )
        raise InputError(f"the depth_scale is {scale:g}, but must be a finite number above 0", hint=hint)
    return float(f"{1 / scale:.6g}") if scale < 1 else scale


def _pixels(name: str, value: Any) -> int | None:
    """A width or a height of pictures, None where it is no such number."""
    if value is None:
        return None
    number = _number(name, value)
    return int(number) if number >= 1 else None


def _number(name: str, value: Any) -> float:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (is_number and math.isfinite(value)):
        raise InputError(f"is not a calibration: {name} is {shortened(value)}", hint=FORM)
    return float(value)


def _numbers(name: str, values: Any) -> list[float]:
    if not isinstance(values, list):
        raise InputError(f"is not a calibration: {name} is {shortened(values)}", hint=FORM)
    return [_number(name, value) for value in values]


def _parsed_yaml(text: str) -> dict[str, Any]:
    """The values by name of a calibration in YAML: two levels of names, numbers and lists of numbers.

    Other YAML is passed over: calibrations use no more, and Scan4D needs no library for it.
    """
    joined = re.sub(r"\[[^\]]*\]", lambda match: re.sub(r"\s+", " ", match.group()), text)
    found: dict[str, Any] = {}
    inner: dict[str, Any] = found
    last: tuple[dict[str, Any], str] | None = None
    for line in joined.splitlines():
        line = re.sub(r"\s#.*$|^#.*$|^%.*$|^---.*$", "", line).rstrip()
        item = re.match(r"\s*-\s+(\S+)$", line)
        if item and last is not None:  # a list of one number a line
            holder, name = last
            known = holder.get(name)
            holder[name] = [*(known if isinstance(known, list) else []), _yaml_value(item.group(1))]
            continue
        match = re.match(r"(\s*)([\w.\-]+)\s*:\s*(.*)$", line)
        if match is None:
            continue
        indent, name, value = match.groups()
        holder = inner if indent else found
        last = (holder, name)
        if value and not value.startswith("!!"):
            holder[name] = _yaml_value(value)
        elif not indent:
            inner = found[name] = {}
    return found


def _yaml_value(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        pass
    try:  # such as 1. or .5, which JSON does not have
        if text.startswith("["):
            return [float(word) for word in re.split(r"[\s,]+", text.strip("[] ")) if word]
        return float(text)
    except ValueError:
        return text.strip("\"'")
