"""EXR: range views, one multi-part OpenEXR file a frame, a part a pod.

A part has the pod's name, the channels `Z` (float, depth in scan units), and where there are such
`R G B` (half, linear), `mask` (half, 1: use the depth), `confidence` (float) and `X Y` (float, measured x and
y in the pod's camera space), and the attributes

- `kind` (string): of depth, `z`, `range` or `height` as `RangeView` has them; without it, `z`;
- `fx fy cx cy` (double): pixels, pixel centres at +0.5, from the upper left corner of the display window;
- `k1 k2 p1 p2 k3 k4 k5 k6` (double): the lens' distortion, the first 4, 5 or 8 of these;
- `color` (string): `srgb8` where the colours were 8 bit, to which they go back;
- `worldToCamera`, `worldToNDC` (m44f) as OpenEXR's standard attributes: matrices for row vectors; camera
  space is left-handed and looks down +z; NDC runs from 0, 0 in the upper left corner to 1, 1;
- `worldToCamera64` (m44d): worldToCamera in double precision, since float32 cannot place a pod at UTM
  coordinates; it counts where it is there;
- `unit` (string): the name of the unit of length; `assumed` (string): what of all this was assumed.

Pictures with depth that other programs have written open as well; see `_exr_renders`.
"""

from __future__ import annotations

import math
import operator
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from threading import get_ident
from typing import Any, BinaryIO, TextIO, cast

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...native import OPENEXR, unsaid
from ..admission import MOST_MEMBERS, admit, check_count, opened, read_exactly, size_of
from ..colors import linear_from_srgb8, srgb8_from_linear
from ..points import UNKNOWN_UNIT
from ..range_view import DepthKind, RangeView, mask_of, memory_of_merging
from ..reading.sequence import Decided
from ..units import usable_unit
from ._exr_renders import rendered_eyes, view_of_eye

TITLE = "EXR"
SUFFIXES = (".exr",)

_PINHOLE = ("fx", "fy", "cx", "cy")
_LENS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
_SRGB8 = "srgb8"
_FORM = (
    "Each part of an EXR range scan needs the channel Z and the attributes worldToCamera, fx, fy, cx and cy"
)
_FLAT = "Convert the deep image into a flat image with a channel Z"
_MAGIC_BYTES, _CHANNEL_BYTES = 8, 16  # in front of the headers; behind the name of a channel in a header
_TYPE_BYTES = {1: 2}  # of a sample of a half; other types have 4
_MOST_RATIO = 40  # of memory to the file: masks leave little of most pictures
# Of a pixel: mask and linear colour; what not all views have; what an eye of other programs' pictures takes.
_VIEW_BYTES, _SRGB8_BYTES, _XY_BYTES, _EYE_BYTES = 7, 3, 8, 30


def read_unit(path: Path) -> str | None:
    """The unit of the first part, or None."""
    with opened(path) as stream:
        return _unit(_headers(stream)[0])


def read(path: Path, frame: int = 0, decided: Decided | None = None) -> tuple[RangeView, ...]:
    """The views in the order of the parts, or those of other programs' pictures.

    Raises InputError where a part is damaged or no range view.
    """
    decided = decided or Decided()
    with opened(path) as stream:
        headers = _headers(stream)
        check_count(len(headers), MOST_MEMBERS, "parts")
        is_ours = any(key in header for header in headers for key in _PINHOLE)
        for number, header in enumerate(headers):
            _check_flat(header, _name(header, number))
            if is_ours:
                _check_form(header, _name(header, number))
        eyes = [] if is_ours else rendered_eyes(headers, decided)
        needed = _memory(headers, _pixel_bytes(stream, len(headers)), len(eyes))
        admit(size_of(stream), needed, _MOST_RATIO)
        images = _decoded(stream, len(headers))
        if is_ours:
            views = tuple(_view(header, images.pop(0), _name(header, n)) for n, header in enumerate(headers))
        else:
            views = tuple(view_of_eye(headers, images, eye, decided) for eye in eyes)
            del images
        admit(size_of(stream), memory_of_merging(views), _MOST_RATIO)
    return views


def _decoded(stream: BinaryIO, parts: int) -> list[dict[str, NDArray]]:
    """The channels of every part by name, (H, W) each."""
    # OpenEXR leaves damaged parts out and prints that to standard output, where results go.
    with redirect_stdout(_OfOthers(sys.stdout)), _file(stream, separate_channels=True) as file:
        if len(file.parts) != parts:
            raise InputError(f"Scan4D can decode only {len(file.parts)} of the {parts} parts of the file")
        return [{name: channel.pixels for name, channel in part.channels.items()} for part in file.parts]


