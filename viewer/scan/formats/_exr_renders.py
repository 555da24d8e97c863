"""Pictures with depth that other programs have written as EXR: which channels are one eye's, and its camera.

A picture has a channel of depth (see `viewer/scan/reading/channels.py`), and perhaps `R G B` and `A` in the
same layer or another. The attribute `multiView` and names of layers, or a part's `view`, mark two eyes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, shortened
from ..range_view import RangeView, mask_of
from ..reading.camera import decide_view
from ..reading.channels import EXPECTED, decide, depth_channels
from ..reading.depths import measured_depths
from ..reading.sequence import Decided

_UNSKEWED = 1e-3  # what else there may be in a projection, as a part of its focal length
_DEFAULT_SCREEN = (0.0, 0.0, 1.0)  # its centre and width, where nobody has set them

_TURNED = np.diag([1.0, 1.0, -1.0, 1.0])  # OpenEXR's cameras look along +z

_Channel = tuple[int, str]  # the number of a part, and the name
_Layer = dict[str, _Channel]  # by the last word of their names


@dataclass(frozen=True)
class RenderedEye:
    """One eye's picture in a file: where its depth is, and where its colours R G B and its alpha are."""

    name: str
    depth: _Channel
    colors: tuple[_Channel, ...]
    alpha: _Channel | None


def rendered_eyes(headers: Sequence[dict[str, Any]], decided: Decided) -> list[RenderedEye]:
    """The eyes whose camera the headers state; without a camera, the first. Raises InputError."""
    eyes: dict[str, dict[tuple[str, ...], _Layer]] = {}
    for part, header in enumerate(headers):
        names = header.get("multiView", [])
        first = header.get("view") or (names[0] if names else "")
        for channel in header["channels"]:
            *layers, word = channel.name.split(".")
            eye = next((layer for layer in layers if layer in names), first)
            layer = tuple(layer for layer in layers if layer != eye)
            eyes.setdefault(eye, {}).setdefault(layer, {}).setdefault(word, (part, channel.name))
    found = [
        eye for name, layers in eyes.items() if (eye := _eye(headers, name, layers, decided)) is not None
    ]
    if not found:
        there = ", ".join(channel.name for header in headers for channel in header["channels"])
        raise InputError(
            f"is not a range view: none of its channels contains depth (channels: {shortened(there)})",
            hint=EXPECTED,
        )
    known = [eye for eye in found if "worldToCamera" in headers[eye.depth[0]]]
    return known or found[:1]


def _eye(
    headers: Sequence[dict[str, Any]], name: str, layers: dict[tuple[str, ...], _Layer], decided: Decided
) -> RenderedEye | None:
    """The picture in an eye's layers; the one with the shortest name where several have a depth."""
    outer = sorted(layers, key=len)
    by_name = {".".join([*layer, word]): (layer, word) for layer in outer for word in layers[layer]}
    chosen = decide(list(by_name), decided.corrections)
    if chosen is None:
        return None
    decided.note(chosen.decision)
    for other in depth_channels(list(by_name)):
        if other != chosen.name:
            decided.note_unused(f"depth in the channel {other}")
    key, depth_word = by_name[chosen.name]
    source, depth = layers[key], layers[key][depth_word]
    part = depth[0]
    name, window = name or headers[part].get("name") or f"part {part}", headers[part]["dataWindow"]
    for layer in (source, *(layers[other] for other in outer)):
        of_depth = layer is source and depth_word in "RGB"
        if not of_depth and {*"RGB"} <= layer.keys() and _has_window(headers[layer["R"][0]], window):
            return RenderedEye(name, depth, tuple(layer[word] for word in "RGB"), layer.get("A"))
    return RenderedEye(name, depth, (), source.get("A"))


def _has_window(header: dict[str, Any], window: Any) -> bool:
    return np.array_equal(header["dataWindow"], window)


