"""Other methods that find visible points, as far as their formulas are public. In float64, on the CPU.

Katz and Tal 2015, On the Visibility of Point Clouds: any flip p / |p| f(|p|) with a falling f will do; beside
the sphere's 2R - |p| they name |p|^g with g < 0. A point is the surer to be visible, the sharper its corner
of the hull is; what exactly is summed up in space is not public, and taken to be the angles of the hull's
faces at the corner, as implementations have it.

Biasutti 2019, Visibility Estimation in Point Clouds with Variable Density: a point is as visible as
exp(-((d - least) / (most - least))^2), d its distance from the eye, least and most those of its neighbours in
the picture; it counts as visible above the mean of all points. The number of neighbours is that of
implementations.

Mehra 2010, Visibility of Noisy Point Cloud Data: noise moves points below the hull, and they are lost. The
text is not public; the twin takes what is within the noise of the hull, along its ray, for visible.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from experiments.machado_2014.verdicts import Mask
from viewer.errors import InputError
from viewer.visibility.exact import Floats, Kernel, LowerSide, SeenPoints, flipped_triangles, gnomonic

NEIGHBORS = 50  # Biasutti 2019


def exponential(power: float) -> Kernel:
    """Flipping to |p|^power, power < 0 (Katz and Tal 2015)."""

    def shrink(distance: Floats, beyond: Floats, middle: float) -> Floats:
        return -np.expm1(power * np.log1p(beyond / middle))

    return shrink


def like_sphere(radius: float, distance: float) -> float:
    """The power that flips as a sphere does at a distance from the eye, to the first order."""
    return -distance / (2 * radius - distance)


def sharpness(seen: SeenPoints, kernel: Kernel) -> Floats:
    """How sharp the corners of the hull of flipped points are: 2 pi less the angles of the faces there, (N,);
    0 where a point is none."""
    flipped, triangles = flipped_triangles(seen, kernel)
    positions = np.concatenate([flipped, np.zeros((int(triangles.max()) + 1 - len(flipped), 3))])
    angles = np.zeros(len(positions))
    for corner in range(3):
        at, one, other = (positions[triangles[:, (corner + turn) % 3]] for turn in range(3))
        across = np.linalg.norm(np.cross(one - at, other - at), axis=1)
        along = ((one - at) * (other - at)).sum(axis=1)
        np.add.at(angles, triangles[:, corner], np.arctan2(across, along))
    angles = angles[: len(flipped)]
    return np.where(angles > 0, np.maximum(2 * np.pi - angles, np.finfo(float).tiny), 0.0)


def image_space_visible(seen: SeenPoints, neighbors: int = NEIGHBORS) -> Mask:
    """The points (N,) that are nearer than their neighbours in the picture (Biasutti 2019).

    Raises InputError where not all points are ahead of the eye.
    """
    from scipy.spatial import cKDTree

    _, around = cKDTree(_picture(seen)).query(_picture(seen), min(neighbors + 1, len(seen.distance)))
    near = seen.distance[around.reshape(len(seen.distance), -1)]
    least, most = near.min(axis=1), near.max(axis=1)
    score = np.exp(-(((seen.distance - least) / np.where(most > least, most - least, 1)) ** 2))
    return score >= score.mean()


def relaxed_visible(seen: SeenPoints, radius: float, kernel: Kernel, noise: float) -> Mask:
    """The points (N,) that are within `noise`, scan units, of the hull, along their rays (after Mehra 2010).

    Raises InputError where not all points are ahead of the eye.
    """
    lower = LowerSide.of(seen, kernel)
    if lower is None:
        raise InputError("the eye is among the points")
    triangles = lower.triangles[(lower.triangles < len(seen.distance)).all(axis=1)]
    above = _heights_above(lower, triangles)
    return (2 * radius - seen.distance) * above / (1 + lower.heights - above) <= noise


def _heights_above(lower: LowerSide, triangles: NDArray[np.intp]) -> Floats:
    """How far points lie above the lower side of their hull, (N,); 0 at its rim, where nothing is below."""
    from open3d import t
    from open3d.core import Tensor

    def flat(values: Floats) -> Floats:
        return (values - values.mean(axis=0)) / max(float(np.ptp(values)), np.finfo(float).tiny)

    positions = np.concatenate([flat(lower.across), flat(lower.heights[:, None])], axis=1).astype(np.float32)
    scene = t.geometry.RaycastingScene()
    scene.add_triangles(Tensor.from_numpy(positions), Tensor.from_numpy(triangles.astype(np.uint32)))
    rays = np.zeros((len(positions), 6), np.float32)
    rays[:, :2], rays[:, 2], rays[:, 5] = positions[:, :2], -2, 1
    faces = scene.cast_rays(Tensor.from_numpy(rays))["primitive_ids"].numpy()
    met = np.flatnonzero(faces < len(triangles))
    corners = triangles[faces[met]]
    first, second, third = (lower.across[column] for column in corners.T)
    base, along, beyond = lower.across[met] - first, second - first, third - first
    area = along[:, 0] * beyond[:, 1] - along[:, 1] * beyond[:, 0]
    by_second = (base[:, 0] * beyond[:, 1] - base[:, 1] * beyond[:, 0]) / area
    by_third = (along[:, 0] * base[:, 1] - along[:, 1] * base[:, 0]) / area
    low, high, highest = (lower.heights[column] for column in corners.T)
    above = np.zeros(len(positions))
    above[met] = lower.heights[met] - (low + by_second * (high - low) + by_third * (highest - low))
    above[np.unique(triangles)] = 0
    return np.maximum(above, 0)


def _picture(seen: SeenPoints) -> Floats:
    across = gnomonic(seen)
    if across is None:
        raise InputError("the eye is among the points")
    return across
