"""The landmarks of a file on a scan: whether they are of it, moved onto its surface, and followed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..analysis.landmarks.landmark_set import LandmarkSet, why_apart
from ..analysis.landmarks.placed import landmarks_of, why_beside
from ..analysis.measures.series import surface_of
from ..analysis.track import Track
from ..analysis.tracking import track_landmarks
from ..errors import InputError
from ..scan.timeline import Timeline
from ..scan.times import frame_in_words
from ._console import tell, warn
from ._scans import framing

_NAMED = 3  # landmarks that a message names


def check_on_scan(path: Path, found: LandmarkSet, timeline: Timeline) -> None:
    """Raise InputError where landmarks of a file are not of this scan, or there are none."""
    if not found.is_defined.any():
        raise InputError("has no placed landmark", path, "Place landmarks in the window first")
    last = int(found.frames[-1])
    if found.is_framed and last >= len(timeline):
        raise InputError(
            f"has landmarks in {frame_in_words(last)}, but the scan has only {len(timeline)} frames", path,
            "The landmarks belong to another scan",
        )  # fmt: skip
    apart = why_apart(found, framing(timeline, range(len(timeline))))
    if apart is not None:
        hint = (
            "Use landmarks of this scan, and check that --axes and --unit state the axes and unit of the scan"
        )
        raise InputError(apart, path, hint)


def put_on_surface(found: LandmarkSet, timeline: Timeline, frame: int) -> LandmarkSet:
    """The landmarks moved onto the surface, and how far, in words; those that are far from it stay."""
    frames = found.frames if found.is_framed or len(found) > 1 else np.array([frame])
    positions, moves, astray = found.positions.copy(), [0.0], []
    for row, index in enumerate(frames.tolist()):
        columns = np.flatnonzero(found.is_defined[row])
        if index >= len(timeline) or not len(columns):
            continue
        surface = surface_of(timeline, timeline.visit(index))
        for column in columns:
            position = surface.nearest(positions[row, column])
            if position is None:
                astray.append(found.names[column])
            else:
                moves.append(float(np.linalg.norm(position - positions[row, column])))
                positions[row, column] = position
    unit = timeline.unit
    if max(moves) > 0:
        mean = np.mean(moves[1:])
        tell(
            f"Scan4D moves landmarks onto the surface, by {mean:.3g} {unit} on average and by at most "
            f"{max(moves):.3g} {unit}"
        )
    if astray:
        few = ", ".join(f"'{name}'" for name in list(dict.fromkeys(astray))[:_NAMED])
        what = f"Scan4D finds no surface near {len(astray)} positions of landmarks, such as {few}"
        warn(f"{what}. These landmarks stay where they are")
    return replace(found, positions=positions)


def tracks_in_frames(found: LandmarkSet, timeline: Timeline, frame: int) -> dict[str, Track]:
    """The landmarks in all frames, in the order of the file; those that are nowhere are pending."""
    landmarks = landmarks_of(found, timeline.pose, len(timeline), frame)
    beside = why_beside(landmarks)
    if beside is not None:
        warn(beside)
    tracks = track_landmarks(timeline, landmarks, first=frame)
    return {name: tracks.get(name) or Track.pending(timeline.times) for name in found.names}


def with_noise(tracks: Mapping[str, Track], noise: float) -> dict[str, Track]:
    """The tracks with the scanner's noise in their covariances."""
    spread = noise**2 * np.eye(3)
    return {name: replace(track, covariances=track.covariances + spread) for name, track in tracks.items()}
