"""`scan4d motion --dense`: where every point of the reference is in the frames."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..analysis.motion.dense import DensePoints, PointState, follow_points
from ..analysis.motion.displacements import mean_path_of
from ..analysis.motion.partial_frames import PartialFrames
from ..csv_text import cell
from ..scan.timeline import Timeline
from ._console import progress, tell, warn
from ._reference import StartOfMotion, key_of_partial
from ._rigid import RigidPart

_COLUMNS = (
    "region", "frame", "time", "x", "y", "z", "stabilised_x", "stabilised_y", "stabilised_z", "sigma", "seen",
)  # fmt: skip
_POOR = 0.5  # of the points: a warning where fewer are seen


def dense_part(args: Namespace, timeline: Timeline, reference: StartOfMotion, partial: Path) -> PartialFrames:
    """Follow every point of the reference; gives the frames, which a folder keeps. Raises InputError."""
    points = DensePoints(reference.pose)
    kept = PartialFrames(partial, key_of_partial(args, timeline, reference, points.reference))
    done = sum(index in kept for index in range(len(timeline)))
    if done:
        tell(f"Scan4D continues: all points in {done} of {len(timeline)} frames are known")
    with progress(len(timeline) - done) as tick:
        for _ in follow_points(timeline, points, reference.frame, kept):
            tick()
    return kept


def dense_facts(frames: int, reference: StartOfMotion, kept: PartialFrames) -> dict[str, Any]:
    """The facts for the report."""
    count, shares, bodies = reference.pose.count, [], 0
    for index in range(frames):
        one = kept.read(index)
        shares.append(np.bincount(one.state, minlength=3) / count)
        bodies += one.pose is not None
    states = np.array(shares)
    others = np.delete(states, [] if reference.frame is None else reference.frame, axis=0)
    return {
        "points": count,
        "same_points_in_file": not bodies and bool((others[:, PointState.LOST] < 1).any()),
        "states": {
            state.name.lower(): {"share": float(states[:, state].mean()), "frames": states[:, state].tolist()}
            for state in PointState
        },
    }


def path_rows(
    paths: Mapping[Path, NDArray[np.int64]], rigid: RigidPart, kept: PartialFrames
) -> list[Sequence[object]]:
    """The rows of paths.csv: the mean paths of regions, whose rows of the reference stand by their files."""
    timeline, reference = rigid.timeline, rigid.reference.pose.cloud.world()
    table: list[Sequence[object]] = [_COLUMNS]
    for file, rows in paths.items():
        frames = map(kept.read, range(len(timeline)))
        path = mean_path_of(reference, frames, rows)
        for index, position in enumerate(path.positions):
            motion = rigid.known[index].motion
            stabilised = np.full(3, np.nan) if motion is None else motion.inverse.points(position)
            numbers = map(cell, (*position, *stabilised, path.sigma[index], path.seen[index]))
            table.append([str(file), index + 1, float(timeline.times[index]), *numbers])
    return table


def tell_dense(found: Mapping[str, Any]) -> None:
    """The facts of the points in words."""
    count, states = found["points"], found["states"]
    if found["same_points_in_file"]:
        tell(f"The frames hold the same {count:,} points: their motion is exact")
        return
    words = ", ".join(f"{states[name]['share']:.1%} {name}" for name in ("seen", "hidden", "lost"))
    tell(f"Of {count:,} points, on average: {words}")
    seen = states["seen"]["frames"]
    poor = sum(share < _POOR for share in seen)
    if poor:
        warn(f"Fewer than half of the points are seen in {poor} of {len(seen)} frames")
