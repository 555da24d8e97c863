"""The engine of code words on the GPU against its plain twin: to the bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scenes import rarely
from word_scenes import GREY, front_view, scattered, streams

from viewer.backends.codeword import engine
from viewer.backends.codeword.engine import WordBuffers, draw_bands
from viewer.codewords.encode import Elements, Encoding, encode_elements
from viewer.codewords.engine import WINDOW, CodePicture, begun, draw_words, draw_words_plainly
from viewer.codewords.stream import WordStream
from viewer.drawing.renderer import Renderer
from viewer.errors import InputError
from viewer.gpu.context import Gpu


def draw_stream(
    gpu: Gpu, stream: WordStream, window: int = WINDOW, background: NDArray[np.uint8] | None = None
) -> CodePicture:
    """Draw a stream as `draw_words` does, on the GPU. Raises InputError."""
    picture = begun(stream, window, background)
    words = WordBuffers(gpu)
    sheet = words.take(stream)
    keys, indices = (gpu.buffer(reserve=picture.keys.nbytes) for _ in range(2))
    image = gpu.buffer(picture.image)
    draw_bands(words, sheet, window, keys, indices, (image, stream.materials), is_surface=False)
    for buffer, array in ((keys, picture.keys), (indices, picture.indices), (image, picture.image)):
        array[:] = np.frombuffer(buffer.read(), array.dtype).reshape(array.shape)
    gpu.discard(words, keys, indices, image)
    return picture


def assert_same(one: CodePicture, other: CodePicture) -> None:
    np.testing.assert_array_equal(one.keys, other.keys)
    np.testing.assert_array_equal(one.indices, other.indices)
    np.testing.assert_array_equal(one.image, other.image)


@given(stream=streams(), window=st.integers(8, 64))
def test_the_picture_is_the_twins(renderer: Renderer, stream: WordStream, window: int) -> None:
    assert_same(draw_stream(renderer.gpu, stream, window), draw_words_plainly(stream))


@given(stream=streams(finer=False))
def test_ranks_that_do_not_fit_beside_z_are_looked_at_apart(renderer: Renderer, stream: WordStream) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine, "RANK_BITS", 0)
        assert_same(draw_stream(renderer.gpu, stream), draw_words_plainly(stream))


@pytest.mark.slow
@given(stream=streams(), bits=st.sampled_from([0, engine.RANK_BITS]))
def test_bands_of_many_words_are_drawn_in_several_calls(
    renderer: Renderer, stream: WordStream, bits: int
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine, "RANK_BITS", bits)
        patch.setattr(engine, "MOST_WORDS", 3)
        assert_same(draw_stream(renderer.gpu, stream), draw_words_plainly(stream))


@pytest.mark.parametrize("size", [(1, 1), (640, 7), (1100, 90), (90, 700)])
@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize("window", [*rarely(8, 16), 13, 64])
def test_strips_and_bands_meet(renderer: Renderer, size: tuple[int, int], exact: bool, window: int) -> None:
    view = front_view(size, perspective=True)
    stream = encode_elements(
        scattered(4000, size, seed=1, radius=5.0), view, GREY, rules=Encoding(exact=exact)
    )
    assert_same(draw_stream(renderer.gpu, stream, window), draw_words(stream))


@pytest.mark.parametrize("exact", [False, True])
def test_a_background_is_drawn_over(renderer: Renderer, exact: bool) -> None:
    size = (70, 50)
    elements = scattered(60, size, seed=2)
    stream = encode_elements(elements, front_view(size), GREY, rules=Encoding(exact=exact))
    picture = np.random.default_rng(3).integers(0, 256, (50, 70, 4), np.uint8)
    drawn = draw_stream(renderer.gpu, stream, background=picture)
    assert_same(drawn, draw_words_plainly(stream, background=picture))
    assert not drawn.covered.all()
    assert drawn.covered.any()


def test_no_words_show_the_background(renderer: Renderer) -> None:
    none = Elements(np.zeros((0, 3), np.float32), np.zeros(0, np.uint8))
    stream = encode_elements(none, front_view((9, 20)), GREY, background=(1, 2, 3, 4))
    drawn = draw_stream(renderer.gpu, stream)
    assert_same(drawn, draw_words_plainly(stream))
    assert (drawn.image == [1, 2, 3, 4]).all()


def test_a_window_of_too_few_lines_is_refused(renderer: Renderer) -> None:
    none = Elements(np.zeros((0, 3), np.float32), np.zeros(0, np.uint8))
    with pytest.raises(InputError, match="a height of 7 lines"):
        draw_stream(renderer.gpu, encode_elements(none, front_view((9, 20)), GREY), 7)
