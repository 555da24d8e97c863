"""Measures of landmarks: their kinds, errors on known shapes, and how often ± holds the truth.

They give the same figures on any machine. What is true is found to 1e-5 of it: paths by least squares of
their pieces, areas and volumes by Green's theorem in the coordinates of the shape.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Iterator
from itertools import product

import numpy as np
from scipy.optimize import least_squares

from experiments.script import Script
from experiments.tables import Row
from viewer.analysis.measures import Measure
from viewer.analysis.measures.kinds import kind_of, measure_kinds
from viewer.analysis.measures.planes import plane_of
from viewer.analysis.measures.series import all_series
from viewer.analysis.measures.surface import PoseSurface
from viewer.analysis.track import Known, Track
from viewer.mesh.geodesic import steps_along
from viewer.scan.faces import Faces
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.timeline import Timeline

SPACINGS = (3.5, 1.8, 0.9)  # mm; on a sphere of R = 100 mm 10 000, 40 000 and 160 000 points
NOISES = (0.0, 0.1, 0.2)  # mm
REPEATS, CHANCES = 2, 10
REACH, SIDE = 60.0, 30.0  # mm: of the points around, and of landmarks from their middle
OFF = 0.2  # mm along the surface, the standard deviation of landmarks

Shape = Callable[[np.ndarray, np.ndarray], np.ndarray]


def sphere(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A sphere by longitude and latitude."""
    return 100 * np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=-1)


