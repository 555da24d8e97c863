"""The region and the motions that are known so far, in a file, so that work goes on where it was stopped."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...files import parsed_json, read_text, reading, save_json
from ...rigid import Rigid
from ...scan.pose import Pose
from ...scan.timeline import Timeline
from .found import found_region
from .region import RigidRegion
from .stabilise import FrameMotion

_MOST_BYTES = 1 << 28


class PartialMotions:
    """A file of motions, and of the region that Scan4D has found for them.

    key: what they are of, plain JSON; what is of anything else is not read.
    """

    def __init__(self, path: Path, key: Mapping[str, Any]) -> None:
        self.path = path
        self._key = json.dumps(key, sort_keys=True)
        self._region: list[int] = []  # ids of its points, as far as it was found

    @property
    def has_region(self) -> bool:
        """Whether the region is there, so that `found_rows` does not look for it."""
        return bool(self._region)

    def read(self) -> dict[int, FrameMotion]:
        """The motions by frame, none without a file. Raises InputError where the file is damaged."""
        if not self.path.exists():
            return {}
        with reading(self.path, "does not hold motions", "Delete the file to begin anew"):
            try:
                said = parsed_json(read_text(self.path, _MOST_BYTES))
                if said["key"] != self._key:
                    return {}
                self._region = [int(point) for point in said["region"]]
                return {int(frame): _motion(values) for frame, values in said["frames"].items()}
            except (AttributeError, KeyError, TypeError) as error:
                raise ValueError(f"{type(error).__name__}: {error}") from error

    def save(self, known: Mapping[int, FrameMotion]) -> None:
        """Write the motions by frame, in one step. Raises InputError."""
        frames = {frame: _values(one) for frame, one in known.items()}
        save_json(self.path, {"key": self._key, "region": self._region, "frames": frames})

    def found_rows(self, timeline: Timeline, pose: Pose, frame: int | None) -> NDArray[np.int64]:
        """The rows of `found_region`, which are not found again where `read` came by them; else the file
        keeps them from the next `save` on."""
        cloud = pose.cloud
        if self.has_region:
            return RigidRegion(np.empty((0, 4)), np.array(self._region)).rows(cloud, {})
        rows = found_region(timeline, pose, frame)
        self._region = (rows if cloud.ids is None else cloud.ids[rows]).tolist()
        return rows


def _values(found: FrameMotion) -> dict[str, Any]:
    """A motion as plain JSON; a gap has its reason alone."""
    if found.motion is None:
        return {"gap": found.reason}
    matrix, covariance = found.motion.matrix.tolist(), found.covariance.tolist()
    kept = {"within": found.within, "residual": found.residual}
    return {"motion": matrix, "covariance": covariance, **kept}


def _motion(values: Mapping[str, Any]) -> FrameMotion:
    if "gap" in values:
        return FrameMotion.gap(values["gap"])
    covariance = np.array(values["covariance"], np.float64).reshape(6, 6)
    within, residual = values["within"], values["residual"]
    return FrameMotion(Rigid(np.array(values["motion"])), covariance, within=within, residual=residual)
