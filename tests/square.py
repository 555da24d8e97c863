"""A picture of four colours, for tests of textures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

RED, GREEN, BLUE, GREY = [255, 0, 0], [0, 255, 0], [0, 0, 255], [128, 128, 128]
QUARTERS = (RED, GREEN, BLUE, GREY)


def save_picture(
    path: Path, side: int = 64, quarters: tuple[list[int], ...] = (RED, GREEN, BLUE, GREY)
) -> None:
    """A picture of four colours: upper left, upper right, lower left, lower right."""
    picture = np.array(quarters, np.uint8).reshape(2, 2, 3)
    Image.fromarray(picture.repeat(side // 2, axis=0).repeat(side // 2, axis=1)).save(path)
