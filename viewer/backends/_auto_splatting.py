"""Drawing splats that a compute pass made of bare positions (Preiner 2012, section 7).

The ways of the surfels backend, in one pass or in two; normals are those of the splats, as the pose has none.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from ..gpu.amplify import Points, amplify
from ..gpu.bindings import Texture
from ..gpu.constants import LEAST_RADIUS
from ..gpu.fastest import instancing_for
from ..gpu.pose import GpuPose
from ..gpu.surface import Surface
from .surfels.passes import blend, blend_by_tiles
from .surfels.splats import FRAGMENT, SURFEL, Splats
from .surfels.tiles import FALLBACK, show_all, tile_lists

WAYS = ("tiles", "tbo", "pull")  # how packed points become splats
_FALLOFF = 4.0  # of the Gaussian mask, which ends where the splat does


def draw_splats(
    points: Points,
    surface: Surface,
    *,
    instancing: str = "auto",
    radius_scale: float = 1.0,
    two: bool = False,
    epsilon: float = 1.0,
) -> None:
    """Draw points whose `buffers` have "splats" and "looks".

    instancing: one of `WAYS`, or "auto", what is fastest on this device. radius_scale: factor on radii. two:
    whether splats that overlap are blended, those at most epsilon radii behind the nearest; else the nearest
    alone is seen.
    """
    splats = _splats(radius_scale, epsilon)
    _draw(points, surface, splats, _instancing(surface, instancing, two), two)
    if not two:
        _take_normals(points, surface)


def _splats(radius_scale: float, epsilon: float) -> Splats:
    return Splats(
        radius_scale=radius_scale,
        uniform_radius=0.0,
        least_radius=LEAST_RADIUS,
        cull_back=False,
        mask_limit=1.0,
        falloff=_FALLOFF,
        enlarge=1.0,
        epsilon=epsilon,
    )


def _draw(points: Points, surface: Surface, splats: Splats, way: str, two: bool) -> None:
    lists = tile_lists(points, surface, splats) if way == "tiles" else None
    if lists is not None:
        show_all(points, surface, lists, splats)
        if two:
            large = lists.large_points(points) if lists.large else None
            blend_by_tiles(points, surface, lists, large, splats)
        return
    feed = FALLBACK if way == "tiles" else way
    amplify(points, surface, feed, SURFEL, FRAGMENT, splats)
    if two:
        blend(points, surface, feed, splats)


def _take_normals(points: Points, surface: Surface) -> None:
    """Take each pixel's normal from the splat that it shows."""
    gpu, covered = surface.gpu, surface.list_covered()
    with gpu.timers.measure("normals"):
        points.array("splats").bind(Texture.SPLATS)
        surface.rows.bind(Texture.ROWS)
        surface.bind_own("normal")
        covered.run(gpu.compute("auto_splats/normals.comp"))


def _instancing(surface: Surface, setting: str, two: bool) -> str:
    """How points become splats; in one pass and in two this need not be the same."""

    def ways(pose: GpuPose, surface: Surface) -> dict[str, Callable[[], None]]:
        points = Points.of(pose, surface, 1.0, use_radii=True)
        return {name: partial(_draw, points, surface, _splats(1.0, 1.0), name, two) for name in WAYS}

    return instancing_for(surface, setting, "tiles", f"packed splats, {1 + two} passes", WAYS, ways)
