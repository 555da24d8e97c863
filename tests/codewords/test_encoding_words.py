"""Encoding: what elements become as code words, and what is drawn of them."""

from __future__ import annotations

import numpy as np
import pytest
from word_scenes import GREY, front_view, one_element, scattered

from viewer.codewords.encode import Elements, Encoding, Light, encode_elements, project_elements
from viewer.codewords.engine import draw_words
from viewer.codewords.project_kernels import NORMAL_I, NORMAL_J, SIZE
from viewer.codewords.stream import WordStream
from viewer.codewords.tables import PAPER, Steps, shape_table
from viewer.codewords.words import decode_words
from viewer.view import View

FLAT = Light(is_lit=False)


def covered(stream: WordStream) -> np.ndarray:
    return draw_words(stream).covered


def ellipse(view: View, center: tuple[float, float], radius: float, across: float, down: float) -> np.ndarray:
    """The pixels whose centres the ellipse of a disc of normal k (across, down, 1) holds, rim included."""
    y, x = np.mgrid[: view.size[1], : view.size[0]] + 0.5
    x, y = x - center[0], y - center[1]
    return x * x + y * y + (across * x + down * y) ** 2 <= radius**2


@pytest.mark.parametrize("radius", [1.0, 3.5, 4.0, 6.5, 8.0, 8.5, 21.0, 300.0])
@pytest.mark.parametrize("tilt", [(0.0, 0.0), (1.2, -0.4), (-0.2, 2.0), (4.0, 4.0)])
def test_a_disc_covers_its_ellipse(radius: float, tilt: tuple[float, float]) -> None:
    """Sizes and normals that are whole steps, of the table and beyond it, across strips and edges."""
    view = front_view((1100, 40))
    for x, y in ((3, 5), (-540, 0), (548, -20), (7, 18), (180, 3)):
        stream = encode_elements(one_element((x, y, 0), radius, (tilt[0], -tilt[1], 1)), view, GREY)
        assert np.array_equal(covered(stream), ellipse(view, (550 + x, 20 - y), radius, *tilt)), (x, y)
        assert set(stream.ids) <= {0}


def test_small_shapes_are_one_word() -> None:
    view = front_view((64, 48))
    stream = encode_elements(one_element((0, 0, 0), 4.0), view, GREY)
    fields = decode_words(stream.words)
    assert (len(stream), fields["mode"][0], fields["x"][0]) == (1, 0, 28)
    assert int(np.flatnonzero(np.diff(stream.line_starts))[0]) == 20
    large = decode_words(encode_elements(one_element((0, 0, 0), 5.0), view, GREY).words)
    assert large["mode"].tolist() == [1] * 5  # of 10 x 10 pixels, in fours of lines
    assert large["x"].tolist() == [27, 35, 27, 35, 28]


@pytest.mark.parametrize("side", [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, 1), (-1, 1), (1, -1)])
@pytest.mark.parametrize("exact", [False, True])
def test_elements_beyond_an_edge(side: tuple[int, int], exact: bool) -> None:
    view = front_view((30, 20))
    for step in range(-6, 9):
        place = (side[0] * (15 + step), side[1] * (10 + step), 0.0)
        stream = encode_elements(one_element(place, 3.0), view, GREY, rules=Encoding(exact=exact))
        expected = ellipse(view, (15 + place[0], 10 - place[1]), 3.0, 0, 0)
        assert np.array_equal(covered(stream), expected)
        assert len(stream) > 0 or not expected.any()
    for far in (100, 1e5, 1e30, np.inf, np.nan):
        stream = encode_elements(
            one_element((side[0] * far, side[1] * far, 0), 3.0), view, GREY, rules=Encoding(exact=exact)
        )
        assert len(stream) == 0


def test_an_element_far_larger_than_the_picture_fills_it() -> None:
    view = front_view((40, 30), perspective=True)
    for radius in (60.0, 2e3, 1e9, 1e20):
        assert covered(encode_elements(one_element((500, 0, 0), max(600, radius)), view, GREY)).all()
        assert covered(encode_elements(one_element((0, 0, 0), radius), view, GREY)).all()


