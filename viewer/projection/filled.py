"""A filled picture of samples: scattered, hidden ones left out, holes filled.

Farooq 2013, chapters 4 to 6.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..gpu.bindings import Texture
from ..gpu.pose import GpuPose
from ..gpu.scatter import Visits
from ..picture.surface import Surface
from ..scan.points import PointCloud
from ..scan.spacing import sparse_spacing
from ..view import View
from .settings import ProjectionParams
from .sources import PointSource, SampleSource
from .spreading import add_spread, spread_macros
from .targets import LEVELS, Targets
from .views import ViewSource


@dataclass(frozen=True)
class _Numbers:
    """Numbers that the shaders read.

    levels: of targets that are shown, a bit each; coarsest: of them. density: the level whose cells samples
    all fill. spacing: of the samples, scan units. first_level, last_level: of range images, that are drawn;
    top_level: the last that there is. parts: of the picture's rows, that large triangles are drawn in.
    """

    levels: int
    coarsest: int
    step: float
    margin: float
    reach: float
    widest: float
    density: int
    tolerance: float
    neighbors: int
    spacing: float
    first_level: int
    last_level: int
    detail: float
    top_level: int
    parts: int


_UPSAMPLING = {"nearest": 0, "bilinear": 1, "bicubic": 2}
_MARGIN, _MARGIN_OF_JOINED = 0.4, 0.15
_ROWS_OF = 1 << 14  # pixels that an invocation may have to look at, of triangles that fill the picture
_MOST_PARTS = 128
_CROWD, _CROWDED = 1 << 13, 64  # point spread functions a pixel, at least; times what is to be expected


def draw_filled(
    pose: GpuPose,
    params: ProjectionParams,
    share: float,
    surface: Surface,
    merge: Callable[[ViewSource, Sequence[str]], None] | None = None,
) -> bool:
    """Draw the samples of a pose; True if a later call would refine the picture. share: of the samples.

    merge: given range views, changes what pixels show of the nearest surface before
    what has no sample is filled from them: called with the source and the channels that they have, of which
    normals are one then."""
    params = _coarser(params, share) if pose.views else params
    source = _source(pose, params, surface, merge is not None)
    visits = source.visits(surface, share)
    with surface.keeping_nearest() as nearest:
        nearest.take(visits)
    refinable = share < 1 if pose.views else surface.stats.share < 1
    fills, hides = params.shown != (0,), params.hide and not source.is_closed
    channels = source.channels(surface)
    spreads = params.antialias != "off" and not source.is_closed and "color" in channels
    if fills or hides or spreads or source.is_made:
        _resolve(
            surface, source, channels, _spread(surface, source, visits, params) if spreads else {"SUMS": 0}
        )
    else:
        surface.stats.skipped["fill"] = "the picture shows only measured samples (level 0)"
    if merge is not None and isinstance(source, ViewSource):
        merge(source, channels)
    if source.is_closed:
        surface.stats.skipped["hide"] = "polygons already hide all samples behind them"
    if not (fills or hides):
        return refinable
    targets = surface.cached(Targets)
    if hides:
        targets.reduce(surface, source, channels)
        with surface.gpu.timers.measure("hide"):
            defines = source.defines([])
            program = surface.gpu.compute("pyramidal/hide.comp", defines, source.parts, source.params)
            _bind(surface, source, channels)
            targets.bind()
            surface.gpu.dispatch(program, surface.size[0] * surface.size[1])
    if fills:
        targets.reduce(surface, source, channels)
        _fill(surface, source, channels, targets, params.upsampling)
    return refinable


def _coarser(params: ProjectionParams, share: float) -> ProjectionParams:
    """The parameters for a share of the samples: those of coarser levels, of one view."""
    if share >= 1:
        return params
    return replace(params, detail=params.detail / math.sqrt(share), blend="nearest")


def _spread(
    surface: Surface, source: SampleSource, visits: Visits, params: ProjectionParams
) -> Mapping[str, object]:
    """Add up point spread functions; gives the macros of what reads their sums."""
    most = _most_at_once(surface, source.count)
    macros = spread_macros(params.antialias, params.kernel, most)
    given = replace(visits, defines={**visits.defines, **macros})
    add_spread(surface, given, params.kernel, most).texels.bind(Texture.SUMS)
    return macros


def _most_at_once(surface: Surface, count: int) -> int:
    """Number of point spread functions that a pixel may be given: far more than if samples were spread over
    what the scan covers of the picture."""
    pose, view = surface.pose, surface.view
    depth = max(float(view.depths(pose.bounds.center - pose.origin)), view.near)
    radius = pose.bounds.radius * view.scale / (depth if view.perspective else 1.0)
    return min(count, _CROWD + _CROWDED * math.ceil(count / max(math.pi * radius**2, 1.0)))


def _bind(surface: Surface, source: SampleSource, channels: Sequence[str]) -> None:
    source.bind()
    surface.bind_storage()
    surface.bind_own("level", *channels)


def _resolve(
    surface: Surface, source: SampleSource, channels: Sequence[str], macros: Mapping[str, object]
) -> None:
    """Make what was scattered into pixels what these show."""
    gpu, covered = surface.gpu, surface.list_covered()
    with gpu.timers.measure("resolve"):
        defines = {**source.defines(channels), **macros}
        program = gpu.compute("pyramidal/resolve.comp", defines, source.parts, source.params)
        _bind(surface, source, channels)
        covered.texels.bind(Texture.LISTED)
        covered.run(program)


def _fill(
    surface: Surface, source: SampleSource, channels: Sequence[str], targets: Targets, upsampling: str
) -> None:
    """Fill pixels from what is around them in the targets."""
    gpu, holes = surface.gpu, targets.list_holes(source.params)
    surface.stats.counted["cells"] = targets.read_holes
    with gpu.timers.measure("fill"):
        defines = {"UPSAMPLING": _UPSAMPLING[upsampling], **source.defines(channels)}
        program = gpu.compute("pyramidal/fill.comp", defines, source.parts, source.params)
        _bind(surface, source, channels)
        targets.bind()
        holes.texels.bind(Texture.LISTED)
        holes.run(program)


def _source(pose: GpuPose, params: ProjectionParams, surface: Surface, normals: bool) -> SampleSource:
    joined = bool(pose.views) and params.primitive == "polygons"
    spacing = pose.samples.spacing if pose.views else pose.stored.remember(_spacing)
    margin = _MARGIN_OF_JOINED if joined else _MARGIN
    last = pose.samples.levels - 1 if pose.views else 0
    first = min(params.first_level, last)
    values = _Numbers(
        levels=sum(1 << level for level in params.shown),
        coarsest=LEVELS - 1,
        step=params.step,
        margin=margin if params.margin is None else params.margin,
        reach=params.reach,
        widest=params.widest,
        density=0 if joined else _density(pose, surface.view, spacing),
        tolerance=params.tolerance,
        neighbors=params.neighbors,
        spacing=spacing,
        first_level=first,
        last_level=last if params.lod else first,
        detail=params.detail,
        top_level=last,
        parts=_parts(surface.size),
    )
    if not pose.views:
        return PointSource(pose, values)
    return ViewSource(pose, surface, params, values, normals)


def foresee_filled(cloud: PointCloud) -> None:
    """Find what the projection reads of points (`Backend.foresee`)."""
    cloud.remember(_spacing)


def _spacing(cloud: PointCloud) -> float:
    """The spacing of points, in half octaves of the scan's size: pictures depend neither on which points it
    was judged by nor on the unit."""
    size = float(np.ptp(cloud.positions, axis=0).max()) if len(cloud) else 0.0
    ratio = sparse_spacing(cloud) / size if size > 0 else 1.0
    return (size or 1.0) * 2.0 ** (round(2 * math.log2(ratio)) / 2)


def _parts(size: tuple[int, int]) -> int:
    """The parts that the rows of a picture are drawn in, where triangles may fill it."""
    return min(2 ** math.ceil(math.log2(max(size[0] * size[1] / _ROWS_OF, 1))), _MOST_PARTS)


def _density(pose: GpuPose, view: View, spacing: float) -> int:
    """The level whose cells samples fill in the middle of the scan."""
    depth = max(float(view.depths(pose.bounds.center - pose.origin)), view.near)
    apart = spacing * view.scale / (depth if view.perspective else 1.0)
    return min(math.ceil(math.log2(max(apart, 1.0))), LEVELS - 1)
