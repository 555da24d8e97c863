"""What pixels of a viewport show, read from the GPU no more often than the picture can have changed."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...analysis.pick import Picked, before_gap, pick
from ...output.labels import covered_cells
from ...picture.surface import Surface


class ProbedView(Protocol):
    """A viewport, as `Probe` needs it."""

    surface: Surface | None
    size: tuple[int, int]
    number: int

    @property
    def is_there(self) -> bool:
        """Whether there is a picture to show."""

    def finish(self) -> None:
        """Draw the picture in full, if it is a preview."""


class Probe:
    """Reads what pixels of a viewport's picture show."""

    def __init__(self, viewport: ProbedView) -> None:
        self._viewport = viewport
        self._picked: tuple[tuple[int, int], Picked | None] | None = None
        self._covered: tuple[int, NDArray[np.bool_]] | None = None  # by the number of the picture

    def forget(self) -> None:
        """Forget what was picked, since another picture comes."""
        self._picked = None

    def pick(self, pixel: tuple[int, int]) -> Picked | None:
        """The position that a pixel shows, without its spacing, never through a gap (`before_gap`).

        Read from the GPU once for each position and picture.
        """
        if self._viewport.surface is None or not self._viewport.is_there:
            return None
        if self._picked is None or self._picked[0] != pixel:
            at = self.pixel_of_picture(pixel)
            meant = before_gap(self._viewport.surface, *at)
            self._picked = pixel, pick(self._viewport.surface, *at, shown=meant, spacing=False)
        return self._picked[1]

    def pixel_of_picture(self, pixel: tuple[int, int]) -> tuple[int, int]:
        """The pixel of the picture that shows the middle of one of the view, of which a preview has fewer."""
        if self._viewport.surface is None:
            return pixel
        (x, y), (width, height), (wide, high) = pixel, self._viewport.surface.size, self._viewport.size
        return math.floor((x + 0.5) * width / wide), math.floor((y + 0.5) * height / high)

    def shows_near(self, pixel: tuple[int, int], reach: int) -> bool:
        """Whether the picture shows something at most so many pixels of the view beside one of them, across
        or down."""
        if self._viewport.surface is None or not self._viewport.is_there:
            return False
        away = max(1, round(reach * self._viewport.surface.size[1] / self._viewport.size[1]))
        return bool(
            np.isfinite(self._viewport.surface.depth_around(*self.pixel_of_picture(pixel), away)).any()
        )

    @property
    def covered(self) -> NDArray[np.bool_] | None:
        """The cells of the picture that show the subject (see `labels.covered_cells`), None without a
        picture.

        Read from the GPU once for each picture.
        """
        if self._viewport.surface is None or not self._viewport.is_there:
            return None
        if self._covered is None or self._covered[0] != self._viewport.number:
            self._covered = self._viewport.number, covered_cells(self._viewport.surface)
        return self._covered[1]

    def pick_in_full(self) -> Picked | None:
        """The last `pick` once more, in the picture in full; None where that was before another picture."""
        pixel = self._picked and self._picked[0]
        self._viewport.finish()
        return self.pick(pixel) if pixel else None
