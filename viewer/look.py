"""How a surface is shown: one look for all backends. Plain values, no GL."""

from __future__ import annotations

import math
import re
from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cache
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from .errors import InputError, shortened, unknown_name
from .geometry import up_vector
from .params import param

# Perceptually uniform and readable with colour-blindness; the tables are the library cmap's.
COLOR_MAPS = ("batlow", "cividis", "viridis", "lapaz", "oslo", "vik")
COLOR_BY = ("auto", "own", "plain", "normal", "depth", "height", "id", "level")
# Of pixels filled from level 1, 2, ..., the last for all above: colours that Okabe and Ito (2008) chose to be
# told apart with colour-blindness, from cold to warm.
LEVEL_COLORS = ("#56b4e9", "#009e73", "#f0e442", "#e69f00", "#cc79a7")
HOLE_COLOR = "#ff0000"
HOLE_REACH = 8  # pixels: half of the widest gaps that count as holes, which are as wide as a pixel of level 4
_UNMAPPED = {"color_by": tuple(name for name in COLOR_BY if name not in ("depth", "height"))}
_UNRANGED = {"color_by": (*_UNMAPPED["color_by"], "depth")}  # where it depends on the view
COLOR_WORDS = {
    "auto": "Automatic",
    "own": "Photo colour",
    "plain": "Single colour",
    "normal": "Surface normal",
    "depth": "Distance from the viewer",
    "height": "Height",
    "id": "Point index",
    "level": "Filled areas",
}
LIGHT_WORDS = {
    "auto": "Automatic",
    "flat": "None",
    "head": "From the viewer",
    "fixed": "From a fixed side",
}
RANGE_WORDS = {"sequence": "All frames", "frame": "Each frame"}
# Samples of each pixel that a picture at rest is the mean of, the middle one among them.
SAMPLES = {"fast": 1, "balanced": 5, "fine": 17}
QUALITY_WORDS = {"fast": "Fast", "balanced": "Balanced", "fine": "Fine"}
# Backgrounds by what they are for; white shows through in files that cannot be transparent.
BACKGROUNDS = {"white": "#ffffff", "black": "#000000", "transparent": "#ffffff00"}
_FIXED, _FLAT = {"light": ("fixed",)}, {"light": ("flat",)}
_EYE_DOME = {"eye_dome": (None, True)}


