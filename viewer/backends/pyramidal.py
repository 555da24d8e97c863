"""Draws range images and points, and fills the holes between their samples.

`pyramidal` uses pyramidal projection (Farooq 2013, chapters 4 to 6). `pyramidal` draws the samples into the
picture, and computes targets: copies of the picture at half the size, a quarter, and so on. `pyramidal` fills
each hole from the finest target whose samples surround the hole.
"""

from __future__ import annotations

from ..gpu.pose import GpuPose
from ..picture.surface import Surface
from ..projection.filled import draw_filled, foresee_filled
from ..projection.settings import ProjectionParams
from ..scan.points import PointCloud
from ..scan.pose import Pose
from . import AT_EDGES, NO_SPACING, Backend, FrameView, Limit, Suited


class Pyramidal(Backend):
    """The backend `pyramidal`."""

    title = "Filled surface"
    good_for = "Draws range images and fills holes"
    params_class = ProjectionParams
    blends = True
    draws_with = ("colors", "normals")
    fills = True
    limits = {
        "the eye inside the scan": Limit(0.01, AT_EDGES),
        "coplanar points": Limit(0.008, AT_EDGES),
        "collinear points, viewed along their line, perspective": Limit(0.08, NO_SPACING),
        "collinear points, viewed along their line, orthographic": Limit(0.08, NO_SPACING),
    }
    default_reasons = {
        "fill": "point clouds have holes to fill, but the polygons of dense range views leave few"
    }

    def needs(self, pose: Pose, params: ProjectionParams) -> tuple[str, ...]:
        """The samples of range views where there are such, else nothing but positions."""
        return ("views",) if pose.views else ()

    def suits(self, pose: Pose) -> Suited | None:
        """Range views: nothing is estimated or merged, and nothing lies nearer to what was measured."""
        return Suited(2) if pose.views else None

    def offers(self, pose: Pose) -> tuple[dict[str, object], ...]:
        """Polygons, and points, of range views; clouds are drawn by splats faster and better."""
        return ({}, {"primitive": "points"}) if pose.views else ()

    def foresee(self, cloud: PointCloud, params: ProjectionParams) -> None:
        """Find the spacing of points."""
        foresee_filled(cloud)

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Scatter, show, hide, fill; complete where all samples shall be drawn."""
        return draw_filled(pose, frame.params, frame.share, surface)