def cylinder(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A cylinder by angle and height."""
    return np.stack([40 * np.cos(u), 40 * np.sin(u), v], axis=-1)


def torus(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A torus by both angles."""
    wide = 80 + 30 * np.cos(v)
    return np.stack([wide * np.cos(u), wide * np.sin(u), 30 * np.sin(v)], axis=-1)


def saddle(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A saddle by what it stands over."""
    return np.stack([u, v, (u * u - v * v) / 120], axis=-1)


# Each with the middle of where landmarks are, in its coordinates.
SHAPES: dict[str, tuple[Shape, tuple[float, float]]] = {
    "sphere, R 100": (sphere, (0.3, 0.2)),
    "cylinder, R 40": (cylinder, (0.0, 0.0)),
    "torus, R 80, r 30": (torus, (0.0, 0.5)),
    "saddle, 1 / 60": (saddle, (5.0, 3.0)),
}
STEP = 1e-4
# Errors are in mm, degrees, percent, and as heights over the region.
FACTORS: dict[str, Callable[[dict[str, float]], float]] = {
    "distance": lambda true: 1.0,
    "angle": lambda true: 1.0,
    "path": lambda true: true["path"] / 100,
    "area": lambda true: true["area"] / 100,
    "volume": lambda true: true["area"],
}


def tangents(shape: Shape, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The changes of position with both coordinates."""
    right = (shape(u + STEP, v) - shape(u - STEP, v)) / (2 * STEP)
    up = (shape(u, v + STEP) - shape(u, v - STEP)) / (2 * STEP)
    return right, up


def sample(
    shape: Shape, middle: np.ndarray, spacing: float, noise: float, rng: np.random.Generator
) -> np.ndarray:
    """Points by chance, one per spacing squared, off the shape by noise, (N, 3)."""
    right, up = tangents(shape, *middle)
    reach = 1.5 * REACH / np.array([np.linalg.norm(right), np.linalg.norm(up)])
    reach = np.minimum(reach, [2.6, 2.6] if shape in (cylinder, torus) else np.inf)
    if shape is sphere:
        reach[1] = min(reach[1], 1.3)
    reach[1] = reach[1] if shape is not cylinder else 1.5 * REACH
    u, v = (middle + reach * rng.uniform(-1, 1, (40 * int((REACH / spacing) ** 2), 2))).T
    right, up = tangents(shape, u, v)
    normals = np.cross(right, up)
    area = np.linalg.norm(normals, axis=1)
    box = (
        4 * reach.prod() * area.max() / len(u)
    )  # of the shape that each sample of the coordinates stands for
    chosen = rng.random(len(u)) < area / area.max() * box / spacing**2
    assert box / spacing**2 < 1, "too few samples"
    points = (
        shape(u, v)[chosen]
        + noise * rng.standard_normal((chosen.sum(), 1)) * (normals / area[:, None])[chosen]
    )
    return points[np.linalg.norm(points - shape(*middle), axis=1) < REACH]


def true_path(shape: Shape, start: np.ndarray, end: np.ndarray, count: int = 64) -> np.ndarray:
    """Places along the shortest path in the shape's coordinates, (P, 2), both ends among them."""
    straight = np.linspace(start, end, count + 1)
    scale = np.maximum(np.abs(end - start), 1e-3)

    def pieces(free: np.ndarray) -> np.ndarray:
        positions = straight.copy()
        positions[1:-1] = free.reshape(-1, 2) * scale
        return np.diff(shape(*positions.T), axis=0).ravel()

    found = least_squares(pieces, (straight[1:-1] / scale).ravel(), xtol=1e-14, ftol=1e-14)
    return np.concatenate([[start], found.x.reshape(-1, 2) * scale, [end]])


def true_length(shape: Shape, positions: np.ndarray) -> float:
    """The length of the path, of finer pieces."""
    fine = np.linspace(0, len(positions) - 1, 20 * len(positions))
    whole = np.stack([np.interp(fine, np.arange(len(positions)), axis) for axis in positions.T])
    return float(np.linalg.norm(np.diff(shape(*whole), axis=0), axis=1).sum())


def within(shape: Shape, outline: np.ndarray, value: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> float:
    """The integral of a value of each position, over what lies in an outline (P, 2)."""
    knots, weights = np.polynomial.legendre.leggauss(12)
    fine = np.linspace(0, 1, 9)[:-1, None]
    ends = np.roll(outline, -1, axis=0)
    positions = (outline[:, None] + fine * (ends - outline)[:, None]).reshape(-1, 2)
    steps = np.roll(positions, -1, axis=0) - positions
    middles, low = positions + steps / 2, outline[:, 1].min()
    half = (middles[:, 1] - low) / 2
    v = low + half[:, None] * (1 + knots)
    u = np.broadcast_to(middles[:, :1], v.shape)
    return float((-(value(u, v) * weights).sum(axis=1) * half * steps[:, 0]).sum())


def truths(shape: Shape, corners: np.ndarray) -> dict[str, float]:
    """What is true of three landmarks, (3, 2) in the shape's coordinates."""
    paths = [true_path(shape, corners[n], corners[(n + 1) % 3]) for n in range(3)]
    outline = np.concatenate([path[:-1] for path in paths])
    center, normal = plane_of(
        np.concatenate([steps_along(shape(*path.T), 0.1)[:-1] for path in paths]), "through"
    )

    def across(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.cross(*tangents(shape, u, v))

    area = within(shape, outline, lambda u, v: np.linalg.norm(across(u, v), axis=-1))
    volume = within(shape, outline, lambda u, v: ((shape(u, v) - center) @ normal) * (across(u, v) @ normal))
    a, b, c = shape(*corners.T)
    one, other = a - b, c - b
    angle = np.degrees(np.arccos(one @ other / np.linalg.norm(one) / np.linalg.norm(other)))
    return {
        "distance": float(np.linalg.norm(a - b)), "angle": float(angle), "path": true_length(shape, paths[0]),
        "area": abs(area), "volume": volume * np.sign(area),
    }  # fmt: skip


def landmarks_on(shape: Shape, middle: tuple[float, float], rng: np.random.Generator) -> np.ndarray:
    """Three landmarks about a middle, (3, 2) in the shape's coordinates."""
    right, up = (np.linalg.norm(side) for side in tangents(shape, *np.array(middle)))
    turns = rng.uniform(0, 2 * np.pi) + 2 * np.pi * np.arange(3) / 3
    around = SIDE * np.stack([np.cos(turns) / right, np.sin(turns) / up], axis=1)
    return np.array(middle) + around * rng.uniform(0.8, 1.1, (3, 1))


def kinds(options: Namespace) -> Iterator[Row]:
    """What can be measured."""
    for kind in measure_kinds().values():
        count = f"{kind.least}" if kind.least == kind.most else f"{kind.least} or more"
        choices = "; ".join(f"`{name}`: {' or '.join(values)}" for name, values in kind.choices.items())
        yield {
            "kind": f"`{kind.name}`", "": kind.title, "landmarks": count,
            "of the": "surface" if kind.needs_surface else "", "what it is": kind.about,
            "options, the first is the default": choices,
        }  # fmt: skip


def errors(options: Namespace) -> Iterator[Row]:
    """Errors by shape, density and noise: of distances and angles of landmarks put onto the surface, and of
    paths, areas and volumes."""
    for (name, (shape, middle)), spacing, noise in product(SHAPES.items(), SPACINGS, NOISES):
        rng = np.random.default_rng(7)
        off: list[list[float]] = []
        for _ in range(REPEATS):
            corners = landmarks_on(shape, middle, rng)
            true = truths(shape, corners)
            points = sample(shape, np.array(middle), spacing, noise, rng)
            surface = PoseSurface(Pose.of(0, 0.0, "shape", PointCloud.from_arrays(points)))
            positions = np.array([surface.nearest(position) for position in shape(*corners.T)], float)
            off.append([])
            for kind, expected in true.items():
                few = positions[:2] if kind in ("distance", "path") else positions
                error = values_of(kind, surface, few) - expected
                off[-1].append(error / FACTORS[kind](true))
        usual = np.sqrt((np.array(off) ** 2).mean(axis=0))
        cells = [f"{value:.3f}" if value < 0.1 else f"{value:.2f}" for value in usual]
        titles = ("distance, mm", "angle, °", "path, %", "area, %", "volume, mm")
        named = {"shape, mm": name, "spacing, mm": f"{spacing:g}", "noise, mm": f"{noise:g}"}
        yield {**named, **dict(zip(titles, cells, strict=True))}


def values_of(kind: str, surface: PoseSurface, positions: np.ndarray) -> float:
    """The value of a kind at positions."""
    found = kind_of(Measure("m", kind, tuple("abc"[: len(positions)])))
    if found.needs_surface:
        return float(found.compute(surface, positions, {}).value)  # type: ignore
    return float(found.compute(positions[None], {})[0])  # type: ignore


class OneFrame:
    """A scan of one frame of points."""

    name, unit, files = "shape", "mm", ()

    def __init__(self, points: np.ndarray) -> None:
        self.points = points

    def __len__(self) -> int:
        return 1

    def label(self, index: int) -> str:
        return self.name

    def times(self) -> np.ndarray:
        return np.zeros(1)

    def load(self, index: int) -> PointCloud:
        return PointCloud.from_arrays(self.points)

    def faces(self, index: int) -> Faces:
        return Faces.joined([])


def coverage(options: Namespace) -> Iterator[Row]:
    """The share of values within one and two standard deviations of the truth, of landmarks that are off
    along the surface by known covariances."""
    kinds = {
        "distance": "ab",
        "angle": "abc",
        "path": "ab",
        "perimeter": "abc",
        "area": "abc",
        "volume": "abc",
    }
    measures = [Measure(kind, kind, tuple(names)) for kind, names in kinds.items()]
    shares: dict[str, list[float]] = {kind: [] for kind in kinds}
    for shape, middle in SHAPES.values():
        rng = np.random.default_rng(11)
        for _ in range(CHANCES):
            corners = landmarks_on(shape, middle, rng)
            true = truths(shape, corners)
            true["perimeter"] = sum(
                true_length(shape, true_path(shape, corners[n], corners[n - 1])) for n in range(3)
            )
            tracks = {}
            for name, corner in zip("abc", corners, strict=True):
                right, up = tangents(shape, *corner)
                axes = np.linalg.qr(np.stack([right, up], axis=1))[0]
                position = shape(*corner) + OFF * axes @ rng.standard_normal(2)
                known = np.array([Known.PLACED], np.uint8)
                tracks[name] = Track(np.zeros(1), position[None], OFF**2 * (axes @ axes.T)[None], known, {})
            points = sample(shape, np.array(middle), SPACINGS[1], NOISES[1], rng)
            with Timeline(OneFrame(points), np.zeros(1), "mm") as timeline:
                found = all_series(measures, tracks, timeline)
            for kind, series in found.items():
                shares[kind].append(abs(series.values[0] - true[kind]) / series.sigmas[0])
    for kind, off in shares.items():
        within = {title: (np.array(off) <= most).mean() for title, most in (("one deviation", 1), ("two", 2))}
        yield {"kind": kind, **{f"within {title}": f"{100 * share:.0f} %" for title, share in within.items()}}


EXPERIMENT = Script([kinds, errors, coverage], page="landmarks.md")
