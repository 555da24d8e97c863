"""What is known of a view before it is drawn: how many points it shows, on how many pixels, how densely."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..gpu.chunks import LEAST, MOST
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..scan.spacing import sparse_spacing
from ..view import View

_SAMPLE = 1 << 13  # points that tell what a view shows; by chance, as files may repeat themselves
_FAR = 32.0  # spacings between one point and the next, from which on they count as scattered
_EACH = 6  # points of the sample for each cell of the grid that tells what they cover
_FEWEST = 16  # of the sample, in view, that tell anything


@dataclass(frozen=True)
class ScanInView:
    """A scan in a picture, as a sample of its points tells.

    points: of the scan. listed: points that are looked at to draw it, see gpu/chunks.py. in_view: points in
    the picture. pixels: of it. covered: pixels that points lie on. spacing, sparse: how far neighbouring
    points lie apart, pixels: usually, and where they are few. rough: how far they lie off the planes through
    their neighbours, pixels. scattered: share of the points that lie far from the one before in the file.
    footprint: edge of a pixel where the points are, scan units.
    """

    points: float
    listed: float
    in_view: float
    pixels: float
    covered: float
    spacing: float
    sparse: float
    rough: float
    scattered: float
    footprint: float

    @classmethod
    def of(cls, pose: Pose, view: View) -> ScanInView:
        """A pose in a view, in some milliseconds; what it tells of the scan itself is found once, in some
        more."""
        positions, steps = pose.overview.remember(_sample)
        is_cloud = isinstance(pose.points, PointCloud)
        sample = positions + (pose.origin - view.origin)
        sample = sample[view.contains(sample)]
        share = len(sample) / max(len(positions), 1)
        count, in_view = float(pose.count), pose.count * share
        pixels, depths = view.project(sample)
        middle = pose.drawn_bounds().center - view.origin
        usual = float(np.median(depths)) if len(sample) else float(view.depths(middle))
        footprint = float(view.footprint(max(usual, view.near)))
        by_chunks = is_cloud and count >= LEAST and share <= MOST
        sparse = sparse_spacing(pose.overview) if is_cloud and count else pose.spacing
        return cls(
            points=count,
            listed=in_view if by_chunks else count,
            in_view=in_view,
            pixels=float(view.size[0] * view.size[1]),
            covered=_covered(pixels, view.size),
            spacing=pose.spacing / footprint,
            sparse=sparse / footprint,
            rough=pose.roughness / footprint,
            scattered=float(np.mean(steps > _FAR * pose.spacing)) if is_cloud and len(steps) else 0.0,
            footprint=footprint,
        )

    def at(self, scale: float) -> ScanInView:
        """A scan as seen in a picture of other width and height: by this factor."""
        return replace(
            self,
            pixels=self.pixels * scale**2,
            covered=self.covered * scale**2,
            spacing=self.spacing * scale,
            sparse=self.sparse * scale,
            rough=self.rough * scale,
            footprint=self.footprint / scale,
        )

    def of_share(self, share: float) -> ScanInView:
        """A scan of which a share of the points is drawn, evenly chosen: as one that has no others."""
        apart = share**-0.5
        return replace(
            self,
            points=self.points * share,
            listed=self.listed * share,
            in_view=self.in_view * share,
            spacing=self.spacing * apart,
            sparse=self.sparse * apart,
        )


def _sample(cloud: PointCloud) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (M, 3) of points by chance, relative to the origin, and how far the next one in the file is
    from each, (M,) scan units."""
    count = len(cloud)
    rows = np.random.default_rng(0).integers(max(count - 1, 1), size=min(_SAMPLE, count))
    positions = cloud.positions[rows].astype(np.float64)
    return positions, np.linalg.norm(cloud.positions[np.minimum(rows + 1, count - 1)] - positions, axis=1)


def _covered(pixels: NDArray[np.float64], size: tuple[int, int]) -> float:
    """How many pixels points (N, 2) lie on that are some of many: by the cells of a grid."""
    if len(pixels) < _FEWEST:
        return 0.0
    low, high = np.quantile(pixels, [0.01, 0.99], axis=0)
    area = float(np.prod(np.maximum(high - low, 1.0)))
    edge = max(np.sqrt(_EACH * area / len(pixels)), 1.0)
    cells = np.floor(pixels / edge).astype(np.int64)
    return min(len(np.unique(cells @ np.array([1, 1 << 32]))) * edge**2, float(size[0] * size[1]))
