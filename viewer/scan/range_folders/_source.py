"""The frames of a folder of range images, as a Timeline asks for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...files import printable
from ..faces import Faces
from ..formats import one_message
from ..range_view import RangeView


@dataclass(frozen=True, eq=False)
class RangeFrames:
    """Frames of range views, each of them in files of its own.

    name: the scan's. labels: a file's name for each frame, at least one. read: the views of a frame, which
    may raise anything. files: all that is read, calibration and poses among them. unit: of all views, as
    the files tell it.
    recorded: the times that were stored with the frames, (T,) seconds, or None.
    """

    name: str
    labels: tuple[str, ...]
    read: Callable[[int], tuple[RangeView, ...]]
    files: tuple[Path, ...]
    unit: str | None
    recorded: Callable[[], NDArray[np.float64] | None] = lambda: None

    def __len__(self) -> int:
        return len(self.labels)

    def label(self, index: int) -> str:
        """The name of a frame's file."""
        return printable(self.labels[index])

    def times(self) -> NDArray[np.float64] | None:
        """(T,) seconds as stored with the frames, or None."""
        return self.recorded()

    def load(self, index: int) -> tuple[RangeView, ...]:
        """Read the views of a frame. Raises InputError."""
        with one_message(self.label(index), "cannot be read"):
            return self.read(index)

    def faces(self, index: int) -> Faces:
        """No faces: range images are grids."""
        return Faces.joined([])
