"""The multi-resolution spline, slowly and obviously: of whole pictures, as Burt and Adelson have it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

KERNELS = {"3x3": np.exp([-2.0, 0.0, -2.0]), "5x5": np.array([1.0, 4.0, 6.0, 4.0, 1.0])}
DARK = 0.02  # as shaders/laplacian/pictures.glsl has it

Picture = NDArray[np.float64]
Taps = NDArray[np.float64]


def _around(taps: Taps, fine: int) -> NDArray[np.float64]:
    """What coarse cells, along one axis, have of so many fine ones: every other is the middle of one."""
    reach = len(taps) // 2
    shares = np.zeros((-(-fine // 2), fine))
    for coarse, away in np.ndindex(len(shares), len(taps)):
        if 0 <= 2 * coarse + away - reach < fine:
            shares[coarse, 2 * coarse + away - reach] = taps[away]
    return shares


def _means(picture: Picture, rows: NDArray, columns: NDArray) -> Picture:
    """Means of pixels, (H, W, C), by their shares along both axes."""
    rows, columns = (shares / shares.sum(axis=1, keepdims=True) for shares in (rows, columns))
    return np.einsum("ay,yxc,bx->abc", rows, picture, columns)


def reduced(picture: Picture, taps: Taps) -> Picture:
    """The next coarser level of a picture, (H, W, C)."""
    return _means(picture, _around(taps, picture.shape[0]), _around(taps, picture.shape[1]))


def expanded(coarse: Picture, shape: tuple[int, int], taps: Taps) -> Picture:
    """The same size as the next finer level, (height, width)."""
    return _means(coarse, _around(taps, shape[0]).T, _around(taps, shape[1]).T)


def pyramid(picture: Picture, levels: int, taps: Taps) -> list[Picture]:
    """A picture and the coarser levels."""
    found = [picture]
    while len(found) < levels:
        found.append(reduced(found[-1], taps))
    return found


def splined(
    pictures: list[Picture],
    shares: list[NDArray[np.float64]],
    top_shares: list[NDArray[np.float64]],
    levels: int,
    taps: Taps,
) -> Picture:
    """The sum of the bands of pictures, (H, W, C), each blended by the shares, (H, W), at its size; the
    coarsest by shares of its own."""
    return blended([pyramid(picture, levels, taps) for picture in pictures], shares, top_shares, taps)


def blended(
    pyramids: list[list[Picture]],
    shares: list[NDArray[np.float64]],
    top_shares: list[NDArray[np.float64]],
    taps: Taps,
) -> Picture:
    """As `splined`, of pictures whose coarser levels are given."""
    levels = len(pyramids[0])
    weights = [
        [*pyramid(share[..., None], levels, taps)[:-1], pyramid(top[..., None], levels, taps)[-1]]
        for share, top in zip(shares, top_shares, strict=True)
    ]
    summed = np.zeros_like(pyramids[0][-1])
    for level in reversed(range(levels)):
        shape = pyramids[0][level].shape[:2]
        summed = expanded(summed, shape, taps) if level < levels - 1 else summed
        for picture, weight in zip(pyramids, weights, strict=True):
            band = picture[level]
            if level < levels - 1:
                band = band - expanded(picture[level + 1], shape, taps)
            summed = summed + weight[level] * band
    return summed
