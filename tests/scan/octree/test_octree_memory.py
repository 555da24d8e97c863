from __future__ import annotations

import subprocess
import sys

import pytest

POINTS = 3_000_000
BUILD = f"""
import numpy as np
from pathlib import Path
from viewer.scan.octree.build import Stop, build
from viewer.scan.points import PointCloud

def status(field):
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith(field))

points = np.random.default_rng(0).normal(size=({POINTS}, 3)).astype(np.float32)
points /= np.linalg.norm(points, axis=1)[:, None]
cloud = PointCloud.from_arrays(points, origin=[0, 0, 0])
build(PointCloud.from_arrays(points[:1000]), attributes=False)  # compiles
before = status("VmRSS")
Path("/proc/self/clear_refs").write_text("5")
build(cloud, Stop(delta=0.02), attributes=False)
print(status("VmHWM") - before)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.slow
def test_building_takes_at_most_three_times_the_codes() -> None:
    done = subprocess.run([sys.executable, "-c", BUILD], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 3 * 8 * POINTS