@dataclass(frozen=True)
class Look:
    """The look sets the colours, light and background of a picture, for all renderers.

    By default, the parameters `color_by` and `light` are `auto`. With `color_by=auto`, the picture shows the
    scan's own colours. With `light=auto`, the light comes from the viewer if the scan has normals. If the
    scan has no normals, eye-dome lighting shades the picture from its depth alone. Photographs of range
    images appear without added light. With `color_by=level`, measured pixels are grey, and filled pixels have
    a colour for each level that filled them."""

    quality: str = param(
        "balanced",
        "Anti-aliasing of still pictures. fast: one sample per pixel; balanced: the mean of 5 samples; "
        "fine: the mean of 17 samples",
        choices=tuple(SAMPLES), words=QUALITY_WORDS, title="Anti-aliasing", basic=True,
    )  # fmt: skip
    color_by: str = param(
        "auto",
        f"What the colour shows: {', '.join(COLOR_BY)}, the name of a scalar, #N for the Nth scalar, "
        "or a quantity that the renderer computes",
        title="Colour by",
        words=COLOR_WORDS,
        group="Colour",
        basic=True,
    )
    color_map: str = param(
        "batlow",
        "Colour map for numbers",
        title="Colour map",
        choices=COLOR_MAPS,
        group="Colour",
        unless=_UNMAPPED,
        basic=True,
    )
    range: str = param(
        "sequence",
        "Range of values of the colour map. sequence: the range of all frames, so that a colour "
        "always means the same value; frame: the range of each frame",
        choices=tuple(RANGE_WORDS), words=RANGE_WORDS, group="Colour", unless=_UNRANGED, basic=True,
    )  # fmt: skip
    low: float | None = param(
        None, "Value at the start of the colour map; auto: computed from the data",
        type=float, group="Colour", unless=_UNMAPPED, basic=True,
    )  # fmt: skip
    high: float | None = param(
        None, "Value at the end of the colour map; auto: computed from the data",
        type=float, group="Colour", unless=_UNMAPPED, basic=True,
    )  # fmt: skip
    up: str = param(
        "+y",
        "Axis that points up, along which height is measured: ±x, ±y, ±z, or three numbers",
        group="Colour",
    )
    plain: str = param(
        "#c8c2b8", "Colour of points without a colour, #rrggbb",
        title="Surface colour", group="Colour", basic=True,
    )  # fmt: skip
    background: str = param("#1a1c20", "Background colour, #rrggbb or #rrggbbaa", group="Colour", basic=True)
    holes: bool = param(
        False,
        f"Show holes in red. Holes are empty areas of up to {2 * HOLE_REACH} pixels inside the subject",
        title="Show holes",
        group="Colour",
        key="G",
        basic=True,
    )
    light: str = param(
        "auto", 
            "Direction of the light. flat: no light; head: from the viewer; fixed: from an azimuth and an "
            "elevation"
        ,
        choices=("auto", "flat", "head", "fixed"), words=LIGHT_WORDS, group="Light", basic=True,
    )  # fmt: skip
    azimuth: float = param(
        -35.0, "Azimuth of the fixed light",
        low=-180, high=180, unit="degrees", group="Light", when=_FIXED, basic=True,
    )  # fmt: skip
    elevation: float = param(
        40.0, "Elevation of the fixed light",
        low=-90, high=90, unit="degrees", group="Light", when=_FIXED, basic=True,
    )  # fmt: skip
    ambient: float = param(0.25, "Ambient light", low=0, high=1, group="Light", unless=_FLAT)
    diffuse: float = param(
        0.75, "Strength of the diffuse light (Phong)", low=0, high=1, group="Light", unless=_FLAT
    )
    specular: float = param(
        0.12, "Strength of the highlights (Phong, specular)", low=0, high=1, group="Light", unless=_FLAT
    )
    shininess: float = param(
        24.0, "Sharpness of the highlights (Phong exponent)", low=1, high=200, group="Light", unless=_FLAT
    )
    eye_dome: bool | None = param(
        None, "Darken edges where the depth changes suddenly; auto: only if the picture has no other light",
        type=bool, title="Edge shading (eye-dome)", group="Light", basic=True,
    )  # fmt: skip
    eye_dome_strength: float = param(
        1.0, "Strength of the edge shading", low=0, high=20, group="Light", when=_EYE_DOME
    )
    eye_dome_radius: int = param(
        1, "Width of the edge shading", low=1, high=16, unit="px", group="Light", when=_EYE_DOME
    )

    @property
    def of_any_scan(self) -> Look:
        """The look without what suits one scan alone: what colours it, the ends of the colour map, and up."""
        own = ("color_by", "low", "high", "up")
        return replace(self, **{name: getattr(type(self)(), name) for name in own})

    def __post_init__(self) -> None:
        rgba(self.plain, "plain")
        rgba(self.background, "background")
        up_vector(self.up)


@dataclass(frozen=True)
class ValueKind:
    """Kind of a number that a backend finds for each row that it draws, for looks to colour by.

    help: a line on what it is. is_length: in the scan's unit; else a pure number. is_log: of a wide range, so
    that its logarithm is coloured. range: where the colour map begins and ends, unless the look says so;
    None: found from what is seen.
    """

    help: str
    is_length: bool = False
    is_log: bool = False
    range: tuple[float, float] | None = None

    def goes_by_log(self, low: float, high: float) -> bool:
        """Whether colours go by the logarithm in this range: where all of it has one."""
        return self.is_log and low > 0 and high > 0


