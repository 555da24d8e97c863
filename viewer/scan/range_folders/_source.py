"""The frames of a folder of range images, as a Timeline asks for them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...files import printable
from ..admission import admit, check_count, shared
from ..faces import Faces
from ..formats import one_message
from ..range_view import RangeView, memory_of_merging
from ..reading.sequence import Decided

MOST_VIEWS = 256  # of a frame
_MERGING_RATIO = 100  # of memory to the files: pictures of depth pack well, and points take far more bytes


@dataclass(frozen=True, eq=False)
class RangeFrames:
    """Frames of range views, each of them in files of its own.

    name: the scan's. labels: a file's name for each frame, at least one. read: the views of a frame one after
    the other, which may raise anything. files: all that is read, images first, as scans of one camera share
    calibration and poses, and the first file tells them apart. unit: of all views, as the files state it.
    recorded: the times that were stored with the frames, (T,) seconds, or None. package: that
    reads them; "" for Scan4D itself. decided: the decisions about the scan.
    """

    name: str
    labels: tuple[str, ...]
    read: Callable[[int], Iterator[RangeView]]
    files: tuple[Path, ...]
    unit: str | None
    recorded: Callable[[], NDArray[np.float64] | None] = lambda: None
    package: str = ""
    decided: Decided = field(default_factory=Decided)

    def __len__(self) -> int:
        return len(self.labels)

    def label(self, index: int) -> str:
        """The name of a frame's file."""
        return printable(self.labels[index])

    def times(self) -> NDArray[np.float64] | None:
        """(T,) seconds as stored with the frames, or None."""
        return self.recorded()

    def load(self, index: int) -> tuple[RangeView, ...]:
        """Read the views of a frame, whose files share one budget. Raises InputError."""
        views: list[RangeView] = []
        with one_message(self.label(index), "cannot be read"), shared() as budget:
            for view in self.read(index):
                views.append(view)
                budget.retained += view.nbytes
                check_count(len(views), MOST_VIEWS, "range views")
            budget.retained = 0  # the views are among what merging takes
            admit(budget.held, memory_of_merging(views), _MERGING_RATIO)
        return tuple(views)

    def faces(self, index: int) -> Faces:
        """No faces: range images are grids."""
        return Faces.joined([])
