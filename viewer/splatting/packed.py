"""Packed splats: drawing what a compute pass of another backend made of bare positions (Preiner 2012, 7).

The variants of surfels, in one pass or in two; normals are those of the splats, as the pose has none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from ..gpu import gl
from ..gpu.bindings import Storage, Texture
from ..gpu.constants import LEAST_RADIUS
from ..gpu.context import Gpu
from ..gpu.pose import GpuPose
from ..picture.surface import Surface
from .amplify import Points, amplify
from .fastest import instancing_for
from .lists import TileLists
from .local import NEAREST_ALONE, Layer, begin_local, settle_depths
from .passes import blend, blend_by_tiles
from .splats import FRAGMENT, SURFEL, Splats
from .tiles import FALLBACK, show_all, show_smaller, show_with, tile_lists, without_wait

VARIANTS = ("tiles", "tbo", "pull")  # how packed points become splats
_SLACK = 0.5  # radii of what a pixel shows, behind which a point is hidden by it
_SPARE = 4  # times the rows that there is room for, beyond which room is given up
_EPSILON = 1.0  # radii of the nearest splat that another may lie behind it and be blended with it
_FALLOFF = 4.0  # of the Gaussian mask, which ends where the splat does


def draw_splats(
    points: Points,
    surface: Surface,
    *,
    instancing: str = "auto",
    radius_scale: float = 1.0,
    two: bool = False,
    refine: bool = True,
    layer: Layer = NEAREST_ALONE,
) -> None:
    """Draw points whose `buffers` have "splats" and "looks".

    instancing: one of `VARIANTS`, or "auto", what is fastest on this device. radius_scale: factor on radii.
    two: whether splats that overlap are blended, else the nearest alone is seen. refine: whether splats of
    points that others hide are made as small as those. layer: how layers are shown, with `two`.
    """
    splats = layer.of(_splats(radius_scale, _EPSILON))
    _draw(points, surface, splats, _instancing(surface, instancing, two), two, refine)
    if not two:
        take_normals(points.array("splats"), surface)


def draw_depths(
    points: Points, surface: Surface, *, instancing: str = "auto", radius_scale: float = 1.0
) -> None:
    """The nearest splat at each pixel, as `draw_splats` has it before any is made smaller; no more."""
    splats = _splats(radius_scale, 0.0)
    _draw(points, surface, splats, _instancing(surface, instancing, two=False), two=False, refine=False)


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


def _draw(points: Points, surface: Surface, splats: Splats, variant: str, two: bool, refine: bool) -> None:
    def draw() -> bool:
        lists = tile_lists(points, surface, splats, looks=two, numbered=refine)
        if lists is not None:
            _draw_by_tiles(points, surface, lists, splats, two, refine)
        return lists is not None

    if variant == "tiles" and without_wait(points, surface, draw):
        settle_depths(surface, splats)
        return
    feed = FALLBACK if variant == "tiles" else variant
    amplify(points, surface, feed, SURFEL, FRAGMENT, splats)
    if refine:
        points = _shrunk(points, surface, splats)
        amplify(points, surface, feed, SURFEL, FRAGMENT, splats)
    if two:
        blend(points, surface, feed, splats)
    settle_depths(surface, splats)


def _draw_by_tiles(
    points: Points, surface: Surface, lists: TileLists, splats: Splats, two: bool, refine: bool
) -> None:
    large = show_all(points, surface, lists, splats)
    if refine:
        points = _shrunk(points, surface, splats, lists)
        if large is None:
            show_smaller(surface, lists, splats)
            surface.stats.counted["refined tiles"] = lists.shown_again
        else:
            large = replace(large, buffers=points.buffers)
            show_with(points, large, surface, lists, splats)
    if two:
        begin_local(surface, splats)
        blend_by_tiles(points, surface, lists, large, splats)


def _shrunk(points: Points, surface: Surface, splats: Splats, lists: TileLists | None = None) -> Points:
    """The points, with splats of those that are hidden no larger than what hides them, and so in `lists`.

    Where the nearest surface is sparse, points behind it are the nearest of their pixels, and find neighbors
    only far away: their splats reach beyond outlines. The paper culls them, draws the others, culls anew by
    what these show, and draws once more. That opens holes where splats of the nearest surface leave gaps:
    made small, those behind it still close them, and one depth map more is enough.
    """
    gpu = surface.gpu
    by_row, count = surface.cached(_ByRow), len(points.pose.cloud)
    radii = by_row.reserve("radii", count, gl.R32F)
    defines = {"TILES": int(lists is not None), **points.defines}
    program = gpu.compute("surfels/packed/shrink.comp", defines, params=splats)
    with gpu.timers.measure("shrink"):
        gpu.set(program, slack=_SLACK)
        points.bind(program)
        surface.bind_textures()
        radii.buffer.bind_to_storage_buffer(Storage.RADII)
        if lists is not None:
            lists.bind_forms()
            discs = by_row.reserve("discs", count, gl.R32UI)
            discs.bind(Texture.DISCS)
            discs.buffer.bind_to_storage_buffer(Storage.DISCS)
        gpu.dispatch(program, points.count)
    return replace(points, buffers={**points.buffers, "radii": radii})


class _ByRow:
    """Numbers of a pose's rows, kept with a surface: "radii", of splats as they are drawn; "discs", by which
    tiles know them."""

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self._gpu = gpu
        self._texels: dict[str, gl.BufferTexture] = {}

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return sum(texels.buffer.size for texels in self._texels.values())

    def reserve(self, name: str, count: int, texel_format: int) -> gl.BufferTexture:
        """Texels for so many rows."""
        old, nbytes = self._texels.get(name), 4 * max(count, 1)
        if old is None or not nbytes <= old.buffer.size <= _SPARE * nbytes:
            self._gpu.discard(old)
            self._texels[name] = gl.BufferTexture(self._gpu.buffer(reserve=nbytes), texel_format)
        return self._texels[name]

    def release(self) -> None:
        """Delete them."""
        self._gpu.discard(*self._texels.values())


def take_normals(splats: gl.BufferTexture, surface: Surface) -> None:
    """Take each pixel's normal from the splat that it shows. splats: by row, as `Points.buffers` has them."""
    gpu, covered = surface.gpu, surface.list_covered()
    with gpu.timers.measure("normals"):
        splats.bind(Texture.SPLATS)
        surface.rows.bind(Texture.ROWS)
        surface.bind_own("normal")
        covered.run(gpu.compute("surfels/packed/normals.comp"))


def _instancing(surface: Surface, setting: str, two: bool) -> str:
    """How points become splats; in one pass and in two this need not be the same."""
    task = f"packed splats, {1 + two} passes"
    return instancing_for(surface, setting, "tiles", task, VARIANTS, partial(_variants, two))


def _variants(two: bool, pose: GpuPose, surface: Surface) -> dict[str, Callable[[], None]]:
    """Pictures of a pose by each variant."""
    points = Points.of(pose, surface, 1.0, use_radii=True)
    return {name: partial(_draw, points, surface, _splats(1.0, 1.0), name, two, False) for name in VARIANTS}
