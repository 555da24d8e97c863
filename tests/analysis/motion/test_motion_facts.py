"""Facts about motions: the fit without the reference, weak directions, and gaps with their reasons."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.analysis.motion.facts import MotionFacts
from viewer.analysis.motion.stabilise import FEW, FrameMotion, WeakLimits
from viewer.rigid import STILL

LIMITS, AXES = WeakLimits.of("mm", 2.0), np.eye(3)


def moved(within: float, shift: float = 0.0) -> FrameMotion:
    return FrameMotion(STILL, np.diag([shift**2, 0, 0, 0, 0, 0]), within=within)


def test_facts_tell_the_fit_of_other_frames_what_is_weak_and_gaps() -> None:
    known = {3: FrameMotion.gap(FEW), 0: moved(1.0), 2: moved(0.9, 0.3), 1: moved(0.98), 4: moved(0.98)}
    found = MotionFacts.of(known, 0, AXES, LIMITS)
    assert found.fit is not None
    assert (found.fit.mean, found.fit.least) == (pytest.approx(2.86 / 3), 0.9)
    assert found.fit.frame == 2
    assert not found.fit.is_rigid
    (weak,) = found.weak
    assert (weak.is_turn, weak.frames, weak.plus_minus) == (False, 1, pytest.approx(1.96 * 0.3))
    assert dict(found.gaps) == {3: FEW}


def test_a_reference_alone_has_no_fit() -> None:
    assert MotionFacts.of({0: moved(1.0)}, 0, AXES, LIMITS) == MotionFacts(None, (), {})
    found = MotionFacts.of({0: moved(1.0)}, None, AXES, LIMITS).fit
    assert found is not None, "of another scan"
    assert found.is_rigid


def test_a_point_spacing_is_close_where_the_unit_is_no_known_length() -> None:
    assert WeakLimits.of("m", 2.0).shift == pytest.approx(5e-4)
    assert WeakLimits.of("units", 2.0).shift == 2.0
