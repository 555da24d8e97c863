"""Splats as Slomp 2014 draws them (V-B), line by line: two geometry passes, and colours through the feed.

The `surfels` backend finds more than a picture: the point of each pixel, the nearest of the enlarged splats
where the first pass found none (a third geometry pass), and it fetches colours by point in place of
feeding them. Here the first pass draws depths alone, pushed away from the eye; the second, twice as large,
blends what passes them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import moderngl
import numpy as np

from viewer.backends import Backend, FrameView
from viewer.camera import Camera
from viewer.gpu import gl
from viewer.gpu.bindings import Texture
from viewer.gpu.constants import LEAST_RADIUS
from viewer.gpu.context import Gpu
from viewer.gpu.pose import GpuPose
from viewer.params import param
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.spacing import typical_spacing
from viewer.splatting.amplify import FEEDS, Points, draw_shapes
from viewer.splatting.splats import SURFEL, Splats

NAME = "surfels-2014"
_FRAGMENT, _RESOLVE = (str(Path(__file__).with_name(f"literal.{kind}")) for kind in ("frag", "comp"))
_ENLARGE, _FALLOFF = 2.0, 4.0
_RADIUS_PER_SPACING = 1.5


@dataclass(frozen=True)
class PaperParams:
    """Parameters of the paper's splats."""

    instancing: str = param("gs", "How points become quads", choices=FEEDS)


def paper_splats() -> Backend:
    """The paper's splats, for benchmarks alone: pixels show no point."""
    return _Literal(NAME)


def drawn_as_printed(cloud: PointCloud, _: Camera) -> tuple[PointCloud, Backend]:
    """What the benchmark draws of a scan: the points with colours, by the paper's splats."""
    return colored(cloud), paper_splats()


def colored(cloud: PointCloud) -> PointCloud:
    """The points with colours: by their normals, as in the paper (III), where they have none of their own."""
    return cloud.remember(_by_normals) if cloud.colors is None else cloud


def _by_normals(cloud: PointCloud) -> PointCloud:
    assert cloud.normals is not None
    colors = np.full((len(cloud), 4), 255, np.uint8)
    colors[:, :3] = np.rint(127.5 + 127.5 * cloud.normals)
    return replace(cloud, colors=colors)


class _Literal(Backend):
    """The paper's splats."""

    title = "Slomp 2014"
    params_class = PaperParams

    def needs(self, pose: Pose, params: PaperParams) -> tuple[str, ...]:
        """The normals and colours that are fed."""
        return ("normals", "colors")

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Draw depths, then colours; always complete."""
        gpu, feed = surface.gpu, frame.params.instancing
        own = pose.cloud.radii is not None
        points = Points(pose, own, len(pose.cloud), colored=True)
        splats = _splats(0.0 if own else _RADIUS_PER_SPACING * pose.stored.remember(typical_spacing))
        sums = surface.cached(_new_sums)
        sums.target.use()
        sums.clear()
        sums.clear_depth()
        gpu.ctx.enable_only(moderngl.DEPTH_TEST)
        gpu.ctx.depth_func = ">"  # reversed depth: near is 1
        pushed = _pushed(pose, surface, splats)
        with gpu.timers.measure("visibility"), gl.kept_colors(), gl.divided_depth(pushed):
            draw_shapes(points, feed, SURFEL, _FRAGMENT, splats, {"SHADES": 0})
        with gpu.timers.measure("shading"), gl.kept_depth():
            gpu.ctx.enable_only(moderngl.DEPTH_TEST | moderngl.BLEND)
            gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
            draw_shapes(splats.larger(points), feed, SURFEL, _FRAGMENT, splats, {"SHADES": 1})
            gpu.ctx.disable(moderngl.BLEND)
        with gpu.timers.measure("resolve"):
            surface.clear()
            surface.bind_storage()
            surface.bind_own("color")
            sums.bind_images(Texture.COLOR_SUMS, Texture.NORMAL_SUMS)
            gpu.dispatch(gpu.compute(_RESOLVE), surface.size[0] * surface.size[1])
        surface.stats.faces_away = True
        return False


def _pushed(pose: GpuPose, surface: Surface, splats: Splats) -> float:
    """The number that reversed depths are divided by: a radius away from the eye, where the scan is."""
    radii = pose.cloud.radii
    radius = splats.uniform_radius if radii is None else float(radii[: 1 << 13].mean())
    return 1 + radius / abs(float(surface.view.depths(pose.sample).mean()))


def _splats(uniform_radius: float) -> Splats:
    return Splats(
        radius_scale=1.0,
        uniform_radius=uniform_radius,
        least_radius=LEAST_RADIUS,
        cull_back=True,
        mask_limit=min(1.0, -math.log(0.0183) / _FALLOFF),
        falloff=_FALLOFF,
        enlarge=_ENLARGE,
        epsilon=0.0,
    )


def _new_sums(gpu: Gpu, size: tuple[int, int]) -> gl.Sums:
    return gl.Sums(gpu.ctx, size)