def view_of_eye(
    headers: Sequence[dict[str, Any]],
    images: Sequence[dict[str, NDArray]],
    eye: RenderedEye,
    decided: Decided,
) -> RangeView:
    """The range view of an eye. images: the channels of every part by name, (H, W) each. Raises InputError.

    Where alpha is 0.01 or less, or depth as large as programs write it where nothing is, nothing was seen.
    """
    header = headers[eye.depth[0]]
    stored = images[eye.depth[0]][eye.depth[1]]
    depth = stored.astype(np.float32)
    mask = measured_depths(stored, decided)
    color = np.stack([images[part][name] for part, name in eye.colors], axis=2) if eye.colors else None
    if eye.alpha is not None:
        alpha = images[eye.alpha[0]][eye.alpha[1]]
        seen = mask_of(alpha)
        mask &= seen
        if color is not None:  # which is multiplied by alpha
            color = color / np.where(seen, alpha, 1)[..., None]
    left, top = (header["dataWindow"][0] - header["displayWindow"][0]).tolist()
    camera = _camera(header, decided)
    return RangeView(
        depth=depth,
        mask=mask,
        color=None if color is None else color.astype(np.float16),
        name=eye.name,
        **camera | {"cx": camera["cx"] - left, "cy": camera["cy"] - top},
    )


def _camera(header: dict[str, Any], decided: Decided) -> dict[str, Any]:
    """The fields of a range view that the camera gives, in the display window."""
    low, high = header["displayWindow"]
    width, height = (high - low + 1).tolist()
    placed = "worldToCamera" in header
    to_camera = _matrix(header, "worldToCamera") if placed else _TURNED
    left_handed = np.linalg.det(to_camera) > 0  # as the camera's space is: then z of the world is turned
    pose = {"world_to_camera": _TURNED @ to_camera @ (_TURNED if left_handed else np.eye(4))}
    if placed and "worldToNDC" in header:
        projection = _projection(_matrix(header, "worldToNDC") @ np.linalg.inv(to_camera), width, height)
        return pose | decide_view(projection, (width, height), decided, "worldToNDC")
    screen = (*header["screenWindowCenter"], header["screenWindowWidth"])
    if screen == _DEFAULT_SCREEN:
        return pose | decide_view(None, (width, height), decided)
    right, up, across = map(float, screen)
    fx = width / across
    fy = fx * float(header["pixelAspectRatio"])
    pinhole = {"fx": fx, "fy": fy, "cx": width / 2 - right * fx, "cy": height / 2 + up * fy}
    return pose | decide_view(pinhole, (width, height), decided, "screenWindowWidth")


def _projection(to_ndc: NDArray[np.float64], width: int, height: int) -> dict[str, Any]:
    """Kind and calibration of a camera whose space goes by this matrix to 0..1 from the upper left corner."""
    parallel = abs(to_ndc[3, 2]) <= _UNSKEWED * abs(to_ndc[3, 3])
    axis = 3 if parallel else 2
    scaled = to_ndc[[0, 1, 3]] / to_ndc[3, axis]
    pixels = scaled * np.array([width, -height, 1.0])[:, None]
    expected = np.zeros((3, 4))
    expected[[0, 1, 2], [0, 1, axis]] = pixels[0, 0], pixels[1, 1], 1
    expected[:2, axis] = pixels[:2, axis]
    if not np.allclose(pixels, expected, rtol=0, atol=_UNSKEWED * abs(pixels[0, 0])):
        raise InputError("the attribute worldToNDC does not describe an upright camera with a straight axis")
    fx, fy, cx, cy = pixels[0, 0], pixels[1, 1], pixels[0, axis], -pixels[1, axis]
    return {"kind": "height" if parallel else "z", "fx": fx, "fy": fy, "cx": cx, "cy": cy}


def _matrix(header: dict[str, Any], name: str) -> NDArray[np.float64]:
    """A matrix for column vectors."""
    return np.asarray(header[name], np.float64).reshape(4, 4).T
