"""Merge the range views of each pose into one surface.

Where several views show a patch, the view that sees it best contributes it. OUT is a .exr file of range
views, or the remaining points as .ply, .pcd or .npz. A sequence needs a numbered pattern such as
out%04d.exr; Scan4D writes the times into times.csv beside it.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import save_json
from ..mesh.merging.competition import Rules
from ..mesh.merging.merged import MergedViews, merge_views
from ..output.export import check_output
from ..scan import formats
from ..scan.inputs import scan_inputs
from ..scan.pose import Pose
from ..scan.range_view import RangeView, merge
from ..scan.timeline import Timeline
from ._console import escaped, tell, warn
from ._outputs import add_output_argument, claim
from ._scans import (
    SCAN_HELP,
    add_pose_arguments,
    chosen_poses,
    frame_outputs,
    frame_title,
    open_timeline,
    read_poses,
    with_files,
)

_HEADER = ("pose", "views", "overlap", "depth rmse", "rotation", "shift", "")


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d merge`."""
    parser.add_argument("scan", metavar="SCAN", help=SCAN_HELP)
    add_output_argument(parser, f"{' '.join(formats.writable_suffixes(views=True))}, or a pattern with %%04d")
    parser.add_argument("--report", type=Path, metavar="FILE.json", help="write all findings")
    add_pose_arguments(parser)
    how = parser.add_argument_group("merging")
    how.add_argument(
        "--refine", action="store_true", help="correct the alignment of the views before merging"
    )
    how.add_argument(
        "--ties", type=float, default=Rules.ties, metavar="T",
        help="also keep pixels whose weight is at most T below the weight in the best view; default 0",
    )  # fmt: skip
    how.add_argument(
        "--smoothing", type=int, default=Rules.smoothing, metavar="PIXELS",
        help=f"smooth the weights over this radius, in pixels; default {Rules.smoothing}",
    )  # fmt: skip
    how.add_argument(
        "--tolerance", type=float, metavar="LENGTH",
        help=
            "largest distance between two measurements of the same surface, in scan units; default: "
            "estimated from noise and pixel size"
        ,
    )  # fmt: skip


def run(args: Namespace) -> int:
    """Merge the chosen poses, by default all; broken frames among several are left out."""
    rules = Rules(args.ties, args.smoothing, args.tolerance)
    if args.report:
        check_output(args.report, (".json",), several=False)
    with open_timeline(args, args.scan) as timeline:
        indices = chosen_poses(args, timeline) or list(range(len(timeline)))
        check_output(args.out, formats.writable_suffixes(views=True), several=len(indices) > 1)
        outputs = [*frame_outputs(args.out, indices, timeline), *([args.report] if args.report else [])]
        claim(outputs, scan_inputs(timeline), args.force)
        facts = []
        for pose, path in with_files(args.out, read_poses(timeline, indices), len(indices)):
            merged = merge_views(_views(pose), rules, args.refine)
            formats.write(path, merge(merged.views, normals=True), merged.views)
            facts.append({"pose": pose.index, "label": pose.label, "time": pose.time, **merged.facts()})
            _warn_of_drift(merged, frame_title(timeline, pose.index), timeline.unit)
        _tell_facts(args, timeline, facts)
    tell(args.out)
    return 0


def _views(pose: Pose) -> tuple[RangeView, ...]:
    """The range views of a pose, at least two."""
    if not pose.views:
        hint = "Range views come from EXR files and folders of range images: docs/reference/formats.md"
        raise InputError("has points, but no range views to merge", pose.label, hint)
    if len(pose.views) < 2:
        raise InputError("has only one range view, but merging needs at least two", pose.label)
    return pose.views


def _warn_of_drift(merged: MergedViews, pose: str, unit: str) -> None:
    """Say which views do not fit together."""
    if not merged.drifted:
        return
    (i, j), worst = max(merged.drifted.items(), key=lambda item: item[1].shift)
    names = f"{merged.given[i].name} and {merged.given[j].name}"
    more = f", and {len(merged.drifted) - 1} more" if len(merged.drifted) > 1 else ""
    hint = (
        "--refine corrects the error"
        if merged.refinement is None
        else ("--refine could not correct the error")
    )
    warn(
        f"{pose}: the calibration of {names}{more} is wrong by {worst.rotation:.2g}° and "
        f"{worst.translation:.2g} {unit}. Noise does not explain this error; {hint}"
    )


def _tell_facts(args: Namespace, timeline: Timeline, facts: Sequence[dict[str, Any]]) -> None:
    """The table on standard output, and the report."""
    rows = [_HEADER, *(row for pose in facts for row in _rows(pose))]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        tell("  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip())
    for pose in facts:
        kept = ", ".join(
            f"{escaped(view['name'])} {view['kept']:,} of {view['pixels']:,}" for view in pose["views"]
        )
        tell(
            f"pose {pose['pose']}: several views show {pose['overlap_before']:.1%} of the area before "
            f"merging, and {pose['overlap_after']:.2%} after merging ({pose['ties']:.2%} because of tied "
            f"weights); number of kept pixels: {kept}"
        )
    if args.report:
        save_json(args.report, {"scan": timeline.name, "unit": timeline.unit, "poses": facts})


def _rows(pose: dict[str, Any]) -> list[tuple[str, ...]]:
    """The lines of the table that tell of the pairs of a pose."""
    rows: list[tuple[str, ...]] = []
    for pair in pose["pairs"]:
        both = escaped(" - ".join(pair["views"]))
        overlap = " ".join(f"{part:.1%}" for part in pair["overlap"])
        rows.append((str(pose["pose"]), both, overlap, *_of_drift(pair["drift"])))
        if pair.get("drift_left"):
            rows.append(("", "  refined", "", *_of_drift(pair["drift_left"])))
    return rows


def _of_drift(drift: dict[str, Any] | None) -> tuple[str, ...]:
    if drift is None:
        return "", "", "", "the overlap is too small to measure"
    return (
        f"{drift['depth_rmse']:.3g}",
        f"{drift['rotation']:.3f} ± {drift['rotation_error']:.3f}°",
        f"{drift['shift']:.3g} ± {drift['shift_error']:.2g}",
        "drifted" if drift["is_significant"] else "",
    )