class _OfOthers:
    """Standard output but for what the thread prints that has made it."""

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._thread = stream, get_ident()

    def write(self, text: str) -> int:
        """Write as a text stream does."""
        return len(text) if get_ident() == self._thread else self._stream.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def write_views(path: Path, views: Sequence[RangeView]) -> None:
    """Write the views; every array and the calibration come back bit for bit.

    Raises InputError where two have the same name.
    """
    import OpenEXR

    names = [view.name for view in views]
    if len({*names}) < len(names) or not all(names):
        raise InputError(f"the names of the pods must differ, but they are {names}", hint="Rename them")
    height, width = np.max([view.depth.shape for view in views], axis=0).tolist()  # one for all parts
    parts = [OpenEXR.Part(_attributes(view, width, height), _channels(view), view.name) for view in views]
    with open(path, "wb") as stream:  # by a stream, failures come as OSError
        OpenEXR.File(parts).write(stream)


def _headers(stream: BinaryIO) -> list[dict[str, Any]]:
    with _file(stream, header_only=True) as file:
        return [dict(part.header) for part in file.parts]  # the file takes the headers back


@contextmanager
def _file(stream: BinaryIO, **how: bool) -> Iterator[Any]:
    """A file that OpenEXR reads from the beginning of a stream; of names, it would take UTF-8 alone."""
    import OpenEXR

    stream.seek(0)
    with unsaid(OPENEXR):
        try:
            file = OpenEXR.File(stream, **how)
        except RuntimeError as error:  # whose words are of a buffer in Python
            raise InputError("is not an EXR file, or is damaged") from error
        with file:
            yield file


def _name(header: dict[str, Any], number: int) -> str:
    return header.get("name") or f"part {number}"


def _unit(header: dict[str, Any]) -> str | None:
    return str(header["unit"]) if "unit" in header else None


def _check_flat(header: dict[str, Any], name: str) -> None:
    """Raise InputError where a part has other than one depth a pixel."""
    import OpenEXR

    if header.get("type") in (OpenEXR.deepscanline, OpenEXR.deeptile):
        raise InputError(f"'{name}' is a deep image (several depths per pixel), not a range view", hint=_FLAT)


def _check_form(header: dict[str, Any], name: str) -> None:
    """Raise InputError where a part of our form is no range view, and say what is missing."""
    missing = [f"attribute {key}" for key in _PINHOLE if key not in header]
    if not {"worldToCamera", "worldToCamera64"} & header.keys():
        missing.insert(0, "attribute worldToCamera")
    if "Z" not in {channel.name for channel in header["channels"]}:
        missing.insert(0, "channel Z")
    if missing:
        raise InputError(f"'{name}' is not a range view. It lacks: {', '.join(missing)}", hint=_FORM)


def _memory(headers: Sequence[dict[str, Any]], samples: Sequence[int], eyes: int) -> int:
    """Bytes that parts take at a time, decoded and as views. samples: bytes of a pixel of each part. eyes: of
    other programs' pictures."""
    pixels, views = [], []
    for header in headers:
        low, high = (corner.astype(int) for corner in header["dataWindow"])
        pixels.append(math.prod(np.maximum(high - low + 1, 0).tolist()))
        measured = {"X", "Y"} <= {channel.name for channel in header["channels"]}
        more = _SRGB8_BYTES * ("color" in header) + _XY_BYTES * measured + _EYE_BYTES * eyes
        views.append(pixels[-1] * (_VIEW_BYTES + more))
    return sum(map(operator.mul, pixels, samples)) + max(views)


def _pixel_bytes(stream: BinaryIO, parts: int) -> list[int]:
    """Bytes of a pixel of each part, as the headers say; OpenEXR says it only after decoding."""
    stream.seek(_MAGIC_BYTES)
    found = [0] * parts
    for part in range(parts):
        while _word(stream):  # the name of an attribute
            kind, size = _word(stream), int.from_bytes(read_exactly(stream, 4), "little")
            if kind == b"chlist":
                types = _channel_types(read_exactly(stream, size))
                found[part] = sum(_TYPE_BYTES.get(type_, 4) for type_ in types)
            else:
                stream.seek(size, 1)
    return found


def _word(stream: BinaryIO) -> bytes:
    """A name in a header, up to the zero behind it."""
    word = bytearray()
    while (byte := read_exactly(stream, 1)) != b"\0":
        word += byte
    return bytes(word)


