"""How well Scan4D tracks landmarks, against the truth. It needs the data folder and ten minutes."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator

import numpy as np

from experiments.landmarks.known import (
    KnownScan,
    resampled_demo,
    scanned_demo,
    scattered_demo,
    shuffled_mesh,
)
from experiments.landmarks.landmark_judge import Judgement, judge_tracking
from experiments.script import Script
from experiments.tables import Row
from viewer.analysis.tracking import track_landmarks
from viewer.bench.report.page import three_digits
from viewer.scan.open import find_source

# Variants, pods, noises in mm
CASES = (("smile", 2, (0.0, 0.1, 0.25)), ("sway", 2, (0.1,)), ("cough", 2, (0.1,)), ("sway", 1, (0.1,)))
MESHES = {"crane": "crane_175", "horse-gallop": "horse_gallop_48"}
SEEDS = range(5)  # of the vertices that are landmarks
MANY = 500  # landmarks, at random
BEHIND = -25.0  # mm: what is farther back is left out
JUMPS = range(0, 64, 8)  # frames of a smile of which each is far from the one before


def tracked(_: Namespace) -> Iterator[Row]:
    """Errors and gaps of the demo's variants, as pods see them."""
    for variant, pods, noises in CASES:
        scan = f"demo:{variant}:1"
        for noise, known in zip(noises, scanned_demo(scan, noises, pods=pods), strict=True):
            found = judge_tracking(known, track_landmarks)
            named = {"scan": f"`{scan}`", "pods": str(pods), "noise": f"{noise:g} mm"}
            gaps = {"gaps there": _share(found.gaps_hit), "gaps elsewhere": _share(found.gaps_false)}
            shares = {"within 2 sigma": _share(found.within), "hidden": str(found.hidden), **gaps}
            yield {**named, **_lengths(found, 1, " mm"), **shares, "s a frame": f"{found.seconds:.2f}"}


def tracked_files(options: Namespace) -> Iterator[Row]:
    """Errors and gaps of landmarks from files without deviations, in spacings of the points."""
    for name, folder in MESHES.items():
        source = find_source(options.data / "sequences" / folder)
        for seed in SEEDS:
            yield _filed(f"`{name}`, {seed}", shuffled_mesh(source, name, seed=seed))
    yield _filed("`demo:smile:1`, every 8th", resampled_demo("demo:smile:1", 0.1, JUMPS))


def tracked_many(_: Namespace) -> Iterator[Row]:
    """Errors and times of as many landmarks as one surface carries."""
    for variant in ("smile", "sway"):
        found = judge_tracking(scattered_demo(f"demo:{variant}:1", 0.1, MANY, behind=BEHIND), track_landmarks)
        yield {
            "scan": f"`{found.name}`", "landmarks": str(found.landmarks), "frames": str(found.frames),
            **_lengths(found, 1, " mm"), "within 2 sigma": _share(found.within),
            "gaps": _share(found.gaps_false), "s a frame": f"{found.seconds:.2f}",
        }  # fmt: skip


def _filed(name: str, known: KnownScan) -> Row:
    """A row of `tracked_files`."""
    found = judge_tracking(known, track_landmarks, from_file=True)
    jump = np.linalg.norm(np.diff(known.paths, axis=0), axis=2).max() / known.spacing
    shares = {"above 3": found.wrong, "within 2 sigma": found.within, "gaps": found.gaps_false}
    return {
        "scan, seed": name, "frames": str(found.frames), "jump": three_digits(jump),
        **_lengths(found, found.spacing), **{title: _share(share) for title, share in shares.items()},
        "s a frame": f"{found.seconds:.2f}",
    }  # fmt: skip


def _lengths(found: Judgement, unit: float, name: str = "") -> Row:
    lengths = {"median": found.median, "95 %": found.p95, "worst": found.worst}
    return {title: f"{three_digits(length / unit)}{name}" for title, length in lengths.items()}


def _share(share: float) -> str:
    return "" if np.isnan(share) else f"{100 * share:.1f} %"


EXPERIMENT = Script([tracked, tracked_files, tracked_many], {"data": None}, "landmarks.md")
