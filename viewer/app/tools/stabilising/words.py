"""What is said of motions: how well the region fits, what it leaves open, and which frames are gaps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ....analysis.motion.facts import MotionFacts
from ....analysis.motion.stabilise import FrameMotion
from ....analysis.track import Known
from ....output.overlays import STATE_MARKS
from ....scan.times import frame_in_words
from ....scan.units import Scale
from ...tool_context import FrameSpan
from .stabiliser import Motions

_GAP_COLOR = STATE_MARKS[Known.GAP].color


class Facts(NamedTuple):
    """Lines on motions. warnings: those that the user should act on."""

    lines: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def facts_of(motions: Motions, known: Mapping[int, FrameMotion], axes: np.ndarray, scale: Scale) -> Facts:
    """Say what is known of the motions. axes: (3, 3), see `anatomical_axes`."""
    pose = motions.pose
    if motions.reference is None or pose is None:
        return Facts()
    share = len(motions.rows) / max(pose.count, 1)
    reference = motions.asked.choices.reference
    lines = [f"The region has {len(motions.rows):,} points, {share:.0%} of {frame_in_words(reference)}."]
    warnings = []
    found = MotionFacts.of(known, reference, axes, motions.limits)
    if found.fit is not None:
        close = f"±{scale.factor * motions.limits.shift:.3g} {scale.unit}"
        lines.append(
            f"Distances of the region within {close}: {found.fit.mean:.1%}. "
            f"Least: {found.fit.least:.1%} in {frame_in_words(found.fit.frame)}."
        )
        if not found.fit.is_rigid:
            warnings.append("The region does not stay rigid in all frames. Choose another region.")
    for one in found.weak:
        amount = one if one.is_turn else replace(one, plus_minus=scale.factor * one.plus_minus)
        warnings.append(f"{amount.in_words(scale.unit)} (in {one.frames} of {len(known)} frames).")
    if found.gaps:
        first, reason = next(iter(found.gaps.items()))
        number = "1 frame is a gap" if len(found.gaps) == 1 else f"{len(found.gaps)} frames are gaps"
        warnings.append(f"{number}, shown as recorded, such as {frame_in_words(first)}: {reason}.")
    return Facts(tuple(lines), tuple(warnings))


def motion_gap_spans(known: Mapping[int, FrameMotion]) -> list[FrameSpan]:
    """The runs of frames that are gaps for the same reason, for the timeline."""
    spans: list[FrameSpan] = []
    for frame in sorted(frame for frame, one in known.items() if one.motion is None):
        words = f"Not stabilised: {known[frame].reason}"
        start = frame
        if spans and spans[-1].frames.stop == frame and spans[-1].words == words:
            start = spans.pop().frames.start
        spans.append(FrameSpan(range(start, frame + 1), _GAP_COLOR, words))
    return spans
