"""The engine of code words on the GPU: bands of lines in shared memory, a work group each.

Maršík 2010, 2.4. Whole numbers, and least ones of them, so that pictures are those of
`viewer.codewords.engine.draw_words_plainly` to the bit, on every driver and in bands of any height.
"""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from ...codewords.engine import NO_KEY
from ...codewords.lighting import LIGHT_BYTES, Materials
from ...codewords.stream import FINE_DEPTHS, WordStream
from ...codewords.tables import BITMAP
from ...codewords.words import DEPTHS, FIELDS
from ...gpu import gl
from ...gpu.bindings import Storage, Texture
from ...gpu.constants import GROUP, NO_DEPTH
from ...gpu.context import Gpu

RANK_BITS = 32 - FIELDS["z"][1]  # that are left beside Z in a number
_SHARED_WORDS = 8192  # that every driver has for a work group (OpenGL 4.3, table 23.63)
MOST_WORDS = 1 << 16  # of a band in one call: drivers may end loops after 2^16 turns in all
_HEAD_BITS = FIELDS["diffuse"][1] + FIELDS["specular"][1] + FIELDS["material"][1]
_LEAST_INVERSE = float(np.finfo(np.float32).tiny)
_SPARE = 1.25  # times the room that is needed
# What each buffer is fetched from as, and its texels.
_BUFFERS = {
    "words": (Texture.SPLATS, gl.RG32UI),
    "ranks": (Texture.IDS, gl.R32UI),
    "starts": (Texture.STARTS, gl.R32UI),
    "finer": (Texture.FORMS, gl.RGB32I),
    "owners": (Texture.LISTED, gl.R32UI),
    "heads": (Texture.LOOKS, gl.R32UI),
    "materials": (Texture.COLORS, gl.RGB32UI),
    # Of encoding; not all are fetched.
    "elements": (Texture.ELEMENTS, gl.RGBA32UI),
    "point_materials": (Texture.MATERIALS, gl.R32UI),
    "spread": (Texture.SCRATCH, gl.R32UI),
    "cursors": (Texture.SCRATCH, gl.R32UI),
}


@dataclass(frozen=True, eq=False)
class Sheet:
    """The sheet that words are drawn on, and how they count.

    size: (width, height). stride: columns of a strip. near, far: depths of the least and the largest Z, as
    pictures count them. is_inverse: whether Z counts inverse depths. has_finer: whether words have finer
    depths, which are drawn in place of Z, without as many of their last bits as `shift` says. line_starts: of
    words, as a stream has them. ranks: how many there may be. has_owners: whether a rank is a number of one
    of the owners; else it is a row.
    """

    size: tuple[int, int]
    stride: int
    near: float
    far: float
    is_inverse: bool
    has_finer: bool
    line_starts: NDArray[np.integer]
    ranks: int
    has_owners: bool
    shift: int = 0


@dataclass(frozen=True)
class _Bands:
    """Parts of a picture as a program has them: each of so many columns and lines, strip_parts in a strip."""

    picture_size: tuple[int, int]
    stride: int
    columns: int
    lines: int
    strip_parts: int
    parts: int
    is_inverse: bool
    nearest: float
    depth_step: float
    least_inverse: float


