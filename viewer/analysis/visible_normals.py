"""Visible normals: what a camera sees of a scan's points, with normals found from their positions alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..backends.auto_splats import widening_of
from ..backends.auto_splats.neighborhoods import MOST_NEIGHBORS, Neighborhoods, Search
from ..camera import Camera
from ..drawing.renderer import shared_renderer
from ..errors import InputError
from ..gpu.constants import UNKNOWN
from ..picture.surface import Surface
from ..scan.noise import noise_of
from ..scan.pods import first_camera
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..view import View


@dataclass(frozen=True, eq=False)
class VisibleNormals:
    """Points that a camera sees, by their ids ascending, and what their neighborhoods tell.

    ids:        (M,) uint32, index in the file
    rows:       (M,) uint32, row in the cloud's arrays
    normals:    (M, 3) float32, unit length, world space, towards the eye
    radii:      (M,) float32, distance of a neighborhood's farthest point, scan units: r_k where counts is k
    counts:     (M,) int64, points of a neighborhood, the point itself among them: k, or fewer before a gap
    splat_radii: (M,) float32, how far the point's Voronoi cell reaches among those that are seen, in the
                plane, and a little more; 0.9 to 2 times 2 r / sqrt(n), n of the neighbors being seen
                (Preiner 2012, 6); 0 where no splat is drawn
    curvatures: (M,) float32, the least eigenvalue of the covariance over the sum of all, 0 to 1/3
    usual:      (M,) float32, the radius that should hold k points by how dense the picture is there
    outliers:   (M,) bool, whether it is far from all others
    neighbors:  (P,) uint32, rows of all that could be neighbors
    hidden:     (P,) bool, which of these another point hides
    ones too
    """

    ids: NDArray[np.uint32]
    rows: NDArray[np.uint32]
    normals: NDArray[np.float32]
    radii: NDArray[np.float32]
    counts: NDArray[np.int64]
    splat_radii: NDArray[np.float32]
    curvatures: NDArray[np.float32]
    usual: NDArray[np.float32]
    outliers: NDArray[np.bool_]
    neighbors: NDArray[np.uint32]
    hidden: NDArray[np.bool_]


@dataclass(frozen=True)
class NormalSearch:
    """Rules for normals from neighborhoods. Raises InputError for values outside their range.

    k: points of a neighborhood, the point itself among them. adaptive: whether planes go through as few of
    the nearest points as noise allows, and where points are noisy, through all in a ball that the noise
    widens, as `auto_splats` has it. hidden_neighbors: whether hidden points that are at most some
    neighborhoods away take part. expansions: of a neighborhood without another point, until its point is an
    outlier; None: there are no outliers. growth: of the area within which another point must follow.
    """

    k: int = 10
    adaptive: bool = True
    hidden_neighbors: bool = True
    expansions: int | None = 3
    growth: float = 4.0

    def __post_init__(self) -> None:
        if not 3 <= self.k <= MOST_NEIGHBORS:
            raise InputError(f"a neighbourhood must have 3 to {MOST_NEIGHBORS} points, not {self.k}")
        if not self.growth >= 1:
            raise InputError(
                f"the factor 'growth' of a neighbourhood must be at least 1, not {self.growth:g}"
            )


def estimate_normals(
    pose: Pose | PointCloud,
    camera: Camera | None = None,
    *,
    size: tuple[int, int] = (1760, 900),
    search: NormalSearch = NormalSearch(),
) -> VisibleNormals:
    """Normals of the points that a picture of this size shows (Preiner 2012, 4 to 6).

    A neighborhood is the k nearest points in space of those that take part, ties by the lowest row. It ends
    before a gap: let d_1 = 0, d_2, ... be the distances of the points by size, and u the usual radius; a
    point with d_2 > 2^expansions u is an outlier, and the first j from 2 on with d_{j+1} > sqrt(growth)
    max(d_j, u) is the count. Where neighbors are thrice as far as is typical for the picture or more, points
    are outliers too that lie off all others: d_2^2 > 0.7 d_count^2.

    The normal is that of the plane through the neighborhood. An adaptive search takes so few of the nearest
    points that neither their residuals nor some more points turn the plane by much. If the noise exceeds a
    twelfth of the spacing, it takes all points in a ball of up to twice the neighborhood's radius.

    camera: None fits the pose from the front. Raises InputError, NoOpenGLError.
    """
    if isinstance(pose, PointCloud):
        pose = Pose(0, 0.0, "points", pose)
    renderer = shared_renderer()
    surface = Surface(renderer.gpu, size)
    resident = renderer.resident(pose)
    bounds = resident.bounds
    camera = camera or first_camera(pose.views, bounds, size[0] / size[1], pose.upright)
    view = View.of(camera, size, resident.origin, bounds)
    surface.start(resident, view)
    found = surface.cached(Neighborhoods)
    alone = UNKNOWN if search.expansions is None else 2.0**search.expansions
    rules = Search(search.k, search.hidden_neighbors, False, search.growth, alone, adaptive=search.adaptive)
    if search.adaptive and len(pose.cloud):
        noise = noise_of(pose.cloud)
        rules = replace(rules, widening=widening_of(noise, search.k), noise=noise.deviation)
    found.find(resident, surface, view, rules)
    return read_normals(resident.cloud, found)


def read_normals(cloud: PointCloud, found: Neighborhoods) -> VisibleNormals:
    """The normals that a search has found, or those of the splats after `auto_splats` drew them."""
    rows = found.read("drawn", np.uint32, 1)[: found.count, 0]
    order = np.argsort(rows)
    rows = rows[order]
    radii, counts, curvatures, usual = found.read("found", np.float32, 4)[: found.count][order].T
    slots = np.sort(found.read("slots", np.uint32, 4)[: found.participants, 3])
    words = found.read("splats", np.uint32, 3)[rows]
    return VisibleNormals(
        ids=rows if cloud.ids is None else cloud.ids[rows],
        rows=rows,
        normals=_unfolded(words[:, 0]),
        radii=radii,
        counts=np.abs(counts).astype(np.int64),
        splat_radii=np.ascontiguousarray(words[:, 1]).view(np.float32),
        curvatures=curvatures,
        usual=usual,
        outliers=counts < 0,
        neighbors=slots // np.uint32(2),
        hidden=slots % 2 == 1,
    )


def _unfolded(words: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Unit normals (N, 3) of words as shaders/common/octahedron.glsl packs them."""
    net = np.maximum(
        np.stack([words & 0xFFFF, words >> 16], 1).astype(np.uint16).view(np.int16) / 32767, -1.0
    )
    z = 1 - np.abs(net).sum(1)
    under = np.maximum(-z, 0)[:, None]
    normals = np.column_stack([net - np.where(net < 0, -under, under), z])
    return (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
