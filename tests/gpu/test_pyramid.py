"""Pyramids of images, against numpy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from viewer.drawing.renderer import Renderer
from viewer.errors import InputError
from viewer.gpu import pyramid
from viewer.gpu.context import Gpu
from viewer.gpu.pyramid import (
    BINOMIAL,
    BOX,
    FRONT_BOX,
    FRONT_TENT,
    GAUSSIAN,
    NEAREST,
    TENT,
    Filter,
    Image,
    Pyramid,
    sizes,
)

FILTERS = {"box": BOX, "nearest": NEAREST, "tent": TENT, "binomial": BINOMIAL, "gaussian": GAUSSIAN}
SIZES = [(1, 1), (2, 1), (1, 5), (7, 1), (5, 3), (16, 8), (33, 17), (255, 3)]
Array = NDArray[np.float64]


def pairs(n: int, how: Filter) -> list[tuple[int, int, float]]:
    """(coarse, fine, tap) of all samples along an axis of n fine samples that have to do with each other."""
    taps = list(enumerate(how.taps, start=how.first))
    return [(i, 2 * i + k, tap) for i in range(-(-n // 2)) for k, tap in taps if 0 <= 2 * i + k < n]


def matrix(n: int, how: Filter) -> Array:
    """(coarse, fine): the taps between the samples along an axis."""
    taps = np.zeros((-(-n // 2), n))
    for coarse, fine, tap in pairs(n, how):
        taps[coarse, fine] = tap
    return taps


def stepped(values: Array, weights: Array, rows: Array, columns: Array) -> tuple[Array, Array]:
    """The means by taps along either axis, of what is there: the plain version of a step."""
    there = np.where(weights > 0, weights, 0)
    known = np.where(there[..., None] > 0, values, 0) * there[..., None]
    sums = np.einsum("ij,jkc,lk->ilc", rows, known, columns)
    weight, inside = rows @ there @ columns.T, rows @ np.ones_like(there) @ columns.T
    return np.where(
        weight[..., None] > 0, sums / np.where(weight > 0, weight, 1)[..., None], 0
    ), weight / inside


def nearest_of(values: Array, weights: Array) -> Array:
    """The sample of each 2 x 2 that is there and whose first channel is least."""
    height, width, channels = values.shape
    out = np.zeros((-(-height // 2), -(-width // 2), channels))
    for y, x in np.ndindex(out.shape[:2]):
        block, there = (a[2 * y : 2 * y + 2, 2 * x : 2 * x + 2] for a in (values, weights > 0))
        if there.any():
            out[y, x] = block[there][np.argmin(block[there][:, 0])]
    return out


def reduced(values: Array, weights: Array, how: Filter) -> tuple[Array, Array]:
    out, weight = stepped(values, weights, *(matrix(n, how) for n in values.shape[:2]))
    return (nearest_of(values, weights) if how.nearest else out), weight


def expanded(values: Array, weights: Array, size: tuple[int, int], how: Filter) -> tuple[Array, Array]:
    return stepped(values, weights, *(matrix(n, how).T for n in size[::-1]))


def picture(size: tuple[int, int], channels: int, seed: int = 0) -> tuple[Array, Array]:
    """Values and weights, a third of which are not there."""
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(*size[::-1], channels)).astype(np.float32)
    weights = np.where(rng.random(size[::-1]) < 1 / 3, 0, rng.random(size[::-1])).astype(np.float32)
    values[weights == 0] = [np.nan, np.inf, 7, -1e30][:channels]
    return values.astype(float), weights.astype(float)


def image(gpu: Gpu, values: Array, weights: Array | None = None) -> Image:
    out = Image(gpu, values.shape[1::-1], values.shape[2])
    out.write(values, weights)
    return out


def assert_close(got: Image, values: Array, weights: Array) -> None:
    read_values, read_weights = got.read()
    np.testing.assert_allclose(read_weights, weights, rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(read_values, values, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", FILTERS)
def test_a_reduced_image_is_that_of_numpy(renderer: Renderer, name: str, size: tuple[int, int]) -> None:
    gpu, how = renderer.gpu, FILTERS[name]
    for channels in range(1, 5):
        values, weights = picture(size, channels)
        fine, coarse = image(gpu, values, weights), Image(gpu, sizes(size, 2)[1], channels)
        pyramid.reduce(gpu, fine, coarse, how)
        assert_close(coarse, *reduced(values, weights, how))
        gpu.discard(fine, coarse)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", FILTERS)
def test_an_expanded_image_is_that_of_numpy(renderer: Renderer, name: str, size: tuple[int, int]) -> None:
    gpu, how = renderer.gpu, FILTERS[name]
    for channels in range(1, 5):
        values, weights = picture(sizes(size, 2)[1], channels)
        coarse, fine = image(gpu, values, weights), Image(gpu, size, channels)
        pyramid.expand(gpu, coarse, fine, how)
        assert_close(fine, *expanded(values, weights, size, how))
        gpu.discard(fine, coarse)


def chain(gpu: Gpu, values: Array, weights: Array | None, how: Filter) -> Pyramid:
    levels = Pyramid(gpu, values.shape[1::-1], values.shape[2])
    levels.levels[0].write(values, weights)
    levels.reduce(how)
    return levels


@pytest.mark.parametrize("name", FILTERS)
def test_a_chain_goes_down_to_a_sample_that_knows_of_all(renderer: Renderer, name: str) -> None:
    values, weights = picture((45, 20), 2)
    levels = chain(renderer.gpu, values, weights, FILTERS[name])
    expected = [(45, 20), (23, 10), (12, 5), (6, 3), (3, 2), (2, 1), (1, 1)]
    assert [level.size for level in levels.levels] == expected == sizes((45, 20))
    for level in levels.levels[1:]:
        values, weights = reduced(values, weights, FILTERS[name])
        assert_close(level, values, weights)
    assert levels.nbytes == sum(12 * width * height for width, height in expected)
    levels.release()


@pytest.mark.parametrize("name", FILTERS)
def test_what_is_the_same_everywhere_stays_the_same_up_to_the_border(renderer: Renderer, name: str) -> None:
    values = np.full((13, 22, 3), [3.0, -1.5, 1e6])
    levels = chain(renderer.gpu, values, None, FILTERS[name])
    for level in levels.levels:
        samples, weights = level.read()
        np.testing.assert_allclose(weights, 1, rtol=1e-6)
        np.testing.assert_allclose(samples, np.broadcast_to(values[0, 0], samples.shape), rtol=1e-6)
    levels.release()


@pytest.mark.parametrize("name", ["tent", "binomial", "gaussian"])
def test_places_in_levels_are_as_stated(renderer: Renderer, name: str) -> None:
    """A ramp stays a ramp within the image: its values tell which place a sample stands for."""
    gpu, how = renderer.gpu, FILTERS[name]
    ramp = np.broadcast_to(np.arange(32.0)[None, :, None] + 0.5, (4, 32, 1))
    levels = chain(gpu, ramp, None, how)
    place = np.arange(16) + 0.5
    expected = 2 * place - (0.5 if len(how.taps) % 2 else 0.0)
    coarse = levels.levels[1].read()[0][0, :, 0]
    np.testing.assert_allclose(coarse[2:-2], expected[2:-2], rtol=1e-6)
    back = Image(gpu, (32, 4), 1)
    pyramid.expand(gpu, levels.levels[1], back, how)
    np.testing.assert_allclose(back.read()[0][0, 6:-6, 0], ramp[0, 6:-6, 0], rtol=1e-6)
    gpu.discard(levels, back)


@given(st.integers(1, 9), st.integers(1, 9), st.sampled_from(sorted(FILTERS)), st.integers(0, 1000))
def test_any_small_image(renderer: Renderer, width: int, height: int, name: str, seed: int) -> None:
    gpu, how = renderer.gpu, FILTERS[name]
    values, weights = picture((width, height), 1, seed)
    levels = chain(gpu, values, weights, how)
    for level in levels.levels[1:]:
        values, weights = reduced(values, weights, how)
        assert_close(level, values, weights)
    back = Image(gpu, levels.levels[0].size, 1)
    if len(levels.levels) > 1:
        pyramid.expand(gpu, levels.levels[1], back, how)
        assert_close(back, *expanded(*(a.astype(float) for a in levels.levels[1].read()), back.size, how))
    gpu.discard(levels, back)


@pytest.mark.slow
def test_more_samples_than_one_dimension_of_a_dispatch_takes(renderer: Renderer) -> None:
    gpu, size = renderer.gpu, (4100, 4100)  # 65 665 work groups
    levels = Pyramid(gpu, size, 1, levels=2)
    pyramid.expand(gpu, image_into(levels.levels[1]), levels.levels[0], BOX)
    samples, weights = levels.levels[0].read()
    y, x = np.mgrid[:4100, :4100] // 2
    np.testing.assert_array_equal(samples[..., 0], (y * 2050 + x) % 1000)
    assert (weights == 1).all()
    levels.release()


def image_into(level: Image) -> Image:
    level.write((np.arange(level.size[0] * level.size[1]) % 1000).astype(np.float32))
    return level


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize("absent", [np.inf, -np.inf, np.nan, -1.0])
def test_a_weight_that_is_none_is_as_good_as_zero(renderer: Renderer, name: str, absent: float) -> None:
    gpu, how, size = renderer.gpu, FILTERS[name], (6, 4)
    values, weights = picture(size, 2)
    results = []
    for other in (0.0, absent):
        fine = image(gpu, values, np.where(weights > 0, weights, other))
        coarse = Image(gpu, (3, 2), 2)
        pyramid.reduce(gpu, fine, coarse, how)
        pyramid.fill(gpu, coarse, fine, how)
        results.append([array.ravel() for each in (coarse, fine) for array in each.read()])
        gpu.discard(fine, coarse)
    assert np.isfinite(np.concatenate(results[1])).all()
    for plain, got in zip(*results, strict=True):
        np.testing.assert_array_equal(got, plain)


def test_images_that_are_none_are_refused(renderer: Renderer) -> None:
    for size, channels in (((0, 3), 1), ((3, -1), 1), ((3, 3), 0), ((3, 3), 5)):
        with pytest.raises(ValueError, match="an image cannot have "):
            Image(renderer.gpu, size, channels)


def test_levels_that_do_not_belong_together_are_refused(renderer: Renderer) -> None:
    gpu = renderer.gpu
    fine, coarse, other = Image(gpu, (6, 4), 1), Image(gpu, (3, 2), 1), Image(gpu, (3, 2), 2)
    one = Image(gpu, (1, 1), 1)
    with pytest.raises(ValueError, match="follow"):
        pyramid.reduce(gpu, coarse, fine, BOX)
    with pytest.raises(ValueError, match="channels"):
        pyramid.reduce(gpu, fine, other, BOX)
    with pytest.raises(ValueError, match="cannot replace the level"):
        pyramid.expand(gpu, one, one, BOX)
    with pytest.raises(InputError, match="too large"):
        Image(gpu, (1 << 20, 1 << 20), 1)
    gpu.discard(fine, coarse, other, one)


def in_front(depths: Array, weights: Array, reach: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Those of some samples that are there and of the surface of the nearest. depths: (H, W, 2), a depth and
    up to which others are of one surface with it."""
    there = [at for at in reach if weights[at] > 0]
    limit = min((depths[at][0], depths[at][1]) for at in there)[1] if there else 0
    return [at for at in there if depths[at][0] <= limit]


