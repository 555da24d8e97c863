"""Merges several range views without visible seams, one frequency band at a time.

`laplacian` uses Laplacian projection (Farooq 2013, chapter 6, and the GRAPP 2009 paper; Burt and Adelson
1983). From each range view, `laplacian` draws a picture of the visible surface. The multi-resolution spline
splits these pictures into frequency bands and merges each band. In coarser bands, the transition between two
views is wider. Fine detail comes from a single view at each position, so nothing appears twice. Differences
in gain or colour between views fade over the width of the coarsest band.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...gpu.pose import GpuPose
from ...params import param
from ...picture.surface import Surface
from ...projection.filled import draw_filled
from ...projection.settings import ProjectionParams
from ...projection.views import ViewSource
from ...scan.pose import Pose
from .. import Backend, FrameView
from .spline import FILTERS, Bands, spline_views

_CAPTURES = {"5x5": "binomial", "3x3": "gaussian"}  # filters of range images that make the levels of pictures
_BANDS, _LEVELS, _VIEWS = "Bands", "Levels", "Range images"


@dataclass(frozen=True)
class Params:
    """Parameters of Laplacian projection."""

    levels: int = param(
        6,
        "Number of frequency bands. The first band holds the detail of single pixels. Each further "
        "band has half the frequency of the previous one",
        low=3,
        high=6,
        group=_BANDS,
        sweep=(3, 6),
        title="Bands",
        basic=True,
    )
    bands: str = param(
        "picture",
        "Images that Scan4D divides into bands. picture: each view, as the picture shows it; capture: "
        "the captured range image, with samples drawn as Gaussians",
        choices=("picture", "capture"),
        group=_BANDS,
        sweep=("picture", "capture"),
    )
    kernel: str = param(
        "5x5",
        "Filter that computes coarser levels. 5x5: the filter of Burt and Adelson; 3x3: a Gaussian with "
        "a sigma of 0.5 samples",
        choices=tuple(FILTERS),
        group=_BANDS,
        sweep=("5x5", "3x3"),
    )
    detail: float = param(
        1.0,
        "Factor on the finest band: a value above 1 sharpens the picture, a value below 1 softens it",
        low=0,
        high=4,
        group=_BANDS,
    )
    weights: str = param(
        "mixed",
        "Which views each band uses. crisp: the best view at each pixel; soft: the mean of all "
        "views, weighted by quality; mixed: crisp, but soft in the coarsest band",
        choices=("mixed", "crisp", "soft"),
        group=_BANDS,
        sweep=("mixed", "crisp", "soft"),
    )
    light: str = param(
        "logarithm",
        "Scale of the colours in the bands. logarithm: logarithmic, so that a brighter view differs only "
        "by a constant; linear: proportional to the light",
        choices=("logarithm", "linear"),
        group=_BANDS,
        sweep=("logarithm", "linear"),
    )
    tolerance: float = param(
        4.0,
        "Largest distance between the surfaces of two views that Scan4D merges, in sample spacings",
        low=0,
        high=100,
        unit="samples",
        group=_VIEWS,
    )
    cull_back: bool = param(
        False, "Leave out surfaces of range images that the view shows from behind", group=_VIEWS
    )
    quality: str = param(
        "fast",
        "How to read a range view whose samples lie closer together than the pixels. fast: one value per "
        "pixel, interpolated between two levels; fine: four values per pixel, from a finer level",
        choices=("fast", "fine"),
        title="Texture sampling",
        group=_VIEWS,
        sweep=("fast", "fine"),
        when={"bands": ("picture",)},
    )
    fill: bool = param(
        True,
        "Fill holes with values from coarser levels of the picture",
        key="H",
        group=_LEVELS,
        title="Fill holes",
        short="Fill",
        basic=True,
    )

    @property
    def surface(self) -> ProjectionParams:
        """How the surface is drawn that the views are looked up on."""
        return ProjectionParams(
            fill=self.fill,
            tolerance=self.tolerance,
            blend="nearest",
            cull_back=self.cull_back,
            filter=_CAPTURES[self.kernel] if self.bands == "capture" else "box",
        )


class Laplacian(Backend):
    """The backend `laplacian`."""

    title = "Merged views"
    good_for = "Merges several range views without seams"
    params_class = Params
    rows = "samples"
    blends = True
    fills = True

    def needs(self, pose: Pose, params: Params) -> tuple[str, ...]:
        """The samples of range views."""
        return ("views",)

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Draw the nearest surface, merge what views see of it, fill; a preview is not merged."""
        params: Params = frame.params

        def merge(source: ViewSource, channels: Sequence[str]) -> None:
            spline_views(surface, source, channels, _bands(params))

        preview = frame.share < 1
        if preview:
            surface.stats.skipped["bands"] = "a preview shows only the nearest range view"
        return draw_filled(pose, params.surface, frame.share, surface, None if preview else merge)


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