def test_elements_outside_of_the_depth_range_are_left_out() -> None:
    view = front_view((40, 30), perspective=True)  # 1 to 1000 before the eye at 100
    for z, expected in ((98.9, 1), (99.1, 0), (99.9, 0), (100, 0), (150, 0), (-899, 1), (-901, 0)):
        assert (len(encode_elements(one_element((0, 0, z), 0.001), view, GREY)) > 0) == bool(expected), z


@pytest.mark.parametrize("perspective", [False, True])
def test_depths_span_what_is_drawn(perspective: bool) -> None:
    view = front_view((64, 48), perspective)
    z = np.linspace(40, -80, 2000)
    elements = Elements(
        positions=np.stack([np.zeros(2000), np.zeros(2000), z], axis=1).astype(np.float32),
        materials=np.zeros(2000, np.uint8),
    )
    stream = encode_elements(elements, view, GREY)
    stored = decode_words(stream.words)["z"][np.argsort(stream.ids)]
    assert (stored[0], stored[-1], np.diff(stored).min()) == (0, 511, 0)
    assert (stream.near, stream.far) == pytest.approx((60, 180))
    error = np.abs(stream.depths(stored) - (100 - z))
    assert error.max() <= stream.depth_error() * 1.0001
    assert error.max() > 0.9 * stream.depth_error()


def test_one_depth_and_none() -> None:
    view = front_view((64, 48))
    one = encode_elements(one_element((0, 0, 0), 3.0), view, GREY)
    assert (one.near, one.far) == (100, 100)
    assert np.array_equal(np.unique(draw_words(one).depths()), [100, np.inf])
    empty = Elements(np.empty((0, 3), np.float32), np.empty(0, np.uint8))
    for exact in (False, True):
        assert len(encode_elements(empty, view, GREY, rules=Encoding(exact=exact))) == 0


def test_words_are_sorted_by_line_and_then_by_id() -> None:
    stream = encode_elements(scattered(500, (60, 50), 4), front_view((60, 50)), GREY)
    line = np.repeat(np.arange(len(stream.line_starts) - 1), np.diff(stream.line_starts))
    assert np.array_equal(np.lexsort((stream.ids, line)), np.arange(len(stream)))


def test_light_falls_as_the_normal_says() -> None:
    view = front_view((40, 30))
    tilted = (np.sin(np.radians(60)), 0, np.cos(np.radians(60)))
    for normal, light, expected in (
        ((0, 0, 1), Light(), (127, 127)),
        ((0, 0, -1), Light(), (127, 127)),  # the side that is seen is lit
        (tilted, Light(shininess=2.0), (64, 0)),
        (tilted, Light(tilted), (127, 0)),
        (tilted, Light((1, 0, 0), 1.0), (110, 110)),
        (tilted, FLAT, (127, 0)),
    ):
        fields = decode_words(encode_elements(one_element((0, 0, 0), 5.0, normal), view, GREY, light).words)
        assert (fields["diffuse"][0], fields["specular"][0]) == expected, normal


def test_missing_normals_and_radii() -> None:
    view = front_view((40, 30))
    for normal in ((0, 0, 0), (np.nan, 0, 1), (3e38, 3e38, 3e38)):
        assert np.array_equal(
            covered(encode_elements(one_element((0, 0, 0), 5.0, normal), view, GREY)),
            ellipse(view, (20, 15), 5.0, 0, 0),
        )
    for radius in (0.0, -1.0, np.nan, np.inf):
        stream = encode_elements(one_element((0, 0, 0), radius), view, GREY, rules=Encoding(radius_scale=3.0))
        assert np.array_equal(covered(stream), ellipse(view, (20, 15), 3.0, 0, 0))
    tiny = encode_elements(one_element((0, 0, 0), 1e-6), view, GREY)
    assert covered(tiny).sum() == 4  # as a bitmap is symmetric about a corner of pixels


