"""Memory stays bounded by what it was told, measured on a process of its own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")

PLAY = """
import sys, viewer
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import shared_renderer
from viewer.drawing.request import Request
from viewer.picture.surface import Surface

renderer = shared_renderer()
surface = Surface(renderer.gpu, (640, 480))
timeline = viewer.open_scan(sys.argv[1])
peak = 0  # of memory of its own; pages of mapped files are the system's to take
camera = viewer.Camera.orbit(timeline.pose(0).cloud.bounds())
for _ in range(2):
    for index in range(len(timeline)):
        timeline.prefetch(index)
        render_frame(renderer, Request(timeline.pose(index), camera, "points"), surface)
        surface.image()
        status = dict(line.split(":") for line in open("/proc/self/status"))
        peak = max(peak, int(status["RssAnon"].split()[0]))
timeline.close()
print(peak // 1024)
"""


@pytest.mark.slow
def test_playing_a_long_sequence_stays_within_the_budget(tmp_path: Path) -> None:
    frames, points, budget = 80, 400_000, 60
    sequence = np.lib.format.open_memmap(
        tmp_path / "long.npy", mode="w+", dtype=np.float32, shape=(frames, points, 3)
    )
    rng = np.random.default_rng(0)
    body = rng.normal(size=(points, 3)).astype(np.float32)
    for index in range(frames):
        sequence[index] = body + 0.01 * index
    sequence.flush()
    assert sequence.nbytes > 6 * budget * 2**20
    del sequence
    done = subprocess.run(
        [sys.executable, "-c", PLAY, str(tmp_path / "long.npy")],
        capture_output=True, text=True, check=True,
        env={"SCAN4D_CACHE_MB": str(budget), "PATH": "/usr/bin:/bin", "PYTHONPATH": ":".join(sys.path)},
    )  # fmt: skip
    assert int(done.stdout) < budget + 300
    (tmp_path / "long.npy").unlink()


@pytest.mark.slow
def test_a_large_cloud_takes_a_small_multiple_of_its_size(tmp_path: Path) -> None:
    """2 million points of 15 bytes: all of a process's peak, the driver's memory included."""
    count = 2_000_000
    rng = np.random.default_rng(0)
    rows = np.zeros(count, [("p", "<f4", 3), ("c", "u1", 3)])
    rows["p"], rows["c"] = rng.normal(size=(count, 3)), rng.integers(0, 255, (count, 3))
    names = ["x", "y", "z", "red", "green", "blue"]
    header = "".join(f"property {'float' if name in 'xyz' else 'uchar'} {name}\n" for name in names)
    path = tmp_path / "large.ply"
    text = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n{header}end_header\n"
    path.write_bytes(text.encode() + rows.tobytes())
    code = PLAY.replace("range(2)", "range(1)")
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True,
        env={"PATH": "/usr/bin:/bin", "PYTHONPATH": ":".join(sys.path)},
    )  # fmt: skip
    own = count * 16 / 2**20  # what the cloud itself holds
    assert int(done.stdout) < 4 * own + 250


@pytest.mark.slow
def test_surfaces_that_nobody_holds_are_given_back() -> None:
    code = """
import numpy as np, viewer
cloud = viewer.PointCloud.from_arrays(np.random.default_rng(0).normal(size=(1000, 3)))
def own():
    status = dict(line.split(":") for line in open("/proc/self/status"))
    return int(status["RssAnon"].split()[0]) // 1024
for _ in range(3):
    viewer.render(cloud, size=(1600, 1600)).image()
before = own()
for _ in range(30):
    viewer.render(cloud, size=(1600, 1600)).image()
print(own() - before)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True,
        env={"PATH": "/usr/bin:/bin", "PYTHONPATH": ":".join(sys.path)},
    )  # fmt: skip
    assert int(done.stdout) < 100, "a surface of this size holds 40 MB"
