"""How long landmarks take to be followed through a scan without shared topology. Prints a table.

    python tests/speed/tracking.py [--frames 200] [--points 100000] [--scan demo:sway] [--folder DIR]

Frames of the demo are sampled anew, each at other places, and written as NPZ; 21 landmarks, set in the
first frame, are followed from there by a process of its own on two cores, with the cache as small as
`SCAN4D_CACHE_MB` says (here 64). Told are the time to the first frame that is known, and to the last one; the
processor time of all threads; and the most memory that the process held, beyond what it had when it began.
--folder keeps the frames for another run.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from viewer.analysis.landmarks import Landmark
from viewer.analysis.spot import Spot
from viewer.analysis.tracking import Tracker
from viewer.bench.tracking.places import PLACES, path_of, truth_places
from viewer.bench.tracking.resampled import ResampledDemo
from viewer.geometry import vector
from viewer.scan import formats
from viewer.scan.open import find_source
from viewer.scan.spacing import nearest_row, typical_spacing
from viewer.scan.timeline import Timeline

CORES = 2
CACHE_MB = 64
NOISE = 0.1  # mm
_EXACT = (0.0,) * 6


def write_frames(folder: Path, source: ResampledDemo) -> None:
    """Write the frames that are not there yet."""
    for index in range(len(source)):
        file = folder / f"{index:04}.npz"
        if not file.exists():
            formats.write(file, source.load(index))


def landmarks_in(source: ResampledDemo, folder: Path) -> list[Landmark]:
    """The landmarks, each set at the truth in the first frame."""
    cloud = find_source(folder).load(0)
    spacing, placed = typical_spacing(cloud), []
    for name, place in zip(PLACES, path_of(truth_places(), [0.0], source.demo.motion)[0], strict=True):
        row, _ = nearest_row(cloud, place)
        placed.append(Landmark(name).with_key(Spot(0, 0.0, vector(place), row, spacing, 0, _EXACT)))
    return placed


def memory(entry: str) -> float:
    """An entry of the process's memory, MB."""
    lines = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return int(lines[entry].split()[0]) * 1024 / 1e6


def follow(source: ResampledDemo, folder: Path) -> dict[str, float]:
    """Follow the landmarks; the figures, by name."""
    landmarks, scan = landmarks_in(source, folder), find_source(folder)
    with Timeline(scan, source.times(), cache_bytes=CACHE_MB << 20) as timeline:
        before, began, worked = memory("VmRSS"), time.perf_counter(), time.process_time()
        tracker, first = Tracker(timeline, landmarks), np.nan
        made = time.perf_counter() - began
        for _ in tracker.run():
            first = first if first == first else time.perf_counter() - began
        wall, worked = time.perf_counter() - began, time.process_time() - worked
    paths = path_of(truth_places(), source.times(), source.demo.motion)
    off = [np.linalg.norm(track.positions - paths[:, n], axis=1) for n, track in
           enumerate(tracker.tracks.values())]  # fmt: skip
    errors = np.concatenate(off)
    return {
        "made": made, "first": first, "wall": wall, "processor": worked, "before": before,
        "peak": memory("VmHWM"), "median": float(np.nanmedian(errors)),
        "p95": float(np.nanquantile(errors, 0.95)), "gaps": float(np.isnan(errors).mean()),
    }  # fmt: skip


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--frames", type=int, default=200)
    arguments.add_argument("--points", type=int, default=100_000)
    arguments.add_argument("--scan", default="demo:sway:1")
    arguments.add_argument("--folder", type=Path, help="where frames are kept")
    arguments.add_argument("--follow", action="store_true", help=argparse.SUPPRESS)
    options = arguments.parse_args()
    source = ResampledDemo(options.scan, NOISE, count=options.points, frames=options.frames)
    if options.follow:
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:CORES])
        print(json.dumps(follow(source, options.folder)))
        return
    with tempfile.TemporaryDirectory() as name:
        folder = options.folder or Path(name)
        folder.mkdir(exist_ok=True)
        write_frames(folder, source)
        command = [sys.executable, __file__, *sys.argv[1:], "--follow", "--folder", str(folder)]
        told = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
    frames = options.frames
    print(f"{frames} frames of {options.points:,} points, {len(PLACES)} landmarks, {CORES} cores")
    print(f"first result {told['first']:.2f} s (tracker made in {1e3 * told['made']:.1f} ms)")
    each = told["processor"] / frames
    print(f"all {told['wall']:.1f} s, processor {told['processor']:.1f} s, {each:.3f} a frame")
    print(f"memory {told['before']:.0f} MB before, {told['peak']:.0f} MB at most")
    print(f"errors: median {told['median']:.4f} mm, 95 % {told['p95']:.4f} mm, gaps {told['gaps']:.2%}")


if __name__ == "__main__":
    main()
