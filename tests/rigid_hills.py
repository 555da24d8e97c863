"""A patch of hills that moves as one, with a part that also rises, sampled at other places in each frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from moving_hills import SIDE, hills
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from viewer.analysis.motion.stabilise import MotionReference
from viewer.rigid import Rigid, rigid_matrix
from viewer.scan.faces import Faces
from viewer.scan.points import PointCloud
from viewer.scan.timeline import Timeline

POINTS = 2500


def pose_of_head(frame: int) -> Rigid:
    """Where the patch is in a frame."""
    turn = Rotation.from_rotvec(np.array([0.02, -0.03, 0.015]) * frame).as_matrix()
    return Rigid(rigid_matrix(turn, np.array([0.5, -0.4, 0.3]) * frame))


def truth(frame: int, reference: int) -> Rigid:
    """The motion from the reference frame to a frame."""
    return pose_of_head(frame).after(pose_of_head(reference).inverse)


class RigidHills:
    """A source of frames. noise: along z at rest. rise: how far what is at x > 8 rises each frame. lacking:
    frames without the patch. outliers: share of points that lie anywhere near. hidden: share of the patch
    that all frames but the first lack. is_flat: whether there are no hills."""

    name = "hills"
    files: tuple[Path, ...] = ()

    def __init__(
        self,
        frames: int,
        *,
        noise: float = 0.02,
        rise: float = 0.0,
        lacking: frozenset[int] = frozenset(),
        outliers: float = 0.0,
        hidden: float = 0.0,
        is_flat: bool = False,
    ) -> None:
        self.unit = "mm"
        self._frames, self._noise, self._rise, self._lacking = frames, noise, rise, lacking
        self._outliers, self._hidden, self._is_flat = outliers, hidden, is_flat

    def __len__(self) -> int:
        return self._frames

    def label(self, index: int) -> str:
        return f"frame {index + 1}"

    def times(self) -> NDArray[np.float64]:
        return np.arange(self._frames) / 25

    def heights(self, index: int, x: NDArray, y: NDArray) -> NDArray[np.float64]:
        """Of the surface in a frame, before the patch moves as one."""
        rising = self._rise * index * np.clip((x - 8) / 6, 0, 1)
        return rising + (0.0 if self._is_flat else hills(x, y))

    def load(self, index: int) -> PointCloud:
        chance = np.random.default_rng(index)
        if index in self._lacking:
            return PointCloud.from_arrays(chance.uniform(0, 9, (500, 3)) + 500.0)
        x, y = chance.uniform(-SIDE / 2, SIDE / 2, (2, POINTS))
        z = self.heights(index, x, y)
        z += self._noise * chance.standard_normal(POINTS)
        points = np.column_stack([x, y, z])
        strays = chance.random(POINTS) < self._outliers
        points[strays] += chance.uniform(-5, 5, (int(strays.sum()), 3))
        if index:
            points = points[y > -SIDE / 2 + self._hidden * SIDE]
        return PointCloud.from_arrays(pose_of_head(index).points(points))

    def faces(self, index: int) -> Faces:
        return Faces.joined([])


class RollingHills(RigidHills):
    """Hills with other waves in each frame. Nothing stays rigid, so the region shrinks in each round."""

    def heights(self, index: int, x: NDArray, y: NDArray) -> NDArray[np.float64]:
        waves = 0.35 * np.sin(x + 1.7 * index) * np.cos(0.8 * y - 2.3 * index)
        return super().heights(index, x, y) + waves


def opened(source: RigidHills) -> Timeline:
    return Timeline(source, source.times(), "mm")


def whole(timeline: Timeline, frame: int = 0) -> MotionReference:
    """A reference whose region is the whole patch."""
    pose = timeline.pose(frame)
    return MotionReference.of(pose, np.arange(pose.count), frame)
