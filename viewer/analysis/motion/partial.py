"""Motions of frames that are known so far, in a file that grows by a line a frame, so that work goes on where
it was stopped."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError, explained
from ...files import open_plain
from ...rigid import Rigid
from .stabilise import FrameMotion


class PartialMotions:
    """A file of motions. key: what they are of; motions of anything else are not read, but replaced."""

    def __init__(self, path: Path, key: Mapping[str, Any]) -> None:
        self.path = path
        self._key = json.dumps(key, sort_keys=True)

    def read(self) -> dict[int, FrameMotion]:
        """The motions by frame; a line that was cut off ends them. Raises InputError."""
        try:
            with open_plain(self.path) as stream:
                first, *lines = stream.read().decode("utf-8", "replace").splitlines()
        except FileNotFoundError:
            return {}
        except (OSError, ValueError) as error:
            what, hint = explained(error) if isinstance(error, OSError) else (str(error), None)
            raise InputError(f"cannot be read: {what}", self.path, hint) from error
        known: dict[int, FrameMotion] = {}
        for line in lines if first == self._key else []:
            try:
                said = json.loads(line)
            except ValueError:
                break
            covariance = np.array(said["covariance"], np.float64).reshape(6, 6)
            motion = None if said["motion"] is None else Rigid(np.array(said["motion"]))
            known[said["frame"]] = FrameMotion(motion, covariance, said["reason"], said["within"])
        return known

    def begin(self, known: Mapping[int, FrameMotion]) -> None:
        """Write anew what is known. Raises InputError."""
        self._write("w", self._key, *(self._line(frame, motion) for frame, motion in known.items()))

    def add(self, frame: int, motion: FrameMotion) -> None:
        """Write one more frame. Raises InputError."""
        self._write("a", self._line(frame, motion))

    def end(self) -> None:
        """Delete the file: all is written elsewhere."""
        self.path.unlink(missing_ok=True)

    def _line(self, frame: int, found: FrameMotion) -> str:
        return json.dumps(
            {
                "frame": frame,
                "motion": None if found.motion is None else found.motion.matrix.tolist(),
                "covariance": found.covariance.ravel().tolist(),
                "reason": found.reason,
                "within": found.within,
            }
        )

    def _write(self, mode: str, *lines: str) -> None:
        try:
            with open(self.path, mode, encoding="utf-8") as stream:
                stream.writelines(f"{line}\n" for line in lines)
        except OSError as error:
            what, hint = explained(error)
            raise InputError(f"cannot be written: {what}", self.path, hint) from error
