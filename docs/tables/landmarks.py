"""Make the tables of docs/how-it-works/landmarks.md that show how well Scan4D tracks landmarks.

    python docs/tables/landmarks.py [NAME ...]

All but the times give the same figures on any machine. It needs the data folder and ten minutes.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pictures import DATA, DOCS

from viewer.analysis.tracking import track_landmarks
from viewer.bench.report.measurement import markdown_table, remeasure_tables
from viewer.bench.report.page import three_digits
from viewer.bench.tracking.known import KnownScan, resampled_demo, scanned_demo, shuffled_mesh
from viewer.bench.tracking.landmark_judge import Judgement, judge_tracking
from viewer.scan.open import find_source

PAGE = DOCS / "how-it-works" / "landmarks.md"
# Variants, pods, noises in mm
CASES = (("smile", 2, (0.0, 0.1, 0.25)), ("sway", 2, (0.1,)), ("cough", 2, (0.1,)), ("sway", 1, (0.1,)))
MESHES = {"crane": "crane_175", "horse-gallop": "horse_gallop_48"}
SEEDS = range(5)  # of the vertices that are landmarks
JUMPS = range(0, 64, 8)  # frames of a smile of which each is far from the one before
FIGURES = ("median", "95 %", "worst", "within 2 sigma", "hidden", "gaps there", "gaps elsewhere", "s a frame")


def _scans() -> Iterator[tuple[list[str], KnownScan]]:
    """The scans with the cells that tell them: scan, pods, noise."""
    for variant, pods, noises in CASES:
        scan = f"demo:{variant}:1"
        for noise, known in zip(noises, scanned_demo(scan, noises, pods=pods), strict=True):
            yield [f"`{scan}`", str(pods), f"{noise:g} mm"], known


def _in_mm(told: Judgement) -> list[str]:
    return [f"{three_digits(length)} mm" for length in (told.median, told.p95, told.worst)]


def _in_spacings(told: Judgement) -> list[str]:
    return [three_digits(length / told.spacing) for length in (told.median, told.p95, told.worst)]


def _shares(told: Judgement) -> list[str]:
    """The figures that are no lengths, as cells."""
    shares = [
        "" if np.isnan(share) else f"{100 * share:.1f} %"
        for share in (told.within, told.gaps_hit, told.gaps_false)
    ]
    return [shares[0], str(told.hidden), *shares[1:], f"{told.seconds:.2f}"]


def tracked() -> str:
    """Errors and gaps of the demo's variants, as pods see them."""
    rows = []
    for cells, known in _scans():
        told = judge_tracking(known, track_landmarks)
        rows.append([*cells, *_in_mm(told), *_shares(told)])
    return markdown_table(["scan", "pods", "noise", *FIGURES], rows, left=("scan",))


def tracked_files() -> str:
    """Errors and gaps of landmarks from files without deviations, in spacings of the points."""
    rows = []
    for name, folder in MESHES.items():
        source = find_source(DATA / "sequences" / folder)
        rows += [_filed(f"`{name}`, {seed}", shuffled_mesh(source, name, seed=seed)) for seed in SEEDS]
    smile = resampled_demo("demo:smile:1", 0.1, JUMPS)
    rows.append(_filed("`demo:smile:1`, every 8th", smile))
    figures = ["median", "95 %", "worst", "above 3", "within 2 sigma", "gaps", "s a frame"]
    return markdown_table(["scan, seed", "frames", "jump", *figures], rows, left=("scan, seed",))


def _filed(name: str, known: KnownScan) -> list[str]:
    """A row of `tracked_files`."""
    told = judge_tracking(known, track_landmarks, from_file=True)
    jump = np.linalg.norm(np.diff(known.paths, axis=0), axis=2).max() / known.spacing
    shares = [f"{100 * share:.1f} %" for share in (told.wrong, told.within, told.gaps_false)]
    cells = [name, str(told.frames), three_digits(jump)]
    return [*cells, *_in_spacings(told), *shares, f"{told.seconds:.2f}"]


if __name__ == "__main__":
    remeasure_tables(PAGE, tracked, tracked_files)