def test_what_faces_away_can_be_left_out() -> None:
    view = front_view((40, 30))
    for normal, kept in (((0, 0, 1), 1), ((0, 0, -1), 0), ((1, 0, 0), 0)):
        assert (
            len(
                encode_elements(
                    one_element((0, 0, 0), 3.0, normal), view, GREY, rules=Encoding(cull_back=True)
                )
            )
            == kept
        )


def test_ellipses_have_half_axes_of_their_own() -> None:
    view = front_view((60, 40))
    elements = one_element((0, 0, 0), 9.0)
    axes = np.array([[8.0, 0, 0, 4.0]], np.float32)
    elements = Elements(elements.positions, elements.materials, elements.normals, elements.radii, axes)
    y, x = np.mgrid[:40, :60] + 0.5
    exact = ((x - 30) / 8) ** 2 + ((y - 20) / 4) ** 2 <= 1
    assert np.array_equal(covered(encode_elements(elements, view, GREY, rules=Encoding(exact=True))), exact)
    nearly = covered(encode_elements(elements, view, GREY))
    assert np.count_nonzero(nearly != exact) <= 8  # n' = sqrt(3), of which the table has 1.8


def exact_disc(view: View, center: np.ndarray, normal: np.ndarray, radius: float) -> tuple[np.ndarray, ...]:
    """Pixels whose rays meet a disc, and the depths there, by the rays themselves."""
    grid = np.mgrid[: view.size[1], : view.size[0]].reshape(2, -1).T[:, ::-1] + 0.5
    ends = [view.unproject(grid, np.full(len(grid), depth)) for depth in (1.0, 2.0)]
    step = ends[1] - ends[0]
    t = ((center - ends[0]) @ normal) / (step @ normal)
    inside = np.linalg.norm(ends[0] + t[:, None] * step - center, axis=1) <= radius
    return inside.reshape(view.size[::-1]), (1 + t).reshape(view.size[::-1])


@pytest.mark.parametrize("perspective", [False, True])
def test_exact_outlines_are_those_of_rays(perspective: bool) -> None:
    view, rng = front_view((80, 60), perspective), np.random.default_rng(5)
    for _ in range(30):
        center = rng.uniform(-1, 1, 3) * [45, 35, 30]
        normal = rng.normal(size=3)
        radius = float(rng.uniform(2, 25))
        if abs(normal[2]) < 0.3 * np.linalg.norm(normal):
            continue
        elements = one_element(tuple(center), radius, normal)
        center = elements.positions[0].astype(float)
        normal = elements.normals[0].astype(float)  # type: ignore[index]
        stream = encode_elements(elements, view, GREY, rules=Encoding(exact=True))
        picture = draw_words(stream)
        expected, depth = exact_disc(view, center, normal, float(elements.radii[0]))  # type: ignore[index]
        assert np.array_equal(picture.covered, expected)
        if expected.any():
            error = np.abs(picture.depths() - depth)[expected]
            assert error.max() <= 1e-5 * (stream.far - stream.near) + 1e-5 * stream.far


@pytest.mark.parametrize("perspective", [False, True])
def test_exact_discs_end_at_the_near_plane(perspective: bool) -> None:
    """About the eye, in front of it and behind, some far larger than what is seen of them."""
    view, rng, shown = front_view((80, 60), perspective), np.random.default_rng(8), 0
    for power in (0, 0, 0, 0, 0, 3, 6) * 6:
        center = rng.uniform(-1, 1, 3) * [40, 30, 25] + [0, 0, 100]
        elements = one_element(tuple(center), float(rng.uniform(2, 60)) * 10.0**power, rng.normal(size=3))
        center, normal = elements.positions[0].astype(float), elements.normals[0].astype(float)  # type: ignore[index]
        stream = encode_elements(elements, view, GREY, rules=Encoding(exact=True))
        picture = draw_words(stream)
        expected, depth = exact_disc(view, center, normal, float(elements.radii[0]))  # type: ignore[index]
        expected &= depth >= 1.0
        np.testing.assert_array_equal(picture.covered, expected)
        if not expected.any():
            assert len(stream) == 0
            continue
        shown += 1
        ends = [1 / stream.near, 1 / stream.far] if perspective else [stream.far, stream.near]
        seen = picture.depths()[expected]
        error = 1 / seen - 1 / depth[expected] if perspective else seen - depth[expected]
        assert np.abs(error).max() <= 1e-5 * (ends[0] - ends[1]) + 1e-6 * ends[0]
        assert stream.near >= 0.999
    assert shown > 10


