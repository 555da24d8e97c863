"""Decides the camera of depth pictures: its intrinsics, its lens, and what a number of a picture means.

The order of sources: the user; the camera file beside the pictures; other files that state cameras; the
default of the data set; else a field of view that Scan4D assumes. A camera for another size of picture is
scaled where both have the same aspect ratio. Scan4D refuses a stated camera that cannot be the picture's, and
passes over such a default.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ...errors import InputError
from ..contents import StatedCamera
from ..range_view import DepthKind, RangeView, assumed_pinhole
from .record import Decision, Source
from .sequence import Decided

Size = tuple[int, int]  # width and height, pixels

CENTER = 0.5  # of a pixel: files have that of the first one at 0, 0, range views at 0.5, 0.5
MILLIMETRES = 1000.0  # steps in a metre, which most recorders store

_SAME_ASPECT = 0.01  # how far the ratio of two aspect ratios may be from 1
_STATE_IT = "State the camera with --read camera=fx,fy,cx,cy, or in a camera.json beside the pictures"
_SCALES = ("1000", "5000", "10000", "1")


@dataclass(frozen=True, kw_only=True)
class DepthCamera:
    """The camera of a depth picture, and what the numbers of the picture mean.

    fx, fy, cx, cy, distortion, kind, assumed: as `RangeView` has them, so the centre of the first pixel is at
    0.5, 0.5. depth_scale: how many of the numbers are one unit. unit: as a file states it, perhaps any text.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()
    kind: DepthKind = "z"
    depth_scale: float = MILLIMETRES
    unit: str = "m"
    assumed: str = ""

    @property
    def of_view(self) -> dict[str, Any]:
        """The fields that a `RangeView` of the picture takes over."""
        names = ("fx", "fy", "cx", "cy", "distortion", "kind", "assumed")
        return {name: getattr(self, name) for name in names}


@dataclass(frozen=True)
class DecidedCamera:
    """A camera, and the decisions "camera" and "depth-scale" that led to it."""

    camera: DepthCamera
    decisions: tuple[Decision, ...]


@dataclass(frozen=True, kw_only=True)
class CameraSources:
    """All that is known of the camera of some depth pictures before one of them is read.

    stated:   by files beside the pictures, the better file first
    default:  of the data set, or None
    corrected: what the user says, or None; depth_scale likewise
    source:   where `stated` comes from
    is_known_scale: whether the data set defines the depth scale
    scale:    steps in one unit where nothing states them
    kind:     what messages call the data set, never empty beside a default
    """

    stated: Sequence[StatedCamera] = ()
    default: StatedCamera | None = None
    corrected: StatedCamera | None = None
    depth_scale: float | None = None
    source: Source = "neighbour"
    is_known_scale: bool = False
    scale: float = MILLIMETRES
    kind: str = ""

    @property
    def unit(self) -> str:
        """The unit of length, perhaps any text: metres where nothing states another."""
        stated = _first(self, "unit")
        return "m" if stated is None else stated


def default_camera(f: float, cx: float, cy: float, width: int, height: int, **others: Any) -> StatedCamera:
    """The camera of a lens as a data set's page gives it: pixel centres at whole numbers."""
    return StatedCamera(fx=f, fy=f, cx=cx, cy=cy, width=width, height=height, **others)


PRIMESENSE = default_camera(525.0, 319.5, 239.5, 640, 480)


def decide_camera(
    sources: CameraSources, size: Size, *, is_whole: bool = True, of_color: Size | None = None
) -> DecidedCamera:
    """The camera of a picture of this size. Raises InputError where a stated camera cannot be its own.

    is_whole: whether the picture stores whole numbers, not floats. of_color: the size of the colours beside
    it, whose camera some recorders store.
    """
    pinhole, decision, assumed = _pinhole(sources, size, of_color)
    scale, of_scale = _depth_scale(sources, is_whole)
    camera = DepthCamera(
        fx=pinhole.fx,
        fy=pinhole.fy,
        cx=pinhole.cx + CENTER,
        cy=pinhole.cy + CENTER,
        distortion=pinhole.distortion,
        kind=pinhole.kind or "z",
        depth_scale=scale,
        unit=sources.unit,
        assumed=assumed,
    )
    return DecidedCamera(camera, (decision, of_scale))


def decide_view(
    stated: Mapping[str, Any] | None,
    size: Size,
    decided: Decided,
    where: str = "",
    why: str = "",
    source: Source = "file",
) -> dict[str, Any]:
    """The camera of a picture in a file that states it or not; the decision goes into the record.

    stated: fields of a `RangeView` (fx, fy, cx, cy and perhaps kind and distortion), None where the file is
    silent. why: a sentence for the record. Returns such fields. Raises InputError where the user's camera
    cannot be the picture's.
    """
    camera = decided.corrections.get("camera")
    if isinstance(camera, str):
        raise InputError("--read camera of a single file needs numbers, not a file", hint=_STATE_IT)
    if stated is None or camera is not None:
        sources = CameraSources(corrected=None if camera is None else corrected_camera(camera))
        found = decide_camera(sources, size)
        decided.note(found.decisions[0])
        return found.camera.of_view
    value: dict[str, Any] = {name: float(stated[name]) for name in ("fx", "fy")}
    value |= {name: float(stated[name]) - CENTER for name in ("cx", "cy")}
    value |= {"distortion": list(stated.get("distortion", ())), "kind": stated.get("kind", "z")}
    decided.note(Decision("camera", value, source, where, why, changes_numbers=True))
    return dict(stated)


