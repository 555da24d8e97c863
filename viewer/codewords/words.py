"""The words themselves: 64 bits with the fields of Maršík 2010, Fig. 4.

Bit 0 is the least significant one. A graphics card has a word as two of 32 bits, the lower one first.

    bit 0        MODE      how SCANS is to be read
    bits 1-24    SCANS     four rows of 6 bits, the first one lowest: first column (3 bits, lower), last
    bits 25-31   DIFFUSE   index of diffuse light, 0 to 127
    bits 32-38   SPECULAR  index of the highlight, 0 to 127
    bits 39-45   MATERIAL  its number
    bits 46-54   X         column of the bitmap's left edge in its strip
    bits 55-63   Z         depth, 0 is the nearest

A row whose first column is behind its last one is empty. With MODE 0 the four rows are the upper half of an
8 x 8 bitmap; the lower half is the same turned by half: row 7 - r has the columns 7 - last to 7 - first. With
MODE 1 they are four full rows of a larger shape, or of one that an edge cuts: a tile of 8 x 8 is two words,
whose y differ by four. y is the line of the first row, and not in the word: words stand in lines.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

FIELDS = {
    "mode": (0, 1), "scans": (1, 24), "diffuse": (25, 7), "specular": (32, 7), "material": (39, 7),
    "x": (46, 9), "z": (55, 9),
}  # fmt: skip
"""Name of each field -> (its lowest bit, how many it has)."""
COLUMNS = 1 << FIELDS["x"][1]  # that a strip may have
DEPTHS = 1 << FIELDS["z"][1]
MATERIALS = 1 << FIELDS["material"][1]
NO_WORD = 0xFFFFFFFF  # the index of a word, and the id of a point, where a pixel shows none


def decode_words(words: NDArray[np.uint64]) -> dict[str, NDArray[np.int32]]:
    """The values of all `FIELDS`, (N,) each."""
    return {
        name: (words >> np.uint64(at) & np.uint64((1 << bits) - 1)).astype(np.int32)
        for name, (at, bits) in FIELDS.items()
    }


def decode_scans(scans: ArrayLike) -> NDArray[np.int32]:
    """First and last column of the four rows of SCANS, (..., 4, 2)."""
    rows = np.asarray(scans)[..., None] >> np.arange(0, 24, 6)
    return np.stack([rows & 7, rows >> 3 & 7], axis=-1).astype(np.int32)


def row_spans(word: int) -> list[tuple[int, int]]:
    """First and last column, from the left edge of its bitmap, of the eight rows of a word of mode 0, or of
    the four of one of mode 1."""
    rows = [(int(first), int(last)) for first, last in decode_scans(word >> 1 & 0xFFFFFF)]
    return rows if word & 1 else rows + [(7 - last, 7 - first) for first, last in reversed(rows)]
