"""How long tracking landmarks takes through a scan without shared topology.

Frames of the demo are sampled anew, each at other positions, and written as NPZ; 21 landmarks, set in the
first frame, are tracked from there by a process of its own on two cores, with a cache of 64 MB. Time to the
first frame that is known, and to the last one; processor time of all threads; and the most memory that the
process held, beside what it had when it began. --folder stores the frames for another run."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from experiments.landmarks.places import PLACES, path_of, truth_places
from experiments.landmarks.resampled import ResampledDemo
from experiments.script import Script
from experiments.tables import Row
from viewer.analysis.landmarks import Landmark
from viewer.analysis.surface_point import SurfacePoint
from viewer.analysis.tracking import Tracker
from viewer.geometry import vector
from viewer.scan import formats
from viewer.scan.open import find_source
from viewer.scan.points import PointCloud
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
    assert isinstance(cloud, PointCloud)
    spacing, placed = typical_spacing(cloud), []
    for name, position in zip(PLACES, path_of(truth_places(), [0.0], source.demo.motion)[0], strict=True):
        row, _ = nearest_row(cloud, position)
        placed.append(
            Landmark(name).with_key(SurfacePoint(0, 0.0, vector(position), row, spacing, 0, _EXACT))
        )
    return placed


def memory(entry: str) -> float:
    """An entry of the process's memory, MB."""
    lines = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    return int(lines[entry].split()[0]) * 1024 / 1e6


def track(source: ResampledDemo, folder: Path) -> dict[str, float]:
    """Track the landmarks; the figures, by name."""
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


def tracking(options: Namespace) -> Iterator[Row]:
    """Times, memory and errors. With --track, this process tracks; else it starts one that does."""
    source = ResampledDemo(options.scan, NOISE, count=options.points, frames=options.frames)
    if options.track:
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:CORES])
        yield track(source, options.folder)
        return
    with tempfile.TemporaryDirectory() as name:
        folder = options.folder or Path(name)
        folder.mkdir(exist_ok=True)
        write_frames(folder, source)
        given = [f"--{word}={getattr(options, word)}" for word in ("frames", "points", "scan")]
        command = [
            sys.executable,
            sys.argv[0],
            "tracking",
            *given,
            "--track",
            "--json",
            "--folder",
            str(folder),
        ]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE)
        found = json.loads(done.stdout)["row"]
    yield {
        "frames": options.frames, "points": options.points, "first, s": found["first"],
        "all, s": found["wall"],
        "processor, s": found["processor"], "processor a frame, s": found["processor"] / options.frames,
        "memory before, MB": found["before"], "at most, MB": found["peak"],
        "error, median mm": found["median"], "95 %, mm": found["p95"], "gaps": f"{found['gaps']:.2%}",
    }  # fmt: skip


EXPERIMENT = Script(
    [tracking],
    {"frames": 200, "points": 100_000, "scan": "demo:sway:1", "folder": None, "track": False},
)
