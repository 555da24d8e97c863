"""What is said of landmarks."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ....analysis.landmarks import Landmark
from ....analysis.track import Known, Track
from ....output.overlays import STATE_MARKS
from ....scan.units import Scale
from ...tool_context import FrameSpan
from .shown import ShownLandmarks

_GAP_COLOR = STATE_MARKS[Known.GAP].color
_DECIMALS = 6  # at most
_MOST_NAMED = 4  # of the landmarks that are gaps in a frame


def position_words(shown: ShownLandmarks, number: int, scale: Scale) -> str:
    """The position of one and its uncertainty with 95 %; "" where it is not known."""
    if not shown.is_there[number]:
        return ""
    sure, factor = float(shown.sure[number]), scale.factor
    decimals = min(max(1 - math.floor(math.log10(factor * sure)), 0), _DECIMALS) if sure > 0 else _DECIMALS
    position = ", ".join(f"{factor * v:.{decimals}f}" for v in shown.positions[number])
    return f"{position} ± {factor * sure:.2g} {scale.unit}" if sure > 0 else f"{position} {scale.unit}"


def corners_words(states: Sequence[str]) -> str:
    """Say how many corners a region has, and how they stand, the commonest state first."""
    counts = [state if count == len(states) else f"{count} {state}" for state, count in Counter(
        state.partition(":")[0] for state in states
    ).most_common()]  # fmt: skip
    return f"{len(states)} corners: {', '.join(counts)}"


def placed_words(landmarks: Sequence[Landmark]) -> str:
    """Say that no landmark waits, and how many of them are skipped or not visible instead of placed."""
    counts = Counter(landmark.state for landmark in landmarks)
    others = {"skipped": counts["skipped"], "not visible": counts["not placed"]}
    if not any(others.values()):
        return "All landmarks are placed"
    rest = "".join(f", {count} {state}" for state, count in others.items() if count)
    return f"{counts['placed']} of {len(landmarks)} landmarks are placed{rest}"


def gap_spans(
    landmarks: Iterable[Landmark], tracks: Mapping[str, Track], regions: Mapping[str, str]
) -> list[FrameSpan]:
    """The runs of frames in which the same landmarks are gaps, for the timeline. regions: names of corners ->
    of their regions, which are named instead."""
    listed = [landmark.name for landmark in landmarks if landmark.name in tracks]
    if not listed:
        return []
    gaps = np.stack([tracks[name].known for name in listed], axis=1) == Known.GAP
    by_frame = {
        int(frame): [listed[number] for number in np.flatnonzero(gaps[frame])]
        for frame in np.flatnonzero(gaps.any(axis=1))
    }
    spans: list[FrameSpan] = []
    last: Sequence[str] = ()
    for frame, gone in by_frame.items():
        names = list(dict.fromkeys(regions.get(name, name) for name in gone))
        if spans and spans[-1].frames.stop == frame and names == last:
            spans[-1] = FrameSpan(range(spans[-1].frames.start, frame + 1), _GAP_COLOR, spans[-1].words)
        else:
            more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
            words = f"No data for {', '.join(names[:_MOST_NAMED])}{more}"
            spans.append(FrameSpan(range(frame, frame + 1), _GAP_COLOR, words))
        last = names
    return spans
