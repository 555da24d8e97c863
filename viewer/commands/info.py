"""Report what a scan or a file of code words contains.

Scan4D reads the first readable pose only, and the header of a file of code words.
"""

from __future__ import annotations

import json
import os
from argparse import ArgumentParser, Namespace
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..codewords import SUFFIX
from ..scan.formats import package_reading
from ..scan.points import PointCloud, finite_rows
from ..scan.pose import Pose
from ..scan.range_folders import RangeFrames
from ..scan.range_view import RangeView
from ..scan.reading.record import Reading
from ..scan.sources import FrameSource
from ..scan.timeline import Timeline
from ._facts import extent, named_lines
from ._scans import SCAN_HELP, first_readable, open_timeline, report


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d info`."""
    parser.add_argument("scan", metavar="SCAN", help=SCAN_HELP)
    parser.add_argument("--json", action="store_true", help="print a JSON object")
    parser.add_argument(
        "--verbose", action="store_true", help="print every decision about how Scan4D reads the scan"
    )


def run(args: Namespace) -> int:
    """Print it."""
    if args.scan.lower().endswith(SUFFIX) and os.path.isfile(args.scan):
        from ._word_facts import stream_as_text, stream_facts  # few scans need it

        words = stream_facts(args.scan)
        print(json.dumps(words, indent=2, allow_nan=False) if args.json else stream_as_text(words))
        return 0
    with open_timeline(args, args.scan) as timeline:
        pose = first_readable(timeline, range(len(timeline)))
        report(timeline, 0)
        facts, record = scan_facts(timeline, pose), timeline.reading
    print(
        json.dumps(facts, indent=2, allow_nan=False) if args.json else _as_text(facts, record, args.verbose)
    )
    return 0


def scan_facts(timeline: Timeline, pose: Pose) -> dict[str, Any]:
    """Facts of a scan from one pose, as plain values. Lengths in scan units, times in seconds.

    Range views are looked at in parts: their points are not merged.
    """
    times = timeline.times
    steps, found = np.diff(times), _Found(_attributes(pose.overview))
    for positions, attributes in _parts(pose):
        found.add(positions, attributes)
    return {
        "name": timeline.name,
        "poses": len(timeline),
        "unit": timeline.unit,
        "package": _package_reading(timeline.source),
        "times": {
            "first": float(times[0]),
            "last": float(times[-1]),
            "median_step": float(np.median(steps)) if len(steps) else None,
        },
        "pose": pose.index,
        "label": pose.label,
        "unreadable": len(timeline.broken.keys() - timeline.empty),
        "points": found.count,
        "dropped": pose.dropped + found.dropped,
        "bytes": pose.nbytes,
        "views": [_view_facts(view) for view in pose.views],
        "beside": [message.text for message in timeline.messages if message.kind == "beside"],
        "reading": timeline.reading.to_json(),
        "origin": pose.origin.tolist(),
        "bounds": {"low": (pose.origin + found.low).tolist(), "high": (pose.origin + found.high).tolist()},
        "attributes": {
            name: {"type": str(values.dtype), "columns": values[:1].size, "range": found.ranges[name]}
            for name, values in _attributes(pose.overview).items()
        },
    }  # fmt: skip


def _package_reading(source: FrameSource) -> str:
    """Name and version of the package that reads the scan; "" for Scan4D itself."""
    if isinstance(source, RangeFrames):
        return source.package
    return package_reading(source.files[0]) if source.files else ""


class _Found:
    """The sums over the parts of a pose.

    count, dropped: of points with finite coordinates, and of others. low, high: (3,) relative to the origin.
    ranges: of each attribute.
    """

    def __init__(self, names: Iterable[str]) -> None:
        self.count = self.dropped = 0
        self.low, self.high = np.full(3, np.inf), np.full(3, -np.inf)
        self.ranges: dict[str, list[float] | None] = dict.fromkeys(names)

    def add(self, positions: NDArray[np.float32], attributes: Mapping[str, NDArray]) -> None:
        """Add points, (n, 3), and their attributes."""
        is_finite = finite_rows(positions)
        retained = positions if is_finite is None else positions[is_finite]
        self.count, self.dropped = self.count + len(retained), self.dropped + len(positions) - len(retained)
        self.low = np.minimum(self.low, retained.min(axis=0, initial=np.inf))
        self.high = np.maximum(self.high, retained.max(axis=0, initial=-np.inf))
        for name, values in attributes.items():
            both = [self.ranges[name], extent(values if is_finite is None else values[is_finite])]
            self.ranges[name] = extent(np.array([span for span in both if span is not None]))


def _parts(pose: Pose) -> Iterator[tuple[NDArray[np.float32], dict[str, NDArray]]]:
    """The points of a pose, relative to the origin, and their attributes, a part at a time."""
    if isinstance(pose.points, PointCloud):
        yield pose.cloud.positions, _attributes(pose.cloud)
        return
    names = _attributes(pose.overview)
    for samples, positions in pose.points.parts():
        yield positions, {name: pose.points.of_samples(name, samples) for name in names}


def _view_facts(view: RangeView) -> dict[str, Any]:
    facts = {"name": view.name, "size": view.depth.shape[::-1]}
    return facts | ({"assumed": view.assumed} if view.assumed else {})


def _shown_view(view: dict[str, Any]) -> str:
    text = "{}, {} x {} pixels".format(view["name"], *view["size"])
    return f"{text}; {view['assumed']}" if "assumed" in view else text


def _attributes(cloud: PointCloud) -> dict[str, NDArray]:
    named = {name: getattr(cloud, name) for name in ("normals", "colors", "radii", "axes")}
    return {name: values for name, values in named.items() if values is not None} | dict(cloud.scalars)


def _as_text(facts: dict[str, Any], record: Reading, verbose: bool) -> str:
    times, unit, broken = facts["times"], facts["unit"], facts["unreadable"]
    low, high = facts["bounds"]["low"], facts["bounds"]["high"]
    poses = f"{facts['poses']}"
    if times["median_step"]:
        poses += f", {times['first']:g} to {times['last']:g} s, {1 / times['median_step']:g} a second"
    points = f"{facts['points']:,}"
    if facts["dropped"]:
        points += f" (Scan4D leaves out {facts['dropped']:,} that are not finite or not measured)"
    rows = [
        ("scan", facts["name"]),
        *([("read by", facts["package"])] if facts["package"] else []),
        ("poses", poses),
        ("pose", f"{facts['pose']}, {facts['label']}"),
        *(
            [("unreadable", f"{broken} of the {broken + 1} poses that Scan4D tried to read")]
            if broken
            else []
        ),
        ("points", points),
        *(("view", _shown_view(view)) for view in facts["views"]),
        *(("beside", text) for text in facts["beside"]),
        *record.lines(),
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
    if verbose:
        rows += [("", ""), ("how Scan4D read this scan", ""), *record.lines(verbose=True)]
    return named_lines(rows)
