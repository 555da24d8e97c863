"""CW: code words, each picture as the range view of its camera; `viewer/codewords/` reads and draws them.

A pixel has the depth of its disc, and the colour that the disc has in the picture, with its light.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...codewords.engine import CodePicture, draw_words
from ...codewords.files import WordFile
from ...errors import EmptyFrame, InputError
from ..admission import admit
from ..range_view import RangeView, memory_of_merging

TITLE = "CW"
SUFFIXES = (".cw",)

_PIXEL_BYTES = 24  # of drawing, and of a view's depth, mask and colour
_RATIO = 40  # of memory to the file: most words cover many pixels


def frame_count(path: Path) -> int:
    """How many pictures there are, by the index."""
    return len(WordFile(path))


def read_times(path: Path) -> NDArray[np.float64] | None:
    """(T,) seconds, None of a file of one picture."""
    return WordFile(path).times


def read(path: Path, frame: int = 0) -> tuple[RangeView, ...]:
    """One picture as a range view. Raises InputError where it is damaged or stores no camera."""
    return Frames(path).read(frame)


class Frames:
    """The pictures of one file."""

    def __init__(self, path: Path) -> None:
        """Reads the index. Raises InputError where the file holds something else."""
        self._file = WordFile(path)

    def read(self, frame: int) -> tuple[RangeView, ...]:
        """One picture as a range view."""
        stream = self._file.read(frame)
        pixels = stream.size[0] * stream.size[1]
        admit(self._file.nbytes, stream.nbytes + _PIXEL_BYTES * pixels, _RATIO)
        view = _view_of(draw_words(stream))
        admit(self._file.nbytes, memory_of_merging([view]), _RATIO)
        return (view,)


def _view_of(picture: CodePicture) -> RangeView:
    stream = picture.stream
    if stream.camera is None:
        raise InputError(
            "the code words store no camera, so Scan4D does not know where their pixels lie in space",
            hint="Draw them with 'scan4d render', or write the file again",
        )
    if not picture.covered.any():
        raise EmptyFrame("shows no disc")
    samples = stream.samples
    scale = stream.camera[0] / samples
    # The sample that a pixel's depth is of lies right of and below its middle.
    center_x, center_y = (stream.camera[1:3] - samples // 2 - 0.5) / samples + 0.5
    world_to_camera = np.vstack([stream.camera[3:].reshape(3, 4), [0.0, 0.0, 0.0, 1.0]])
    return RangeView(
        depth=picture.depths(), kind="z" if stream.perspective else "height", mask=picture.covered,
        color=np.ascontiguousarray(picture.image[..., :3]), fx=float(scale), fy=float(scale),
        cx=float(center_x), cy=float(center_y),
        world_to_camera=world_to_camera,
    )  # fmt: skip
