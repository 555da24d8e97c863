"""Motions of frames that are known so far, in a file, so that work goes on where it was stopped."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...files import parsed_json, read_text, reading, save_json
from ...rigid import Rigid
from .stabilise import FrameMotion

_MOST_BYTES = 1 << 28


class PartialMotions:
    """A file of motions. key: what they are of, plain JSON; motions of anything else are not read."""

    def __init__(self, path: Path, key: Mapping[str, Any]) -> None:
        self.path = path
        self._key = json.dumps(key, sort_keys=True)

    def read(self) -> dict[int, FrameMotion]:
        """The motions by frame, none without a file. Raises InputError where the file is damaged."""
        if not self.path.exists():
            return {}
        with reading(self.path, "does not hold motions", "Delete the file to begin anew"):
            try:
                said = parsed_json(read_text(self.path, _MOST_BYTES))
                frames = said["frames"] if said["key"] == self._key else {}
                return {int(frame): _motion(values) for frame, values in frames.items()}
            except (AttributeError, KeyError, TypeError) as error:
                raise ValueError(f"{type(error).__name__}: {error}") from error

    def save(self, known: Mapping[int, FrameMotion]) -> None:
        """Write the motions by frame, in one step. Raises InputError."""
        save_json(self.path, {"key": self._key, "frames": {n: _values(one) for n, one in known.items()}})


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