def _channel_types(channels: bytes) -> Iterator[int]:
    at = 0
    while (end := channels.find(b"\0", at)) > at:
        yield int.from_bytes(channels[end + 1 : end + 5], "little")
        at = end + 1 + _CHANNEL_BYTES


def _view(header: dict[str, Any], pixels: dict[str, NDArray], name: str) -> RangeView:
    to_camera = header.get("worldToCamera64", header.get("worldToCamera"))
    fx, fy, cx, cy = (_number(header[key]) for key in _PINHOLE)
    # The corner of what is stored, where a program has cropped the picture.
    left, top = (header["dataWindow"][0] - header["displayWindow"][0]).tolist()
    depth = pixels["Z"].astype(np.float32, copy=False)
    color = _stacked(pixels, "RGB", np.float16)
    return RangeView(
        depth=depth,
        kind=cast(DepthKind, str(header.get("kind", "z"))),
        mask=mask_of(pixels["mask"]) if "mask" in pixels else np.ones(depth.shape, bool),
        color=srgb8_from_linear(color) if color is not None and header.get("color") == _SRGB8 else color,
        confidence=pixels["confidence"].astype(np.float32, copy=False) if "confidence" in pixels else None,
        xy=_stacked(pixels, "XY", np.float32),
        fx=fx,
        fy=fy,
        cx=cx - left,
        cy=cy - top,
        distortion=tuple(_number(header[key]) for key in _LENS if key in header),
        world_to_camera=_turned(np.asarray(to_camera, np.float64).reshape(4, 4).T),
        name=name,
        unit=usable_unit(_unit(header)) or UNKNOWN_UNIT,
        assumed=str(header.get("assumed", "")),
    )


def _stacked(pixels: dict[str, NDArray], names: str, dtype: type) -> NDArray | None:
    """Channels of these names as one image, or None where one is missing."""
    if not {*names} <= pixels.keys():
        return None
    return np.stack([pixels[name].astype(dtype, copy=False) for name in names], axis=2)


def _number(value: Any) -> float:
    """An attribute of one number; double ones come as arrays."""
    return float(np.asarray(value).item())


def _channels(view: RangeView) -> dict[str, NDArray]:
    channels = {"Z": view.depth, "mask": view.mask.astype(np.float16)}
    if view.color is not None:
        color: NDArray = view.color
        linear = linear_from_srgb8(color) if _has_eight_bits(view) else color
        channels |= dict(zip("RGB", np.moveaxis(linear, 2, 0), strict=True))
    if view.xy is not None:
        channels |= dict(zip("XY", np.moveaxis(view.xy, 2, 0), strict=True))
    if view.confidence is not None:
        channels["confidence"] = view.confidence
    return {name: np.ascontiguousarray(channel) for name, channel in channels.items()}


def _attributes(view: RangeView, width: int, height: int) -> dict[str, Any]:
    """The header of a part in a display window of this size."""
    import OpenEXR

    to_camera = _turned(view.world_to_camera)
    to_ndc = np.array(
        [
            [view.fx / width, 0, view.cx / width, 0],
            [0, -view.fy / height, view.cy / height, 0],
            [0, 0, 0, 1],
            [0, 0, 1, 0],
        ]
    )
    if view.kind == "height":  # nothing is divided by depth
        to_ndc = to_ndc[:, [0, 1, 3, 2]]
    calibration = {key: getattr(view, key) for key in _PINHOLE} | dict(
        zip(_LENS, view.distortion, strict=False)
    )
    return {
        "type": OpenEXR.scanlineimage,
        "compression": OpenEXR.ZIP_COMPRESSION,
        "dataWindow": _window(*view.depth.shape[::-1]),
        "displayWindow": _window(width, height),
        "worldToCamera": np.ascontiguousarray(to_camera.T, np.float32),
        "worldToCamera64": np.ascontiguousarray(to_camera.T),
        "worldToNDC": np.ascontiguousarray((to_ndc @ to_camera).T, np.float32),
        **{key: np.array([value], np.float64) for key, value in calibration.items()},
        **({"color": _SRGB8} if _has_eight_bits(view) else {}),
        "kind": view.kind,
        **({"assumed": view.assumed} if view.assumed else {}),
        "unit": view.unit,
    }


def _has_eight_bits(view: RangeView) -> bool:
    return view.color is not None and view.color.dtype == np.uint8


def _window(width: int, height: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The first and the last pixel, (x, y)."""
    return np.zeros(2, np.int32), np.array([width - 1, height - 1], np.int32)


def _turned(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """World to camera with the view axis turned round: between ours and OpenEXR's camera space."""
    turned = matrix.copy()
    turned[2] = -turned[2]
    return turned