def front_mean(
    values: Array, guide: Array, weights: Array, taps: dict[tuple[int, int], float]
) -> tuple[Array, float]:
    """The plain version of a step with `Filter.front`, for one sample. taps: of the samples in its reach."""
    used = in_front(guide, weights, list(taps))
    weight = sum(taps[at] * weights[at] for at in used)
    total = sum((taps[at] * weights[at] * values[at] for at in used), np.zeros(values.shape[2]))
    return (total / weight if used else total), weight / sum(taps.values())


def taps_of(n: int, how: Filter) -> tuple[dict[int, dict[int, float]], dict[int, dict[int, float]]]:
    """For each coarse sample along an axis of n fine ones the fine ones it is made of, and the other way."""
    down: dict[int, dict[int, float]] = {i: {} for i in range(-(-n // 2))}
    up: dict[int, dict[int, float]] = {i: {} for i in range(n)}
    for coarse, fine, tap in pairs(n, how):
        down[coarse][fine] = up[fine][coarse] = tap
    return down, up


def across(rows: dict[int, float], columns: dict[int, float]) -> dict[tuple[int, int], float]:
    return {(y, x): a * b for y, a in rows.items() for x, b in columns.items()}


def surfaces(size: tuple[int, int], seed: int) -> tuple[Array, Array]:
    """Depths of two surfaces, how far each reaches, and weights, a third of which are not there."""
    rng = np.random.default_rng(seed)
    _, weights = picture(size, 1, seed)
    depth = np.where(rng.random(size[::-1]) < 0.4, 1.0, 3.0) + 0.4 * rng.random(size[::-1])
    return np.stack([depth, depth + 0.3 + rng.random(size[::-1])], axis=2).astype(np.float32).astype(
        float
    ), weights


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("how", [FRONT_BOX, FRONT_TENT], ids=["box", "tent"])
def test_the_surface_in_front_is_pulled_and_pushed(
    renderer: Renderer, how: Filter, size: tuple[int, int]
) -> None:
    """Of depths, and of colours that go by them."""
    gpu, coarse_size = renderer.gpu, sizes(size, 2)[1]
    (rows_down, rows_up), (columns_down, columns_up) = (taps_of(n, how) for n in size[::-1])
    depths, weights = surfaces(size, 1)
    colors, _ = picture(size, 3, 2)
    colors = np.nan_to_num(colors, posinf=0, neginf=0)
    guide, color = image(gpu, depths, weights), image(gpu, colors)
    for values, fine in ((depths, guide), (colors, color)):
        made = Image(gpu, coarse_size, values.shape[2])
        pyramid.reduce(gpu, fine, made, how, guide)
        expected = np.zeros((*coarse_size[::-1], values.shape[2])), np.zeros(coarse_size[::-1])
        for y, x in np.ndindex(expected[1].shape):
            taps = across(rows_down[y], columns_down[x])
            expected[0][y, x], expected[1][y, x] = front_mean(values, depths, weights, taps)
        assert_close(made, *expected)
        gpu.discard(made)
    coarse_depths, coarse_weights = surfaces(coarse_size, 3)
    coarse_colors = np.random.default_rng(4).random((*coarse_size[::-1], 3)).astype(np.float32).astype(float)
    coarse_guide, coarse_color = image(gpu, coarse_depths, coarse_weights), image(gpu, coarse_colors)
    for values, coarse, fine, own in (
        (coarse_colors, coarse_color, color, colors),
        (coarse_depths, coarse_guide, guide, depths),  # last, since it says what is there
    ):
        pyramid.fill(gpu, coarse, fine, how, (coarse_guide, guide))
        read, read_weights = fine.read()
        for y, x in np.ndindex(read.shape[:2]):
            if weights[y, x] > 0:
                np.testing.assert_array_equal(read[y, x], own[y, x])
                continue
            taps = across(rows_up[y], columns_up[x])
            mean, weight = front_mean(values, coarse_depths, coarse_weights, taps)
            np.testing.assert_allclose(read[y, x], mean, rtol=1e-4, atol=1e-5)
            np.testing.assert_allclose(read_weights[y, x], weight, rtol=1e-4, atol=1e-6)
    gpu.discard(guide, color, coarse_guide, coarse_color)