@pytest.mark.parametrize("perspective", [False, True])
def test_depths_of_discs_that_are_seen_edge_on(perspective: bool) -> None:
    """However steep, what is shown of a disc is no nearer and no farther than the disc."""
    view, shown = front_view((80, 60), perspective), 0
    for tilt in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 2e-6):
        for place in ((0.5, 0.5, 0), (0.4, -7.5, 9), (-20.5, 11.5, -30)):
            toward = np.array(place) - (np.array([0, 0, 100]) if perspective else np.array([*place[:2], 100]))
            aside = np.cross(toward, (0, 1, 0))
            normal = aside / np.linalg.norm(aside) + tilt * toward / np.linalg.norm(toward)
            picture = draw_words(
                encode_elements(one_element(place, 8.0, normal), view, GREY, rules=Encoding(exact=True))
            )
            depth = picture.depths()[picture.covered]
            shown += len(depth)
            assert (np.abs(depth - (100 - place[2])) <= 8.001).all()
    assert shown > 100


def test_the_table_is_off_by_its_steps_alone() -> None:
    """A disc that is quantised lies within the steps of the ellipse that it stands for."""
    view, rng = front_view((80, 60)), np.random.default_rng(6)
    for _ in range(40):
        tilt = rng.uniform(-3, 3, 2)
        radius, place = float(rng.uniform(2, 7.5)), rng.uniform(-9, 9, 2)
        seen = covered(encode_elements(one_element((*place, 0), radius, (tilt[0], -tilt[1], 1)), view, GREY))
        center = (40 + place[0], 30 - place[1])
        width = radius / np.sqrt(1 + tilt @ tilt)
        margin = 0.5**0.5 + 0.25 + 0.5 * 0.2 * 2**0.5 * radius  # the centre, the size, the normal
        grown = ellipse(view, center, radius * (1 + margin / width), *tilt)
        assert not (seen & ~grown).any()


@pytest.mark.parametrize("steps", [PAPER, Steps(33, 4, 121, 10)])
def test_sizes_and_normals_are_within_half_a_step(steps: Steps) -> None:
    """In a parallel view, where a disc's image is exactly one of the table's; opposite normals are one."""
    view, elements = front_view((200, 150)), scattered(3000, (200, 150), 7)
    found = project_elements(elements, view, FLAT, Encoding(steps))
    assert elements.normals is not None
    assert elements.radii is not None
    normals, radii = (each[found.rows].astype(float) for each in (elements.normals, elements.radii))
    slopes = normals[:, :2] / normals[:, 2:] * [1, -1] * steps.normal_parts
    inside = np.abs(slopes).max(axis=1) <= steps.steepest
    assert inside.mean() > 0.8
    stored = found.shapes[:, [NORMAL_I, NORMAL_J]]
    apart = np.minimum(np.abs(stored - slopes).max(axis=1), np.abs(stored + slopes).max(axis=1))
    assert apart[inside].max() <= 0.5 + 1e-6
    assert np.abs(stored).max() == steps.steepest
    assert np.abs(found.shapes[:, SIZE] - radii * steps.size_parts)[radii > 1].max() <= 0.5 + 1e-6


def test_other_steps() -> None:
    view, steps = front_view((60, 40)), Steps(33, 4, 121, 10)
    stream = encode_elements(
        one_element((0, 0, 0), 5.25, (0.7, 0, 1)), view, GREY, rules=Encoding(steps=steps)
    )
    assert np.array_equal(covered(stream), ellipse(view, (30, 20), 5.25, 0.7, 0))
    assert shape_table(steps).steps != PAPER
