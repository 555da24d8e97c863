"""Layers: what lies over the points of a pose, without being part of the scan."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..rigid import STILL, Rigid
from .pose import Pose


@dataclass(frozen=True, eq=False)
class Layers:
    """Numbers that were computed of a pose's points, and where the pose is moved to.

    scalars: name -> (N,) array of any real type, by row of the pose's cloud; a name that the scan has too
    stands for these. An array that is given again, be it in other Layers, is not uploaded again; to change
    numbers, give a new array. place: from the scan's coordinates to the world's.
    """

    scalars: Mapping[str, NDArray[np.generic]] = field(default_factory=dict)
    place: Rigid = STILL

    def check(self, pose: Pose) -> None:
        """Raise InputError where there are not as many numbers as points."""
        for name, values in self.scalars.items():
            if np.shape(values) != (len(pose.cloud),) or values.dtype.kind not in "fiub":
                found = f"{np.shape(values)} {values.dtype}"
                raise InputError(f"the layer '{name}' is {found}, expected {len(pose.cloud):,} numbers")

    def names(self, scalars: Iterable[str]) -> list[str]:
        """The names of all numbers there are: the scan's first."""
        return list(dict.fromkeys([*scalars, *self.scalars]))


NO_LAYERS = Layers()
