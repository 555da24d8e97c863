"""Laplacian projection: several range views merged without seams, band by band.

Farooq 2013, chapter 6, and the GRAPP 2009 paper behind it; Burt and Adelson 1983. Each view is a picture of
the surface that pixels show; the pictures are merged by the multi-resolution spline: per band of frequencies,
with weights whose transition is as wide as the band's waves. Where one view wins, its details are shown
alone, so nothing is seen twice; where views differ in gain or colour, that fades over the coarsest band.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...gpu.pose import GpuPose
from ...gpu.surface import Surface
from ...params import param
from ...scan.pose import Pose
from .. import FrameView, pyramidal
from ..pyramidal.views import ViewSource
from .spline import FILTERS, Bands, spline_views

TITLE = "Merged views"
GOOD_FOR = "Several range views, without seams"
ROWS = "samples"
FILLS = True
BLENDS = True

_CAPTURES = {"5x5": "binomial", "3x3": "gaussian"}  # filters of range images that make the levels of pictures
_BANDS, _LEVELS, _VIEWS = "Bands", "Levels", "Range images"


@dataclass(frozen=True)
class Params:
    """Parameters of Laplacian projection."""

    levels: int = param(
        6,
        "Bands, each of half the frequency of the one before, the first of single pixels",
        low=3,
        high=6,
        group=_BANDS,
        sweep=(3, 6),
        title="Bands",
        basic=True,
    )
    bands: str = param(
        "picture",
        "What bands are of: the picture that each view gives, or levels of the captured image, whose samples "
        "are drawn as Gaussians",
        choices=("picture", "capture"),
        group=_BANDS,
        sweep=("picture", "capture"),
    )
    kernel: str = param(
        "5x5",
        "What the levels of pictures are made by: Burt and Adelson's filter, or one of spread 0.5",
        choices=tuple(FILTERS),
        group=_BANDS,
        sweep=("5x5", "3x3"),
    )
    detail: float = param(1.0, "Gain of the finest band", low=0, high=4, group=_BANDS)
    weights: str = param(
        "mixed",
        "Whose bands are shown: those of the view that sees a place best, those of all by how well they do, "
        "or the best's but for the coarsest",
        choices=("mixed", "crisp", "soft"),
        group=_BANDS,
        sweep=("mixed", "crisp", "soft"),
    )
    light: str = param(
        "logarithm",
        "What bands are of: the logarithm of light, in which views whose gains differ differ by the same "
        "everywhere, or light",
        choices=("logarithm", "linear"),
        group=_BANDS,
        sweep=("logarithm", "linear"),
    )
    tolerance: float = param(
        4.0,
        "How far apart surfaces of two views may be to be merged, in samples",
        low=0,
        high=100,
        unit="samples",
        group=_VIEWS,
    )
    cull_back: bool = param(False, "Leave out surfaces of range images that show their backs", group=_VIEWS)
    quality: str = param(
        "fast",
        "How a pixel looks up what a view sees where samples lie closer than pixels: at one place, between "
        "two levels; or, for pictures that can wait, at four places of a finer level",
        choices=("fast", "fine"),
        title="Texture sampling",
        group=_VIEWS,
        sweep=("fast", "fine"),
        when={"bands": ("picture",)},
    )
    fill: bool = param(
        True, "Fill holes from coarser levels", key="H", group=_LEVELS, title="Fill holes", basic=True
    )

    @property
    def surface(self) -> pyramidal.Params:
        """How the surface is drawn that the views are looked up on."""
        return pyramidal.Params(
            fill=self.fill,
            tolerance=self.tolerance,
            blend="nearest",
            cull_back=self.cull_back,
            filter=_CAPTURES[self.kernel] if self.bands == "capture" else "box",
        )


def needs(pose: Pose, params: Params) -> tuple[str, ...]:
    """The samples of range views."""
    return ("views",)


def draw(pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
    """Draw the nearest surface, merge what views see of it, fill; a preview is not merged."""
    params: Params = frame.params

    def merge(source: ViewSource, channels: Sequence[str]) -> None:
        spline_views(surface, source, channels, _bands(params))

    preview = frame.share < 1
    if preview:
        surface.stats.skipped["bands"] = "a preview shows the nearest view"
    return pyramidal.draw_filled(pose, params.surface, frame.share, surface, None if preview else merge)


def _bands(params: Params) -> Bands:
    captured = params.bands == "capture"
    return Bands(
        levels=params.levels,
        filter=FILTERS[params.kernel],
        detail=params.detail,
        crisp=params.weights != "soft",
        top_crisp=params.weights == "crisp",
        logarithmic=params.light == "logarithm",
        captured=captured,
        fine=params.quality == "fine" and not captured,
    )
