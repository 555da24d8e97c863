"""Colours of vertices from pictures."""

from __future__ import annotations

import numpy as np

from viewer.scan.texture import TexturedCorners, sampled, vertex_colors

PICTURE = np.array([[[0, 0, 0], [200, 0, 0]], [[0, 100, 0], [0, 0, 40]]], np.uint8)  # 2 x 2


def test_middles_of_pixels_have_their_own_colours_and_v_points_up() -> None:
    uv = np.array([(0.25, 0.75), (0.75, 0.75), (0.25, 0.25), (0.75, 0.25)])
    np.testing.assert_array_equal(sampled(PICTURE, uv), PICTURE.reshape(-1, 3))


def test_between_pixels_colours_are_mixed_and_beyond_the_edge_they_stay() -> None:
    uv = np.array([(0.5, 0.75), (0.5, 0.5), (0.0, 1.0), (1.0, 0.0)])
    wanted = [(100, 0, 0), (50, 25, 10), (0, 0, 0), (0, 0, 40)]
    np.testing.assert_allclose(sampled(PICTURE, uv), wanted)


def test_positions_beyond_the_picture_repeat_it() -> None:
    uv = np.array([(0.3, 0.6), (0.9, 0.1)])
    np.testing.assert_allclose(sampled(PICTURE, uv + np.array([3, -2])), sampled(PICTURE, uv), atol=1e-9)


def test_corners_that_name_nothing_change_no_vertex() -> None:
    """A vertex beyond the points, a material that is not there, and a corner without a position."""
    corners = TexturedCorners(
        np.array([0, 9, 1, 2]), np.array([(0.75, 0.75), (0, 0), (0, 0), (np.nan, 0)]), np.array([0, 0, -1, 0])
    )
    found = vertex_colors(corners, [PICTURE], np.ones((1, 3)), 3)
    np.testing.assert_array_equal(found, [(200, 0, 0), (255, 255, 255), (255, 255, 255)])
