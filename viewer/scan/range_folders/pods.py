"""A scanner's range images: pods.json tells the pods, their calibration, and the files of each.

    {"unit": "mm",
     "pods": [{"name": "left", "kind": "range", "fx": 2600, "fy": 2600, "cx": 1499.5, "cy": 2249.5,
               "distortion": [-0.1, 0.02, 0, 0],
               "pose": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
               "range": "left_*_range.tif", "texture": "left_*_texture.png", "mask": "left_*_mask.png"}]}

`range` is a float TIFF or a 16-bit picture; the others, with `confidence`, may be missing. A name may have
one `*`: a frame is what stands there, and each is looked for with all pods. Calibrations are as in a
camera.json, but `depth_scale` is 1 where it is missing; `pose` is from the camera to the world in an image's
axes, 4 x 4.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, shortened
from ...files import named_inside
from ..admission import admit
from ..contents import StatedCamera
from ..image_poses import UPRIGHT, from_camera_to_world
from ..points import UNKNOWN_UNIT
from ..range_view import RangeView
from ..reading.camera import CameraSources, DepthCamera, Size, decide_camera
from ..reading.camera_files import camera_of
from ..reading.record import Decision
from ..reading.sequence import Decided
from ..times import natural_key
from ._pictures import ViewFiles, depth_view, size_of_image
from ._source import RangeFrames
from ._texts import object_of

TITLE = "a scanner's range images"
FILE = "pods.json"

_MOST_PODS = 64
_FORM = 'Example of such a file: {"unit": "mm", "pods": [{"name": "left", "range": "left_*.tif", "fx": ...}]}'
_RANGE, _TEXTURE, _MASK, _CONFIDENCE = _IMAGES = ("range", "texture", "mask", "confidence")
_ANY = "*"
_NAME_BYTES = 1000  # of memory for a file that a pattern names


@dataclass(frozen=True)
class _Pod:
    name: str
    camera: StatedCamera
    world_to_camera: NDArray[np.float64]
    patterns: dict[str, str]  # of the images that it has


def find(folder: Path, names: Sequence[str], decided: Decided) -> RangeFrames | None:
    """The frames that pods.json names, None without one. Raises InputError where it is unusable."""
    if FILE not in names:
        return None
    try:
        unit, pods = _rig(object_of(folder / FILE))
    except InputError as error:
        raise InputError(error.what, folder / FILE, error.hint or _FORM) from error
    found = _matches(folder, dict.fromkeys(pattern for pod in pods for pattern in pod.patterns.values()))
    frames = sorted({key for pod in pods for key in found[pod.patterns[_RANGE]]}, key=natural_key)
    if not frames:
        looked = ", ".join(pod.patterns[_RANGE] for pod in pods)
        raise InputError(f"there is no range image {looked}", folder / FILE)

    def read(index: int) -> Iterator[RangeView]:
        of_frame, cameras = decided.at(index), []
        for pod in pods:
            images = _files(folder, pod, frames[index])
            if images[_RANGE].is_file():

                def camera_of_pod(stored: NDArray, _: Size | None, pod: _Pod = pod) -> DepthCamera:
                    found = decide_camera(
                        CameraSources(stated=[pod.camera], source="file"), size_of_image(stored)
                    )
                    cameras.append((pod.name, found.decisions))
                    return found.camera

                files = ViewFiles(
                    depth=images[_RANGE],
                    color=images.get(_TEXTURE),
                    mask=images.get(_MASK),
                    confidence=images.get(_CONFIDENCE),
                )
                yield depth_view(files, camera_of_pod, pod.world_to_camera, of_frame, pod.name)
        of_frame.note(*_joined(cameras))

    labels = tuple(next(pod.patterns[_RANGE].replace(_ANY, key) for pod in pods) for key in frames)
    used = (pattern.replace(_ANY, key) for pattern, keys in found.items() for key in sorted(keys))
    files = tuple(folder / name for name in (*dict.fromkeys(used), FILE))
    return RangeFrames(folder.resolve().name, labels, read, files, unit)


def _joined(cameras: Sequence[tuple[str, tuple[Decision, ...]]]) -> Iterator[Decision]:
    """The decisions about the cameras of all pods: the value of each by the pod's name."""
    for of_pods in zip(*(decisions for _, decisions in cameras), strict=True):
        values = {name: one.value for (name, _), one in zip(cameras, of_pods, strict=True)}
        yield replace(of_pods[0], value=values)


