"""Command lines in processes of their own, and the small scans that they are tried on."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from command_line import Done
from numpy.typing import NDArray
from scenes import sphere

from viewer.camera import Camera
from viewer.scan.points import PointCloud

ROOT = Path(__file__).resolve().parents[2]
SMALL = ("--size", "96x64")
FRAMES = 5


def process(*argv: object, **environment: str) -> subprocess.Popen[str]:
    """A command line in a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "viewer.cli", *map(str, argv)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        env={**os.environ, **environment},
    )


def finish(running: subprocess.Popen[str]) -> Done:
    out, err = running.communicate()
    assert "Traceback" not in err
    return Done(running.returncode, out, err)


def cloud_at(index: int) -> PointCloud:
    """Frame of a ball that grows."""
    return sphere(2000, radius=1 + 0.1 * index)


def stored(path: Path) -> dict[str, NDArray]:
    with np.load(path) as arrays:
        return dict(arrays)


def names(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


def front(cloud: PointCloud, **options: object) -> Camera:
    return Camera.orbit(cloud.bounds(), aspect=96 / 64, **options)  # type: ignore[arg-type]
