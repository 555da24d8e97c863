"""Draws each point as a disc along the surface, so that discs close the gaps between points.

`surfels` implements the method of Slomp 2014, sections IV and V. To draw a disc, `surfels` draws a square,
perpendicular to the normal, with a Gaussian mask that ends at the radius. `surfels` draws discs in one pass,
or in two passes that blend overlapping discs. If the scan stores half-axes, discs are ellipses.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..gpu import gl
from ..gpu.constants import LEAST_RADIUS, UNKNOWN
from ..gpu.pose import GpuPose
from ..params import param, radius_scale_param
from ..picture.surface import Surface
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..scan.spacing import typical_spacing
from ..splatting import passes
from ..splatting.amplify import FEEDS, Points, amplify
from ..splatting.fastest import instancing_for
from ..splatting.gaps import GapRadii
from ..splatting.local import NEAREST_ALONE, Layer, foresee_noise, layer_of, surface_param
from ..splatting.splat_culling import draw_unhidden, may_cull
from ..splatting.splats import FRAGMENT, SURFEL, Splats
from ..splatting.subpixel import average, splat_subpixel, subpixel_share
from ..splatting.tiles import FALLBACK, most_listed, splat
from . import AT_EDGES, Backend, FrameView, Limit, Suited, share_param, with_levels

_SEEN_THROUGH = (
    "each pixel shows a mean of overlapping splats; radii, the number of copies and rounding decide the "
    "weight of each splat"
)

_VARIANTS = ("tiles", *FEEDS)
AS_PRINTED = "as_printed"  # a value of `passes`
_TWO = ("two", "two_large")
_ENLARGED = (*_TWO, AS_PRINTED)
_HIDING = ("one", *_TWO)  # those in which nothing shows through what lies before it
# A uniform radius of 1.5 times the spacing closes a surface that is evenly covered.
_RADIUS_PER_SPACING = 1.5
# Factor on the radius in previews of some points, which lie less evenly than all do: of the demo's pixels in
# the coarsest preview, 0.01 % show what is behind, 0.4 % without it.
_UNEVEN = 1.3


def _blended(**pixels: float) -> tuple[Limit, ...]:
    """Limits of the values of `passes` that blend in an order. pixels: of `sorted`, and of `printed`."""
    values = {"sorted": "sorted", "printed": AS_PRINTED}
    return tuple(Limit(share, _SEEN_THROUGH, {"passes": (values[name],)}) for name, share in pixels.items())


@dataclass(frozen=True)
class Params:
    """Parameters of the surfels backend."""

    passes: str = param(
        "auto",
        "How Scan4D draws overlapping splats. one: show the nearest splat; two: blend the nearest splat "
        "with the splats close behind it; auto: two with enlarge=1, or one if two is too slow in motion. "
        "For comparison, the other values reproduce the pictures of Slomp 2014, Fig. 3: one_blended (a), "
        "one_no_depth (b), visibility (c), two_large (e), sorted (blended from back to front), and "
        "as_printed (two passes as that paper prints them: colours without light or points)",
        choices=(
            *("auto", "one", "two", "one_blended", "one_no_depth", "visibility", "two_large", "sorted"),
            AS_PRINTED,
        ),
        sweep=("auto", "one", "two"),
        group="Surface",
    )
    enlarge: float = param(
        2.0,
        "Factor on the size of splats in the second pass (Slomp 2014, Fig. 3 f); 1: not enlarged (Fig. 3 d)",
        low=1.0,
        high=8.0,
        group="Surface",
        when={"passes": _ENLARGED},
    )
    epsilon: float = param(
        1.0,
        "Largest distance behind the nearest splat at which Scan4D still blends another splat with it, "
        "in radii of the nearest splat",
        low=0.0,
        high=100.0,
        group="Surface",
        unless={"passes": ("one_blended", "one_no_depth", "sorted")},
    )
    surface: str = surface_param("local", "Surface", when={"passes": ("auto", "one", "two", "two_large")})
    radius: str = param(
        "auto",
        "Radii of splats. auto: the radii of the scan, enlarged if they leave gaps, or the size of the "
        "gaps around each point; own: the radii of the scan, or estimated radii; uniform: one radius for "
        "all points",
        choices=("auto", "own", "uniform"),
        group="Splats",
    )
    radius_scale: float = radius_scale_param(group="Splats", basic=True)
    mask_falloff: float = param(
        4.0,
        "How fast the opacity of a splat fades: exp(-falloff d^2), where d is 1 at the radius",
        low=0.1,
        high=100.0,
        group="Splats",
    )
    mask_cutoff: float = param(
        0.0183,
        "Opacity at which a splat ends. A splat never extends beyond its radius",
        low=0.0183,
        high=0.99,
        group="Splats",
    )
    cull_back: bool = param(
        False,
        "Leave out splats that face away from the viewer",
        group="Splats",
        unless={"passes": (AS_PRINTED,)},  # which leaves them out
    )
    share: float | None = share_param(
        None, "all points, or with a software driver, as many points as its lists can hold", "Splats"
    )
    instancing: str = param(
        "auto",
        "Method by which the GPU draws splats. auto: the fastest method on this device; tiles: a compute "
        "shader. The other methods draw quads from a geometry shader, uniform blocks, buffer textures, "
        "vertex attributes or pulled vertices",
        choices=("auto", *_VARIANTS),
        affects="speed",
        group="Speed",
    )


class Surfels(Backend):
    """The backend `surfels`."""

    title = "Discs"
    good_for = "Best look for points with normals"
    params_class = Params
    draws_with = ("colors", "radii", "axes")
    blends = True
    fills = True
    limits = {
        "rotated by a quarter turn": _blended(printed=0.0),
        "rotated by 37 degrees": _blended(printed=0.0003),
        "zoomed in to 1/1000 of the scan's width": _blended(printed=0.0003),
        "zoomed in to a millionth of the scan's width": (
            *_blended(sorted=0.0),
            Limit(0.0, _SEEN_THROUGH),
        ),
        "zoomed in to 1/1000 of a splat's width": _blended(sorted=0.0, printed=0.0),
        "zoomed in to a millionth of a splat's width": _blended(sorted=0.0, printed=0.0),
        "each point 1000 times in a row": _blended(sorted=0.5, printed=0.3),
        "the list of points 1000 times": _blended(sorted=0.5, printed=0.3),
        "a body, each point 1000 times": _blended(sorted=0.21, printed=0.26),
        "each point 1000 times, without radii": (
            *_blended(sorted=0.56, printed=0.24),
            Limit(0.01, AT_EDGES, {"passes": _TWO}),  # lists of tiles have no room: these are rasterised
        ),
        "one point x1000": _blended(sorted=0.03, printed=0.11),
        "collinear points, viewed along their line, perspective": _blended(sorted=0.002, printed=0.006),
        "collinear points, viewed along their line, orthographic": _blended(sorted=0.002, printed=0.006),
        "zero radii": _blended(sorted=0.75, printed=0.0),
        "negative radii": _blended(sorted=0.75, printed=0.0),
        "NaN radii": _blended(sorted=0.75, printed=0.0),
    }
    default_reasons = {
        "cull_back": "the camera can see the inside of an open scan: without splats that face away, 2.2 % "
        "of the "
        "pixels of the bunny would show the background, because the bunny has no base. We found no "
        "test for closed scans that is both safe and faster (docs/how-it-works/surfels.md)"
    }

    def needs(self, pose: Pose, params: Params) -> tuple[str, ...]:
        """Normals, and radii where they shall be the points' own."""
        return ("normals", "radii") if params.radius == "own" else ("normals",)

    def suits(self, pose: Pose) -> Suited | None:
        """Scans that store normals."""
        return None if pose.overview.normals is None else Suited(1)

    def offers(self, pose: Pose) -> tuple[dict[str, object], ...]:
        """Two passes, and one, where normals are stored."""
        return (
            ()
            if pose.views or pose.overview.normals is None
            else with_levels(pose, {}, {"passes": "one", "surface": "nearest"})
        )

    def foresee(self, cloud: PointCloud, params: Params) -> None:
        """Estimate the noise of points, and find how large their discs are."""
        foresee_noise(cloud, params)
        if len(cloud):
            _foresee_sizes(cloud, params)

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Splat in as many passes as are asked for; complete where all points are drawn in their size."""
        params: Params = frame.params
        if not len(pose.cloud):
            surface.clear()
            return False
        params, layer = _with_passes(params, pose, frame, surface)
        if frame.moving and frame.share < 1:
            params = replace(params, radius_scale=_UNEVEN * params.radius_scale)
        instancing = _instancing(params, surface)
        surface.stats.faces_away = params.cull_back
        sizes, known = _sizes(pose, frame, surface)

        def draw_points(points: Points) -> bool:
            _splat(points, surface, params, instancing, layer.of(_splats(params, sizes.uniform)))
            return "tiles" in surface.stats.skipped  # as there are many large ones among these

        reach, margin = params.radius_scale * sizes.largest, _splats(params, 0.0).least_radius
        larger = max(params.enlarge, 1.0) if params.passes in _ENLARGED else 1.0
        may_thin = params.share is None and instancing == "tiles" and surface.gpu.software
        most = most_listed(surface.gpu) if may_thin else len(pose.cloud)
        stays = frame.share >= 1 and "pose" not in frame.changed and len(pose.cloud) <= most
        if stays and params.passes in _HIDING and may_cull(pose):
            points = Points(pose, sizes.own, len(pose.cloud), buffers=sizes.buffers)
            splats = layer.of(_splats(params, sizes.uniform))
            limits = replace(
                splats, radius_scale=larger * splats.radius_scale, least_radius=larger * splats.least_radius
            )
            draw_unhidden(points, surface, limits, sizes.largest, draw_points)
        else:
            points = Points.of(pose, surface, frame.share, sizes.own, larger * margin, larger * reach)
            splats = _splats(params, sizes.uniform)
            if points.count > most and _mean_share(points, surface, params, splats) < 1:
                points = _as_many(most, points, pose, frame, surface, (larger * margin, larger * reach))
            draw_points(replace(points, buffers=sizes.buffers))
        return surface.stats.is_sample or not (known and layer.known)


def _as_many(
    most: int, points: Points, pose: GpuPose, frame: FrameView, surface: Surface, margins: tuple[float, float]
) -> Points:
    """So many in place of all of these points: a coarser level of detail. margins: as `Points.of` has."""
    stats, share = surface.stats, most / points.count
    stats.asked, stats.left_out = share, 0
    stats.chosen["share"] = (
        f"{share:.2f}, because the lists can hold only {most:,} of the {points.count:,} splats in view"
    )
    return Points.of(pose, surface, share * frame.share, points.use_radii, *margins)


@dataclass(frozen=True)
class _Sizes:
    """How large discs are.

    own: whether points bring their own radii. uniform: the radius of those that have none, scan units.
    largest: of all radii. buffers: as `Points` has them.
    """

    own: bool
    uniform: float
    largest: float
    buffers: Mapping[str, gl.BufferTexture] = field(default_factory=dict)


def _sizes(pose: GpuPose, frame: FrameView, surface: Surface) -> tuple[_Sizes, bool]:
    """How large discs are, and whether that is known as it shall be: else one size is for all, meanwhile."""
    own, known = frame.params.radius != "uniform", True
    if frame.params.radius == "auto" and pose.stored.axes is None:
        gaps = pose.cached(GapRadii)
        if frame.moving and gaps.presumes_none(pose):
            surface.stats.simplified = True
            surface.stats.skipped["gaps"] = (
                "during playback, Scan4D does not search for gaps again if the radii of the last pose left "
                "none"
            )
        else:
            in_haste = frame.moving and surface.gpu.software
            known = gaps.find(pose, wait=frame.budget_ms is None, fits=not in_haste)
            surface.stats.simplified = surface.stats.simplified or (in_haste and not gaps.fits)
        own = pose.stored.remember(_has_radii)
        if gaps.texels is not None:
            if own:
                surface.stats.chosen["radius"] = (
                    "the size of the gaps between points, because the scan's own radii leave gaps"
                )
            return _Sizes(True, gaps.usual, gaps.largest, gaps.buffers), True
    # The spacing takes longer to find than many a pose takes to draw.
    suffices = own and pose.cloud.remember(_has_radii, np.all)
    uniform = 0.0 if suffices else _uniform_radius(pose.stored)
    return _Sizes(own, uniform, max(uniform, pose.cloud.longest_reach() if own else 0.0)), known


def _with_passes(params: Params, pose: GpuPose, frame: FrameView, surface: Surface) -> tuple[Params, Layer]:
    """The parameters with the passes that "auto" stands for, two where the local surface takes these; and
    what is shown of layers."""
    if params.passes == "auto":
        params = replace(params, passes="two" if passes.blends(frame, surface) else "one", enlarge=1.0)
    if params.passes == AS_PRINTED:
        params = replace(params, cull_back=True)
    if params.passes not in _HIDING:
        return params, NEAREST_ALONE
    layer = layer_of(pose, frame, surface, blends=params.passes in _TWO)
    if layer.is_local and params.passes == "one":
        params = replace(params, passes="two", enlarge=1.0)
    return params, layer


def _splat(points: Points, surface: Surface, params: Params, instancing: str, splats: Splats) -> None:
    share = _mean_share(points, surface, params, splats)
    if share == 1 or (share > 0 and params.passes == "one"):
        _draw_subpixel(points, surface, params, instancing, replace(splats, mean_share=share))
    elif params.passes in _TWO:
        _draw_two(points, surface, params, instancing, splats)
    else:
        _draw_one(points, surface, params, instancing, splats)


def _mean_share(points: Points, surface: Surface, params: Params, splats: Splats) -> float:
    """The part of what a pixel shows that is the mean of its splats: 1 where they are under a pixel."""
    enlarged = splats.larger(points) if params.passes in _TWO else points
    may_average = params.passes == "one" or (params.passes in _TWO and params.epsilon > 0)
    return subpixel_share(enlarged, surface, splats) if may_average else 0.0


def _splats(params: Params, uniform_radius: float) -> Splats:
    mask_limit = min(1.0, -math.log(params.mask_cutoff) / params.mask_falloff)
    return Splats(
        radius_scale=params.radius_scale,
        uniform_radius=uniform_radius,
        least_radius=LEAST_RADIUS / math.sqrt(mask_limit),
        cull_back=params.cull_back,
        mask_limit=mask_limit,
        falloff=params.mask_falloff * mask_limit,
        enlarge=params.enlarge,
        epsilon=params.epsilon,
    )


def _draw_nearest(points: Points, surface: Surface, instancing: str, splats: Splats) -> None:
    """The nearest splat of each pixel."""
    if instancing == "tiles":
        splat(points, surface, splats)
    else:
        amplify(points, surface, instancing, SURFEL, FRAGMENT, splats)


def _draw_subpixel(points: Points, surface: Surface, params: Params, instancing: str, splats: Splats) -> None:
    """Splats of about a pixel: those of a pixel are averaged, in place of any second pass; the larger they
    are, the less, so that nothing changes at once while one comes nearer."""
    if params.passes in _TWO:
        surface.stats.skipped["second pass"] = (
            "splats are smaller than a pixel, so each pixel shows the mean of its splats"
        )
    if params.instancing == "auto":
        surface.stats.chosen["instancing"] = "scatter"
        surface.stats.skipped["tiles"] = (
            "splats are smaller than a pixel, so Scan4D writes each splat to a single pixel"
        )
        splat_subpixel(points, surface, splats)
    else:
        _draw_nearest(points, surface, instancing, splats)
    if splats.epsilon > 0:
        average(points, surface, splats)


def _draw_one(points: Points, surface: Surface, params: Params, instancing: str, splats: Splats) -> None:
    """The nearest splats, and what is made of them beyond that; or what Slomp 2014 prints."""
    feed = FALLBACK if instancing == "tiles" else instancing
    if params.passes == AS_PRINTED:
        passes.splat_as_printed(points, surface, feed, splats)
        return
    _draw_nearest(points, surface, instancing, splats)
    if params.passes == "visibility":
        passes.show_visibility(points, surface, splats)
    elif params.passes == "sorted":
        passes.splat_sorted(points, surface, feed, splats)
    elif params.passes != "one":
        passes.splat_over(points, surface, feed, splats, tested=params.passes == "one_blended")


def _draw_two(points: Points, surface: Surface, params: Params, instancing: str, splats: Splats) -> None:
    """Visibility, then blending."""
    if params.passes == "two_large":
        points, splats = splats.larger(points), replace(splats, enlarge=1.0)
    if splats.enlarge == 1 and splats.epsilon == splats.layer == 0:
        surface.stats.skipped["second pass"] = (
            "Scan4D neither enlarges nor blends splats with these parameters"
        )
        _draw_nearest(points, surface, instancing, splats)
    elif instancing == "tiles":
        passes.tiled_two_passes(points, surface, splats)
    else:
        passes.two_passes(points, surface, instancing, splats)


def _instancing(params: Params, surface: Surface) -> str:
    """How points become splats; in one pass and in two this need not be the same."""
    like = "two" if params.passes in _TWO else "one"
    variants = partial(_variants, like)
    return instancing_for(surface, params.instancing, "tiles", f"surfels, passes {like}", _VARIANTS, variants)


def _variants(passes: str, pose: GpuPose, surface: Surface) -> dict[str, Callable[[], None]]:
    """Pictures of a pose by each variant."""
    params, points = Params(passes=passes), Points.of(pose, surface, 1.0, use_radii=True)
    splats = _splats(params, 0.0)
    return {name: partial(_splat, points, surface, params, name, splats) for name in _VARIANTS}


def _has_radii(cloud: PointCloud, of: Callable[[NDArray], bool] = np.any) -> bool:
    """Whether any point, or all, has a radius that the shader takes."""
    return cloud.radii is not None and bool(of((cloud.radii > 0) & (cloud.radii < np.float32(UNKNOWN))))


def _uniform_radius(cloud: PointCloud) -> float:
    return _RADIUS_PER_SPACING * cloud.remember(typical_spacing)


def _foresee_sizes(cloud: PointCloud, params: Params) -> None:
    """Find the facts that sizes of discs go by."""
    cloud.whole_bounds()
    if params.radius != "uniform" and cloud.remember(_has_radii):
        cloud.reaches()
        if cloud.remember(_has_radii, np.all):
            return
    _uniform_radius(cloud)
