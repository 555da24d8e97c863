"""Streams of code words: what an engine is sent for one picture. `files.py` saves them as `.cw` files.

A picture is cut into strips of at most 512 columns, as a word's X has nine bits. Each strip has its words
line by line, from the top: a line holds those whose first row it is, by ascending id. Z counts what is linear
over a plane in the picture, as depth buffers do: depth in parallel views, and its inverse in perspective.

A packed stream, all little-endian, is a file of one picture:

    8 bytes    "SCAN4DCW"
    uint32     version 1; flags (1: perspective, 2: finer depths, 4: camera, 8: depth buffer of 16 bits,
               16: 2 samples along a pixel's edge, 32: 4); width; height; strips; materials
    uint64     words
    float64    nearest depth (Z = 0); farthest depth (Z = 511), scan units
    4 bytes    background, sRGB and alpha
    float64    with a camera, 15 numbers: see `WordStream.camera`
    uint32     first column of each strip
    uint32     words in each line, all lines of the first strip, then those of the next one
    uint64     the words
    uint32     an id for each word
    int32 x 3  for each word, with finer depths: see `WordStream.finer`
    uint16     materials x 3 each: I_0, k_d, k_s
    uint32     CRC-32 of all before
"""

from __future__ import annotations

import math
import struct
import zlib
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from . import SUFFIX
from .lighting import Materials
from .words import COLUMNS, DEPTHS, FIELDS

FINE_DEPTHS = 1 << 24  # steps of finer depths from the nearest to the farthest
PLANE_BITS = (16, 24)  # that a depth buffer may have where words have finer depths
STEEPEST_DEPTHS = 1 << 26  # that finer depths may grow by in a pixel
MAGIC = b"SCAN4DCW"  # of every file of code words
_VERSION = 1
_PERSPECTIVE, _FINER, _CAMERA, _SIXTEEN = 1, 2, 4, 8  # flags
_SAMPLES = {1: 0, 2: 16, 4: 32}  # samples along the edge of a pixel -> flag
_CAMERA_NUMBERS = 15
_HEADER = struct.Struct("<8s6IQdd4s")
_CHECKSUM = struct.Struct("<I")
WRITE_AGAIN = "Write the file again"  # what to do about a damaged file
_MOST_PIXELS = 1 << 26
_LONGEST_EDGE = 1 << 15
_NEAREST, _FARTHEST = 1e-30, 1e30  # scan units, whose inverses float32 holds too


