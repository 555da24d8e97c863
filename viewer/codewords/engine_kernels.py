"""The inner loop of the engine of code words, compiled by numba; see `engine`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from .stream import FINE_DEPTHS
from .tables import BITMAP
from .words import NO_WORD

_MOST_DEPTH = FINE_DEPTHS - 1
_NO_KEY = np.int32(0x7FFFFFFF)
_NO_WORD = np.uint32(NO_WORD)


class StripPart(NamedTuple):
    """A part of a strip of the picture."""

    left: int  # column of the strip
    columns: int  # of the strip
    top: int  # first line that is flushed
    bottom: int  # line after the last one


class StripWords(NamedTuple):
    """The words of a strip, see `WordStream`."""

    line_starts: NDArray[np.int64]  # (height + 1,), of the strip alone
    words: NDArray[np.uint64]
    ids: NDArray[np.uint32]
    finer: NDArray[np.int32]  # (words, 3) or (0, 3)
    shift: int  # bits of finer depths that the depth buffer leaves out


class PictureArrays(NamedTuple):
    """A picture that is drawn into, see `CodePicture`."""

    image: NDArray[np.uint8]
    keys: NDArray[np.int32]
    indices: NDArray[np.uint32]


@compiled
def slide(
    part: StripPart,
    stream: StripWords,
    window: int,
    materials: NDArray[np.int32],
    light_bytes: NDArray[np.uint8],
    picture: PictureArrays,
) -> None:
    """Slide a window of some lines down a part of a strip. materials: (3, M, 3), I_0, k_d and k_s."""
    left, columns, top, bottom = part
    line_starts, words, ids, finer, shift = stream
    image, keys, indices = picture
    height = len(line_starts) - 1
    has_finer = len(finer) > 0
    most = len(light_bytes) - 1
    window_keys = np.full((window, columns), _NO_KEY, np.int32)
    window_indices = np.full((window, columns), _NO_WORD, np.uint32)
    for y in range(max(top - BITMAP + 1, 0), bottom):
        for index in range(line_starts[y], line_starts[y + 1]):
            low = np.uint32(words[index] & np.uint64((1 << 32) - 1))
            high = np.uint32(words[index] >> np.uint64(32))
            scans = np.int32(low >> np.uint32(1)) & 0xFFFFFF
            x = np.int32(high >> np.uint32(14)) & 511
            key = np.int32(high >> np.uint32(23))
            is_tile = low & np.uint32(1) != 0
            right = grown_down = np.int32(0)
            if has_finer:
                key, right, grown_down = finer[index, 0], finer[index, 1], finer[index, 2]
            for row in range(min(4 if is_tile else 8, height - y)):
                span = scans >> (6 * (row if row < 4 else 7 - row))
                first, last = span & 7, span >> 3 & 7
                if row >= 4:
                    first, last = 7 - last, 7 - first
                slot = (y + row) % window
                for column in range(first, min(last, columns - 1 - x) + 1):
                    here = np.int32(key + column * right + row * grown_down)
                    if shift > 0:
                        here = np.int32(min(max(int(here), 0), _MOST_DEPTH) >> shift)
                    before = window_keys[slot, x + column]
                    if here < before or (
                        here == before and ids[index] < ids[window_indices[slot, x + column]]
                    ):
                        window_keys[slot, x + column] = here
                        window_indices[slot, x + column] = index
        slot = y % window
        for column in range(columns):
            index = window_indices[slot, column]
            window_indices[slot, column] = _NO_WORD
            if index == _NO_WORD:
                continue
            key, window_keys[slot, column] = window_keys[slot, column], _NO_KEY
            if y < top:
                continue
            at = left + column
            keys[y, at] = key
            indices[y, at] = index
            diffuse = np.int32(words[index] >> np.uint64(25)) & 127
            specular = np.int32(words[index] >> np.uint64(32)) & 127
            material = np.int32(words[index] >> np.uint64(39)) & 127
            diffuse += diffuse >> 6
            specular += specular >> 6
            for channel in range(3):
                lit = materials[1, material, channel] * diffuse
                lit += materials[2, material, channel] * specular
                light = min(materials[0, material, channel] + (lit + 64 >> 7), most)
                image[y, at, channel] = light_bytes[light]
            image[y, at, 3] = 255
