"""Files of code words, `.cw`: of one picture, or of the pictures of many poses.

A file of one picture is a stream as `stream.py` packs it, version 1. A file of several, all little-endian:

    8 bytes    "SCAN4DCW"
    uint32     version 2; number of pictures
    uint64     where the index is, bytes from the start of the file
    bytes      the pictures, each compressed by zlib
    the index  for each picture: float64 time, seconds; uint64 where it is; uint32 bytes of it, and bytes
               of it uncompressed; uint32 kind: 0 key, 1 difference; uint32 0
    uint32     CRC-32 of the first 24 bytes and the index

A key picture is a stream, version 1. A difference to the picture before is a bit for each of that one's
groups, the first in the highest bit of the first byte, and then a stream of the words of the other groups,
see `changes.py`. At least every `KEY_EVERY`th picture is a key picture: to read a picture takes no more than
these.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, explained
from ..files import open_plain, whole_file
from .changes import WordChange, changed_stream, group_count, word_change
from .stream import (
    MAGIC,
    WRITE_AGAIN,
    WordStream,
    check_length,
    stream_bytes,
    stream_from_bytes,
    stream_to_bytes,
)

KEY_EVERY = 16  # pictures
_SEVERAL = 2  # version of files of several pictures
_HEADER = struct.Struct("<8sIIQ")
_CHECKSUM = struct.Struct("<I")
_INDEX = np.dtype(
    [("time", "<f8"), ("at", "<u8"), ("bytes", "<u4"), ("unpacked", "<u4"), ("kind", "<u4"), ("zero", "<u4")]
)
_KEY, _DIFFERENCE = 0, 1
_MOST_PICTURES = 1 << 20
_LONGEST_HEADER = 256  # bytes
_MOST_RATIO, _FREE = 256, 1 << 20  # a picture may unpack to so many times its bytes, and to so many more
_LEAST_KEPT = 0.1  # share of the words below which a key picture is stored instead of a difference


def write_stream(stream: WordStream, path: Path | str) -> None:
    """Write a file of one picture. Raises InputError."""
    with whole_file(path) as temporary:
        temporary.write_bytes(stream_to_bytes(stream))


@contextmanager
def writing_streams(path: Path | str) -> Iterator[Callable[[WordStream, float], None]]:
    """A function that adds a picture and its time, seconds, to a file of several. Raises InputError."""
    index: list[tuple[float, int, int, int, int, int]] = []
    before: WordStream | None = None
    since_key = 0
    with whole_file(path) as temporary, open(temporary, "wb") as file:
        file.write(_HEADER.pack(MAGIC, _SEVERAL, 0, 0))

        def add(stream: WordStream, time: float) -> None:
            nonlocal before, since_key
            since_key += 1
            change = None if before is None or since_key >= KEY_EVERY else word_change(before, stream)
            if change is not None and len(change.added) > (1 - _LEAST_KEPT) * len(stream):
                change = None
            if change is None:
                data, kind, since_key = stream_to_bytes(stream), _KEY, 0
            else:
                data, kind = np.packbits(change.kept).tobytes() + stream_to_bytes(change.added), _DIFFERENCE
            pressed = zlib.compress(data)
            index.append((time, file.tell(), len(pressed), len(data), kind, 0))
            file.write(pressed)
            before = stream

        yield add
        header = _HEADER.pack(MAGIC, _SEVERAL, len(index), file.tell())
        table = np.array(index, _INDEX).tobytes()
        file.write(table + _CHECKSUM.pack(zlib.crc32(header + table)))
        file.seek(0)
        file.write(header)


def read_stream(path: Path | str, index: int = 0) -> WordStream:
    """Read one picture of a file. Raises InputError for a file that cannot be read, or is damaged."""
    return WordFile(path).read(index)


class WordFile:
    """The pictures of a file, which any thread may read, in any order.

    times: (T,) float64 seconds; None of a file of one picture. nbytes: of the file. Raises InputError for one
    that cannot be read, or whose index is damaged.
    """

    def __init__(self, path: Path | str) -> None:
        self._path = Path(path)
        self._held: tuple[int, WordStream] | None = None  # the last one that was read, by number
        with self._opened() as file:
            self.nbytes = os.fstat(file.fileno()).st_size
            self._index = _index_of(file, self.nbytes)
        self.times: NDArray[np.float64] | None = None
        if self._index is not None:
            self.times = self._index["time"].astype(np.float64)

    def __len__(self) -> int:
        return 1 if self._index is None else len(self._index)

    @property
    def keys(self) -> int:
        """How many of the pictures are key pictures."""
        return 1 if self._index is None else int((self._index["kind"] == _KEY).sum())

    def read(self, index: int) -> WordStream:
        """One picture. Raises InputError where it, or one that it refers to, is damaged."""
        if not 0 <= index < len(self):
            hint = f"The file contains {len(self)} pictures, and Scan4D counts them from 0"
            raise InputError(f"has no picture {index}", self._path, hint)
        with self._opened() as file:
            if self._index is None:
                return stream_from_bytes(file.read(self.nbytes))
            key = int(np.flatnonzero(self._index["kind"][: index + 1] == _KEY)[-1])
            held, stream = self._held or (-1, None)
            if not key <= held <= index:
                held, stream = key - 1, None
            for number in range(held + 1, index + 1):
                try:
                    stream = _read_picture(file, self._index[number], stream)
                except InputError as error:
                    raise InputError(f"picture {number}: {error.what}", self._path, error.hint) from error
        assert stream is not None
        self._held = index, stream
        return stream

    @contextmanager
    def _opened(self) -> Iterator[BinaryIO]:
        """The file; what goes wrong is one message that names it."""
        try:
            with open_plain(self._path) as file:
                yield file
        except OSError as error:
            what, hint = explained(error)
            raise InputError(f"cannot be read: {what}", self._path, hint) from error
        except InputError as error:
            raise InputError(error.what, error.where or self._path, error.hint) from error


def _index_of(file: BinaryIO, held: int) -> NDArray | None:
    """The index of a file of so many bytes; None of one picture. Raises InputError."""
    header = file.read(_HEADER.size)
    is_ours = header.startswith(MAGIC) and len(header) == _HEADER.size
    if not is_ours or _HEADER.unpack(header)[1] != _SEVERAL:
        file.seek(0)
        check_length(held, stream_bytes(file.read(_LONGEST_HEADER)))
        return None
    _, _, count, at = _HEADER.unpack(header)
    if not 1 <= count <= _MOST_PICTURES:
        raise InputError(f"states that it holds {count} pictures", hint=WRITE_AGAIN)
    check_length(held, at + count * _INDEX.itemsize + _CHECKSUM.size)
    file.seek(at)
    table = file.read(count * _INDEX.itemsize)
    if _CHECKSUM.pack(zlib.crc32(header + table)) != file.read():
        raise InputError("is damaged: its checksum is wrong", hint=WRITE_AGAIN)
    index = np.frombuffer(table, _INDEX)
    ends = index["at"] + index["bytes"]
    is_inside = (index["at"] >= _HEADER.size) & (ends >= index["at"]) & (ends <= at)
    if not (is_inside.all() and index["kind"][0] == _KEY and (index["kind"] <= _DIFFERENCE).all()):
        raise InputError("has an index that does not fit its pictures", hint=WRITE_AGAIN)
    if not (np.isfinite(index["time"]).all() and (np.diff(index["time"]) >= 0).all()):
        raise InputError("has times that are not numbers in ascending order", hint=WRITE_AGAIN)
    if (index["unpacked"] > _MOST_RATIO * index["bytes"].astype(np.int64) + _FREE).any():
        raise InputError("has pictures that are compressed more than words can be", hint=WRITE_AGAIN)
    return index


def _read_picture(file: BinaryIO, entry: np.void, before: WordStream | None) -> WordStream:
    """A picture of an entry of the index. before: the one that a difference refers to."""
    file.seek(int(entry["at"]))
    size = int(entry["unpacked"])
    try:
        unpack = zlib.decompressobj()
        data = unpack.decompress(file.read(int(entry["bytes"])), size + 1)
    except zlib.error as error:
        raise InputError("is damaged: it cannot be decompressed", hint=WRITE_AGAIN) from error
    if len(data) != size or not unpack.eof:
        raise InputError("is damaged: its length is wrong", hint=WRITE_AGAIN)
    if entry["kind"] == _KEY:
        return stream_from_bytes(data)
    assert before is not None  # the first picture is a key picture
    groups = group_count(before)
    bits = np.frombuffer(data[: -(-groups // 8)], np.uint8)
    if len(bits) * 8 < groups:
        raise InputError("is cut short", hint=WRITE_AGAIN)
    kept = np.unpackbits(bits, count=groups).astype(bool)
    return changed_stream(before, WordChange(kept, stream_from_bytes(data[len(bits) :])))
