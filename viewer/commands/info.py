"""Tell what a scan holds; reads its first readable pose alone."""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import shortened
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..scan.range_view import RangeView
from ..scan.timeline import Timeline
from ._console import escaped
from ._scans import SCAN_HELP, first_readable, open_timeline


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d info`."""
    parser.add_argument("scan", metavar="SCAN", help=SCAN_HELP)
    parser.add_argument("--json", action="store_true", help="as a JSON object")


def run(args: Namespace) -> int:
    """Print it."""
    with open_timeline(args, args.scan) as timeline:
        facts = scan_facts(timeline, first_readable(timeline))
    print(json.dumps(facts, indent=2, allow_nan=False) if args.json else _as_text(facts))
    return 0


def scan_facts(timeline: Timeline, pose: Pose) -> dict[str, Any]:
    """Facts of a scan from one pose, as plain values. Lengths in scan units, times in seconds."""
    cloud, times = pose.cloud, timeline.times
    steps = np.diff(times)
    low, high = ([float(f(column)) for column in cloud.positions.T] for f in (np.min, np.max))
    return {
        "name": timeline.name,
        "poses": len(timeline),
        "unit": timeline.unit,
        "times": {
            "first": float(times[0]),
            "last": float(times[-1]),
            "median_step": float(np.median(steps)) if len(steps) else None,
        },
        "pose": pose.index,
        "label": pose.label,
        "points": len(cloud),
        "dropped": cloud.dropped,
        "bytes": pose.nbytes,
        "views": [_view_facts(view) for view in pose.views],
        "origin": cloud.origin.tolist(),
        "bounds": {"low": (cloud.origin + low).tolist(), "high": (cloud.origin + high).tolist()},
        "attributes": {
            name: {"type": str(values.dtype), "columns": values[:1].size, "range": _range(values)}
            for name, values in _attributes(cloud).items()
        },
    }  # fmt: skip


def _view_facts(view: RangeView) -> dict[str, Any]:
    facts = {"name": view.name, "size": view.depth.shape[::-1]}
    return facts | ({"assumed": view.assumed} if view.assumed else {})


def _told(view: dict[str, Any]) -> str:
    told = "{}, {} x {} pixels".format(view["name"], *view["size"])
    return f"{told}; {view['assumed']}" if "assumed" in view else told


def _attributes(cloud: PointCloud) -> dict[str, NDArray]:
    named = {name: getattr(cloud, name) for name in ("normals", "colors", "radii", "axes")}
    return {name: values for name, values in named.items() if values is not None} | dict(cloud.scalars)


def _range(values: NDArray) -> list[float] | None:
    """[lowest, highest] of the finite values, None where there is none."""
    finite = values[np.isfinite(values)]
    return [float(finite.min()), float(finite.max())] if finite.size else None


def _as_text(facts: dict[str, Any]) -> str:
    times, unit = facts["times"], facts["unit"]
    low, high = facts["bounds"]["low"], facts["bounds"]["high"]
    poses = f"{facts['poses']}"
    if times["median_step"]:
        poses += f", {times['first']:g} to {times['last']:g} s, {1 / times['median_step']:g} a second"
    points = f"{facts['points']:,}"
    if facts["dropped"]:
        points += f" ({facts['dropped']:,} with a NaN or infinite coordinate left out)"
    rows = [
        ("scan", facts["name"]),
        ("poses", poses),
        ("pose", f"{facts['pose']}, {facts['label']}"),
        ("points", points),
        *(("view", _told(view)) for view in facts["views"]),
        ("unit", unit),
        ("size", " x ".join(f"{b - a:g}" for a, b in zip(low, high, strict=True))),
        ("from", ", ".join(f"{value:g}" for value in low)),
        ("to", ", ".join(f"{value:g}" for value in high)),
        ("origin", ", ".join(f"{value:g}" for value in facts["origin"])),
        ("memory", f"{facts['bytes'] / 1e6:.1f} MB a pose"),
    ]
    for name, attribute in facts["attributes"].items():
        span = "no finite value" if attribute["range"] is None else "{:g} to {:g}".format(*attribute["range"])
        columns = f" x {attribute['columns']}" if attribute["columns"] > 1 else ""
        rows.append((name, f"{attribute['type']}{columns}, {span}"))
    shown = [(escaped(shortened(name)), escaped(str(value))) for name, value in rows]
    width = max(len(name) for name, _ in shown)
    return "\n".join(f"{name:{width}}  {value}" for name, value in shown)
