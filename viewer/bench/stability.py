"""Numerical stability: how far apart two pictures are, and how far they may be; see `numerics`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..backends import Backend, Limit
from ..drawing.renderer import Renderer
from ..splatting.amplify import FEEDS
from .rounding import IN_SOFTWARE, Rounding
from .shots import PointView, RgbdImage, picture

# From these steps on a pixel counts as another one. Eight bits round within one level, and a
# highlight doubles that.
_DEPTH_STEP, _COLOR_STEP = 0.1, 3  # pixel widths, levels of 255
_ROUNDINGS = 6 * 2.0**-17  # pixels: of a coordinate between 128 and 256
# The same where a row cannot be held: another surface or another side of it, not another point beside.
_COARSE_STEPS = (8.0, 64)


@dataclass(frozen=True)
class Difference:
    """How far two pictures are apart.

    pixels: the share of pixels that differ: only one picture covers them, or depth or colour is
    a step apart. depth, color: the mean difference of the others, pixel widths and levels.
    """

    pixels: float
    depth: float
    color: float

    def __str__(self) -> str:
        return f"{self.pixels:.4%} of the pixels, depth {self.depth:.2g} px, colour {self.color:.2g} levels"


def difference(
    one: RgbdImage, other: RgbdImage, depth_step: float = _DEPTH_STEP, color_step: float = _COLOR_STEP
) -> Difference:
    """Compare two pictures of one size. Steps in pixel widths and in levels of 255."""
    covered, other_covered = (~np.isposinf(each.depth) for each in (one, other))  # NaN is another depth
    both = covered & other_covered
    depth = np.abs(np.where(both, one.depth, 0) - np.where(both, other.depth, 0))
    color = np.abs(one.color - other.color)
    same = (covered == other_covered) & (depth < depth_step) & (color.max(axis=2) < color_step)
    if not same.any():
        return Difference(1.0, 0.0, 0.0)
    return Difference(1 - float(same.mean()), float(depth[same].mean()), float(color[same].mean()))


@dataclass(frozen=True)
class Tolerance:
    """How far apart is still the same, from how far the points may be apart.

    error: pixel widths, root mean square over the points; reason: where it comes from.

    Share of the pixels: a pixel differs where its centre lies within the error of a border
    between what two points show. With a point or a splat for each pixel the borders are 2 pixel
    widths long in each pixel. Splats meet where their depths are equal; on the torus
    neighbours lean by 1/14 towards each other, which moves the border by 14 errors.
    2 sides x 2 x 14 on the third of the picture that is covered: 20 x error.
    The others: five errors of depth, for slopes up to five; and no more than as many borders
    whose two sides are less than a step apart.
    """

    error: float
    reason: str

    @property
    def bound(self) -> Difference:
        """The largest difference that is within it."""
        pixels = min(20 * self.error, 1.0)
        return Difference(pixels, 5 * self.error + _DEPTH_STEP * pixels, _COLOR_STEP * pixels)

    def on(self, driver: Rounding, *, rasterised: bool) -> Tolerance:
        """Tolerance of pictures by a driver: each of six roundings of a pixel coordinate may be a quotient's
        (`numerics.FLOAT32`), and a rasteriser moves corners, evenly, by up to `driver.corner`."""
        more = _ROUNDINGS * (driver.roundings - 1) + rasterised * driver.corner / 3**0.5
        if not self.error or not more:
            return self
        return Tolerance(self.error + more, f"{self.reason}, and the rounding of the graphics driver")

    def holds(self, found: Difference) -> bool:
        """Whether a difference is within it."""
        bound = self.bound
        return found.pixels <= bound.pixels and found.depth <= bound.depth and found.color <= bound.color


@dataclass(frozen=True)
class Outcome:
    """The result of a row.

    found: how far apart the pictures are. held: whether that is within the row's tolerance. limit: what
    holds instead of it; None: the tolerance must hold. coarse: the share of the pixels that are coarse
    steps apart, which a limit bounds.
    """

    found: Difference
    held: bool
    limit: Limit | None
    coarse: float

    @property
    def allowed(self) -> bool:
        """Whether it is held, or within its limit."""
        return self.held or (self.limit is not None and self.coarse <= self.limit.pixels)


@dataclass(frozen=True, eq=False)
class Row:
    """One line of the suite: a shot, and a variant that must give its picture.

    summed: the tolerance where a rasteriser adds up what a pixel shows: of a backend that blends, fed as is
    reported. None: the same. setting: parameters of a backend, by name; the row is for those that have them
    all."""

    name: str
    shot: Callable[[], PointView]
    variant: Callable[[PointView], PointView]
    tolerance: Tolerance
    summed: Tolerance | None = None
    setting: Mapping[str, Any] = field(default_factory=dict)

    def is_for(self, backend: Backend) -> bool:
        """Whether a backend has the parameters that the row sets."""
        return self.setting.keys() <= {parameter.name for parameter in backend.parameters}

    def tolerance_of(self, backend: Backend, params: Any = None, driver: Rounding = IN_SOFTWARE) -> Tolerance:
        """How far apart a backend's pictures may be. params: None: its defaults. driver: what draws them."""
        is_summed = backend.blends and getattr(params, "instancing", None) in FEEDS
        tolerance = self.summed if is_summed and self.summed else self.tolerance
        return tolerance.on(driver, rasterised=any(p.name == "instancing" for p in backend.parameters))

    def limit_of(self, backend: Backend, params: Any = None) -> Limit | None:
        """The bound of a backend that cannot hold the row, by its declaration; None: it must."""
        params = backend.params() if params is None else params
        return next((limit for limit in backend.limits_of(self.name) if limit.applies(params)), None)

    def compare(self, renderer: Renderer, backend: Backend, params: Any = None) -> Outcome:
        """Draw both and compare them; a picture of nothing is none that holds. params: of the backend, but
        for those that the row sets; None: its defaults. Raises InputError as `picture` does."""
        params = replace(backend.params() if params is None else params, **self.setting)
        shot = self.shot()
        one, other = (picture(renderer, backend, s, params) for s in (shot, self.variant(shot)))
        found = difference(one, other)
        coarse = difference(one, other, *_COARSE_STEPS).pixels
        shown = not np.isposinf(one.depth).all()
        driver = Rounding.of(renderer.gpu)
        held = shown and self.tolerance_of(backend, params, driver).holds(found)
        return Outcome(found, held, self.limit_of(backend, params), coarse)
