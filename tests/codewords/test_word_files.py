"""Files of several pictures of code words: differences, random access, damage."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from word_scenes import GREY, equal_streams, front_view, scattered, streams

from viewer.codewords.changes import changed_stream, word_change
from viewer.codewords.encode import encode_elements
from viewer.codewords.files import KEY_EVERY, WordFile, read_stream, write_stream, writing_streams
from viewer.codewords.stream import WordStream, stream_to_bytes
from viewer.errors import InputError

HEADER, ENTRY = struct.Struct("<8sIIQ"), struct.Struct("<dQIIII")
PICTURES = KEY_EVERY + 4
same_folder = settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def store(path: Path, pictures: Sequence[WordStream]) -> Path:
    with writing_streams(path) as add:
        for number, stream in enumerate(pictures):
            add(stream, number / 4)
    return path


def moving(number: int) -> WordStream:
    """Points of which one in eight moves from picture to picture; the nearest and the farthest stay."""
    view = front_view((600, 40), perspective=True)
    elements = scattered(200, view.size, 1)
    positions = elements.positions.copy()
    positions[:25, :2] += 3 * number
    positions[:25, 2] = 0
    return encode_elements(replace(elements, positions=positions), view, GREY)


@pytest.fixture(scope="module")
def pictures() -> list[WordStream]:
    return [moving(number) for number in range(PICTURES)]


@pytest.fixture
def sequence(pictures: list[WordStream], tmp_path: Path) -> Path:
    return store(tmp_path / "a.cw", pictures)


@given(before=streams(), data=st.data())
def test_a_difference_makes_the_second_picture_of_the_first(before: WordStream, data: st.DataObject) -> None:
    """Words that are gone, that changed and that are new."""
    count = len(before)
    rng = np.random.default_rng(data.draw(st.integers(0, 99)))
    chosen, turned = rng.random(count) < 0.7, rng.random(count) < 0.3
    words = before.words ^ (turned.astype(np.uint64) << np.uint64(25))
    starts = np.concatenate([[0], np.cumsum(chosen)])[before.line_starts]
    finer = None if before.finer is None else before.finer[chosen]
    after = replace(
        before, words=words[chosen], ids=before.ids[chosen], line_starts=starts, finer=finer, near=1.5
    )
    for one, other in ((before, after), (after, before), (before, before)):
        change = word_change(one, other)
        assert change is not None
        assert equal_streams(changed_stream(one, change), other)
    assert len(word_change(before, before).added) == 0  # type: ignore[union-attr]
    assert word_change(before, replace(before, finer=None, depth_bits=24)) is None or before.finer is None


def test_only_what_changed_is_stored(sequence: Path, pictures: list[WordStream]) -> None:
    change = word_change(pictures[0], pictures[1])
    assert change is not None
    assert set(change.added.ids) <= set(range(25))
    file = WordFile(sequence)
    assert (len(file), file.keys) == (PICTURES, 2)
    assert file.times is not None
    assert file.times.tolist() == [number / 4 for number in range(PICTURES)]
    keys = sum(len(zlib.compress(stream_to_bytes(stream))) for stream in pictures)
    assert file.nbytes < 0.5 * keys


@pytest.mark.parametrize("order", ["forwards", "backwards", "any"])
def test_pictures_are_read_in_any_order(sequence: Path, pictures: list[WordStream], order: str) -> None:
    numbers = {
        "forwards": list(range(PICTURES)),
        "backwards": list(range(PICTURES))[::-1],
        "any": np.random.default_rng(0).permutation(PICTURES).tolist(),
    }[order]
    file = WordFile(sequence)
    for number in numbers:
        assert equal_streams(file.read(number), pictures[number])
    with pytest.raises(InputError, match=f"has no picture {PICTURES}. The file contains {PICTURES} pictures"):
        file.read(PICTURES)


def test_pictures_that_cannot_be_told_by_differences(pictures: list[WordStream], tmp_path: Path) -> None:
    """Of other sizes, with finer depths, with other words: key pictures."""
    other = replace(pictures[1], words=pictures[1].words ^ np.uint64(1 << 25))
    small = encode_elements(scattered(20, (30, 20), 2), front_view((30, 20)), GREY)
    shown = [pictures[0], other, small, pictures[0], pictures[0]]
    file = WordFile(store(tmp_path / "b.cw", shown))
    assert file.keys == 4
    assert all(equal_streams(file.read(number), stream) for number, stream in enumerate(shown))


@same_folder
@given(at=st.integers(0, 10**6), change=st.integers(1, 255))
def test_a_changed_byte_is_one_message(sequence: Path, at: int, change: int) -> None:
    data = bytearray(sequence.read_bytes())
    data[at % len(data)] ^= change
    path = sequence.with_name("b.cw")
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"b\.cw: [^\n]+$"):
        read_all(path)


def read_all(path: Path) -> list[WordStream]:
    file = WordFile(path)
    return [file.read(number) for number in range(len(file))]


@same_folder
@given(share=st.floats(0, 1, exclude_max=True))
def test_a_file_that_is_cut_short_is_noticed(sequence: Path, share: float) -> None:
    data = sequence.read_bytes()
    path = sequence.with_name("b.cw")
    path.write_bytes(data[: int(share * len(data))])
    with pytest.raises(InputError, match=r"is cut short|is not a file of code words"):
        WordFile(path)
    path.write_bytes(data + b"\0")
    with pytest.raises(InputError, match="is longer than its header states"):
        WordFile(path)


@pytest.mark.parametrize(
    ("entry", "field", "value", "words"),
    [
        (0, 4, 1, "has an index that does not fit its pictures"),
        (3, 4, 2, "has an index that does not fit its pictures"),
        (2, 1, 1 << 63, "has an index that does not fit its pictures"),
        (2, 1, 0, "has an index that does not fit its pictures"),
        (2, 2, 1 << 31, "has an index that does not fit its pictures"),
        (1, 0, float("nan"), "has times that are not numbers in ascending order"),
        (1, 0, 9.0, "has times that are not numbers in ascending order"),
        (2, 3, 1 << 31, "has pictures that are compressed more than words can be"),
        (2, 3, 99, "picture 2: is damaged: its length is wrong"),
        (2, 2, 99, "picture 2: is damaged: its length is wrong"),
        (2, 4, 0, "picture 2: is not a file of code words"),
    ],
)
def test_an_index_that_makes_no_sense(
    sequence: Path, entry: int, field: int, value: float, words: str
) -> None:
    """Even where its checksum is right."""
    data = bytearray(sequence.read_bytes())
    at = HEADER.unpack_from(data)[3]
    numbers = list(ENTRY.unpack_from(data, at + entry * ENTRY.size))
    numbers[field] = value
    ENTRY.pack_into(data, at + entry * ENTRY.size, *numbers)
    data[-4:] = struct.pack("<I", zlib.crc32(bytes(data[: HEADER.size]) + bytes(data[at:-4])))
    sequence.write_bytes(data)
    with pytest.raises(InputError, match=words):
        WordFile(sequence).read(2)


def test_the_file_is_as_documented(sequence: Path, pictures: list[WordStream]) -> None:
    """Read again by the layout alone."""
    data = sequence.read_bytes()
    magic, version, count, at = HEADER.unpack_from(data)
    assert (magic, version, count) == (b"SCAN4DCW", 2, PICTURES)
    assert len(data) == at + PICTURES * ENTRY.size + 4
    time, start, size, whole, kind, zero = ENTRY.unpack_from(data, at)
    assert (time, start, kind, zero) == (0.0, HEADER.size, 0, 0)
    assert zlib.decompress(data[start : start + size]) == stream_to_bytes(pictures[0])
    _, start, size, whole, kind, _ = ENTRY.unpack_from(data, at + ENTRY.size)
    found = zlib.decompress(data[start : start + size])
    change = word_change(pictures[0], pictures[1])
    assert change is not None
    assert (kind, len(found)) == (1, whole)
    assert found == np.packbits(change.kept).tobytes() + stream_to_bytes(change.added)


def test_one_picture_is_a_file_of_one(pictures: list[WordStream], tmp_path: Path) -> None:
    write_stream(pictures[0], tmp_path / "a.cw")
    file = WordFile(tmp_path / "a.cw")
    assert (len(file), file.keys, file.times) == (1, 1, None)
    assert equal_streams(read_stream(tmp_path / "a.cw"), pictures[0])
