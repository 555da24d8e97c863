"""Files of code words: what is written is read, and damaged ones are refused with one message."""

from __future__ import annotations

import struct
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from word_scenes import GREY, equal_streams, front_view, scattered, streams

from viewer.codewords.encode import encode_elements
from viewer.codewords.engine import draw_words
from viewer.codewords.files import read_stream, write_stream
from viewer.codewords.lighting import LIGHT_BYTES, map_palette, mapped, palette_of
from viewer.codewords.stream import WordStream, strip_width
from viewer.codewords.words import COLUMNS
from viewer.errors import InputError

same_folder = settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@pytest.fixture
def small(tmp_path: Path) -> Path:
    view = front_view((600, 20), perspective=True)
    write_stream(encode_elements(scattered(60, view.size, 1), view, GREY), tmp_path / "a.cw")
    return tmp_path / "a.cw"


@same_folder
@given(stream=streams())
def test_what_is_written_is_read(stream: WordStream, tmp_path: Path) -> None:
    write_stream(stream, tmp_path / "a.cw")
    again = read_stream(tmp_path / "a.cw")
    assert equal_streams(again, stream)
    assert np.array_equal(draw_words(again).image, draw_words(stream).image)


def test_the_file_is_as_documented(small: Path) -> None:
    """Read again by the layout alone."""
    data, stream = small.read_bytes(), read_stream(small)
    head = struct.unpack_from("<8s6IQdd4B", data)
    words = len(stream)
    assert head[:8] == (b"SCAN4DCW", 1, 1 | 4, 600, 20, 2, 2, words)
    assert head[8:] == (stream.near, stream.far, 0, 0, 0, 255)
    at = struct.calcsize("<8s6IQdd4s")
    assert np.frombuffer(data, "<f8", 15, at).tolist() == stream.camera.tolist()
    at += 15 * 8
    assert np.frombuffer(data, "<u4", 2, at).tolist() == [0, 300]
    assert np.array_equal(np.frombuffer(data, "<u4", 40, at + 8), np.diff(stream.line_starts))
    assert np.array_equal(np.frombuffer(data, "<u8", words, at + 168), stream.words)
    assert np.array_equal(np.frombuffer(data, "<u4", words, at + 168 + 8 * words), stream.ids)
    assert len(data) == at + 168 + 12 * words + 3 * 2 * 3 * 2 + 4
    assert struct.unpack("<I", data[-4:])[0] == zlib.crc32(data[:-4])


@same_folder
@given(at=st.integers(0, 10**6), change=st.integers(1, 255))
def test_a_changed_byte_is_noticed(small: Path, at: int, change: int) -> None:
    data = bytearray(small.read_bytes())
    data[at % len(data)] ^= change
    (small.parent / "b.cw").write_bytes(data)
    with pytest.raises(InputError, match=r"b\.cw: [^\n]+$"):
        read_stream(small.parent / "b.cw")


@same_folder
@given(share=st.floats(0, 1, exclude_max=True))
def test_a_file_that_is_cut_short_is_noticed(small: Path, share: float) -> None:
    data = small.read_bytes()
    (small.parent / "b.cw").write_bytes(data[: int(share * len(data))])
    with pytest.raises(InputError, match=r"is cut short|is not a file of code words"):
        read_stream(small.parent / "b.cw")


