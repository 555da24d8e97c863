"""How finely a scan is drawn while it moves, chosen by how long its pictures took. No clock inside."""

from __future__ import annotations

from functools import cache
from itertools import takewhile
from statistics import median
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_STEPS = tuple(2 ** (-n / 4) for n in range(1, 100))  # of points, or of pixels
_DENSE = 0.5  # points for each pixel that is drawn: more are seen by few, fewer leave holes between them
_SMALLEST = 0.35  # scale; below, fewer points gain more time than they cost of the picture
_FEWEST = 10_000  # points
# Where pictures go on from the one before, fewer points cost less of them than pixels do: which scale is gone
# down to, and then to how many points for each pixel that is drawn.
_KEPT = ((0.7, 0.4), (0.5, 0.4))
_LATE = {1: 4.0, 3: 2.0, 8: 1.25, 12: 1.0}  # pictures whose median tells by being so many times the goal
_SOON, _LATEST = 12, 48  # pictures that tell that more can be drawn; and where that was often wrong
_GAIN = 1.15  # times what the coarsest takes: where that is late too, what gains less is not left out
_MARGIN = 0.85  # of the goal that a picture may be expected to take: less than times vary
_SURE = 0.5  # of the goal: a picture at rest, without all that goes on in motion, was surely in time
_BASE_MS = 30.0  # at first: that a window takes for a picture, whatever it shows
_POINT = 5.0  # at first: what a point takes, in pixels
_NOISE = 0.3  # of what a picture takes, from one to the next
_DRIFT, _SHIFT = 0.1, 0.1  # of what all, and each part, takes, from one look to the next


class Detail(NamedTuple):
    """How finely a picture is drawn. share: of the points. scale: of width and height. 1 and 1: in full."""

    share: float = 1.0
    scale: float = 1.0

    @property
    def size(self) -> float:
        """How much is drawn, against all: less for each coarser detail."""
        return self.share * self.scale**2


@cache
def details(points: int, pixels: int, keeps: bool = False) -> tuple[Detail, ...]:
    """Details for a scan and a view of so many, from full to coarsest: fewer points where they are dense,
    fewer pixels, fewer points where they are dense in these. keeps: whether pictures go on from what the one
    before shows, so that few points in each suffice: these go before pixels as coarse as any."""
    dense = [1.0, *takewhile(lambda share: share * points >= _DENSE * pixels, _STEPS)]
    scales = [*takewhile(lambda scale: scale >= _SMALLEST, (step**0.5 for step in _STEPS))]
    few = [share for share in _STEPS if share < dense[-1] and share * points >= _FEWEST]
    steps = [Detail(share) for share in dense]
    for least_scale, least_points in (*(_KEPT if keeps else ()), (_SMALLEST, _DENSE)):
        share, scale = steps[-1]
        steps += [Detail(share, finer) for finer in scales if least_scale <= finer < scale]
        scale = steps[-1].scale
        least = least_points * scale**2 * pixels
        steps += [Detail(fewer, scale) for fewer in few if least <= fewer * points and fewer < share]
    return tuple(steps)


class Budget:
    """Chooses the detail to draw at, so that pictures take about as long as they may.

    Coarser pictures are drawn where several were late, finer ones only where what the pictures until then
    took says that they will be in time with a margin: the detail does not go up and down by itself.
    """

    def __init__(self, keeps: bool = False) -> None:
        """keeps: see `details`."""
        self.detail = Detail()
        self._keeps = keeps
        self._cost: _Cost | None = None
        self._times: list[float] = []  # ms, of pictures at this detail, not yet looked at
        self._patience = _SOON  # pictures until finer ones may be tried
        self._is_tried = False  # whether the last change was to finer ones

    def note(self, ms: float, detail: Detail, goal_ms: float, points: int, pixels: int) -> None:
        """Take in what a picture of a scan of so many points took at a detail, in a view of so many pixels,
        and should have taken at most."""
        if detail != self.detail:
            if detail == Detail() and ms <= _SURE * goal_ms:
                self.detail = detail
                self._times.clear()
            return
        self._times.append(ms)
        late = [
            self._times[-count:]
            for count, times in _LATE.items()
            if len(self._times) >= count and median(self._times[-count:]) > times * goal_ms
        ]
        if not late and len(self._times) < self._patience:
            return
        cost = self._learned(sorted([*late, self._times][0]), _work(detail, points, pixels))
        self._times.clear()
        steps = details(points, pixels, self._keeps)
        now = sum(step.size > detail.size for step in steps[:-1])  # it may be of another scan or view
        expected = [cost.ms(_work(step, points, pixels)) for step in steps]
        least_ms = _GAIN * expected[-1]
        wanted = sum(ms > max(_MARGIN * goal_ms, least_ms) for ms in expected)
        if late and expected[now] > least_ms:
            wanted = min(max(wanted, now + 1), len(steps) - 1)
        if late and self._is_tried:
            self._patience = min(2 * self._patience, _LATEST)
        self._is_tried = wanted < now
        if late or self._is_tried:
            self.detail = steps[wanted]

    def _learned(self, times: list[float], drawn: NDArray[np.float64]) -> _Cost:
        """The cost of pictures, now that some took these times, in ascending order."""
        ms = times[len(times) // 4]  # what else the machine does only adds to it
        if self._cost is None:
            self._cost = _Cost(ms, drawn)
        else:
            self._cost.learn(ms, drawn, len(times))
        return self._cost


class _Cost:
    """Time that a picture takes always, for each of its pixels and for each of its points, as far as pictures
    have told: a Kalman filter. All three may change together, as on a busy machine, and each a little."""

    def __init__(self, ms: float, drawn: NDArray[np.float64]) -> None:
        """Begin with one picture, whose parts are guessed."""
        base = min(_BASE_MS, 0.4 * ms)
        parts = drawn[1:] * (1.0, _POINT)
        self._mean = np.array([base, *(ms - base) * parts / parts.sum() / drawn[1:]])
        self._covariance = np.diag(np.square([_BASE_MS, *self._mean[1:]]))

    def ms(self, drawn: NDArray[np.float64]) -> float:
        """Milliseconds that a picture is expected to take. drawn: see `_work`."""
        return float(drawn @ self._mean)

    def learn(self, ms: float, drawn: NDArray[np.float64], pictures: int) -> None:
        """Take in what so many pictures took, a typical one of them."""
        mean = self._mean
        each = _SHIFT * np.maximum(mean, _BASE_MS / drawn)
        covariance = self._covariance + _DRIFT**2 * np.outer(mean, mean) + np.diag(each**2)
        toward = covariance @ drawn
        gain = toward / (drawn @ toward + (_NOISE * ms) ** 2 / pictures)
        self._mean = np.maximum(mean + gain * (ms - drawn @ mean), 0.0)
        self._covariance = covariance - np.outer(gain, toward)


def _work(detail: Detail, points: int, pixels: int) -> NDArray[np.float64]:
    """The work of a picture: one, its pixels and its points."""
    return np.array([1.0, detail.scale**2 * pixels, detail.share * max(points, 1)])
