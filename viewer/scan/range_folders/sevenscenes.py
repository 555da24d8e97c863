"""Microsoft's 7-Scenes: frame-NNNNNN.depth.png, .color.jpg (or .png) and .pose.txt.

Depth is in millimetres, a pose is from the camera to the world in metres. Without a `camera-intrinsics.txt`
the camera is the one that the data set's page gives, f 585, c 320, 240. Without poses, where that file alone
tells the kind, each frame is in its camera's own space.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..image_poses import UPRIGHT
from ..reading.camera import default_camera
from ..reading.sequence import Decided
from ._cameras import camera_of_folder
from ._partners import frames_of_pictures, named_pictures, pose_of_file
from ._source import RangeFrames

TITLE = "7-Scenes"

_DEPTH, _POSE = ".depth.png", ".pose.txt"
_INTRINSICS = "camera-intrinsics.txt"
_KINECT = default_camera(585.0, 320.0, 240.0, 640, 480)


def find(folder: Path, names: Sequence[str], decided: Decided) -> RangeFrames | None:
    """A frame for each depth picture, where some names end as 7-Scenes has it."""
    has_depth, has_poses = (any(name.endswith(end) for name in names) for end in (_DEPTH, _POSE))
    if not has_depth or not (has_poses or _INTRINSICS in names):
        return None
    pictures = named_pictures(folder, names)
    camera = camera_of_folder(
        folder, names, decided.corrections, default=_KINECT, is_known_scale=True, kind=TITLE
    )

    def pose(index: int) -> NDArray[np.float64]:
        return pose_of_file(pictures[index]) if has_poses else UPRIGHT

    return frames_of_pictures(folder, pictures, camera, pose, decided)


def lacks(names: Sequence[str]) -> str:
    """The pictures of depth, where there are poses without."""
    has_poses = any(name.endswith(_POSE) for name in names)
    return f"the depth pictures, frame-N{_DEPTH}, are missing" if has_poses else ""
