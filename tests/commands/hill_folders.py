"""Folders of hills that move, sampled at other places in each frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from moving_hills import SIDE, hills
from scipy.spatial.transform import Rotation

from viewer.scan import formats
from viewer.scan.points import PointCloud

TURN = Rotation.from_rotvec([0.02, -0.03, 0.015])  # from frame to frame


def turning_hills(folder: Path | str, points: int) -> None:
    """Write three frames of so many points, which turn and shift by 0.5 along x."""
    Path(folder).mkdir()
    for frame in range(3):
        x, y = np.random.default_rng(frame).uniform(-SIDE / 2, SIDE / 2, (2, points))
        turned = (TURN**frame).apply(np.column_stack([x, y, hills(x, y)]))
        cloud = PointCloud.from_arrays(turned + np.array([0.5 * frame, 0, 0]))
        formats.write(f"{folder}/f{frame}.npz", cloud)
