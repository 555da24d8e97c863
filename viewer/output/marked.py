"""Pictures with their marks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..look import ValueKind, rgba
from .callouts import draw_lines
from .image_painter import ImagePainter
from .legend import Legend
from .marks import draw
from .plot_below import PLOT_HEIGHT, draw_plot


def marked(
    image: NDArray[np.uint8],
    legend: Legend | None,
    values: tuple[float, float] | None,
    kind: ValueKind | None = None,
) -> NDArray[np.uint8]:
    """The image, (H, W, 4) uint8 sRGB and alpha, with the legend's marks; outside them as it was.

    values, kind: as for `draw`.
    """
    from PIL import Image

    if legend is None or not legend.marks:
        return image
    below = Image.fromarray(image)
    lines, above = ImagePainter(below.size), ImagePainter(below.size)
    taken = draw(above, below.size, legend, values, kind)
    draw_lines(lines, below.size, legend, taken)
    made = Image.alpha_composite(Image.alpha_composite(below, lines.image), above.image)
    plot = ImagePainter(below.size)
    if legend.plot is None or not draw_plot(plot, below.size, legend.plot, legend.pose):
        return np.asarray(made)
    wide, high = (round((1 - PLOT_HEIGHT) * extent) for extent in below.size)
    with_room = Image.new("RGBA", below.size, rgba(legend.look.background))
    with_room.paste(made.resize((max(wide, 1), max(high, 1))), ((below.width - wide) // 2, 0))
    return np.asarray(Image.alpha_composite(with_room, plot.image))