def test_other_files_are_refused(small: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_stream(small.with_name("none.cw"))
    with pytest.raises(InputError, match="cannot be read"):
        read_stream(small.parent)
    small.write_bytes(small.read_bytes() + b"\0")
    with pytest.raises(InputError, match="is longer than its header states"):
        read_stream(small)


HEADER = "<8s6IQdd4s"
DAMAGES = {  # number of the field in the header, value -> words of the message
    (1, 7): "is of version 7",
    (2, 1 << 20): "has unknown flags",
    (3, 0): "0 x 20 pixels",
    (3, 1 << 31): "2147483648 x 20 pixels",
    (4, 1 << 20): "600 x 1048576 pixels",
    (5, 1): "1 strips for 600 columns",
    (5, 601): "601 strips",
    (6, 0): "0 materials",
    (6, 129): "129 materials",
    (7, 1 << 62): "is cut short",
    (8, -1.0): "of the code words are out of range",
    (8, float("nan")): "of the code words are out of range",
    (9, float("inf")): "of the code words are out of range",
    (9, 1e-9): "of the code words are out of range",
}


@pytest.mark.parametrize(("change", "words"), DAMAGES.items())
def test_headers_that_make_no_sense(small: Path, change: tuple[int, float], words: str) -> None:
    """Even where the file is as long as its header says and its checksum is right."""
    data = small.read_bytes()
    head = list(struct.unpack_from(HEADER, data))
    head[change[0]] = change[1]
    body = data[struct.calcsize(HEADER) : -4]
    if change[0] == 6:
        body = body[: len(body) - 2 * 18] + bytes(18 * int(change[1]))
    data = struct.pack(HEADER, *head) + body
    small.write_bytes(data + struct.pack("<I", zlib.crc32(data)))
    with pytest.raises(InputError, match=words):
        read_stream(small)


def test_streams_that_an_engine_cannot_draw(small: Path) -> None:
    stream = read_stream(small)
    lines = stream.line_starts.copy()
    lines[5], lines[6] = lines[6] + 3, lines[5]
    beyond = stream.words | np.uint64(511 << 46)
    material = stream.words | np.uint64(1 << 45)
    ids = stream.ids.copy()
    line = int(np.flatnonzero(np.diff(stream.line_starts) > 1)[0])
    first = int(stream.line_starts[line])
    ids[first], ids[first + 1] = 9, 8
    steep = np.full((len(stream), 3), (1 << 26) + 1, np.int32)
    for changes, words in (
        ({"line_starts": lines}, "begins before"),
        ({"line_starts": stream.line_starts[:-1]}, "is not the sum over the lines"),
        ({"line_starts": stream.line_starts + 1}, "is not the sum over the lines"),
        ({"words": beyond}, "columns of its strip"),
        ({"words": material}, "the table of 2 materials does not contain"),
        ({"ids": ids}, "sorted by their ids"),
        ({"ids": stream.ids[1:]}, "must store an id for each code word"),
        ({"finer": steep}, "exact depths"),
        ({"finer": steep[1:]}, "must store an id for each code word"),
        ({"depth_bits": 9}, "has 16 or 24 bits, not 9"),
        ({"camera": np.full(15, np.nan)}, "the camera of the code words"),
        ({"camera": np.zeros(15)}, "the camera of the code words"),
        ({"stride": 513}, "1 to 512 columns, not 513"),
        ({"size": (600, 1 << 15)}, "is not the sum over the lines"),
        ({"size": (1 << 14, 1 << 14)}, "16384 x 16384"),
    ):
        with pytest.raises(InputError, match=words):
            replace(stream, **changes)


def test_wide_pictures_are_strips_of_at_most_512_columns() -> None:
    for width in (1, 512, 513, 640, 1024, 1025, 5000):
        stride = strip_width(width)
        assert stride <= COLUMNS
        assert -(-width // stride) == -(-width // COLUMNS)  # as few as may be


def test_strips_make_one_picture() -> None:
    """Elements across the edges of strips, and the same ones with the picture's columns in other strips."""
    wide = front_view((1300, 30))
    elements = scattered(400, (1300, 30), 3, radius=9.0)
    whole = draw_words(encode_elements(elements, wide, GREY))
    assert whole.stream.strips == 3
    for left in (0, 700):
        part = replace(wide, size=(400, 30), shift=(650 - left - 200, 0.0))
        cut = encode_elements(elements, part, GREY)
        # Depths are those of what a picture shows: compared where both have the same range.
        both = replace(cut, near=whole.stream.near, far=whole.stream.far)
        assert both.strips == 1
        assert np.array_equal(draw_words(both).covered, whole.covered[:, left : left + 400])


def test_light_is_the_same_table_everywhere() -> None:
    """It is part of the rule, so whatever a machine's `pow` gives has to be this."""
    assert zlib.crc32(LIGHT_BYTES.tobytes()) == 2717344875
    assert (LIGHT_BYTES[0], LIGHT_BYTES[-1], np.diff(LIGHT_BYTES.astype(int)).min()) == (0, 255, 0)


@given(st.lists(st.tuples(*[st.integers(0, 255)] * 3), min_size=1, max_size=128))
def test_up_to_128_colors_stay_as_they_are(colors: list[tuple[int, int, int]]) -> None:
    given_colors = np.array(colors, np.uint8)
    palette, index = palette_of(given_colors)
    assert len(palette) == len({*colors})
    assert np.array_equal(palette[index], given_colors)


def test_more_colors_are_128_near_ones() -> None:
    colors = np.random.default_rng(0).integers(0, 256, (20_000, 4)).astype(np.uint8)
    palette, index = palette_of(colors)
    assert len(palette) <= 128
    error = np.linalg.norm(palette[index].astype(int) - colors[:, :3], axis=1)
    assert np.sqrt((error**2).mean()) < 40  # 128 cubes of equal size have 51 / sqrt(2)
    assert len(palette_of(np.empty((0, 3), np.uint8))[0]) == 1


def test_numbers_have_the_colors_of_a_map() -> None:
    table = np.stack([np.arange(256)] * 3, axis=1).astype(np.uint8)
    palette = map_palette(table, (9, 8, 7, 255))
    values = np.array([-np.inf, 0.0, 1.0, 2.0, 3.0, np.nan, np.inf])
    shown = palette[mapped(values, 0.0, 2.0)]
    assert shown[:, 0].tolist() == [0, 0, 128, 255, 255, 9, 255]
    assert mapped(np.array([3.0, 5.0]), 5.0, 5.0).tolist() == [0, 0]
