"""How exactly Scan4D finds the motion of a head, for what it costs. It takes some minutes."""

from __future__ import annotations

import time
from argparse import Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from experiments.motion.heads import (
    REGIONS,
    Change,
    Heads,
    motion_error,
    region_motions,
    rows_within,
    stabilised_errors,
    strays,
    without_side,
)
from experiments.motion.methods import Method, open3d_icp, small_gicp
from experiments.script import Script
from experiments.tables import Row
from viewer.analysis.motion.found import found_region
from viewer.analysis.motion.registration import LEVELS, register_region
from viewer.analysis.motion.stabilise import FrameMotion, MotionReference, WeakLimits, moment_surface
from viewer.rigid import Rigid
from viewer.scan.points import PointCloud

Float = NDArray[np.float64]

SWAY, SMILE, COUGH = "demo:sway:1", "demo:smile:1", "demo:cough:1"
HIDDEN = 0.3  # of the region
LIMITS = WeakLimits(0.5)
REFERENCES = (5, 16, 29, 40, 51)  # frames, and
AFTER = range(2, 64, 9)  # those that are registered with each
SEEDS = range(8)  # of heads that only turn, each with another reference
TURNED = (3, 19, 35, 51)  # frames of each
COMPARED = range(4, 64, 6)  # frames that each method registers
DEFORMING = "nose", "upper face"
OTHERS: Mapping[str, Callable[[Float], Method]] = {
    "small_gicp, GICP": partial(small_gicp, kind="GICP"),
    "small_gicp, point to plane": partial(small_gicp, kind="PLANE_ICP"),
    "open3d ICP, point to plane": partial(open3d_icp, is_robust=False),
    "open3d ICP, Tukey's weights": partial(open3d_icp, is_robust=True),
}
WORLD, ZERO = np.eye(3), np.zeros(3)


def variants(_: Namespace) -> Iterator[Row]:
    """Errors of all frames of the demo's variants, for the region that Scan4D finds."""
    sway = Heads.of(SWAY)
    timeline = sway.timeline()
    rows = found_region(timeline, timeline.pose(0), 0)
    yield _stabilised("`demo:sway`, which turns by 15° and talks", sway)
    yield _stabilised("`demo:sway`, 5 % of the points up to 17 mm off", sway, strays)
    hidden = without_side(sway, rows, HIDDEN)
    what = "`demo:sway`, without 30 % of the region in all frames but the reference"
    yield _stabilised(what, sway, hidden, rows)
    for scan in (SMILE, COUGH):
        yield _stabilised(f"`{scan.removesuffix(':1')}`", Heads.of(scan))


def _stabilised(
    name: str,
    heads: Heads,
    change: Change = lambda frame, points: points,
    rows: NDArray[np.int64] | None = None,
) -> Row:
    """A row of `variants`. rows: of the region in the first frame; None: it is to be found."""
    timeline = heads.timeline(change)
    poses = [timeline.pose(frame) for frame in range(len(timeline))]
    before, is_found = time.process_time(), rows is None
    if rows is None:
        rows = found_region(timeline, poses[0], 0)
    finding = time.process_time() - before
    reference = MotionReference.of(poses[0], rows, 0)
    errors = stabilised_errors(heads, timeline, reference, LIMITS.shift)
    taken = time.process_time() - before - finding
    gaps = len(timeline) - 1 - len(errors)
    times = {
        "time of 64 frames": f"{taken:.1f} s",
        "search": f"{finding:.1f} s" if is_found else "",
    }
    return {"scan": name, **_medians(errors), "gaps": str(gaps), **times}


