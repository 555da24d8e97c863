"""Range views as meshes: what joins, what does not, and what of a surface was measured."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from range_scenes import looking_at, sphere_view

from viewer.camera import Camera
from viewer.errors import InputError
from viewer.mesh.range_mesh import triangulated, was_scanned
from viewer.mesh.reference import trace
from viewer.scan.range_view import RangeView


def view_of(depth: list[list[float]], **changes: Any) -> RangeView:
    """A pod on the z axis with one pixel for a hundredth of the depth."""
    values = np.array(depth, np.float32)
    height, width = values.shape
    arguments = {
        "depth": values, "mask": np.ones(values.shape, bool), "fx": 100.0, "fy": 100.0,
        "cx": width / 2, "cy": height / 2, "world_to_camera": looking_at((0, 0, 1), (0, 0, 0)),
    }  # fmt: skip
    return RangeView(**{**arguments, **changes})


NAN = float("nan")


@pytest.mark.parametrize("kind", ["z", "range", "height"])
def test_four_neighbours_are_two_triangles_that_face_the_pod(kind: str) -> None:
    mesh = triangulated([view_of([[1, 1], [1, 1]], kind=kind)])
    assert len(mesh.faces) == 2
    assert (mesh.areas()[:, 2] > 0).all()
    assert len(np.unique(mesh.faces)) == 4


@pytest.mark.parametrize("corner", range(4))
def test_three_neighbours_are_one_triangle(corner: int) -> None:
    depth = np.ones(4)
    depth[corner] = NAN
    mesh = triangulated([view_of(depth.reshape(2, 2).tolist())])
    assert mesh.faces.shape == (1, 3)
    assert mesh.areas()[0, 2] > 0


@pytest.mark.parametrize(("step", "joined"), [(0.099, True), (0.101, False)])
@pytest.mark.parametrize("kind", ["z", "height"])
def test_a_depth_step_of_ten_spacings_is_an_edge(step: float, joined: bool, kind: str) -> None:
    view = view_of([[1, 1, 1 + step, 1 + step]] * 2, kind=kind)
    assert len(triangulated([view]).faces) == (6 if joined else 4)


def test_of_a_corner_that_steps_away_the_other_three_stay() -> None:
    for corner in range(4):
        depth = np.ones(4)
        depth[corner] = 2
        assert len(triangulated([view_of(depth.reshape(2, 2).tolist())]).faces) == 1


def test_pixels_without_neighbours_are_no_mesh() -> None:
    with pytest.raises(InputError, match="neighbouring samples of the range views do not"):
        triangulated([view_of([[1, NAN], [NAN, 1]])])


def test_views_of_a_sphere_close_it_and_keep_their_normals_and_colours() -> None:
    views = [sphere_view((0, 0, 4), size=(120, 100)), sphere_view((0, 0, -4), size=(120, 100), name="right")]
    views = [RangeView(**{**vars(view), "mask": np.isfinite(view.depth)}) for view in views]
    mesh = triangulated(views)
    assert len(mesh.points) == sum(np.count_nonzero(view.valid()) for view in views)
    assert (np.einsum("ij,ij->i", mesh.areas(), mesh.points.normals[mesh.faces[:, 0]]) > 0).mean() > 0.99
    for eye in ((0, 0, 5), (0, 0, -5)):
        picture = trace(mesh, Camera(eye=eye), (60, 60))
        radius = np.linalg.norm(picture.positions() + picture.origin, axis=1)
        assert np.abs(radius - 1).max() < 4e-3
        assert (picture.color[picture.covered] > 0).any()


def test_what_was_measured_is_told_from_what_lies_behind_and_beside() -> None:
    near = view_of([[1.0] * 20] * 20)
    places = np.array([[0, 0, 0], [0.05, 0, 0.01], [0, 0, -0.5], [0.5, 0, 0], [0, 0, 3]], float)
    assert was_scanned([near], places).tolist() == [True, True, False, False, False]
    masked = view_of([[1.0] * 20] * 20, mask=np.zeros((20, 20), bool))
    assert not was_scanned([masked], places).any()
    assert was_scanned([masked, near], places).sum() == 2
