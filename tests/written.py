"""Reading back what was written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def bits(array: NDArray) -> NDArray[np.uint8]:
    """The array's bits, so that NaN equals NaN."""
    return np.ascontiguousarray(array).view(np.uint8)


def picture(path: Path) -> NDArray[np.uint8]:
    """A PNG as it is stored, (H, W, 4)."""
    from PIL import Image

    with Image.open(path) as image:
        return np.asarray(image)


def film(path: Path) -> tuple[list[NDArray[np.uint8]], float]:
    """The images of a film, (H, W, 3), and how many it shows a second."""
    import av

    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
        return frames, float(stream.average_rate)
