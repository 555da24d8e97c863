"""Tracked landmarks against the truth: how far off, how well they know it, which gaps are right."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from time import process_time

import numpy as np

from experiments.landmarks.known import KnownScan
from viewer.analysis.landmarks import Landmark
from viewer.analysis.landmarks.landmark_set import LandmarkSet
from viewer.analysis.landmarks.placed import landmarks_of
from viewer.analysis.surface_point import SurfacePoint
from viewer.analysis.track import Known, Track
from viewer.geometry import vector
from viewer.scan.spacing import nearest_row
from viewer.scan.timeline import Timeline

_WRONG = 3.0  # spacings: an error from which on a position is that of another part of the surface
_EXACT = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # covariance of a key: it is the truth


@dataclass(frozen=True)
class Judgement:
    """Figures of a tracked scan.

    frames, landmarks: how many. spacing: of the points, scan units. median, p95, worst: errors, scan units,
    in frames that count as tracked where the truth is in the scan. within: share of these errors that are
    at most two standard deviations (`Track.sigmas`). wrong: share of them above three spacings. hidden: in
    how many frames landmarks are, all counted together. gaps_hit: the share of them that are gaps, NaN
    without any. gaps_false: the share of gaps where the truth is in the scan. seconds: of processor time, a
    frame.
    """

    name: str
    frames: int
    landmarks: int
    spacing: float
    median: float
    p95: float
    worst: float
    within: float
    wrong: float
    hidden: int
    gaps_hit: float
    gaps_false: float
    seconds: float


def keyed_landmarks(known: KnownScan, keys: int = 1) -> list[Landmark]:
    """The landmarks of a scan, each set at the truth, in the first of the frames that have it.

    keys: in how many of these frames it is set; of several, the last is one, and the others are even.
    """
    landmarks = []
    for number, name in enumerate(known.names):
        landmark, there = Landmark(name), np.flatnonzero(known.counted[:, number])
        for frame in dict.fromkeys(there[np.linspace(0, len(there) - 1, keys).astype(int)].tolist()):
            position = known.paths[frame, number]
            row, _ = nearest_row(known.source.load(frame), position)
            time = float(known.source.times()[frame])
            point = SurfacePoint(frame, time, vector(position), row, known.spacing, 0, _EXACT)
            landmark = landmark.with_key(point)
        landmarks.append(landmark)
    return landmarks


def filed_landmarks(known: KnownScan, timeline: Timeline) -> list[Landmark]:
    """The landmarks of a scan at their true places in its first frame, as from a file without deviations."""
    return list(landmarks_of(LandmarkSet.of(known.names, known.paths[:1]), timeline.visit, len(timeline), 0))


def judge_tracks(known: KnownScan, tracks: Mapping[str, Track], seconds: float = np.nan) -> Judgement:
    """Judge tracks of `keyed_landmarks`, by name. seconds: what tracking took a frame."""
    states = np.stack([tracks[name].known for name in known.names], axis=1)
    positions = np.stack([tracks[name].positions for name in known.names], axis=1)
    sigmas = np.stack([tracks[name].sigmas for name in known.names], axis=1)
    tracked = np.isin(states, (Known.TRACKED, Known.CARRIED)) & known.counted
    errors = np.linalg.norm(positions - known.paths, axis=2)[tracked]
    gaps = states == Known.GAP
    asked = known.counted & (states != Known.PLACED)

    def share(of: np.ndarray) -> float:
        return float(of.mean()) if of.size else np.nan

    median, p95, worst = np.quantile(errors, [0.5, 0.95, 1.0]) if errors.size else [np.nan] * 3
    return Judgement(
        name=known.name,
        frames=len(states),
        landmarks=len(known.names),
        spacing=known.spacing,
        median=float(median),
        p95=float(p95),
        worst=float(worst),
        within=share(errors <= 2 * sigmas[tracked]),
        wrong=share(errors > _WRONG * known.spacing),
        hidden=int(known.hidden.sum()),
        gaps_hit=share(gaps[known.hidden]),
        gaps_false=share(gaps[asked]),
        seconds=seconds,
    )


def judge_tracking(
    known: KnownScan,
    tracker: Callable[[Timeline, Sequence[Landmark]], Mapping[str, Track]],
    keys: int = 1,
    *,
    from_file: bool = False,
) -> Judgement:
    """Judge a tracker on a scan. tracker: tracks the landmarks of a timeline, such as `track_landmarks`.

    keys: in how many frames each landmark is set, see `keyed_landmarks`. from_file: see `filed_landmarks`.
    """
    with Timeline(known.source, known.source.times()) as timeline:
        landmarks = filed_landmarks(known, timeline) if from_file else keyed_landmarks(known, keys)
        began = process_time()
        tracks = tracker(timeline, landmarks)
        return judge_tracks(known, tracks, (process_time() - began) / len(timeline))
