"""Draws an octree of the points as discs or cubes, which are coarser where they are far away.

`voxels` implements the method of Slomp 2014, section VI. `voxels` divides octants until nearly every point
has an octant of its own. Of the octree, `voxels` draws the octants that are about as large as a pixel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ...gpu.context import Gpu
from ...gpu.pose import GpuPose
from ...params import param
from ...picture.stats import Stats
from ...picture.surface import Surface
from ...scan.octree import DEEPEST, Octree
from ...scan.octree.build import STOPS, Stop, build, shortfall
from ...scan.octree.stored import octree_of, without_own_radii
from ...scan.octree.traverse import Sight, Traversal
from ...scan.points import PointCloud
from ...scan.pose import Pose
from ...splatting.amplify import Points
from ...splatting.local import NEAREST_ALONE, foresee_noise, layer_of, surface_param
from ...splatting.passes import blends
from ...view import View
from .. import AROUND_ALL, NO_DETAIL, NO_SPACING, Backend, Derives, FrameView, Limit
from .cubes import draw_cubes, shade_flat
from .cuts import OctreeCuts
from .discs import VARIANTS, draw_discs
from .shown import CutCounts

_CUBES = ("cubes", "flat_cubes")  # values of `shape`
_IN_CUBES = {"shape": _CUBES}

_ANYWHERE = Sight(np.zeros(3), np.eye(3), 1.0, (1, 1), 1.0, math.inf, perspective=True)


@dataclass(frozen=True)
class Params:
    """Parameters of the voxels backend."""

    stop: str = param(
        "auto",
        "When Scan4D stops dividing octants. auto: as stored in an octree file, which Scan4D then draws as "
        "stored; for other scans as delta. delta: when nearly every position has its own octant; depth: at "
        "a fixed level; occupancy: when an octant holds few points",
        choices=("auto", *STOPS),
        affects="derive",
        group="Octree",
    )
    delta: float = param(
        0.05,
        "Share of the positions that may lie in the same octant as other positions",
        low=0,
        high=1,
        affects="derive",
        group="Octree",
        when={"stop": ("auto", "delta")},
    )
    depth: int = param(
        10,
        "Level of the leaves",
        low=0,
        high=DEEPEST,
        affects="derive",
        group="Octree",
        when={"stop": ("depth",)},
    )
    occupancy: int = param(
        8,
        "Largest number of points in an octant that Scan4D does not divide",
        low=1,
        high=1 << 20,
        affects="derive",
        unit="points",
        group="Octree",
        when={"stop": ("occupancy",)},
    )
    shape: str = param(
        "discs",
        "Shape of octants in the picture. discs: a disc at the mean position, perpendicular to the mean "
        "normal; cubes: a cube with the light of the mean normal; flat_cubes: a cube with the light of "
        "its faces",
        choices=("discs", *_CUBES),
        words={"discs": "Pieces of the surface", "cubes": "Cubes", "flat_cubes": "Flat cubes"},
        basic=True,
        affects="derive",
        group="Octants",
    )
    radius: str = param(
        "auto",
        "Radii of discs. auto: the largest radius that the scan stores for the points of an octant; "
        "if a scan stores none, or if they are smaller than the distance between neighbouring octants, as "
        "spacing; spacing: the distance between neighbouring octants, enlarged so that discs form a closed "
        "surface",
        choices=("auto", "spacing"),
        affects="derive",
        group="Octants",
        when={"shape": ("discs",)},
    )
    radius_scale: float = param(
        1.0,
        "Factor on the radius of discs. With 1, discs form a closed surface",
        low=0.01,
        high=100.0,
        sweep=(0.8, 1.0),
        group="Octants",
        when={"shape": ("discs",)},
    )
    passes: str = param(
        "auto",
        "one: show the nearest disc; two: blend the nearest disc with the discs close behind it; auto: "
        "two, or one if two is too slow in motion",
        choices=("auto", "one", "two"),
        sweep=("auto", "one"),
        group="Octants",
        when={"shape": ("discs",)},
    )
    surface: str = surface_param("local", "Octants", when={"shape": ("discs",)})
    least: float = param(
        0.75,
        "Smallest half edge of a cube, in radii of the disc that would replace it. Larger cubes leave "
        "fewer gaps; 0: the exact size of the octant",
        low=0.0,
        high=10.0,
        group="Octants",
        when={"shape": _CUBES},
    )
    max_depth: int = param(
        DEEPEST,
        "Deepest level to draw",
        low=0,
        high=DEEPEST,
        sweep=(6, 7, 8, 9, 10, 11),
        group="Octants",
        title="Detail",
        basic=True,
    )
    pixel_threshold: float = param(
        1.0,
        "Scan4D draws an octant instead of its children if the edge of the octant is at most this many "
        "pixels",
        low=0.25,
        high=64.0,
        unit="px",
        group="Octants",
    )
    cull_back: bool = param(
        False, "Leave out octants whose normals all face away from the viewer", group="Octants"
    )
    instancing: str = param(
        "auto",
        "Method by which the GPU draws octants. auto: the fastest method on this device; tiles: a "
        "compute shader, which draws small cubes as faces. The other methods use a geometry shader, "
        "uniform blocks, buffer textures, vertex attributes or pulled vertices",
        choices=("auto", *VARIANTS),
        affects="speed",
        group="Speed",
    )


class Voxels(Backend):
    """The backend `voxels`."""

    title = "Voxels"
    good_for = "For large scans: draws distant parts of the scan coarser"
    params_class = Params
    rows = "octants"
    blends = True
    derives = Derives.ON_THREAD
    limits = {
        "rotated by 37 degrees": (Limit(0.007, AROUND_ALL, _IN_CUBES), Limit(0.001, AROUND_ALL)),
        "the near plane inside the scan": (Limit(0.01, AROUND_ALL, _IN_CUBES), Limit(0.001, AROUND_ALL)),
        "the eye inside the scan": (Limit(0.04, AROUND_ALL, _IN_CUBES), Limit(0.01, AROUND_ALL)),
        "zoomed in to 1/1000 of the scan's width": (
            Limit(0.007, AROUND_ALL, _IN_CUBES),
            Limit(0.001, AROUND_ALL),
        ),
        "zoomed in to a millionth of the scan's width": (
            Limit(0.99, NO_DETAIL, _IN_CUBES),
            Limit(0.65, NO_DETAIL),
        ),
        "collinear points": Limit(0.015, AROUND_ALL),
        "collinear points, viewed along their line, perspective": Limit(0.01, NO_SPACING),
        "collinear points, viewed along their line, orthographic": Limit(0.01, NO_SPACING),
    }
    default_reasons = {
        "cull_back": "the camera can see the inside of an open scan: without octants that face away, 1.5 "
        "% of the "
        "pixels of the bunny would show the background, because the bunny has no base",
        "radius_scale": "with a radius_scale of 0.8, gaps remain between discs: in 0.1 % of the pixels of "
        "the "
        "armadillo, and in 1 % of the pixels of a dancing body",
    }

    def needs(self, pose: Pose, params: Params) -> tuple[str, ...]:
        """Normals, but for faces, which have their own."""
        return () if params.shape == "flat_cubes" else ("normals",)

    def derive(self, pose: Pose, params: Params, view: View | None) -> Octree:
        """The octree of a pose: the one that its file stores, or one built from its points."""
        stored = octree_of(pose.cloud) if params.stop == "auto" else None
        cloud = pose.cloud
        if params.radius == "spacing" or params.shape in _CUBES:
            stored, cloud = stored and without_own_radii(stored), replace(cloud, radii=None)
        octree = stored or build(cloud, _stop(params))
        # A process's first cut imports, a machine's first compiles: not while a window draws.
        traversal = Traversal(octree.prefix(1), _ANYWHERE)
        traversal.advance()
        traversal.cut(octree.low)
        return octree

    def upload(self, gpu: Gpu, octree: Octree) -> OctreeCuts:
        """Nothing is uploaded until a view is known."""
        return OctreeCuts(gpu, octree)

    def foresee(self, cloud: PointCloud, params: Params) -> None:
        """Estimate the noise of points."""
        foresee_noise(cloud, params)

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Draw the nodes that the view tells apart; complete where all were found, and all shall be drawn."""
        params: Params = frame.params
        voxels: OctreeCuts = frame.derived
        if not pose.count:
            surface.clear()
            return False
        shown = voxels.show(pose, frame)
        surface.show(shown)
        found = shown.found
        coarse = frame.share < 1 and found.coarsest < min(params.max_depth, voxels.octree.depth)
        _report(found, voxels.octree, params, surface.stats)
        surface.stats.coarseness = found.coarseness
        if coarse:
            surface.stats.left_out = math.ceil(pose.count * (1 - frame.share))  # as good as
        points = Points(shown.points, use_radii=True, count=shown.points.count)
        if not points.count:
            surface.clear()
            return not found.complete
        layer = NEAREST_ALONE
        if params.shape == "discs":
            two = blends(frame, surface) if params.passes == "auto" else params.passes == "two"
            layer = layer_of(pose, frame, surface, blends=two)
            draw_discs(
                points,
                surface,
                instancing=params.instancing,
                radius_scale=params.radius_scale,
                two=two or layer.is_local,
                layer=layer,
            )
        else:
            draw_cubes(points, surface, params.instancing)
        if params.shape == "flat_cubes":
            shade_flat(points, surface)
        return coarse or not (found.complete and layer.known)


def _stop(params: Params) -> Stop:
    """The rule for octrees that are built."""
    rule = "delta" if params.stop == "auto" else params.stop
    return Stop(rule=rule, delta=params.delta, depth=params.depth, occupancy=params.occupancy)


def _report(found: CutCounts, octree: Octree, params: Params, stats: Stats) -> None:
    stopped = shortfall(octree, _stop(params))
    if stopped:
        stats.chosen["depth"] = stopped
    if params.cull_back and octree.attributes and octree.attributes[0].cones is None:
        stats.skipped["cull_back"] = "the octree file does not store how far the normals in an octant differ"
    for cause, count in (("out of view", found.outside), ("facing away", found.facing_away)):
        if count:
            stats.skipped[f"octants {cause}"] = f"{count:,}, with all their children"
