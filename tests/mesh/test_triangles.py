"""Meshes: reading their faces, and where rays hit them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scenes import sphere_hits, sphere_mesh

from viewer.bench.metrics import angles_between
from viewer.camera import Camera
from viewer.errors import InputError
from viewer.mesh.reference import trace
from viewer.mesh.triangles import Mesh, face_normals, read_mesh, vertex_normals
from viewer.scan.formats import read_faces
from viewer.scan.points import PointCloud

SIZE = (64, 48)
SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="ascii")
    return path


def test_obj_polygons_become_fans(tmp_path: Path) -> None:
    mesh = read_mesh(write(tmp_path / "a.obj", SQUARE + "f 1/1 2/2 3/3 4/4\nf -4 -3 -2\n"))
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 2]]
    assert face_normals(mesh).tolist() == [[0, 0, 1]] * 3
    assert vertex_normals(mesh).tolist() == [[0, 0, 1]] * 4


PLY = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"


@pytest.mark.parametrize("name", ["vertex_indices", "vertex_index"])
@pytest.mark.parametrize("faces", ["3 0 1 2\n3 0 2 3\n", "4 0 1 2 3\n"])
def test_ply_faces_by_either_name(tmp_path: Path, name: str, faces: str) -> None:
    header = f"{PLY}element face {faces.count(chr(10))}\nproperty list uchar int {name}\nend_header\n"
    text = header + SQUARE.replace("v ", "") + faces
    assert read_faces(write(tmp_path / "a.ply", text)).triangles().tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize(
    ("faces", "message"),
    [
        ("", "no faces"),
        ("f 1 2 9\n", "vertex 8, but there are only 4 vertices"),
        ("f 1 2 x\n", "faces cannot be read"),
        ("f 0 1 2\n", "vertex that does not exist"),
    ],
)
def test_unusable_faces_are_one_message(tmp_path: Path, faces: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as error:
        read_mesh(write(tmp_path / "a.obj", SQUARE + faces))
    assert "a.obj" in str(error.value)


@pytest.mark.parametrize(
    ("header", "faces", "message"),
    [
        ("", "", "no faces"),
        ("element face 1\nproperty int flag\n", "3\n", "refer to no vertices"),
        ("element face 1\nproperty int vertex_index\n", "3\n", "refer to no vertices"),
        (
            "element face 2\nproperty list uchar int vertex_index\n",
            "3 0 1 2\n",
            "contains only 1 of the 2 faces",
        ),
        (
            "element face 1\nproperty list uchar int vertex_index\n",
            "3 0 1 -2\n",
            "vertex that does not exist",
        ),
        ("element face 1\nproperty list uchar float vertex_index\n", "3 0 1 nan\n", "faces cannot be read"),
        (
            "element face 99999999999\nproperty list uchar int vertex_index\n",
            "3 0 1 2\n",
            "contains only 1 of the 99999999999 faces",
        ),
    ],
)
def test_unusable_ply_faces_are_one_message(tmp_path: Path, header: str, faces: str, message: str) -> None:
    text = f"{PLY}{header}end_header\n" + SQUARE.replace("v ", "") + faces
    with pytest.raises(InputError, match=message) as error:
        read_mesh(write(tmp_path / "a.ply", text))
    assert "a.ply" in str(error.value)


def test_a_format_without_faces_is_no_mesh(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the mesh has no faces"):
        read_mesh(write(tmp_path / "a.xyz", SQUARE.replace("v ", "")))


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_a_fine_sphere_mesh_is_the_analytic_sphere(projection: str) -> None:
    rings = 128
    camera = Camera(eye=(3, 2, 4), projection=projection)
    picture = trace(sphere_mesh(rings), camera, SIZE)
    depth, normal = sphere_hits(camera, SIZE)
    assert (picture.covered != np.isfinite(depth)).sum() <= 2  # on the outline
    rounding, sagitta = 8 * np.finfo(np.float32).eps, (np.pi / rings) ** 2 / 4  # of a quad's diagonal
    radius = np.linalg.norm(picture.positions(), axis=1)
    assert radius.max() < 1 + rounding  # chords lie inside
    assert radius.min() > 1 - 1.01 * sagitta - rounding
    angle = angles_between(picture.normal, normal)[picture.covered & np.isfinite(depth)]
    assert np.median(angle) < 0.02
    assert np.quantile(angle, 0.99) < 1  # at the outline a hit moves along the surface


def test_hits_on_a_mesh_are_exact_to_float32_wherever_the_eye_and_the_mesh_are() -> None:
    """Against the planes of the faces that are named, in float64."""
    for eye, fov, center in (((3, 2, 4), 30, (0, 0, 0)), ((3e4, 2e4, 4e4), 0.003, (0, 0, 0)),
                             ((3, 2, 4), 30, (4e6, -7e6, 2e6))):  # fmt: skip
        mesh = sphere_mesh(32, center)
        camera = Camera(eye=tuple(np.add(eye, center)), target=center, fov_y=fov)
        picture = trace(mesh, camera, SIZE)
        assert 0.2 < picture.covered.mean() < 0.8
        faces = picture.id[picture.covered]
        corners = mesh.points.positions[mesh.faces[faces, 0]].astype(np.float64)
        offsets = ((picture.positions() - corners) * face_normals(mesh)[faces]).sum(axis=1)
        # A ray's start is up to two radii away, with three roundings of half a float32 step each.
        assert np.abs(offsets).max() < 8 * np.finfo(np.float32).eps


def test_colours_are_interpolated_in_linear_light() -> None:
    points = PointCloud.from_arrays(
        [[-2, -2, 0], [2, -2, 0], [0, 3, 0]],
        colors=np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255]], np.uint8),
    )
    picture = trace(Mesh(points, np.array([[0, 1, 2]], np.uint32)), Camera(eye=(0, 0, 5)), SIZE)
    assert np.abs(picture.color[picture.covered].sum(axis=1) - 1).max() < 1e-5
    assert (picture.normal[picture.covered] == [0, 0, 1]).all()  # of the face


def test_points_are_carried_with_their_faces() -> None:
    mesh = sphere_mesh(16)
    turn = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    moved = Mesh(PointCloud.from_arrays(mesh.points.positions @ turn.T * 2 + 1), mesh.faces)
    picture = trace(mesh, Camera(eye=(3, 2, 4)), SIZE)
    carried = mesh.carry(picture.id[picture.covered], picture.positions(), moved)
    assert np.abs(carried + moved.origin - (picture.positions() @ turn.T * 2 + 1)).max() < 1e-5
