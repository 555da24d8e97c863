"""Settings of pyramidal projection."""

from __future__ import annotations

from dataclasses import dataclass

from ..gpu.pyramid import BINOMIAL, BOX, GAUSSIAN, NEAREST, Filter
from ..params import Obstacle, param
from .spreading import FUNCTIONS, KERNELS
from .targets import LEVELS
from .views import MODES

_FILTERS = {"box": BOX, "gaussian": GAUSSIAN, "binomial": BINOMIAL, "nearest": NEAREST}
_FILLING = {"fill": (True,)}
_JOINED = Obstacle("primitive", "polygons connect the samples and leave few holes to fill")
_LEVELS, _HIDDEN, _VIEWS, _SMOOTHING = "Levels", "Hidden points", "Range images", "Anti-aliasing"


@dataclass(frozen=True)
class ProjectionParams:
    """Parameters of pyramidal projection."""

    fill: bool = param(
        True,
        "Fill holes with values from coarser levels of the picture",
        key="H",
        group=_LEVELS,
        sweep=(True, False),
        title="Fill holes",
        short="Fill",
        obstacle=_JOINED,
        basic=True,
    )
    level_0: bool = param(True, "Show the measured samples", key="0", short="0", group=_LEVELS)
    level_1: bool = param(
        True,
        "Fill holes with values from the picture at 1/2 of its width and height",
        key="1",
        short="1",
        obstacle=_JOINED,
        group=_LEVELS,
        when=_FILLING,
    )
    level_2: bool = param(
        True,
        "Fill holes with values from the picture at 1/4 of its width and height",
        key="2",
        short="2",
        obstacle=_JOINED,
        group=_LEVELS,
        when=_FILLING,
    )
    level_3: bool = param(
        True,
        "Fill holes with values from the picture at 1/8 of its width and height",
        key="3",
        short="3",
        obstacle=_JOINED,
        group=_LEVELS,
        when=_FILLING,
    )
    level_4: bool = param(
        True,
        "Fill holes with values from the picture at 1/16 of its width and height",
        key="4",
        short="4",
        obstacle=_JOINED,
        group=_LEVELS,
        when=_FILLING,
    )
    upsampling: str = param(
        "bilinear",
        "Method that interpolates filled pixels between samples of a coarser level",
        choices=("nearest", "bilinear", "bicubic"),
        group=_LEVELS,
        when=_FILLING,
    )
    step: float = param(
        6.0,
        "Largest depth step between neighbouring samples of the same surface, in cell widths of their level",
        low=0.1,
        high=100,
        group=_LEVELS,
        when=_FILLING,
    )
    margin: float | None = param(
        None,
        "How far Scan4D fills beyond the outermost samples of a surface, in sample spacings; auto: 0.15 "
        "for samples that polygons connect, and 0.4 for other samples",
        type=float,
        low=0,
        high=1,
        group=_LEVELS,
        when=_FILLING,
    )
    reach: float = param(
        2.25,
        "Largest distance of a filled pixel from the samples that fill it, in sample spacings",
        low=0.1,
        high=100,
        group=_LEVELS,
        when=_FILLING,
    )
    widest: float = param(
        1.0,
        "Widest hole that Scan4D fills from a level, in cell widths of that level. Scan4D always fills "
        "gaps between neighbouring samples",
        low=0,
        high=3,
        group=_LEVELS,
        when=_FILLING,
    )
    hide: bool = param(
        True,
        "Hide samples that show through holes of a nearer surface. Polygons always hide these samples",
        key="Shift+H",
        title="Hide what lies behind",
        obstacle=Obstacle("primitive", "polygons already hide what lies behind them"),
        basic=True,
        group=_HIDDEN,
        sweep=(True, False),
    )
    tolerance: float = param(
        2.0,
        "Scan4D hides samples that lie at least this far behind a nearer surface, in cell widths of the "
        "sample's level",
        low=0,
        high=100,
        group=_HIDDEN,
        when={"hide": (True,)},
    )

    neighbors: int = param(
        4,
        "Samples stay visible within this distance of a sample of the nearer surface, in samples",
        low=0,
        high=100,
        unit="samples",
        group=_HIDDEN,
        when={"hide": (True,)},
    )
    first_level: int = param(
        0, "Finest level of range images to draw; 0: as measured", low=0, high=5, group=_VIEWS
    )
    primitive: str = param(
        "polygons",
        "Shapes that Scan4D draws for samples of range images",
        choices=("points", "polygons"),
        title="Draw samples as",
        key="Shift+P",
        short="Points",
        group=_VIEWS,
        sweep=("points", "polygons"),
    )
    lod: bool = param(
        True,
        "Draw the level of range images whose samples are about as large as pixels",
        group=_VIEWS,
        affects="draw",
    )
    detail: float = param(
        1.0, "Spacing of samples, in pixels, above which Scan4D draws a finer level",
        low=0.25, high=16, unit="px", group=_VIEWS, when={"lod": (True,)},
    )  # fmt: skip
    filter: str = param(
        "box",
        "Filter that computes the coarser levels of range images",
        choices=tuple(_FILTERS),
        group=_VIEWS,
    )
    blend: str = param(
        "linear",
        "What to show where several range views see the same surface. linear: the mean of all range "
        "views; best: the best range view; nearest: the nearest sample",
        choices=MODES,
        group=_VIEWS,
        sweep=("linear", "best", "nearest"),
    )
    cull_back: bool = param(
        False, "Leave out surfaces of range images that the view shows from behind", group=_VIEWS
    )
    skip: bool = param(
        True, "Skip tiles of range images that the picture does not show", group=_VIEWS, affects="speed"
    )
    antialias: str = param(
        "off",
        "Draw each point as a blurred dot (point spread function) and add up the colours. table: "
        "read the dot from a table; analytic: compute the dot for each point",
        choices=FUNCTIONS,
        group=_SMOOTHING,
        sweep=("off", "table", "analytic"),
    )
    kernel: str = param(
        "3x3",
        "Size of a point spread function, in pixels",
        choices=KERNELS,
        group=_SMOOTHING,
        unless={"antialias": ("off",)},
    )
    fade: bool = param(
        False,
        "Blend with the next coarser level where samples lie closer together than pixels",
        group=_SMOOTHING,
        when={"lod": (True,)},
    )

    @property
    def reduction(self) -> Filter:
        """The filter of coarser levels."""
        return _FILTERS[self.filter]

    @property
    def shown(self) -> tuple[int, ...]:
        """The levels that may show, ascending."""
        on = [level for level in range(LEVELS) if getattr(self, f"level_{level}")]
        return tuple(level for level in on if self.fill or level == 0)
