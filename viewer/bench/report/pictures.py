"""Pictures of an error: reference, backend and their differences side by side."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..metrics import angles_between

if TYPE_CHECKING:
    from PIL.ImageFont import FreeTypeFont, ImageFont

PANELS = (
    "reference",
    "backend",
    "signed depth difference in pixel footprints; magenta: holes; yellow: pixels outside the true outline",
    "angle between the normals",
    "largest colour difference over all channels",
)

Image = NDArray[np.uint8]  # (H, W, 3)

_WIDTH, _HEIGHT = 420, 480  # pixels of a panel's picture, at most
_GAP, _HEAD, _FOOT = 10, 30, 44
_FONT = 20
_MARGIN = 0.04  # of the picture's size, left around what is seen
_PAPER, _INK = (255, 255, 255), (38, 41, 46)
_HOLE, _SPILL = (230, 0, 200), (240, 200, 0)  # neither is on the map of depth differences
_NOTHING = (205, 208, 212)
_RANGE = 0.98  # the quantile of depth differences that the map ends at


def picture_path(folder: Path, scene: str, backend: str) -> Path:
    """Path of the picture of a backend in a scene, below a folder of results."""
    safe = "".join(letter if letter.isalnum() or letter in "_-." else "-" for letter in scene)
    return folder / "pictures" / f"{safe}--{backend}.png"


def side_by_side(reference: dict[str, Any], drawn: dict[str, Any], footprint: NDArray[np.floating]) -> Image:
    """The panels of `PANELS` in a row, each with a heading and, where it is a map, its colour bar.

    reference, drawn: "image" (H, W, 4) uint8, "depth" (H, W), +inf where nothing is, "normal" (H, W, 3).
    footprint: (H, W), of a pixel at the reference's depth, scan units.
    """
    seen = _seen(np.isfinite(reference["depth"]) | np.isfinite(drawn["depth"]))
    reference, drawn = ({name: a[seen] for name, a in p.items()} for p in (reference, drawn))
    footprint = footprint[seen]
    true, found = np.isfinite(reference["depth"]), np.isfinite(drawn["depth"])
    both, depth = true & found, np.zeros(true.shape)
    depth[both] = (drawn["depth"][both] - reference["depth"][both]) / footprint[both]
    reach = _reach(depth[both])
    angle = angles_between(drawn["normal"], reference["normal"])
    angle = np.minimum(angle, 180 - angle)
    change = np.abs(drawn["image"][..., :3].astype(np.float64) - reference["image"][..., :3]).max(axis=2)

    shades = _mapped(depth / (2 * reach) + 0.5, both, "vik")
    shades[true & ~found], shades[found & ~true] = _HOLE, _SPILL
    marks = [("hole", _HOLE), ("spill", _SPILL)]
    return np.concatenate(
        [
            _panel(reference["image"][..., :3], "reference"),
            _panel(drawn["image"][..., :3], "backend"),
            _panel(shades, "depth difference", ("vik", -reach, reach, "px"), marks),
            _panel(
                _mapped(angle / 90, both & np.isfinite(angle), "viridis"),
                "normal angle",
                ("viridis", 0, 90, "°"),
            ),
            _panel(
                _mapped(change / 255, true | found, "inferno"),
                "colour difference",
                ("inferno", 0, 255, "levels"),
            ),
        ],
        axis=1,
    )[:, :-_GAP]


def titled_row(pictures: Mapping[str, Image]) -> Image:
    """Pictures (H, W, 3) in a row, each below its title."""
    return np.concatenate([_panel(pixels, title) for title, pixels in pictures.items()], axis=1)[:, :-_GAP]


def _seen(covered: NDArray[np.bool_]) -> tuple[slice, slice]:
    """The part of a picture where something is, with a margin; all of it where nothing is."""
    margin = round(_MARGIN * max(covered.shape))
    sides = []
    for axis in (1, 0):
        where = np.flatnonzero(covered.any(axis=axis))
        first, last = (int(where[0]), int(where[-1])) if len(where) else (0, covered.shape[1 - axis])
        sides.append(slice(max(0, first - margin), last + 1 + margin))
    return sides[0], sides[1]


def _reach(differences: NDArray[np.float64]) -> float:
    """A round number that nearly all differences are within: 1, 2 or 5 times a power of ten."""
    limit = float(np.quantile(np.abs(differences), _RANGE)) if differences.size else 0.0
    if limit <= 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(limit))
    return float(power * next(step for step in (1, 2, 5, 10) if limit <= step * power * (1 + 1e-9)))


def _mapped(values: NDArray[np.float64], where: NDArray[np.bool_], name: str) -> Image:
    """Values 0..1 through a colour map, (H, W, 3) uint8; plain where not `where`."""
    from cmap import Colormap

    out = np.full((*values.shape, 3), _NOTHING, np.uint8)
    table = np.asarray(Colormap(name).lut(256))[:, :3]
    steps = np.clip(values[where] * 255, 0, 255)
    out[where] = np.round(table[steps.round().astype(np.intp)] * 255)
    return out


def _panel(
    pixels: Image,
    heading: str,
    bar: tuple[str, float, float, str] | None = None,
    marks: list[tuple[str, tuple[int, int, int]]] | None = None,
) -> Image:
    """One panel: heading above, picture, below it the colour bar (map, low, high, unit) and marks."""
    from PIL import Image as Pillow
    from PIL import ImageDraw

    picture = Pillow.fromarray(np.ascontiguousarray(pixels))
    scale = min(1.0, _WIDTH / picture.width, _HEIGHT / picture.height)
    size = max(1, round(picture.width * scale)), max(1, round(picture.height * scale))
    picture = picture.resize(size, Pillow.Resampling.BOX)
    width = max(picture.width, _WIDTH)
    canvas = Pillow.new("RGB", (width + _GAP, _HEAD + picture.height + _FOOT), _PAPER)
    canvas.paste(picture, (0, _HEAD))
    draw, font, top = ImageDraw.Draw(canvas), _font(), _HEAD + picture.height + 5
    draw.text((0, _HEAD - 8), heading, _INK, font, anchor="ls")
    if bar is not None:
        name, low, high, unit = bar
        length = width // 2
        ramp = np.broadcast_to(np.linspace(0, 1, length), (11, length))
        canvas.paste(Pillow.fromarray(_mapped(ramp, np.ones(ramp.shape, bool), name)), (0, top))
        draw.text((0, top + 14), f"{low:g}", _INK, font, anchor="la")
        draw.text((length, top + 14), f"{high:g} {unit}", _INK, font, anchor="ma")
        if low < 0:
            draw.text((length // 2, top + 14), "0", _INK, font, anchor="ma")
    x = width - 1
    for label, shade in reversed(marks or []):
        x -= round(draw.textlength(label, font))
        draw.text((x, top - 4), label, _INK, font, anchor="la")
        x -= 20
        draw.rectangle((x, top, x + 14, top + 13), shade)
        x -= 14
    return np.asarray(canvas)


def _font() -> FreeTypeFont | ImageFont:
    from PIL import ImageFont

    return ImageFont.load_default(_FONT)
