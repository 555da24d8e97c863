"""Points on surfaces, with what is known of them in closed form.

They come as the arguments of `PointCloud.from_arrays` by name, all float64, so that they can be
moved, scaled and spoilt before they become a cloud; normals are exact, colours tell them apart.
`cloud` and `on_mesh` make clouds of any size, in float32.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...mesh.triangles import Mesh
from ...scan.points import PointCloud
from ...srgb import bytes_from_linear, linear_from_bytes
from .subjects import with_rows

Arrays = dict[str, NDArray]
Sampler = Callable[[int, slice], Arrays]  # some rows of a number of points

_RADIUS_PER_SPACING = 1.5  # discs of this radius close the surface
_R2 = np.array([0.7548776662466927, 0.5698402909980532])  # powers of the generalised golden ratio
_GOLDEN_TURN = np.pi * (3 - np.sqrt(5))
_ALL = slice(None)
_CANDIDATES = 5  # positions tried for each point of blue noise
_APART = 0.715  # distance between points of blue noise, in spacings of as many evenly spread ones
_CHUNK = 1 << 20  # points made at a time, so that float64 copies stay small


def evenly(number: NDArray[np.integer], shift: NDArray[np.float64] | float = 0.0) -> NDArray[np.float64]:
    """Points (N, 2) of a sequence (Roberts 2018) that covers the unit square evenly as far as it is followed.

    number: (N,), their numbers in it. shift: (2,), where it starts.
    """
    return (number[:, None] * _R2 + shift) % 1


def on_sphere(count: int, rows: slice = _ALL) -> Arrays:
    """The unit sphere, evenly covered (Fibonacci's spiral: Swinbank and Purser 2006). rows: which points."""
    number = _numbers(count, rows)
    height, turn = 1 - (2 * number + 1) / count, _GOLDEN_TURN * number
    out = np.sqrt(1 - height**2)
    normals = np.stack([out * np.cos(turn), height, out * np.sin(turn)], axis=1)
    return _points(normals, normals, np.sqrt(4 * np.pi / count))


def on_square(count: int, rows: slice = _ALL) -> Arrays:
    """The square -1..1 on z = 0, facing +z, evenly covered. rows: which points."""
    x, y = (2 * evenly(_numbers(count, rows)) - 1).T
    normals = np.tile([0.0, 0.0, 1.0], (len(x), 1))
    return _points(np.stack([x, y, np.zeros(len(x))], axis=1), normals, np.sqrt(4 / count))


def on_cube(count: int, rows: slice = _ALL) -> Arrays:
    """The cube -1..1, its sides evenly covered, by turns. rows: which points."""
    number, side = np.divmod(_numbers(count, rows), 6)
    every, axis = np.arange(len(side)), side // 2
    normals = np.zeros((len(side), 3))
    normals[every, axis] = 1 - 2 * (side % 2)
    positions = normals.copy()
    positions[every, (axis + 1) % 3], positions[every, (axis + 2) % 3] = (2 * evenly(number) - 1).T
    return _points(positions, normals, np.sqrt(24 / count))


def on_torus(count: int, rows: slice = _ALL, *, ring: float = 1.0, tube: float = 0.4) -> Arrays:
    """A torus about the y axis, evenly covered. rows: which points."""
    turn, share = evenly(_numbers(count, rows)).T
    # The area of a slice of the tube grows with its distance from the axis: invert its integral.
    table = np.linspace(0, 2 * np.pi, 4097)
    angle = np.interp(share, (ring * table + tube * np.sin(table)) / (2 * np.pi * ring), table)
    outward = np.stack([np.cos(2 * np.pi * turn), np.zeros(len(turn)), np.sin(2 * np.pi * turn)], axis=1)
    normals = outward * np.cos(angle)[:, None] + np.array([0, 1, 0]) * np.sin(angle)[:, None]
    return _points(outward * ring + normals * tube, normals, np.sqrt(4 * np.pi**2 * ring * tube / count))


def wall(columns: int, rows: int, spacing: float, wave: float = 0.0) -> Arrays:
    """A grid of points on z = 0 around the origin, facing +z.

    wave: how fast colours change along x and y, radians a point; 0: one colour for all.
    """
    x, y = np.meshgrid(np.arange(columns) - (columns - 1) / 2, np.arange(rows) - (rows - 1) / 2)
    positions = spacing * np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    arrays = _points(positions, np.tile([0.0, 0.0, 1.0], (x.size, 1)), spacing)
    return {**arrays, "colors": 0.5 + 0.5 * np.sin(positions / spacing * wave + np.arange(3))}


def rings(count: int, around: int) -> Arrays:
    """A cylinder about the y axis, four units high, one in radius, in rings of ellipses that just close it.

    count: of rings. around: points of each. `axes` instead of `radii`, as `PointCloud` has them.
    """
    turn, level = np.meshgrid(np.arange(around) * 2 * np.pi / around, (np.arange(count) + 0.5) / count - 0.5)
    normals = np.column_stack([np.cos(turn).ravel(), 0 * turn.ravel(), np.sin(turn).ravel()])
    half_axes = [0.0, 0.75 * 4 / count, 0.0, 0.75 * 2 * np.pi / around]
    return {
        "positions": normals + np.outer(4 * level.ravel(), [0.0, 1.0, 0.0]),
        "normals": normals,
        "axes": np.tile(half_axes, (len(normals), 1)),
    }


def hall(count: int) -> Arrays:
    """The wall of a round hall about the z axis, one in radius, from z = -0.5 to -60, covered by chance.

    From its near end it is near and far at once. One normal in ten points out of the hall.
    """
    rng = np.random.default_rng(3)
    turn, down = rng.uniform(0, 2 * np.pi, count), rng.uniform(0.5, 60, count)
    outward = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    normals = outward * np.where(rng.random(count) < 0.9, -1, 1)[:, None]
    return _points(outward - np.outer(down, [0.0, 0.0, 1.0]), normals, np.sqrt(2 * np.pi * 60 / count))


def hills(count: int) -> Arrays:
    """The square -1..1 of x and z with hills along y, 0.04 high, evenly covered."""
    x, z = (2 * evenly(np.arange(count)) - 1).T
    y = 0.02 * (1 + np.sin(9 * x) * np.cos(9 * z))
    slope_x, slope_z = 0.18 * np.cos(9 * x) * np.cos(9 * z), -0.18 * np.sin(9 * x) * np.sin(9 * z)
    normals = np.stack([-slope_x, np.ones(count), -slope_z], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return _points(np.stack([x, y, z], axis=1), normals, np.sqrt(4 / count))


def line(count: int, end: tuple[float, float, float]) -> Arrays:
    """Points on the line from -end to end, facing +z."""
    positions = np.linspace(-1, 1, count)[:, None] * np.array(end)
    spacing = 2 * np.linalg.norm(end) / max(count - 1, 1)
    return _points(positions, np.tile([0.0, 0.0, 1.0], (count, 1)), spacing)


def cloud(sampler: Sampler, count: int) -> PointCloud:
    """A cloud of one of the surfaces above, uncoloured."""

    def sample(rows: slice) -> PointCloud:
        part = sampler(count, rows)
        return PointCloud.from_arrays(
            part["positions"], normals=part["normals"], radii=part["radii"], origin=np.zeros(3)
        )

    return _joined([sample(rows) for rows in _chunks(count)])


def on_mesh(mesh: Mesh, count: int, seed: int = 0) -> PointCloud:
    """Points spread over a mesh by area, in the order of its faces, radii for the mean spacing.

    Normals and colours are those of the vertices, interpolated, where the mesh has them.
    """
    ends = np.cumsum(np.linalg.norm(mesh.areas(), axis=1) / 2)
    shift = np.random.default_rng(seed).random(2)

    def sample(rows: slice) -> PointCloud:
        number = _numbers(count, rows)
        faces = np.searchsorted(ends, (number + 0.5) / count * ends[-1])
        u, v = evenly(number, shift).T
        root = np.sqrt(u)
        weights = np.stack([1 - root, root * (1 - v), root * v])
        positions, normals, colors = _at(mesh, faces, weights)
        radii = np.full(len(faces), _RADIUS_PER_SPACING * np.sqrt(ends[-1] / count))
        return PointCloud.from_arrays(
            positions, normals=normals, colors=colors, radii=radii, origin=mesh.origin
        )

    return _joined([sample(rows) for rows in _chunks(count)])


def at_random(mesh: Mesh, count: int, rng: np.random.Generator) -> PointCloud:
    """Points at random positions of a mesh, uniform by area; normals and colours as `on_mesh`, no radii."""
    ends = np.cumsum(np.linalg.norm(mesh.areas(), axis=1))
    faces = np.searchsorted(ends, rng.random(count) * ends[-1])
    u, v = rng.random((2, count))
    root = np.sqrt(u)
    positions, normals, colors = _at(mesh, faces, np.stack([1 - root, root * (1 - v), root * v]))
    return PointCloud.from_arrays(positions, normals=normals, colors=colors, origin=mesh.origin)


def blue_noise(mesh: Mesh, count: int, rng: np.random.Generator) -> PointCloud:
    """About so many points of a mesh at random positions, none of which is close to another on the same side
    of the surface (Poisson disks, by random order: Bowers et al. 2010); attributes as `at_random`."""
    from scipy.spatial import cKDTree

    some = at_random(mesh, _CANDIDATES * count, rng)
    assert some.normals is not None
    area = float(np.linalg.norm(mesh.areas(), axis=1).sum()) / 2
    pairs = cKDTree(some.positions).query_pairs(_APART * np.sqrt(area / count), output_type="ndarray")
    pairs = pairs[(some.normals[pairs[:, 0]] * some.normals[pairs[:, 1]]).sum(axis=1) > 0]
    # Candidates come in random order: the lower row goes first.
    open_, kept = np.ones(len(some), bool), np.zeros(len(some), bool)
    while open_.any():
        later = np.zeros(len(some), bool)
        later[pairs[:, 1]] = True
        first = open_ & ~later
        kept |= first
        taken = first[pairs[:, 0]]
        open_[first] = False
        open_[pairs[taken, 1]] = False
        pairs = pairs[open_[pairs].all(axis=1)]
    return with_rows(some, np.flatnonzero(kept))


def torus_grid(around: int, stretch: float, *, ring: float = 1.0, tube: float = 0.4) -> Arrays:
    """A grid on the torus of `on_torus`. around: points around the ring. stretch: how many times as far apart
    they are as those around the tube, where the ring is longest."""
    step = 2 * np.pi * (ring + tube) / around
    along = max(round(2 * np.pi * tube * stretch / step), 3)
    turn, angle = (
        part.ravel()
        for part in np.meshgrid(np.arange(around) * 2 * np.pi / around, np.arange(along) * 2 * np.pi / along)
    )
    outward = np.stack([np.cos(turn), np.zeros(len(turn)), np.sin(turn)], axis=1)
    normals = outward * np.cos(angle)[:, None] + np.array([0, 1, 0]) * np.sin(angle)[:, None]
    return _points(outward * ring + normals * tube, normals, step)


def _at(mesh: Mesh, faces: NDArray, weights: NDArray) -> tuple[NDArray, NDArray, NDArray | None]:
    """Absolute positions, unit normals and colours at positions of barycentric weights (3, N) on faces
    (N,)."""
    points, corners = mesh.points, mesh.faces[faces]
    flat = normals = mesh.areas(faces)
    if points.normals is not None:
        normals = _blend(points.normals, corners, weights)
    normals = np.where(normals.any(axis=1, keepdims=True), normals, flat)
    return (
        _blend(points.positions, corners, weights) + mesh.origin,
        normals / np.linalg.norm(normals, axis=1, keepdims=True),
        None
        if points.colors is None
        else bytes_from_linear(_blend(linear_from_bytes(points.colors[:, :3]), corners, weights)),
    )


def _blend(values: NDArray, corners: NDArray, weights: NDArray) -> NDArray:
    """Values (V, C) of vertices blended over corners (N, 3) with weights (3, N): (N, C)."""
    return sum(weight[:, None] * values[corner] for weight, corner in zip(weights, corners.T, strict=True))


def _joined(parts: list[PointCloud]) -> PointCloud:
    """One cloud of several with the same attributes and the same origin."""

    def joined(arrays: list[NDArray | None]) -> NDArray | None:
        there = [array for array in arrays if array is not None]
        return np.concatenate(there) if there else None

    return replace(
        parts[0],
        positions=np.concatenate([part.positions for part in parts]),
        normals=joined([part.normals for part in parts]),
        colors=joined([part.colors for part in parts]),
        radii=joined([part.radii for part in parts]),
        axes=joined([part.axes for part in parts]),
    )


def _chunks(count: int) -> Iterator[slice]:
    return (slice(start, min(start + _CHUNK, count)) for start in range(0, count, _CHUNK))


def _numbers(count: int, rows: slice) -> NDArray[np.intp]:
    return np.arange(*rows.indices(count))


def _points(positions: NDArray, normals: NDArray, spacing: float | np.floating) -> Arrays:
    radii = np.full(len(positions), _RADIUS_PER_SPACING * spacing)
    return {"positions": positions, "normals": normals, "colors": normals * 0.5 + 0.5, "radii": radii}
