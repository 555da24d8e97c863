"""The engine of code words and its plain twin: the same to the bit, whatever the window."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from word_scenes import GREY, encode_words, front_view, one_element, scattered, streams

from viewer.codewords.encode import Encoding, Light, encode_elements
from viewer.codewords.engine import NO_KEY, NO_WORD, CodePicture, draw_words, draw_words_plainly
from viewer.codewords.lighting import Materials
from viewer.codewords.stream import FINE_DEPTHS, WordStream
from viewer.codewords.tables import Steps
from viewer.codewords.words import FIELDS
from viewer.errors import InputError
from viewer.srgb import bytes_from_light, light_from_bytes

FULL = 0b111000_111000_111000_111000  # all eight columns


def same(a: CodePicture, b: CodePicture) -> bool:
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ("image", "keys", "indices"))


def stream_of(
    size: tuple[int, int],
    words: list[tuple[int, dict[str, int]]],
    ids: list[int],
    materials: Materials = GREY,
) -> WordStream:
    """A stream of one strip. words: line and fields that are not 0 of each, the lines ascending."""
    fields = {name: np.array([given.get(name, 0) for _, given in words], int) for name in FIELDS}
    lines = [line for line, _ in words]
    line_starts = np.searchsorted(lines, np.arange(size[1] + 1)).astype(np.int64)
    return WordStream(
        size=size, stride=size[0], line_starts=line_starts,
        words=encode_words(fields), ids=np.array(ids, np.uint32), near=1.0, far=2.0, materials=materials,
        background=(1, 2, 3, 4),
    )  # fmt: skip


@settings(max_examples=60, deadline=None)
@given(streams(sampled=True), st.integers(8, 40))
def test_the_engine_draws_as_its_twin_with_any_window(stream: WordStream, window: int) -> None:
    plain = draw_words_plainly(stream)
    assert same(draw_words(stream), plain)
    assert same(draw_words(stream, window), plain)
    assert same(draw_words_plainly(stream, window), plain)


RULES = (Encoding(), Encoding(exact=True, depth_bits=16), Encoding(exact=True))


@pytest.mark.parametrize("rules", RULES)
def test_encoded_scenes_are_drawn_the_same(rules: Encoding) -> None:
    for seed, size in enumerate([(70, 40), (1, 1), (7, 9), (530, 12)]):
        view = front_view(size, perspective=bool(seed % 2))
        stream = encode_elements(scattered(120, size, seed), view, GREY, rules=rules)
        picture = draw_words(stream)
        assert picture.covered.any()
        assert same(picture, draw_words_plainly(stream, 8))


@settings(max_examples=60, deadline=None)
@given(stream=streams(), processors=st.integers(1, 9))
def test_threads_share_a_picture(stream: WordStream, processors: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("viewer.threads._SHARE", 1)
        patch.setattr("os.cpu_count", lambda: processors)
        assert same(draw_words(stream), draw_words_plainly(stream))


def test_the_nearest_word_is_seen_and_ties_go_to_the_lowest_id_then_to_the_first() -> None:
    scans = {"scans": FULL, "mode": 1}
    words = [
        (0, {**scans, "z": 5, "material": 0}),
        (1, {**scans, "z": 4, "material": 1}),
        (2, {**scans, "z": 5, "material": 1}),
        (3, {**scans, "z": 5, "material": 0}),
        (3, {**scans, "z": 5, "material": 0}),
    ]
    picture = draw_words(stream_of((8, 8), words, [9, 8, 7, 7, 7]))
    assert picture.indices[:, 0].tolist() == [0, 1, 1, 1, 1, 2, 3, NO_WORD]
    assert picture.keys[:, 0].tolist() == [5, 4, 4, 4, 4, 5, 5, NO_KEY]


def test_a_depth_buffer_of_16_bits_holds_whole_steps() -> None:
    """Of planes, at each pixel; what is outside of its range is at an end."""
    words = [(0, {"scans": FULL, "mode": 1}), (4, {"scans": FULL, "mode": 1})]
    planes = np.array([[-300, 256, 0], [FINE_DEPTHS - 700, 200, 100]], np.int32)
    stream = replace(stream_of((8, 8), words, [0, 1]), finer=planes, depth_bits=16)
    picture = draw_words(stream)
    assert picture.keys[0].tolist() == [0, 0, 0, 1, 2, 3, 4, 5]
    assert picture.keys[4].tolist() == [65533, 65534, 65534, 65535, 65535, 65535, 65535, 65535]
    inverse = 1 + (picture.keys[4] + 0.5) / 65536 * (0.5 - 1)
    np.testing.assert_allclose(picture.depths()[4], 1 / inverse, rtol=1e-6)


def test_depths_at_both_ends_are_seen_before_nothing() -> None:
    words = [(0, {"scans": FULL, "z": 511}), (0, {"scans": FULL, "z": 0, "x": 8})]
    picture = draw_words(stream_of((16, 8), words, [0, 1]))
    assert picture.covered.all()
    assert np.array_equal(np.unique(picture.depths()), [1.0, 2.0])
    assert picture.ids()[0, [0, 15]].tolist() == [0, 1]


def test_what_is_right_of_a_strip_or_below_the_picture_is_cut_off() -> None:
    picture = draw_words(stream_of((11, 10), [(7, {"scans": FULL, "x": 10})], [3]))
    assert np.argwhere(picture.covered).tolist() == [[7, 10], [8, 10], [9, 10]]


def test_a_stream_of_no_words_is_the_background() -> None:
    stream = stream_of((5, 6), [], [])
    for picture in (draw_words(stream), draw_words_plainly(stream)):
        assert (picture.image == [1, 2, 3, 4]).all()
        assert (picture.ids() == NO_WORD).all()
        assert np.isinf(picture.depths()).all()


def test_a_picture_can_lie_behind() -> None:
    behind = np.random.default_rng(0).integers(0, 256, (8, 12, 4)).astype(np.uint8)
    picture = draw_words(stream_of((12, 8), [(0, {"scans": FULL, "diffuse": 127})], [0]), background=behind)
    assert np.array_equal(picture.image[:, 8:], behind[:, 8:])
    assert (picture.image[:, :8, 3] == 255).all()
    assert same(
        picture,
        draw_words_plainly(stream_of((12, 8), [(0, {"scans": FULL, "diffuse": 127})], [0]), 9, behind),
    )
    with pytest.raises(InputError, match="background of shape"):
        draw_words(stream_of((5, 5), [], []), background=behind)


def test_a_window_below_eight_lines_is_refused() -> None:
    with pytest.raises(InputError, match="a height of 7 lines"):
        draw_words(stream_of((5, 5), [], []), 7)


def test_a_pixel_is_the_mean_light_of_its_samples() -> None:
    """Of a word over the left half of a pixel; and what lies behind shows through."""
    words = [(0, {"scans": 0b001000_001000_001000_001000, "mode": 1, "diffuse": 127, "material": 1})]
    stream = replace(stream_of((8, 4), words, [3]), samples=4, background=(0, 0, 0, 255))
    picture = draw_words(stream)
    assert (stream.picture_size, picture.image.shape, picture.keys.shape) == ((2, 1), (1, 2, 4), (1, 2))
    full = draw_words(replace(stream, samples=1)).image[0, 0, :3]
    half = bytes_from_light(light_from_bytes(full) / 2)
    assert np.abs(picture.image[0, 0, :3].astype(int) - half).max() <= 1
    assert picture.image[0, 1].tolist() == [0, 0, 0, 255]
    assert not picture.covered.any(), "the sample beside the middle"
    clear = draw_words(replace(stream, background=(9, 9, 9, 0)))
    assert clear.image[0, 0].tolist() == [*full, 128], "what is clear has no colour"
    behind = np.array([[[255, 255, 255, 255], [1, 2, 3, 255]]], np.uint8)
    assert draw_words(stream, background=behind).image[0, 1].tolist() == [1, 2, 3, 255]
    with pytest.raises(InputError, match="whole pixels of 4 x 4 samples"):
        replace(stream_of((6, 4), [], []), samples=4)


@pytest.mark.parametrize("exact", [False, True])
def test_samples_bring_pictures_nearer_to_the_shape(exact: bool) -> None:
    """Of one disc: how much of each pixel it covers."""
    view = front_view((40, 30))
    y, x = np.mgrid[:480, :640] / 16
    true = (np.hypot(x - 20.3, y - 14.6) <= 9.7).reshape(30, 16, 40, 16).mean(axis=(1, 3))
    errors = []
    for samples in (1, 2, 4):
        element = one_element((0.3, 0.4, 0.0), 9.7)
        rules = Encoding(Steps(sizes=65), exact=exact, samples=samples)
        stream = encode_elements(element, view, GREY, Light(is_lit=False), rules, background=(0, 0, 0, 0))
        errors.append(float(np.abs(draw_words(stream).image[..., 3] / 255 - true).mean()))
    assert errors[2] < 0.5 * errors[0], errors
    assert errors[1] < errors[0]


def test_light_is_ambient_diffuse_and_specular() -> None:
    materials = Materials(
        *(np.array([row], np.uint16) for row in ([100, 0, 0], [0, 4095, 2000], [900, 0, 4095]))
    )
    for diffuse, specular in ((0, 0), (127, 0), (0, 127), (63, 64), (127, 127)):
        words = [(0, {"scans": FULL, "diffuse": diffuse, "specular": specular})]
        image = draw_words(stream_of((8, 8), words, [0], materials)).image
        parts = [index / 128 if index < 64 else (index + 1) / 128 for index in (diffuse, specular)]
        light = np.array([100 + 900 * parts[1], 4095 * parts[0], 2000 * parts[0] + 4095 * parts[1]]) / 4095
        expected = np.where(
            light < 0.0031308, light * 12.92, 1.055 * light.clip(1e-9, 1) ** (1 / 2.4) - 0.055
        )
        assert np.abs(image[0, 0, :3] - 255 * expected.clip(0, 1)).max() < 1.6  # steps of dark light are wide
