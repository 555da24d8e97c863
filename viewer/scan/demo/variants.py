"""Variants of the demo scan: the same head, moving otherwise, as exactly known and as chance has it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...errors import InputError, unknown_name
from .motion import BROW, EYELID, JAW, MOUTH_CORNER, TALK, Bend, HeadMotion, Peak, Turn

_MOST_TURNED = np.radians(15.0)
_NOD, _SHAKE, _TILT = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
_BOTH_WAYS = (0.25, 0.75)  # of a period: when a swing is farthest


def _smile(rng: np.random.Generator) -> HeadMotion:
    """A smile of one side, which the other hardly shares; the lips part a little."""
    shares = [1.0, rng.uniform(0.0, 0.15)]
    rng.shuffle(shares)
    peak = Peak(rng.uniform(0.14, 0.18), rng.uniform(0.4, 0.6), rng.uniform(2.0, 4.0))
    return HeadMotion(
        (
            Bend(BROW, (Peak(rng.uniform(0.0, 0.03), peak.center, peak.sharpness),)),
            Bend(JAW, (Peak(rng.uniform(0.0, 0.03), peak.center, peak.sharpness),)),
            Bend(MOUTH_CORNER, (peak,), (shares[0], shares[1])),
        )
    )


def _sway(rng: np.random.Generator) -> HeadMotion:
    """A head that turns to either side and nods by 15 degrees, and tilts a little, as it talks."""
    phase = rng.uniform(0.0, 1.0)
    return HeadMotion(
        TALK.bends,
        (
            _swing(_NOD, _MOST_TURNED, phase + rng.uniform(0.1, 0.4)),
            _swing(_SHAKE, _MOST_TURNED, phase),
            _swing(_TILT, rng.uniform(-0.4, 0.4) * _MOST_TURNED, phase + rng.uniform(0.0, 1.0)),
        ),
    )


def _cough(rng: np.random.Generator) -> HeadMotion:
    """Coughs in quick succession: the jaw drops in a tenth of a second, the head jerks, the eyes shut."""
    start, apart = rng.uniform(0.2, 0.3), rng.uniform(0.15, 0.2)
    centers = [start + apart * number for number in range(3)]
    heights, sharpness = rng.uniform(0.6, 1.0, 3), rng.uniform(50.0, 80.0)

    def bursts(most: float, delay: float = 0.0) -> tuple[Peak, ...]:
        return tuple(
            Peak(most * height, center + delay, sharpness)
            for center, height in zip(centers, heights, strict=True)
        )

    return HeadMotion(
        (
            Bend(EYELID, (Peak(0.6, centers[1], 12.0),)),
            Bend(JAW, bursts(0.15)),
            Bend(MOUTH_CORNER, bursts(-0.04)),
        ),
        (Turn(_NOD, bursts(np.radians(6.0), 0.01)),),
    )


def _swing(axis: tuple[float, float, float], most: float, phase: float) -> Turn:
    """A turn to either side. most: radians; phase: in periods."""
    there, back = _BOTH_WAYS
    return Turn(axis, (Peak(most, there + phase, 3.0), Peak(-most, back + phase, 3.0)))


VARIANTS: dict[str, Callable[[np.random.Generator], HeadMotion]] = {
    "smile": _smile,
    "sway": _sway,
    "cough": _cough,
}


def demo_motion(scan: str) -> HeadMotion:
    """The motion of the demo by its name: "demo", "demo:VARIANT" or "demo:VARIANT:SEED", of seed 0
    by default. Raises InputError for a variant that there is not, and a seed that is no whole number."""
    _, named, which = scan.partition(":")
    if not named:
        return TALK
    variant, _, seed = which.partition(":")
    if variant not in VARIANTS:
        raise unknown_name("variant of the demo", variant, VARIANTS)
    if seed and not (seed.isascii() and seed.isdigit() and len(seed) <= 18):
        raise InputError(
            f"'{seed}' is not a seed", scan, "Use a whole number of at least 0, such as demo:smile:3"
        )
    return VARIANTS[variant](np.random.default_rng(int(seed or 0)))
