"""Decides which arrays of a file are range images, and what belongs to them: colours, cameras and poses.

| array | shape |
|---|---|
| depth, heights of a terrain | (H, W), (S, H, W) |
| a grid of points | (H, W, 3), (S, H, W, 3) |
| colours, mask, confidence | the same, with 1, 3 or 4 numbers a pixel, which may come before the rows |
| camera, pose | one of all frames, or one a frame |

S counts frames. Axes of length 1 do not count. Names count in upper and lower case.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any, Literal, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...errors import EmptyFrame, InputError
from ..admission import MOST_FRAMES, check_count
from ..contents import ArrayInFile, StatedCamera
from .camera_files import cameras_of, field_of
from .corrections import NOTHING_CORRECTED, Corrections
from .record import Decision
from .sequence import Decided

Kind = Literal["depth", "xyz", "elevation"]
ArrayT = TypeVar("ArrayT", bound=ArrayInFile)

LONGEST = 1024  # numbers, or bytes of a word, where few are expected
_SOURCES: dict[Kind, tuple[str, ...]] = {  # the first one that is there makes the images
    "depth": (
        "depth", "depths", "depth_map", "depth_maps", "depthmap", "depthmaps", "depth_image", "depth_images",
        "depth_img", "depth_imgs", "depth_meters", "depth_m", "depth_mm",
    ),
    "xyz": ("xyz",),
    "elevation": ("elevation",),
}  # fmt: skip
IMAGE_ARRAYS = (*chain(*_SOURCES.values()),)
COLORS = ("color", "colors", "colour", "colours", "rgb", "rgbs", "image", "images", "img", "imgs")
_PARTNERS = {
    "color": COLORS,
    "mask": ("mask", "masks", "valid_mask", "valid_masks"),
    "confidence": ("confidence", "confidences", "conf", "confs", "depth_conf", "depth_confidence"),
}
_TO_WORLD = (
    "pose", "poses", "camera_pose", "camera_poses", "cam_pose", "cam_poses", "cam2world", "cam_to_world",
    "camera2world", "camera_to_world", "c2w", "cam_c2w", "t_wc", "world_from_camera",
)  # fmt: skip
_TO_CAMERA = (
    "world_to_camera", "world2camera", "world2cam", "world_to_cam", "w2c", "t_cw", "camera_from_world",
)  # fmt: skip
_EITHER = ("extrinsics", "extrinsic")  # to the camera by definition, but some programs mean the inverse
KEY = "extrinsics"
TO_CAMERA, TO_WORLD = "to-camera", "to-world"  # what `--read extrinsics=` takes
_CHANNELS = (3, 4)
_MATRICES = ((3, 3), (3, 4), (4, 4))
_POSES = ((4, 4), (3, 4), (16,), (12,))
_PINHOLE = ("fx", "f", "matrix")  # one of which a camera has


@dataclass(frozen=True)
class RangeArrays:
    """The range images of a file.

    kind: "depth", "xyz" or "elevation". source: the array of them. frames: how many. size: (H, W).
    partners: by "color", "mask" and "confidence", of any shape. arrays: all of the file, by lower case names.
    """

    kind: Kind
    source: ArrayInFile
    frames: int
    size: tuple[int, int]
    partners: Mapping[str, ArrayInFile]
    arrays: Mapping[str, ArrayInFile]


def range_arrays(arrays: Mapping[str, ArrayInFile]) -> RangeArrays | None:
    """The range images among the arrays; None where there are none. Raises InputError where their shape fits
    none."""
    by_name = {name.lower(): array for name, array in arrays.items()}
    found = _source(by_name)
    if found is None:
        return None
    kind, source = found
    deep = (3,) if kind == "xyz" else ()
    shape = source.shape
    inner = len(shape) - len(deep)
    fits = inner in (2, 3) and shape[inner:] == deep and (deep or inner == 2 or shape[-1] not in _CHANNELS)
    if not fits or len(shape) < 2:
        form = "(H, W, 3) or (S, H, W, 3)" if deep else "(H, W) or (S, H, W)"
        raise InputError(f"array '{source.name}' has shape {shape}, expected {form}")
    if 0 in shape:
        raise EmptyFrame(f"holds no pixels: array '{source.name}' has shape {shape}")
    frames = shape[0] if inner == 3 else 1
    check_count(frames, MOST_FRAMES, "frames")
    partners = {
        role: as_picture(by_name[name]) if role == "color" else _plain(by_name[name])
        for role, names in _PARTNERS.items()
        for name in names[::-1]
        if name in by_name
    }
    rows, columns = shape[inner - 2 : inner]
    return RangeArrays(kind, source, frames, (rows, columns), partners, by_name)


def image_source(arrays: Mapping[str, ArrayInFile]) -> str | None:
    """The name of the array that makes range images, None where none does."""
    found = _source({name.lower(): array for name, array in arrays.items()})
    return None if found is None else found[1].name


def states_a_camera(arrays: Mapping[str, ArrayInFile]) -> bool:
    """Whether an array by its name states the camera of depth."""
    return any(field_of(name) in _PINHOLE for name in arrays)


def _source(by_name: Mapping[str, ArrayInFile]) -> tuple[Kind, ArrayInFile] | None:
    """The array that makes the images, and its kind; a list of points is none."""
    for kind, names in _SOURCES.items():
        for name in names:
            if name in by_name and (array := _plain(by_name[name])).shape[1:] != (3,):
                return kind, array
    return None


def _plain(array: ArrayT) -> ArrayT:
    """The array without axes of length 1, but with two axes at least."""
    shape = array.shape
    if len(shape) <= 2 or 0 in shape:
        return array
    retained = tuple(length for length in shape if length > 1)
    return array.reshaped(retained) if len(retained) >= 2 else array


def as_picture(array: ArrayT) -> ArrayT:
    """The array of colours with the numbers of a pixel last."""
    array = _plain(array)
    shape = array.shape
    if len(shape) >= 3 and shape[-1] not in _CHANNELS and shape[-3] in _CHANNELS:
        return array.with_last(3)
    return array


class StatedArrays(NamedTuple):
    """Statements of small arrays about the camera of a frame.

    fields: numbers and words by the names that camera files have. names: of the arrays of the pinhole.
    """

    fields: dict[str, Any]
    names: tuple[str, ...]

    @property
    def has_pinhole(self) -> bool:
        """Whether they state any part of a pinhole."""
        return bool(self.names)

    @property
    def cameras(self) -> tuple[StatedCamera, ...]:
        """The cameras that they state, at least one, that of depth first. Raises InputError."""
        return cameras_of(self.fields, ", ".join(self.names))


def stated_arrays(images: RangeArrays, frame: int) -> StatedArrays:
    """Read the small arrays that state the camera of a frame. Raises InputError where one is unusable."""
    used = {images.source.name.lower(), *(array.name.lower() for array in images.partners.values())}
    fields: dict[str, Any] = {}
    pinhole = []
    for name, array in images.arrays.items():
        field = field_of(name)
        if field is None or field == "size" or name in used:
            continue
        fields[name] = _word(array) if field in ("unit", "kind", "model") else _numbers(images, array, frame)
        if field in (*_PINHOLE, "fy", "cx", "cy"):
            pinhole.append(array.name)
    return StatedArrays(fields, tuple(pinhole))


def _numbers(images: RangeArrays, array: ArrayInFile, frame: int) -> Any:
    """The numbers that a small array has for a frame: one number, or lists."""
    count = math.prod(array.shape)
    if not 0 < count <= max(LONGEST, 16 * images.frames) or array.dtype.kind not in "fiu":
        raise InputError(f"array '{array.name}' is {array.shape} {array.dtype}, expected few numbers")
    values = array.read().astype(np.float64)
    values = values.reshape([length for length in values.shape if length > 1])
    is_one_each = images.frames > 1 and values.ndim and len(values) == images.frames
    if is_one_each and not (values.shape in _MATRICES and _is_matrix(values)):
        values = values[frame]
    return values.ravel().tolist() if values.shape in _MATRICES else values.tolist()


def _is_matrix(values: NDArray[np.float64]) -> bool:
    """Whether numbers in the shape of a matrix are one, by the zeros beside its diagonal."""
    return not values[0, 1] and not values[1, 0]


def _word(array: ArrayInFile) -> str:
    if array.dtype.kind not in "US" or math.prod(array.shape) != 1 or array.dtype.itemsize > LONGEST:
        raise InputError(f"array '{array.name}' is {array.shape} {array.dtype}, expected a word")
    word = array.read().ravel()[0]
    return word.decode("utf-8", "replace") if isinstance(word, bytes) else str(word)


class StatedPose(NamedTuple):
    """The pose of a frame's camera in an image's axes.

    name: of its array. matrix: (4, 4). is_to_camera: whether it goes from the world to the camera.
    """

    name: str
    matrix: NDArray[np.float64]
    is_to_camera: bool


def stated_pose(images: RangeArrays, frame: int, decided: Decided) -> StatedPose | None:
    """The pose that the arrays state of a frame; None where they state none. Raises InputError."""
    name = next((name for name in (*_TO_WORLD, *_TO_CAMERA, *_EITHER) if name in images.arrays), None)
    if name is None:
        return None
    array = images.arrays[name]
    plain = _plain(array)
    is_each = plain.shape in [(images.frames, *shape) for shape in _POSES]
    if not (is_each or plain.shape in _POSES) or array.dtype.kind not in "fiu":
        expected = "16 numbers" if images.frames == 1 else "a matrix of 4 x 4 or 3 x 4 numbers a frame"
        raise InputError(f"array '{array.name}' is {array.shape} {array.dtype}, expected {expected}")
    rows = plain.read(frame if is_each else None).astype(np.float64).reshape(-1, 4)
    matrix = rows if len(rows) == 4 else np.vstack([rows, [0, 0, 0, 1]])
    is_to_camera = name in _TO_CAMERA
    if name in _EITHER:
        decided.note(decision := decide_extrinsics(array.name, decided.corrections))
        is_to_camera = decision.value == TO_CAMERA
    return StatedPose(array.name, matrix, is_to_camera)


def decide_extrinsics(name: str, corrections: Corrections = NOTHING_CORRECTED) -> Decision:
    """Whether the matrices in the array of this name lead from the world to the camera, or back."""
    if (by_user := corrections.decision(KEY)) is not None:
        return by_user
    why = f"Some programs store matrices from the camera to the world as '{name}'"
    return Decision(KEY, TO_CAMERA, "assumed", name, why, (TO_WORLD,), changes_numbers=True)
