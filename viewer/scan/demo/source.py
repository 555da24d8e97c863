"""The demo scan as a source of frames: a head that speaks, blinks and smiles, or moves as a variant does."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..faces import Faces
from ..points import PointCloud
from ..reading.record import Decision
from ..reading.sequence import Decided
from ..times import frame_in_words
from .asset import rest_points
from .motion import PERIOD, move, turn
from .variants import demo_motion

_MOST_GROWTH = 4.0  # of area; beyond it, at the corners of the mouth, larger radii would stick out


class DemoSource:
    """64 poses of a head in one loop of 2.56 s, computed when asked for.

    Point i is the same point of the subject in every pose. Each cloud has normals, colours,
    radii (the local spacing) and the scalar `displacement`, mm from the pose at rest.
    name: "demo", or a variant as `demo_motion` has it; raises InputError where there is none.
    """

    unit = "mm"
    files: tuple[Path, ...] = ()
    fps = 25.0

    def __init__(self, name: str = "demo") -> None:
        self.name = name
        self.motion = demo_motion(name)
        self.decided = Decided()
        self.decided.note(Decision("format", "the demo scan"))

    def __len__(self) -> int:
        return round(PERIOD * self.fps)

    def label(self, index: int) -> str:
        """The name of a pose."""
        return frame_in_words(index)

    def times(self) -> NDArray[np.float64]:
        """(T,) seconds."""
        return np.arange(len(self)) / self.fps

    def load(self, index: int) -> PointCloud:
        """Compute one pose; the first call reads the points at rest."""
        rest, time = rest_points(), index / self.fps
        skin, eyes = slice(0, rest.skin), slice(rest.skin, None)
        positions, normals, radii = rest.positions.copy(), rest.normals.copy(), rest.radii.copy()
        positions[:, skin], normals[:, skin], growth = move(
            rest.positions[:, skin], rest.normals[:, skin], time, self.motion
        )
        positions[:, eyes], normals[:, eyes] = turn(
            rest.positions[:, eyes], rest.normals[:, eyes], time, self.motion
        )
        radii[skin] *= np.sqrt(np.clip(growth, 1.0, _MOST_GROWTH))
        cloud = PointCloud.from_arrays(
            np.ascontiguousarray(positions.T),
            normals=normals.T,
            colors=rest.colors,
            radii=radii,
            scalars={"displacement": np.sqrt(np.square(positions - rest.positions).sum(axis=0))},
            origin=np.zeros(3),
            precise=False,
        )
        return replace(cloud, topology=self.name)

    def faces(self, index: int) -> Faces:
        """No faces: the points stand for themselves."""
        return Faces.joined([])