def value_source(look: Look, scalars: Collection[str], found: Collection[str] = ()) -> str | None:
    """Source of the number that the look colours by: "depth", "height", a scalar's name, or one of what the
    backend has found, unless a scalar is called so.

    None where colours do not come from a number. Raises InputError for an unknown name.
    """
    if look.color_by in ("depth", "height"):
        return look.color_by
    if look.color_by in COLOR_BY:
        return None
    if (source := _number(look, scalars, found)) is None:
        raise unknown_name("colour source", look.color_by, [*COLOR_BY, *scalars, *found])
    return source


def drawable(look: Look, scalars: Collection[str], found: Collection[str] = ()) -> Look:
    """The look where there is what it colours by, else with colours of its own choice: frames of one
    scan may differ in their scalars, and backends in what they find."""
    has_source = look.color_by in COLOR_BY or _number(look, scalars, found) is not None
    return look if has_source else replace(look, color_by="auto")


def is_open_range(look: Look) -> bool:
    """Whether an end of the colour map is still to be found over all frames."""
    has_range = look.color_by not in _UNRANGED["color_by"]
    return has_range and look.range == "sequence" and None in (look.low, look.high)


def with_range(look: Look, found: tuple[float, float] | None) -> Look:
    """The look with what was found over all frames for its open ends; None: each frame's own range holds."""
    if not is_open_range(look):
        return look
    if found is None:
        return replace(look, range="frame")
    low, high = found
    return replace(
        look, low=low if look.low is None else look.low, high=high if look.high is None else look.high
    )


def unnamed(look: Look, scalars: Collection[str]) -> Look:
    """The look with the number of the scalar that it colours by in place of its name."""
    if look.color_by in COLOR_BY or (scalar := _scalar(look, scalars)) is None:
        return look
    return replace(look, color_by=f"#{[*scalars].index(scalar) + 1}")


def _number(look: Look, scalars: Collection[str], found: Collection[str]) -> str | None:
    """The scalar, or else what the backend found, that `color_by` names; None where there is neither."""
    scalar = _scalar(look, scalars)
    return look.color_by if scalar is None and look.color_by in found else scalar


def _scalar(look: Look, scalars: Collection[str]) -> str | None:
    """The scalar that `color_by` names or numbers, counted from 1; None where the cloud has none such, or it
    is called like another source."""
    scalar, number = look.color_by, re.fullmatch("#([1-9][0-9]{0,8})", look.color_by)
    if scalar not in scalars and number is not None:
        scalar = next(islice(scalars, int(number[1]) - 1, None), "")
    return scalar if scalar in scalars and scalar not in COLOR_BY else None


def wants_normals(look: Look) -> bool:
    """Whether the look cannot be drawn without normals."""
    return look.light in ("head", "fixed") or look.color_by == "normal"


def is_lit(look: Look) -> bool:
    """Whether the look shows normals where there are some."""
    return look.light != "flat" or look.color_by == "normal"


def light_direction(look: Look) -> tuple[float, float, float]:
    """Direction to the fixed light, view space: azimuth 0 and elevation 0 is where the eye is."""
    a, e = math.radians(look.azimuth), math.radians(look.elevation)
    return math.cos(e) * math.sin(a), math.sin(e), math.cos(e) * math.cos(a)


def rgba(text: str, name: str = "colour") -> tuple[int, int, int, int]:
    """The bytes of '#rrggbb' or '#rrggbbaa'; raises InputError."""
    if not re.fullmatch("#([0-9a-fA-F]{6}|[0-9a-fA-F]{8})", text):
        raise InputError(f"'{shortened(text)}' is not a colour", name, "Use #rrggbb or #rrggbbaa")
    values = bytes.fromhex(text[1:])
    return values[0], values[1], values[2], values[3] if len(values) == 4 else 255


@cache
def color_table(name: str) -> NDArray[np.uint8]:
    """256 colours of a map, (256, 4) uint8 sRGB, read-only."""
    import cmap

    table = (np.asarray(cmap.Colormap(name).lut(256)) * 255).round().astype(np.uint8)
    table.setflags(write=False)
    return table
