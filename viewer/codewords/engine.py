"""Engine of code words on the CPU: whole numbers alone, the same picture everywhere.

Maršík 2010, 2.4: a window of some lines slides down the picture, strip by strip. A word is drawn when the
window's first line is its own; then this line can receive nothing more, and is flushed. As bitmaps have
eight rows, any window of eight lines or more gives the same picture.

The rule: of the words that cover a pixel, that with the least depth is seen; of those the one with the
lowest id; of these the first in the stream. Depth is Z, or, where the stream has finer ones, depth + x right
+ y down at the pixel's position (x, y) in the word's bitmap. A depth buffer of 16 bits
holds that sum, cut to 0 to 2^24 - 1, without its last 8 bits. What lies right of a strip or below the picture
is cut off.

With several samples along a pixel's edge, all of this is about samples. A pixel has the mean of its samples'
light and of their alpha; depth and word are those of one of them, right of and below the pixel's middle.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..srgb import light_from_bytes
from ..threads import ranges, threads_for, together
from .lighting import LIGHT_BYTES
from .stream import FINE_DEPTHS, WordStream
from .tables import BITMAP
from .words import NO_WORD, decode_words, row_spans

WINDOW = 16  # lines
_PIXELS = 16  # that a word covers, about
NO_KEY = 0x7FFFFFFF  # depth where nothing is, behind all others


@dataclass(frozen=True, eq=False)
class CodePicture:
    """Picture that an engine draws, row 0 at the top.

    image: (H, W, 4) uint8 sRGB and alpha. keys: (H, W) int32, depths as the stream counts them, NO_KEY for
    nothing. indices: (H, W) uint32, of the words that are seen, in the stream, NO_WORD for none.
    """

    stream: WordStream
    image: NDArray[np.uint8]
    keys: NDArray[np.int32]
    indices: NDArray[np.uint32]

    @property
    def covered(self) -> NDArray[np.bool_]:
        """(H, W): whether a pixel shows anything."""
        return self.keys != NO_KEY

    def depths(self) -> NDArray[np.float32]:
        """(H, W): scan units, +inf for nothing."""
        return np.where(self.covered, self.stream.depths(self.keys), np.float32(np.inf))

    def ids(self) -> NDArray[np.uint32]:
        """(H, W): of the points that are seen, NO_WORD for none."""
        ids = np.append(self.stream.ids, np.uint32(NO_WORD))
        return ids[np.minimum(self.indices, len(self.stream))]


def draw_words(
    stream: WordStream, window: int = WINDOW, background: NDArray[np.uint8] | None = None
) -> CodePicture:
    """Draw a stream, compiled, on several threads. See `draw_words_plainly` for the rules in a few lines.

    window: lines, at least eight. background: (H, W, 4) uint8 that is drawn over; None: the stream's colour.
    Raises InputError.
    """
    from .engine_kernels import PictureArrays, StripPart, StripWords, slide

    picture = begun(stream, window, background)
    materials = stream.materials
    finer = np.empty((0, 3), np.int32) if stream.finer is None else stream.finer
    coefficients = np.stack([materials.ambient, materials.diffuse, materials.specular]).astype(np.int32)

    def drawn(strip: int, top: int, bottom: int) -> None:
        left, height = strip * stream.stride, stream.size[1]
        starts = stream.line_starts[strip * height : (strip + 1) * height + 1]
        slide(
            StripPart(left, min(stream.stride, stream.size[0] - left), top, bottom),
            StripWords(starts, stream.words, stream.ids, finer, stream.shift),
            window,
            coefficients,
            LIGHT_BYTES,
            PictureArrays(picture.image, picture.keys, picture.indices),
        )

    together(_PIXELS * len(stream), [partial(drawn, *part) for part in _parts(stream)])
    return resolved(picture)


def _parts(stream: WordStream) -> list[tuple[int, int, int]]:
    """(strip, first line, last line + 1) of parts that threads draw, each of about as many words."""
    height, found = stream.size[1], []
    for strip in range(stream.strips):
        starts = stream.line_starts[strip * height : (strip + 1) * height + 1]
        shares = np.linspace(starts[0], starts[-1], threads_for(_PIXELS * len(stream)) + 1)[1:-1]
        borders = np.concatenate([[0], np.searchsorted(starts[:-1], shares), [height]])
        found += [(strip, top, bottom) for top, bottom in ranges(borders)]
    return found


def draw_words_plainly(
    stream: WordStream, window: int = WINDOW, background: NDArray[np.uint8] | None = None
) -> CodePicture:
    """Draw a stream as `draw_words` does, slow and obvious: the twin of all engines."""
    picture, (width, height) = begun(stream, window, background), stream.size
    fields = decode_words(stream.words)
    colors = stream.materials.colors(fields["material"], fields["diffuse"], fields["specular"])
    for strip in range(stream.strips):
        left = strip * stream.stride
        columns = min(stream.stride, width - left)
        keys = np.full((window, columns), NO_KEY, np.int64)
        indices = np.full((window, columns), NO_WORD, np.int64)
        for y in range(height):
            line = strip * height + y
            for index in range(int(stream.line_starts[line]), int(stream.line_starts[line + 1])):
                x = int(fields["x"][index])
                for row, (first, last) in enumerate(row_spans(int(stream.words[index]))):
                    for column in range(first, min(last, columns - 1 - x) + 1):
                        at = (y + row) % window, x + column  # below the picture it is never flushed
                        key = int(fields["z"][index])
                        if stream.finer is not None:
                            key = int(stream.finer[index] @ np.array([1, column, row]))
                        if stream.shift:
                            key = min(max(key, 0), FINE_DEPTHS - 1) >> stream.shift
                        rank = key, int(stream.ids[index]), index
                        if rank < (keys[at], _id(stream, indices[at]), indices[at]):
                            keys[at], indices[at] = key, index
            seen = keys[y % window] != NO_KEY
            part = slice(left, left + columns)
            picture.image[y, part][seen, :3] = colors[indices[y % window][seen]]
            picture.image[y, part][seen, 3] = 255
            picture.keys[y, part], picture.indices[y, part] = keys[y % window], indices[y % window]
            keys[y % window], indices[y % window] = NO_KEY, NO_WORD
    return resolved(picture)


def resolved(picture: CodePicture) -> CodePicture:
    """The picture that samples make."""
    samples = picture.stream.samples
    if samples == 1:
        return picture
    width, height = picture.stream.picture_size

    def sums(values: NDArray[np.uint32]) -> NDArray[np.uint32]:
        parts = values.reshape(height, samples, width, samples, -1)
        return parts.sum(axis=(1, 3), dtype=np.uint32)

    alpha = picture.image[..., 3:].astype(np.uint32)
    light, weights = sums(light_from_bytes(picture.image[..., :3]) * alpha), sums(alpha)
    weight = np.maximum(weights, 1)
    colors = LIGHT_BYTES[(light + weight // 2) // weight]
    opaque = (weights + samples * samples // 2) // (samples * samples)
    middle = slice(samples // 2, None, samples)
    return CodePicture(
        picture.stream, np.concatenate([colors, opaque.astype(np.uint8)], axis=2),
        np.ascontiguousarray(picture.keys[middle, middle]),
        np.ascontiguousarray(picture.indices[middle, middle]),
    )  # fmt: skip


def _id(stream: WordStream, index: int) -> int:
    return NO_WORD if index == NO_WORD else int(stream.ids[index])


def begun(stream: WordStream, window: int, background: NDArray[np.uint8] | None) -> CodePicture:
    """Samples of which none is drawn yet. Raises InputError."""
    width, height = stream.picture_size
    if window < BITMAP:
        raise InputError(
            f"a window with a height of {window} lines is too small",
            hint=f"Use at least {BITMAP} lines, the height of a bitmap",
        )
    if background is not None and background.shape != (height, width, 4):
        what = (
            f"the background has the shape {background.shape}, but the picture has {width} x {height} pixels"
        )
        raise InputError(what, hint="Give a background of shape (height, width, 4)")
    columns, lines = stream.size
    image = np.empty((lines, columns, 4), np.uint8)
    if background is None:
        image[:] = stream.background
    else:
        image[:] = background.repeat(stream.samples, axis=0).repeat(stream.samples, axis=1)
    keys = np.full((lines, columns), NO_KEY, np.int32)
    return CodePicture(stream, image, keys, np.full((lines, columns), NO_WORD, np.uint32))
