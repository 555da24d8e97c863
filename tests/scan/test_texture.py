"""Colours of vertices from pictures, and points between the vertices."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.scan.texture import (
    TexturedMesh,
    bilinear,
    means_of_rows,
    pixels_at,
    points_between,
    texels_covered,
    vertex_samples,
)

PICTURE = np.array([[[0, 0, 0], [200, 0, 0]], [[0, 100, 0], [0, 0, 40]]], np.uint8)  # 2 x 2


def sampled(picture: np.ndarray, uv: np.ndarray, is_clamped: bool = False) -> np.ndarray:
    return bilinear(picture.shape[:2], uv, is_clamped).of(picture)


def square(sizes: tuple[int, ...] = (4,)) -> TexturedMesh:
    """A quad over the whole picture, as one face or as triangles."""
    corners = np.array([0, 1, 2, 3]) if sizes == (4,) else np.array([0, 1, 2, 0, 2, 3])
    uv = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float64)
    return TexturedMesh(np.array(sizes), corners, corners, np.zeros(len(sizes), np.int64), uv)


def test_middles_of_pixels_have_their_own_colours_and_v_points_up() -> None:
    uv = np.array([(0.25, 0.75), (0.75, 0.75), (0.25, 0.25), (0.75, 0.25)])
    np.testing.assert_array_equal(sampled(PICTURE, uv), PICTURE.reshape(-1, 3))
    np.testing.assert_array_equal(pixels_at((2, 2), uv), [0, 1, 2, 3])


def test_between_pixels_colours_are_mixed_and_beyond_the_edge_they_stay() -> None:
    uv = np.array([(0.5, 0.75), (0.5, 0.5), (0.0, 1.0), (1.0, 0.0)])
    wanted = [(100, 0, 0), (50, 25, 10), (0, 0, 0), (0, 0, 40)]
    np.testing.assert_allclose(sampled(PICTURE, uv), wanted)


def test_positions_beyond_the_picture_repeat_it_or_its_edge() -> None:
    uv = np.array([(0.3, 0.6), (0.9, 0.1)])
    np.testing.assert_allclose(sampled(PICTURE, uv + np.array([3, -2])), sampled(PICTURE, uv), atol=1e-3)
    np.testing.assert_array_equal(
        sampled(PICTURE, np.array([(7, 0.75), (0.25, -3)]), True), [(200, 0, 0), (0, 100, 0)]
    )
    np.testing.assert_array_equal(pixels_at((2, 2), uv + np.array([3, -2])), pixels_at((2, 2), uv))


def test_transparent_pixels_do_not_count_where_others_do() -> None:
    alpha = np.array([[0, 255], [0, 0]], np.uint8)[..., None]
    found = sampled(np.concatenate([PICTURE, alpha], axis=2), np.array([(0.5, 0.5), (0.25, 0.25)]))
    np.testing.assert_allclose(found, [(200, 0, 0), (0, 100, 0)])


def test_corners_that_name_nothing_are_no_samples() -> None:
    """A vertex beyond the points, a face without a material, and a corner without a position."""
    mesh = TexturedMesh(
        np.array([1, 1, 1, 1, 1]), np.array([0, 9, 1, 2, 0]), np.array([0, 0, 0, 5, 0]),
        np.array([0, 0, -1, 0, 0]), np.array([(0.75, 0.75)]),
    )  # fmt: skip
    found = vertex_samples(mesh, 3)
    assert sorted(found.rows.tolist()) == [0, 2]
    assert np.isnan(found.uv[found.rows == 2]).all()


def test_a_vertex_has_the_mean_of_its_samples_and_else_is_white() -> None:
    colors = np.array([(10, 20, 30), (20, 40, 60), (1, 2, 3)])
    found = means_of_rows(np.array([0, 0, 2]), colors, 3)
    np.testing.assert_array_equal(found, [(15, 30, 45), (255, 255, 255), (1, 2, 3)])


@pytest.mark.parametrize("sizes", [(4,), (3, 3)])
def test_points_between_lie_evenly_on_the_triangles_one_a_texel(sizes: tuple[int, ...]) -> None:
    """A square of 40 x 40 texels: two triangles of 800 texels, each divided 28 times."""
    mesh = square(sizes)
    np.testing.assert_allclose(texels_covered(mesh, 4, np.array([1600.0])), [1600])
    points = points_between(mesh, 4, np.array([1600.0]), 10**6)
    assert len(points) == 2 * 28**2 == points.count_by_group(3)[0]
    found = np.empty((len(points), 2), np.float32)
    for column in (0, 1):  # vertices at their positions in the texture
        points.interpolate(mesh.uv[:, column].astype(np.float32), found[:, column])
    np.testing.assert_allclose(found, points.uv, atol=1e-6)
    assert ((found > 0) & (found < 1)).all()
    counts, _, _ = np.histogram2d(*found.T, bins=7, range=[(0, 1), (0, 1)])
    assert counts.min() > 0.7 * counts.mean()
    assert counts.max() < 1.3 * counts.mean()
    assert len(np.unique(found, axis=0)) == len(found)


def test_points_between_are_as_many_as_may_be_and_named_by_what_they_are() -> None:
    mesh = square()
    found = points_between(mesh, 4, np.array([1e6]), 1000)
    assert 900 < len(found) <= 1000
    assert found.name == points_between(mesh, 4, np.array([1e6]), 1000).name
    assert found.name != points_between(mesh, 4, np.array([1e6]), 500).name
    assert not len(points_between(mesh, 4, np.array([0.0]), 1000))
    one = points_between(mesh, 3, np.array([1e6]), 1000)  # a corner of the other triangle names no vertex
    np.testing.assert_array_equal(one.triangles, [[0, 1, 2]])


def test_whole_numbers_come_from_the_nearest_vertex() -> None:
    points = points_between(square((3, 3)), 4, np.array([800.0]), 10**6)
    labels = np.empty(len(points), np.int32)
    points.interpolate(np.array([7, 8, 9, 10], np.int32), labels)
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    distances = np.linalg.norm(points.uv[:, None] - corners, axis=2)
    chosen = distances[np.arange(len(points)), labels - 7]
    assert set(labels.tolist()) == {7, 8, 9, 10}
    assert np.mean(chosen <= distances.min(axis=1) + 0.05) > 0.8  # of its triangle, not of the square
