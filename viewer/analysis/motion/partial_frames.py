"""Frames in which points are followed so far, in a folder, so that work goes on where it was stopped."""

from __future__ import annotations

import json
import shutil
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...files import output_folder, parsed_json, read_text, reading, save_json, whole_file
from ..tracking.body import BodyPose
from .dense import TrackedFrame

_KEY = "key.json"
_ARRAYS = "displacement", "sigma", "state", "rows"
_MOST_BYTES = 1 << 20
_HINT = "Delete the folder to begin anew"


class PartialFrames:
    """A folder with a file for each frame. key: what the frames are of, plain JSON; those of anything else
    are deleted. Raises InputError where the folder cannot be read or made."""

    def __init__(self, folder: Path, key: Mapping[str, Any]) -> None:
        self.folder = folder
        wanted = json.loads(json.dumps(key))
        if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
            with reading(folder / _KEY, "does not say what the frames are of", _HINT):
                is_same = parsed_json(read_text(folder / _KEY, _MOST_BYTES)) == wanted
            if is_same:
                return
            self.end()
        output_folder(folder)
        save_json(folder / _KEY, wanted)

    def __contains__(self, frame: int) -> bool:
        return self._file(frame).exists()

    def read(self, frame: int) -> TrackedFrame:
        """The points in a frame. Raises InputError where its file is damaged."""
        path = self._file(frame)
        with reading(path, "does not hold the points of a frame", _HINT):
            try:
                with np.load(path, allow_pickle=False) as held:
                    return TrackedFrame(
                        held["displacement"],
                        held["sigma"],
                        held["state"],
                        BodyPose(held["nodes"], held["turns"]) if "nodes" in held else None,
                        held["rows"],
                    )
            except (KeyError, zipfile.BadZipFile) as error:
                raise ValueError(f"{type(error).__name__}: {error}") from error

    def save(self, frame: int, found: TrackedFrame) -> None:
        """Write the points in a frame, in one step. Raises InputError."""
        arrays = {name: getattr(found, name) for name in _ARRAYS}
        if found.pose is not None:
            arrays |= {"nodes": found.pose.positions, "turns": found.pose.turns}
        with whole_file(self._file(frame)) as temporary, open(temporary, "wb") as stream:
            np.savez(stream, allow_pickle=False, **arrays)

    def end(self) -> None:
        """Delete the folder's frames: all is written elsewhere, or of something else."""
        shutil.rmtree(self.folder)

    def _file(self, frame: int) -> Path:
        return self.folder / f"frame_{frame:06d}.npz"
