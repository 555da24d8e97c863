"""Writing scans as other programs do, and reading back what was written."""

from __future__ import annotations

from collections.abc import Sequence
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


def film_times(path: Path) -> tuple[list[float], float]:
    """When the pictures of a film begin, and how long it is, seconds: as a player decodes them."""
    import av

    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        stamps = [float(frame.time) for frame in container.decode(stream)]
        return stamps, float(stream.duration * stream.time_base)


def write_mesh(
    path: Path, points: NDArray[np.floating], faces: Sequence[Sequence[int]], binary: bool = True
) -> None:
    """A PLY file of float32 points (N, 3) and triangles between them."""
    kind = "binary_little_endian" if binary else "ascii"
    head = (
        f"ply\nformat {kind} 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    if binary:
        rows = np.array([(3, tuple(face)) for face in faces], [("count", "u1"), ("corners", "<i4", 3)])
        body = points.astype("<f4").tobytes() + rows.tobytes()
    else:
        lines = [" ".join(map(str, point)) for point in points] + [" ".join(map(str, (3, *f))) for f in faces]
        body = "\n".join([*lines, ""]).encode()
    path.write_bytes(head.encode() + body)