def references(_: Namespace) -> Iterator[Row]:
    """Errors of the region that Scan4D finds in several reference frames, and how many are within the ±."""
    for scan in (SWAY, SMILE):
        heads, errors, told = Heads.of(scan), [], []
        timeline = heads.timeline()
        for first in REFERENCES:
            pose = timeline.pose(first)
            reference = MotionReference.of(pose, found_region(timeline, pose, first), first)
            for frame in AFTER:
                surface, right = moment_surface(timeline.pose(frame).cloud, ZERO), heads.truth(frame, first)
                found = register_region(reference.region, surface, right, LEVELS[1:])
                assert found is not None
                errors.append(motion_error(found.motion, right, reference.middle))
                told.append(FrameMotion(found.motion, found.covariance).spread(WORLD))
        yield {"scan": f"`{scan.removesuffix(':1')}`", **_medians(errors), "within ±": _share(errors, told)}


def regions(_: Namespace) -> Iterator[Row]:
    """Errors of regions of a head that only turns, so that all of them are rigid."""
    errors: dict[str, list[Float]] = {name: [] for name in REGIONS}
    told: dict[str, list[Float]] = {name: [] for name in REGIONS}
    for seed in SEEDS:
        heads, first = Heads.turning(seed), int(np.random.default_rng(seed).integers(64))
        for found in region_motions(heads, first, set(TURNED) - {first}, seed):
            errors[found.region].append(found.error)
            told[found.region].append(found.motion.spread(WORLD))
    for name in REGIONS:
        exceeded = np.median(LIMITS.exceeded(np.array(told[name])), axis=0).reshape(2, 3)
        weak = [", weak" if one > 1 else "" for one in exceeded.max(axis=1)]
        yield {"region": name, **_medians(errors[name], weak), "within ±": _share(errors[name], told[name])}


def methods(_: Namespace) -> Iterator[Row]:
    """Errors and times of Scan4D and of other registrations, each begun with the true motion of the frame
    before."""
    heads = Heads.of(SWAY)
    timeline = heads.timeline()
    pose = timeline.pose(0)
    rest = heads.at(0).inverse.points(heads.points[0])
    chosen = {"found": found_region(timeline, pose, 0)}
    chosen |= {f"{name}, which deforms": rows_within(REGIONS[name], rest) for name in DEFORMING}
    for name, rows in chosen.items():
        reference = MotionReference.of(pose, rows, 0)
        region = {"region": f"{name} ({len(rows):,} points)"}
        ours = _compared(heads, reference, _scan4d(reference))
        yield {**region, "method": "Scan4D", **ours}
        for title, made in OTHERS.items():
            try:
                method = made(heads.points[0][rows])
            except ImportError as error:
                cells = dict.fromkeys(ours, "") | {"rotation error": str(error)}
            else:
                cells = _compared(heads, reference, method)
            yield {**region, "method": title, **cells}


def _scan4d(reference: MotionReference) -> Method:
    def method(frame: Float, start: Rigid) -> Rigid:
        surface = moment_surface(PointCloud.from_arrays(frame), reference.origin)
        found = register_region(reference.region, surface, start.in_frame(reference.origin))
        assert found is not None
        return found.motion.in_frame(-reference.origin)

    return method


def _compared(heads: Heads, reference: MotionReference, method: Method) -> Row:
    """Errors and processor time of a method, for a region of the first frame."""
    errors = []
    before = time.process_time()
    for frame in COMPARED:
        found = method(heads.points[frame], heads.truth(frame - 1, 0))
        errors.append(motion_error(found, heads.truth(frame, 0), reference.middle))
    taken = (time.process_time() - before) / len(COMPARED)
    return {**_medians(errors), "time": f"{taken:.2f} s"}


def _medians(errors: Sequence[Float], notes: Sequence[str] = ("", "")) -> Row:
    turn, shift = np.median(np.linalg.norm(np.reshape(errors, (-1, 2, 3)), axis=2), axis=0)
    return {"rotation error": f"{turn:.2g}°{notes[0]}", "position error": f"{shift:.2g} mm{notes[1]}"}


def _share(errors: Sequence[Float], told: Sequence[Float]) -> str:
    """The share of errors within what Scan4D tells."""
    return f"{np.mean(np.abs(errors) <= np.array(told)):.0%}".replace("%", " %")


EXPERIMENT = Script([variants, references, regions, methods], page="how-it-works/stabilising.md")