class WordBuffers:
    """Words on the GPU, as the engine reads them; kept from picture to picture."""

    def __init__(self, gpu: Gpu, _: tuple[int, int] = (0, 0)) -> None:
        self.gpu = gpu
        self._texels: dict[str, gl.BufferTexture] = {}

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return sum(texels.buffer.size for texels in self._texels.values())

    def reserve(self, name: str, nbytes: int) -> gl.BufferTexture:
        """The buffer of this name, with room for so many bytes; what it held may be gone."""
        if name not in self._texels or self._texels[name].buffer.size < nbytes:
            self.gpu.discard(self._texels.pop(name, None))
            buffer = self.gpu.buffer(reserve=int(nbytes * _SPARE) // 16 * 16 + 16)
            self._texels[name] = gl.BufferTexture(buffer, _BUFFERS[name][1])
        return self._texels[name]

    def write(self, name: str, values: NDArray) -> None:
        """Make these the contents of a buffer."""
        texels = self.reserve(name, values.nbytes)
        if values.nbytes:
            texels.buffer.write(np.ascontiguousarray(values))

    def bind(self, *names: str) -> None:
        """Bind buffers where shaders fetch from them."""
        for name in names:
            self._texels[name].bind(_BUFFERS[name][0])

    def take(self, stream: WordStream) -> Sheet:
        """Upload any stream: ids may be those of several words at a pixel. Owners are indices of words."""
        order = np.argsort(stream.ids, kind="stable").astype(np.uint32)
        ranks = np.empty_like(order)
        ranks[order] = np.arange(len(order), dtype=np.uint32)
        self.write("owners", order)
        self.write("heads", _heads(stream.words)[order])
        return self._take(stream, ranks, len(order), has_owners=True)

    def take_encoded(self, stream: WordStream, count: int, base: float, is_lit: bool) -> Sheet:
        """Upload a stream whose ids are rows of `count` points, of each of which a pixel has one word at
        most. Ranks are these rows. base: depth that pictures count from. is_lit: whether colours are wanted.
        """
        if is_lit:
            heads = np.zeros(count, np.uint32)
            heads[stream.ids] = _heads(stream.words)
            self.write("heads", heads)
        return self._take(stream, stream.ids, count, has_owners=False, base=base)

    def _take(
        self, stream: WordStream, ranks: NDArray[np.uint32], count: int, has_owners: bool, base: float = 0.0
    ) -> Sheet:
        self.write("words", stream.words.astype("<u8", copy=False))
        self.write("starts", stream.line_starts.astype(np.uint32))
        self.write("ranks", ranks)
        if stream.finer is not None:
            self.write("finer", stream.finer)
        return Sheet(
            stream.size, stream.stride, stream.near - base, stream.far - base, stream.perspective,
            stream.finer is not None, stream.line_starts, count, has_owners, stream.shift,
        )  # fmt: skip

    def release(self) -> None:
        """Delete everything."""
        self.gpu.discard(*self._texels.values())


def _heads(words: NDArray[np.uint64]) -> NDArray[np.uint32]:
    """Diffuse, specular and material of words, (N,)."""
    return (words >> np.uint64(FIELDS["diffuse"][0]) & np.uint64((1 << _HEAD_BITS) - 1)).astype(np.uint32)


def draw_bands(
    words: WordBuffers,
    sheet: Sheet,
    window: int,
    depths: moderngl.Buffer,
    rows: moderngl.Buffer,
    lit: tuple[moderngl.Buffer, Materials] | None = None,
    is_surface: bool = True,
) -> None:
    """Draw words. window: lines of a band.

    depths, rows: a word a pixel, written for all. lit: where the colours of pixels that show something go,
    and the materials that they are of. is_surface: whether these are a Surface's depths and rows; else depths
    as words count them, and owners.
    """
    gpu = words.gpu
    packed = not sheet.has_finer and sheet.ranks < 1 << RANK_BITS
    room = _SHARED_WORDS if packed else _SHARED_WORDS // 2
    bands, longest = _bands(sheet, window, room), _longest(sheet, window)
    with gpu.timers.measure("words"):
        words.bind("words", "starts", "ranks", *(["finer"] if sheet.has_finer else []))
        depths.bind_to_storage_buffer(Storage.DEPTHS)
        rows.bind_to_storage_buffer(Storage.ROWS)
        for skipped in range(0, max(longest, 1), MOST_WORDS):
            is_last = skipped + MOST_WORDS >= longest
            shown, owned = is_surface and is_last, sheet.has_owners and is_last
            defines = {
                "FINER": int(sheet.has_finer),
                "SHIFT": sheet.shift,
                "MOST_DEPTH": FINE_DEPTHS - 1,
                "PACKED": int(packed),
                "RANK_BITS": f"{RANK_BITS}u",
                "PIXELS": room,
                "MOST_WORDS": f"{MOST_WORDS}u",
                "RESUMED": int(skipped > 0),
                "OWNERS": int(owned),
                "SHOWN": int(shown),
                "NOWHERE": f"{NO_DEPTH if shown else NO_KEY}u",
                "LIT": int(lit is not None and is_last),
            }
            program = gpu.compute("codeword/engine.comp", defines, params=bands)
            if owned:
                words.bind("owners")
            if lit is not None:
                _bind_lighting(words, *lit)
            gpu.set(program, skipped=skipped)
            gpu.dispatch(program, bands.parts * -(-sheet.size[1] // window) * GROUP)


def _bind_lighting(words: WordBuffers, colors: moderngl.Buffer, materials: Materials) -> None:
    """Bind what colours are made of, and where they go."""
    tables = np.stack([materials.ambient, materials.diffuse, materials.specular], axis=1)
    words.write("materials", tables.astype(np.uint32))
    words.bind("heads", "materials")
    words.gpu.cached(_light_bytes).bind(Texture.ENCODED)
    colors.bind_to_storage_buffer(Storage.COLOR)


def _longest(sheet: Sheet, window: int) -> int:
    """The most words that a band of one strip has, and that reach into it."""
    height = sheet.size[1]
    tops = np.arange(0, height, window)
    firsts, ends = np.maximum(tops - BITMAP + 1, 0), np.minimum(tops + window, height)
    before = np.arange(-(-sheet.size[0] // sheet.stride))[:, None] * height
    starts = sheet.line_starts
    return int((starts[before + ends] - starts[before + firsts]).max())


def _bands(sheet: Sheet, window: int, room: int) -> _Bands:
    """How a picture is divided so that `room` pixels hold a part."""
    columns = min(sheet.stride, room // window)
    strip_parts = -(-sheet.stride // columns)
    start, end = (1 / sheet.near, 1 / sheet.far) if sheet.is_inverse else (sheet.near, sheet.far)
    step = (end - start) / ((FINE_DEPTHS >> sheet.shift) if sheet.has_finer else DEPTHS - 1)
    return _Bands(
        picture_size=sheet.size,
        stride=sheet.stride,
        columns=-(-sheet.stride // strip_parts),
        lines=window,
        strip_parts=strip_parts,
        parts=strip_parts * -(-sheet.size[0] // sheet.stride),
        is_inverse=sheet.is_inverse,
        nearest=start + (0.5 * step if sheet.shift else 0.0),
        depth_step=step,
        least_inverse=_LEAST_INVERSE,
    )


def _light_bytes(gpu: Gpu) -> gl.BufferTexture:
    """The sRGB byte of each step of light."""
    return gl.BufferTexture(gpu.buffer(LIGHT_BYTES.astype(np.uint32)), gl.R32UI)
