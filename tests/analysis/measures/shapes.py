"""Analytic shapes as points, and scans of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from viewer.analysis.measures import Measure
from viewer.analysis.measures.kinds import kind_of
from viewer.analysis.measures.surface import Found, PoseSurface, Refused
from viewer.analysis.track import Known, Track
from viewer.scan.faces import Faces
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.timeline import Timeline


def sphere_points(count: int, radius: float, noise: float = 0.0, seed: int = 0) -> np.ndarray:
    """Points of a sphere about the origin, (N, 3), evenly by chance."""
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((count, 3))
    return (
        points * (radius + noise * rng.standard_normal((count, 1))) / np.linalg.norm(points, axis=1)[:, None]
    )


def pose_of(points: np.ndarray, normals: np.ndarray | None = None, index: int = 0) -> Pose:
    """A pose of these points."""
    return Pose.of(index, float(index), "points", PointCloud.from_arrays(points, normals=normals))


def compute(surface: PoseSurface, kind: str, places: np.ndarray, **options: str) -> Found | Refused:
    """What a kind says of a surface and places (K, 3), named "0", "1", ..."""
    measure = Measure("m", kind, tuple(map(str, range(len(places)))), options)
    return kind_of(measure).compute(surface, places, options)  # type: ignore[return-value]


def found(surface: PoseSurface, kind: str, places: np.ndarray, **options: str) -> Found:
    """The value that a kind finds."""
    result = compute(surface, kind, places, **options)
    assert isinstance(result, Found), result
    return result


def refused(surface: PoseSurface, kind: str, places: np.ndarray, **options: str) -> str:
    """The reason why a kind finds no value."""
    result = compute(surface, kind, places, **options)
    assert isinstance(result, Refused), result
    return result.in_words([str(number) for number in range(len(places))])


def track_of(positions: Sequence[Sequence[float]], deviation: float = 0.1, gaps: Sequence[int] = ()) -> Track:
    """A landmark at these places, one a frame, tracked but where there are gaps."""
    there = np.array(positions, float)
    known = np.full(len(there), Known.TRACKED, np.uint8)
    known[list(gaps)] = Known.GAP
    there[list(gaps)] = np.nan
    spread = np.tile(deviation**2 * np.eye(3), (len(there), 1, 1))
    return Track(np.arange(len(there), dtype=float), there, spread, known, {})


class Frames:
    """Frames that are in memory, with faces or without, and how often each was read."""

    name, unit, files = "frames", "mm", ()

    def __init__(self, clouds: Sequence[PointCloud], faces: Faces | None = None) -> None:
        self._clouds, self._faces = clouds, faces
        self.loaded = [0] * len(clouds)

    def __len__(self) -> int:
        return len(self._clouds)

    def label(self, index: int) -> str:
        return f"frame{index}"

    def times(self) -> np.ndarray:
        return np.arange(len(self), dtype=float)

    def load(self, index: int) -> PointCloud:
        self.loaded[index] += 1
        return self._clouds[index]

    def faces(self, index: int) -> Faces:
        return self._faces or Faces.joined([])

    def timeline(self) -> Timeline:
        return Timeline(self, self.times(), "mm")