def note_fitted(view: RangeView, decided: Decided) -> None:
    """Put the camera of an organised grid into the record: its points show which pixels see them."""
    why = "The camera is the pinhole that fits the organised points best"
    value = {"fx": view.fx, "fy": view.fy, "cx": view.cx - CENTER, "cy": view.cy - CENTER, "kind": view.kind}
    decided.note(Decision("camera", value | {"distortion": []}, "file", "the organised points", why))


def decide_of_arrays(
    stated: Sequence[StatedCamera],
    size: Size,
    decided: Decided,
    is_whole: bool,
    depth_scale: float | None = None,
) -> DecidedCamera:
    """The camera of depths in arrays, and their scale: 1 where no array states it.

    is_whole: whether the depths are whole numbers. depth_scale: that an array states beside no camera. The
    decisions go into the record. Raises InputError where a stated camera cannot be the picture's.
    """
    camera = decided.corrections.get("camera")
    if isinstance(camera, str):
        raise InputError("--read camera of a single file needs numbers, not a file", hint=_STATE_IT)
    sources = CameraSources(
        stated=stated,
        corrected=None if camera is None else corrected_camera(camera),
        depth_scale=decided.corrections.get("depth-scale"),
        source="file",
        scale=1.0 if depth_scale is None else depth_scale,
    )
    found = decide_camera(sources, size, is_whole=is_whole)
    of_camera, of_scale = found.decisions
    if depth_scale is not None and of_scale.source == "assumed":
        of_scale = Decision("depth-scale", depth_scale, "file", "depth_scale", changes_numbers=True)
    is_unstated = of_scale.source == "assumed" and not is_whole
    decided.note(of_camera, *(() if is_unstated else (of_scale,)))
    return found


def scaled(camera: StatedCamera, size: Size) -> StatedCamera:
    """The camera for pictures of another size that have the aspect ratio of its own."""
    assert camera.width is not None
    right = size[0] / camera.width
    down = right if camera.height is None else size[1] / camera.height
    return replace(
        camera,
        fx=camera.fx * right,
        fy=camera.fy * down,
        cx=(camera.cx + CENTER) * right - CENTER,
        cy=(camera.cy + CENTER) * down - CENTER,
        width=size[0],
        height=size[1],
    )


def camera_for(camera: StatedCamera, size: Size, of_color: Size | None = None) -> StatedCamera | str:
    """The camera for a picture of this size, scaled if need be; else a clause that says why it cannot be."""
    if camera.kind == "height":
        return camera
    if camera.width is not None and camera.height is not None:
        if (camera.width, camera.height) == size:
            return camera
        if not have_same_aspect((camera.width, camera.height), size):
            return (
                f"the camera is for pictures of {camera.width} x {camera.height} pixels, but this picture "
                f"has {_shown(size)}"
            )
        return scaled(camera, size)
    if _is_inside(camera, size):
        return camera
    if of_color is not None and have_same_aspect(of_color, size) and _is_inside(camera, of_color):
        return scaled(replace(camera, width=of_color[0], height=of_color[1]), size)
    outside = f"the principal point {camera.cx:g}, {camera.cy:g} of the camera is outside the picture"
    return f"{outside}, which has {_shown(size)}"


def have_same_aspect(one: Size, other: Size, most: float = _SAME_ASPECT) -> bool:
    """Whether pictures of these sizes may show the same: by the ratio of their aspect ratios."""
    return abs(one[0] * other[1] / (one[1] * other[0]) - 1) <= most


def _is_inside(camera: StatedCamera, size: Size) -> bool:
    return 0 < camera.cx + CENTER < size[0] and 0 < camera.cy + CENTER < size[1]


def _pinhole(sources: CameraSources, size: Size, of_color: Size | None) -> tuple[StatedCamera, Decision, str]:
    """The pinhole, the decision for it, and words on what Scan4D assumes; "" where it assumes nothing."""
    if sources.corrected is not None:
        stated, camera = _fitting([sources.corrected], size, of_color)
        return camera, _decision(camera, stated, "user", "--read"), ""
    if sources.stated:
        stated, camera = _fitting(_ranked(sources.stated, size), size, of_color)
        return camera, _decision(camera, stated, sources.source, stated.where), ""
    assumed = assumed_pinhole(*size)
    words = why = assumed["assumed"]
    guess = StatedCamera(
        fx=assumed["fx"], fy=assumed["fy"], cx=assumed["cx"] - CENTER, cy=assumed["cy"] - CENTER,
        width=size[0], height=size[1],
    )  # fmt: skip
    if sources.default is not None:
        default = camera_for(sources.default, size)
        if not isinstance(default, str):
            why = f"No file states the camera, so Scan4D uses the default camera of {sources.kind}"
            return default, _decision(default, sources.default, "assumed", "", why, (_as_text(guess),)), ""
        why += f", because the default camera of {sources.kind} is for {_of(sources.default)}"
    others = () if sources.default is None else (_as_text(scaled_alike(sources.default, size)),)
    return guess, _decision(guess, guess, "assumed", "", f"{why}. {_STATE_IT}", others), words