@dataclass(frozen=True, eq=False)
class WordStream:
    """Words of a picture in the order that an engine takes them.

    size: (width, height). stride: columns of a strip, but for the last one, which has what is left.
    line_starts: (strips * height + 1,) int64: the words of line y of strip s are those from number
    line_starts[s * height + y] on. words: (N,) uint64. ids: (N,) uint32: of the points that they are of.
    near, far: depths that Z = 0 and 511 stand for, scan units. materials: of the lighting. background: sRGB
    and alpha. perspective: whether Z counts inverse depths.

    finer: None, or (N, 3) int32 beside the words: depth at the first row and left column of a word's bitmap,
    and how much it grows a pixel to the right and a pixel down, with FINE_DEPTHS steps from near to far.
    It takes the place of Z. Sums within a bitmap stay within 32 bits. depth_bits: of the engine's depth
    buffer where there are finer depths, 24 or 16. With 16, a pixel holds the sum without its last 8 bits.

    camera: None, or (15,) float64, where the picture was seen from: pixels per unit of x/-z, of x in parallel
    views; the pixel of the line of sight, right and down; then, row by row, the (3, 4) matrix that takes
    points of the scan's world to the camera, which looks down -z.

    samples: along the edge of a pixel of the finished picture, 1, 2 or 4. With several, each pixel of the
    stream is a sample, and a pixel of the picture has the mean of its samples.

    Raises InputError where it is no stream that an engine can draw.
    """

    size: tuple[int, int]
    stride: int
    line_starts: NDArray[np.int64]
    words: NDArray[np.uint64]
    ids: NDArray[np.uint32]
    near: float
    far: float
    materials: Materials
    background: tuple[int, int, int, int] = (0, 0, 0, 255)
    perspective: bool = True
    finer: NDArray[np.int32] | None = field(default=None)
    camera: NDArray[np.float64] | None = None
    depth_bits: int = 24
    samples: int = 1

    def __post_init__(self) -> None:
        check_picture_size(self.size)
        if not 1 <= self.stride <= COLUMNS:
            raise InputError(f"a strip has 1 to {COLUMNS} columns, not {self.stride}")
        self._check_lines()
        self._check_depths()
        self._check_words()
        self._check_camera()
        if self.samples not in _SAMPLES or any(edge % self.samples for edge in self.size):
            raise InputError(
                f"the samples do not form whole pixels of {self.samples} x {self.samples} samples"
            )

    def _check_lines(self) -> None:
        count = len(self.words)
        starts = self.line_starts
        if len(starts) != self.strips * self.size[1] + 1 or starts[0] != 0 or starts[-1] != count:
            raise InputError("the number of code words is not the sum over the lines")
        if (np.diff(starts) < 0).any():
            raise InputError("a line of code words begins before the one above it")
        if len(self.ids) != count or (self.finer is not None and self.finer.shape != (count, 3)):
            raise InputError(
                "a file of code words must store an id for each code word, and depths of its corners for "
                "all code words or for none"
            )

    def _check_depths(self) -> None:
        least = _NEAREST if self.perspective else -_FARTHEST
        if not least <= self.near <= self.far <= _FARTHEST:
            raise InputError(f"the depths {self.near:g} to {self.far:g} of the code words are out of range")
        if self.depth_bits not in PLANE_BITS:
            raise InputError(f"a depth buffer of code words has 16 or 24 bits, not {self.depth_bits}")
        limits = np.array([1 << 30, STEEPEST_DEPTHS, STEEPEST_DEPTHS])
        if self.finer is not None and (np.abs(self.finer.astype(np.int64)) > limits).any():
            raise InputError(
                "exact depths of code words are larger than 2^30, or change by more than 2^26 per pixel"
            )

    def _check_words(self) -> None:
        at, bits = FIELDS["material"]
        if len(self.words) == 0:
            return
        if int((self.words >> np.uint64(at) & np.uint64((1 << bits) - 1)).max()) >= len(self.materials):
            raise InputError(
                f"a code word uses a material that the table of {len(self.materials)} materials does not "
                "contain"
            )
        strip = np.repeat(np.arange(self.strips), np.diff(self.line_starts[:: self.size[1]]))
        at, bits = FIELDS["x"]
        x = (self.words >> np.uint64(at) & np.uint64((1 << bits) - 1)).astype(np.int64)
        if (x >= np.minimum(self.stride, self.size[0] - strip * self.stride)).any():
            raise InputError("a code word is outside the columns of its strip")
        falls = np.flatnonzero(self.ids[1:] < self.ids[:-1]) + 1
        if not np.isin(falls, self.line_starts).all():
            raise InputError("the words of a line must be sorted by their ids")

    def _check_camera(self) -> None:
        if self.camera is None:
            return
        least, most = _NEAREST, _FARTHEST
        if not (np.abs(self.camera) < most).all() or not least < self.camera[0]:
            raise InputError("the camera of the code words has numbers that are out of range")

    def __len__(self) -> int:
        return len(self.words)

    @property
    def strips(self) -> int:
        """Number of strips."""
        return -(-self.size[0] // self.stride)

    @property
    def picture_size(self) -> tuple[int, int]:
        """(width, height) of the finished picture."""
        return self.size[0] // self.samples, self.size[1] // self.samples

    @property
    def nbytes(self) -> int:
        """Bytes of what an engine is sent, without the materials."""
        finer = 0 if self.finer is None else self.finer.nbytes
        return self.words.nbytes + self.ids.nbytes + self.line_starts.nbytes + finer

    @property
    def shift(self) -> int:
        """The bits of a finer depth that the depth buffer leaves out."""
        return PLANE_BITS[-1] - self.depth_bits

    def depths(self, keys: NDArray[np.integer]) -> NDArray[np.float32]:
        """Depths, scan units, any shape, of values of Z, or of finer ones as a depth buffer has them: of the
        middles of its steps."""
        steps = DEPTHS - 1 if self.finer is None else FINE_DEPTHS >> self.shift
        t = (np.asarray(keys, np.float64) + (0.5 if self.shift else 0.0)) / steps
        if not self.perspective:
            return (self.near + t * (self.far - self.near)).astype(np.float32)
        inverse = 1 / self.near + t * (1 / self.far - 1 / self.near)
        return (1 / np.maximum(inverse, np.finfo(np.float32).tiny)).astype(np.float32)

    def steps_of(self, depths: NDArray[np.floating]) -> NDArray[np.float64]:
        """Depths, scan units, any shape, as Z counts them, not rounded."""
        count = np.reciprocal if self.perspective else np.positive
        start, end, values = (count(np.asarray(each, np.float64)) for each in (self.near, self.far, depths))
        return (values - start) / ((end - start) or 1.0) * (DEPTHS - 1)

    def depth_error(self) -> float:
        """Most that a depth is off by rounding it to Z, scan units: half a step where steps are largest."""
        span = self.far - self.near
        return (span * self.far / self.near if self.perspective else span) / (DEPTHS - 1) / 2


def check_picture_size(size: tuple[int, int]) -> None:
    """Raise InputError where a picture of (width, height) pixels cannot be made of code words."""
    width, height = size
    if not (1 <= width <= _LONGEST_EDGE and 1 <= height <= _LONGEST_EDGE and width * height <= _MOST_PIXELS):
        raise InputError(
            f"a picture of code words cannot have {width} x {height} pixels",
            hint=f"Use at most {_LONGEST_EDGE:,} pixels along an edge, and {_MOST_PIXELS:,} in all",
        )


def strip_width(width: int) -> int:
    """Columns of the strips of a picture: as few strips as may be, of about one width."""
    return -(-width // -(-width // COLUMNS))


def stream_to_bytes(stream: WordStream) -> bytes:
    """The bytes of a stream, as a file of one picture holds them."""
    flags = _PERSPECTIVE * stream.perspective | _FINER * (stream.finer is not None)
    flags |= _CAMERA * (stream.camera is not None) | _SIXTEEN * (stream.shift > 0) | _SAMPLES[stream.samples]
    header = _HEADER.pack(
        MAGIC, _VERSION, flags, *stream.size, stream.strips, len(stream.materials), len(stream),
        stream.near, stream.far, bytes(stream.background),
    )  # fmt: skip
    materials = stream.materials
    arrays = [
        *([] if stream.camera is None else [stream.camera.astype("<f8")]),
        (np.arange(stream.strips) * stream.stride).astype("<u4"),
        np.diff(stream.line_starts).astype("<u4"),
        stream.words.astype("<u8"),
        stream.ids.astype("<u4"),
        *([] if stream.finer is None else [stream.finer.astype("<i4")]),
        *(table.astype("<u2") for table in (materials.ambient, materials.diffuse, materials.specular)),
    ]
    data = header + b"".join(array.tobytes() for array in arrays)
    return data + _CHECKSUM.pack(zlib.crc32(data))


def stream_from_bytes(data: bytes) -> WordStream:
    """The stream of what `stream_to_bytes` returned. Raises InputError where it is damaged."""
    check_length(len(data), stream_bytes(data))
    (checksum,) = _CHECKSUM.unpack_from(data, len(data) - _CHECKSUM.size)
    if zlib.crc32(memoryview(data)[: -_CHECKSUM.size]) != checksum:
        raise InputError("is damaged: its checksum is wrong", hint=WRITE_AGAIN)
    return _stream_of(data)


def check_length(held: int, needed: int) -> None:
    """Raise InputError where there are not as many bytes as a header states."""
    if held != needed:
        what = "is cut short" if held < needed else "is longer than its header states"
        raise InputError(what, hint=WRITE_AGAIN)


def stream_bytes(header: bytes) -> int:
    """Bytes of the packed stream that begins so. Raises InputError where it is none."""
    if not header.startswith(MAGIC) or len(header) < _HEADER.size:
        raise InputError(
            "is not a file of code words", hint=f"'scan4d render -o NAME{SUFFIX}' writes such files"
        )
    _, version, flags, width, height, strips, materials, words, *_ = _HEADER.unpack_from(header)
    if version != _VERSION:
        raise InputError(f"is of version {version}", hint=f"This version of Scan4D reads version {_VERSION}")
    if flags & ~(_PERSPECTIVE | _FINER | _CAMERA | _SIXTEEN | sum(_SAMPLES.values())):
        raise InputError(f"has unknown flags: {flags}")
    check_picture_size((width, height))
    if not -(-width // COLUMNS) <= strips <= width:
        raise InputError(
            f"has {strips} strips for {width} columns, but a strip has at most {COLUMNS} columns"
        )
    each = 12 + 12 * bool(flags & _FINER)
    head = _HEADER.size + 8 * _CAMERA_NUMBERS * bool(flags & _CAMERA)
    return head + 4 * strips * (1 + height) + each * words + 18 * materials + _CHECKSUM.size


def _stream_of(data: bytes) -> WordStream:
    _, _, flags, width, height, strips, materials, words, near, far, background = _HEADER.unpack_from(data)
    at = _HEADER.size

    def take(kind: str, *shape: int) -> NDArray:
        nonlocal at
        array = np.frombuffer(data, kind, math.prod(shape), at).reshape(shape)
        at += array.nbytes
        return array.astype(array.dtype.newbyteorder("="), copy=False)

    camera = take("<f8", _CAMERA_NUMBERS) if flags & _CAMERA else None
    starts = take("<u4", strips).astype(np.int64)
    stride = int(starts[1]) if strips > 1 else width
    if (starts != np.arange(strips) * stride).any() or not starts[-1] < width <= strips * stride:
        raise InputError("has strips that differ in width or do not lie side by side")
    counts = take("<u4", strips * height)
    return WordStream(
        size=(width, height),
        stride=stride,
        line_starts=np.concatenate([[0], np.cumsum(counts, dtype=np.int64)]),
        words=take("<u8", words),
        ids=take("<u4", words),
        finer=take("<i4", words, 3) if flags & _FINER else None,
        near=near,
        far=far,
        materials=Materials(*(take("<u2", materials, 3) for _ in range(3))),
        background=tuple(background),
        perspective=bool(flags & _PERSPECTIVE),
        camera=camera,
        samples=next((each for each, flag in _SAMPLES.items() if flag == flags & sum(_SAMPLES.values())), 0),
        depth_bits=PLANE_BITS[0] if flags & _SIXTEEN else PLANE_BITS[-1],
    )
