"""Ranges of the numbers that a scan is coloured by, over all of its frames: one colour is one value."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, unknown_name
from ..geometry import up_vector
from ..look import Look, drawable, value_source
from .layers import NO_LAYERS, Layers
from .points import PointCloud, strided
from .pose import Pose
from .timeline import Timeline

Source = tuple[str, str]  # what colours come from, and the axis of heights
_Spread = tuple[float, float, float, float]


def robust_range(values: NDArray) -> tuple[float, float]:
    """The 2 % and 98 % quantiles of the finite values (N,), as float64; all of them where these are one
    value; (0, 1) where there is none."""
    spread = _spread(values)
    return (0.0, 1.0) if spread is None else _union([spread])


def scalar_range(cloud: PointCloud, name: str) -> tuple[float, float]:
    """The 2 % and 98 % quantiles of a scalar's finite values. Found once. Raises InputError that lists the
    scalars."""
    if name not in cloud.scalars:
        raise unknown_name("scalar", name, list(cloud.scalars))
    return cloud.remember(_scalar_range, name)


def _scalar_range(cloud: PointCloud, name: str) -> tuple[float, float]:
    return robust_range(strided(cloud.scalars[name]))


def _spread(values: NDArray) -> _Spread | None:
    """Least value, 2 % and 98 % quantiles, largest value of the finite ones; None where there is none."""
    finite = values.astype(np.float64)
    finite = finite[np.isfinite(finite)]
    if not len(finite):
        return None
    low, high = (float(v) for v in np.quantile(finite, [0.02, 0.98]))
    return float(finite.min()), low, high, float(finite.max())


def _union(spreads: Sequence[_Spread]) -> tuple[float, float]:
    least, lows, highs, most = zip(*spreads, strict=True)
    low, high = min(lows), max(highs)
    return (low, high) if high > low else (min(least), max(most))


def point_values(pose: Pose, look: Look, layers: Layers = NO_LAYERS) -> NDArray | None:
    """Some thousands of the numbers of a pose's points that a look colours by, (M,): heights or a scalar.

    None where colours come from none, or from what depends on the view.
    """
    scalars = {**pose.overview.scalars, **layers.scalars}
    source = value_source(drawable(look, scalars), scalars)
    if source == "height":
        return layers.world_from_pose.points(pose.sample + pose.origin) @ up_vector(look.up)
    return None if source in (None, "depth") else strided(scalars[source])


class ValueRanges:
    """Ranges over the frames of one scan, of each source of colours that was asked for.

    A range spans those of the frames, each without its outliers: what happens in few frames has its colours
    too. A frame that has no such numbers, or is broken, counts as known. Any thread may call any method.
    """

    def __init__(self, count: int) -> None:
        """count: of the scan's frames."""
        self.count = count
        self._state = threading.Lock()
        self._known: dict[Source, dict[int, _Spread | None]] = {}

    def has(self, index: int, look: Look) -> bool:
        """Whether a frame is known."""
        with self._state:
            return index in self._known.get(_source(look), {})

    def known(self, look: Look) -> int:
        """How many frames are known."""
        with self._state:
            return len(self._known.get(_source(look), {}))

    def take(self, pose: Pose, look: Look, layers: Layers = NO_LAYERS) -> None:
        """Take in what the look colours by of a frame, unless it is known."""
        if not self.has(pose.index, look):
            values = point_values(pose, look, layers)
            self._note(pose.index, look, None if values is None else _spread(values))

    def leave_out(self, index: int, look: Look) -> None:
        """Count a frame that cannot be read as known."""
        self._note(index, look, None)

    def _note(self, index: int, look: Look, spread: _Spread | None) -> None:
        with self._state:
            self._known.setdefault(_source(look), {})[index] = spread

    def range(self, look: Look) -> tuple[float, float] | None:
        """The least of the 2 % quantiles and the largest of the 98 % quantiles of the frames that are known;
        None where none of them has such numbers."""
        with self._state:
            found = [spread for spread in self._known.get(_source(look), {}).values() if spread is not None]
        return _union(found) if found else None

    def gather(self, timeline: Timeline, look: Look, indices: Iterable[int]) -> None:
        """Take in frames of the scan; it reads those that it has to read one at a time, and drops them."""
        for index in indices:
            if self.has(index, look):
                continue
            try:
                pose = timeline.visit(index)
            except InputError:
                self.leave_out(index, look)
            else:
                self.take(pose, look)


def _source(look: Look) -> Source:
    return look.color_by, look.up if look.color_by == "height" else ""