def scaled_alike(camera: StatedCamera, size: Size) -> StatedCamera:
    """The camera with the same field of view across, its principal point in the middle of such a picture."""
    across = size[0] / (camera.width or size[0])
    return replace(
        camera,
        fx=camera.fx * across,
        fy=camera.fx * across,
        cx=size[0] / 2 - CENTER,
        cy=size[1] / 2 - CENTER,
    )


def _ranked(cameras: Sequence[StatedCamera], size: Size) -> list[StatedCamera]:
    """The cameras of the better file first; of each file those for this size first."""
    files = list(dict.fromkeys(one.where for one in cameras))
    return sorted(cameras, key=lambda one: (files.index(one.where), (one.width, one.height) != size))


def _fitting(
    cameras: Sequence[StatedCamera], size: Size, of_color: Size | None
) -> tuple[StatedCamera, StatedCamera]:
    """The first of the cameras that can be the picture's, as stated and as fitted. Raises InputError."""
    reasons: list[tuple[str, StatedCamera]] = []
    for stated in cameras:
        camera = camera_for(stated, size, of_color)
        if not isinstance(camera, str):
            return stated, camera
        reasons.append((camera, stated))
    reason, stated = reasons[0]
    hint = (
        _STATE_IT
        if stated.width is not None
        else (f"If this camera is right, state its width and height in pixels. {_STATE_IT}")
    )
    raise InputError(f"{reason}{f' ({stated.where})' if stated.where else ''}", hint=hint)


def _decision(
    camera: StatedCamera,
    stated: StatedCamera,
    source: Source,
    where: str,
    why: str = "",
    alternatives: tuple[str, ...] = (),
) -> Decision:
    value: dict[str, Any] = {name: getattr(camera, name) for name in ("fx", "fy", "cx", "cy")}
    value |= {"distortion": list(camera.distortion), "kind": camera.kind or "z"}
    if not why and (camera.fx, camera.cx) != (stated.fx, stated.cx):
        why = (
            "The camera file is for pictures of another size: Scan4D scales the camera to "
            f"{camera.width} x {camera.height}"
        )
    return Decision("camera", value, source, where, why, alternatives, changes_numbers=True)


def _depth_scale(sources: CameraSources, is_whole: bool) -> tuple[float, Decision]:
    def decided(scale: float, source: Source, where: str = "", why: str = "") -> tuple[float, Decision]:
        others = tuple(text for text in _SCALES if float(text) != scale) if source == "assumed" else ()
        return scale, Decision("depth-scale", scale, source, where, why, others, changes_numbers=True)

    if sources.depth_scale is not None:
        return decided(sources.depth_scale, "user", "--read")
    if (stated := _first(sources, "depth_scale")) is not None:
        is_default = not any(one.depth_scale is not None for one in sources.stated)
        where = next((one.where for one in sources.stated if one.depth_scale is not None), sources.kind)
        return decided(stated, "folder" if is_default else sources.source, where)
    if not is_whole and sources.scale == MILLIMETRES:
        return decided(1.0, "assumed", "", "The picture stores floats, which are usually lengths")
    if sources.is_known_scale:
        return decided(MILLIMETRES, "folder", sources.kind)
    why = "Nothing states the unit of the depths"
    if sources.scale == MILLIMETRES:
        why = "No file states the unit of the depths. Most recorders store millimetres"
    return decided(sources.scale, "assumed", "", why)


def _first(sources: CameraSources, name: str) -> Any:
    """The first value that a source states, the default last."""
    stated = [sources.corrected, *sources.stated, sources.default]
    return next(
        (getattr(one, name) for one in stated if one is not None and getattr(one, name) is not None), None
    )


def _as_text(camera: StatedCamera) -> str:
    """The camera as `--read camera=` takes it."""
    return ",".join(
        f"{value:.6g}" for value in (camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion)
    )


def _of(camera: StatedCamera) -> str:
    return f"{camera.width} x {camera.height} pixels"


def _shown(size: Size) -> str:
    return f"{size[0]} x {size[1]}"


def corrected_camera(numbers: Sequence[float]) -> StatedCamera:
    """The camera of `--read camera=`: fx, fy, cx, cy, and the coefficients of the lens or none."""
    fx, fy, cx, cy, *lens = numbers
    return StatedCamera(fx=fx, fy=fy, cx=cx, cy=cy, distortion=tuple(lens), where="--read")