def _rig(stored: dict[str, Any]) -> tuple[str, list[_Pod]]:
    """The unit and the pods of a file. Raises InputError."""
    if not isinstance(stored.get("pods"), list):
        raise InputError("lists no pods")
    unit = str(stored.get("unit", UNKNOWN_UNIT))
    if not 0 < len(stored["pods"]) <= _MOST_PODS:
        raise InputError(f"lists {len(stored['pods'])} pods, but Scan4D reads 1 to {_MOST_PODS}")
    pods = [_pod(pod, f"pod{number}", unit) for number, pod in enumerate(stored["pods"])]
    if len({pod.name for pod in pods}) < len(pods):
        raise InputError("gives several pods the same name")
    return unit, pods


def _pod(stored: Any, name: str, unit: str) -> _Pod:
    if not isinstance(stored, dict):
        raise InputError(f"{name} is not a JSON object")
    stated = stored.get("name", name)
    if not isinstance(stated, str) or not stated:
        raise InputError(f"the name of {name} is {shortened(stated)}")
    try:
        camera = camera_of(stored, FILE)
        camera = replace(
            camera,
            depth_scale=1.0 if camera.depth_scale is None else camera.depth_scale,
            unit=unit if camera.unit is None else camera.unit,
        )
        there = [image for image in _IMAGES if image in stored or image == _RANGE]
        patterns = {image: _pattern(stored, image) for image in there}
        return _Pod(stated, camera, _pose(stored), patterns)
    except InputError as error:
        raise InputError(f"pod '{shortened(stated)}' {error.what}", hint=error.hint) from error


def _pose(stored: dict[str, Any]) -> NDArray[np.float64]:
    if "pose" not in stored:
        return UPRIGHT
    try:
        pose = np.array(stored["pose"], np.float64)
    except (TypeError, ValueError):
        pose = np.empty(0)
    if pose.shape != (4, 4):
        raise InputError("has a pose that is not a 4 x 4 matrix")
    return from_camera_to_world(pose)


def _pattern(stored: dict[str, Any], image: str) -> str:
    """A file's name within the folder, with one star at most."""
    stated = stored.get(image)
    if not isinstance(stated, str) or stated.count(_ANY) > 1 or _ANY in os.path.dirname(stated):
        raise InputError(
            f"has the {image} {shortened(stated)}, but this must be a file name with at most one {_ANY}"
        )
    named_inside(Path(), stated, None)
    return stated


def _matches(folder: Path, patterns: Collection[str]) -> dict[str, set[str]]:
    """Texts for the star in the names of the files of each pattern; without a star, none or an empty one.

    Raises InputError where patterns name the same files so often that it would take too much memory.
    """
    names = {parent: _listed(parent) for parent in {(folder / pattern).parent for pattern in patterns}}
    held = _NAME_BYTES * sum(map(len, names.values()))
    found: dict[str, set[str]] = {}
    for pattern in patterns:
        file = folder / pattern
        start, star, end = map(os.path.normcase, file.name.partition(_ANY))
        there = names[file.parent] if star else []
        found[pattern] = {
            name[len(start) : len(name) - len(end)]
            for name in there
            if len(name) > len(start) + len(end)
            and (compared := os.path.normcase(name)).startswith(start)
            and compared.endswith(end)
        }
        if not star and file.is_file():
            found[pattern].add("")
        admit(held, _NAME_BYTES * sum(map(len, found.values())))
    return found


def _listed(folder: Path) -> list[str]:
    """The names in a folder; none where it is not there."""
    try:
        return os.listdir(folder)
    except OSError:
        return []


def _files(folder: Path, pod: _Pod, key: str) -> dict[str, Path]:
    """The files of a frame of a pod by their images."""
    return {image: folder / pattern.replace(_ANY, key) for image, pattern in pod.patterns.items()}
