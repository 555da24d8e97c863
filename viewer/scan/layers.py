"""Layers: numbers and motions over the points of a pose that are not part of the scan."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..rigid import STILL, Rigid
from .pose import Pose


@dataclass(frozen=True, eq=False)
class Layers:
    """Numbers computed for a pose's points, and the pose's motion.

    scalars: name -> (N,) array of any real type, by row of the pose's cloud; it has precedence over a scalar
    of the scan with that name. Scan4D does not upload the same array twice, even in other Layers; for other
    numbers, give a new array. world_from_pose: from the scan's coordinates to the world's.
    """

    scalars: Mapping[str, NDArray[np.generic]] = field(default_factory=dict)
    world_from_pose: Rigid = STILL

    def check(self, pose: Pose) -> None:
        """Raise InputError unless there is one number for each point."""
        for name, values in self.scalars.items():
            if np.shape(values) != (len(pose.cloud),) or values.dtype.kind not in "fiub":
                found = f"{np.shape(values)} {values.dtype}"
                raise InputError(f"the layer '{name}' is {found}, expected {len(pose.cloud):,} numbers")

    def names(self, scalars: Iterable[str]) -> list[str]:
        """The names of all numbers there are: the scan's first."""
        return list(dict.fromkeys([*scalars, *self.scalars]))

    def without(self, names: Collection[str]) -> Layers:
        """The layers without some of the numbers."""
        left = {name: values for name, values in self.scalars.items() if name not in names}
        return replace(self, scalars=left)


NO_LAYERS = Layers()
