"""A scan with many landmarks and measures, as a user left it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewer.analysis.landmarks import Landmark
from viewer.analysis.measures import Measure
from viewer.analysis.surface_point import SurfacePoint
from viewer.app.tools.plotting.choices import CurveChoices
from viewer.document.document import Document
from viewer.document.landmarks import Landmarks
from viewer.document.saved_session import SavedSession, stored_file
from viewer.geometry import vector

TRACED = 6  # landmarks whose ways are drawn


def sheet(frames: int, side: int = 101) -> NDArray[np.float64]:
    """A wavy sheet that breathes, (T, side², 3)."""
    x, y = np.meshgrid(np.linspace(-60, 60, side), np.linspace(-45, 45, side))
    turns = 2 * np.pi * np.arange(frames)[:, None, None] / 50
    z = 6 * np.sin(x / 12 + turns) * np.cos(y / 9)
    flat = np.broadcast_to(np.stack([x, y], axis=-1), (frames, side, side, 2))
    return np.concatenate([flat, z[..., None]], axis=-1).reshape(frames, -1, 3)


def document(first: NDArray[np.float64], landmarks: int, measures: int) -> Document:
    """Landmarks spread over the points of a frame, (N, 3), distances of them, ways of a few."""
    rows = np.linspace(0, len(first) - 1, landmarks).astype(int).tolist()
    names = [f"landmark {number}" for number in range(1, landmarks + 1)]
    placed = tuple(
        Landmark(name, (SurfacePoint(0, 0.0, vector(first[row]), row, 1.2, 0),))
        for name, row in zip(names, rows, strict=True)
    )
    made = tuple(
        Measure(f"distance {number}", "distance", (names[number], names[-1 - number]))
        for number in range(measures)
    )
    parts = Landmarks(placed, measures=made), CurveChoices(traced=tuple(names[:TRACED]))
    return Document().with_part(parts[0]).with_part(parts[1])


def left_open(folder: Path, frames: int, landmarks: int, measures: int) -> Path:
    """A scan in a folder, which is the home of the window that is going to open it with all of these, and
    with curves under the timeline."""
    positions, scan = sheet(frames), folder / "scan.npz"
    np.savez(scan, positions=positions.astype(np.float32), faces=np.array([(0, 1, 2), (1, 2, 3)]))
    config = folder / "config" / "scan4d"
    (config / "scans").mkdir(parents=True)
    session = SavedSession(str(scan), None, 0, document(positions[0], landmarks, measures))
    (config / "scans" / stored_file(str(scan)).name).write_text(json.dumps(session.to_json()))
    tools = {"plotting": {"is_open": True}}
    (config / "settings.json").write_text(json.dumps({"format": 1, "tools": tools}))
    return scan
