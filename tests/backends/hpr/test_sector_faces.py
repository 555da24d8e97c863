"""Faces between candidates, against plain loops."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import NOTHING, looking_down_z, rarely, sphere, sphere_hits
from sector_scenes import Scene
from test_splats import CAMERAS, bumpy

from viewer.backends.hpr import faces as faces_module
from viewer.backends.hpr.faces import draw_faces
from viewer.backends.hpr.splats import SectorSplats
from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud

Draw = Callable[..., Surface]
Depths = NDArray[np.float64]
LONGEST = 4.0
FACES = {"output": "faces", "steps": 16, "radius": 1000}  # no point of the back is seen through gaps


def drawn(renderer: Renderer, scene: Scene, longest: float = LONGEST) -> SectorSplats:
    splats = SectorSplats(renderer.gpu, (1, 1))
    splats.find(scene.pose, scene.candidates)
    draw_faces(scene.pose, scene.surface, scene.candidates, scene.candidates.visible, splats, longest)
    return splats


def kept(scene: Scene, splats: SectorSplats, longest: float) -> list[tuple[int, ...]]:
    """The faces without those that have an edge which is too long."""
    spacings = np.frombuffer(splats["spacings"].buffer.read(), np.float32)

    def is_short(a: int, b: int) -> bool:
        length = np.linalg.norm(scene.positions[a] - scene.positions[b])
        return bool(length <= longest * min(spacings[a], spacings[b]))

    return [
        f
        for f in scene.faces()
        if all(is_short(*edge) for edge in ((f[0], f[1]), (f[1], f[2]), (f[2], f[0])))
    ]


def pixels_inside(corners: NDArray, size: tuple[int, int]) -> Iterator[tuple[int, int, NDArray]]:
    """The pixels of a picture whose centres a triangle contains, corners (3, 2), and their shares of its
    corners, (3,). None for a triangle without an area."""
    edges = np.column_stack([corners, np.ones(3)])
    if abs(np.linalg.det(edges)) < 1e-9:
        return
    low = np.maximum(np.ceil(corners.min(axis=0) - 0.5).astype(int), 0)
    high = np.minimum(np.floor(corners.max(axis=0) - 0.5).astype(int), np.array(size) - 1)
    for y, x in product(range(low[1], high[1] + 1), range(low[0], high[0] + 1)):
        shares = np.linalg.solve(edges.T, [x + 0.5, y + 0.5, 1])
        if (shares >= -1e-9).all():
            yield y, x, shares


def plain_picture(
    scene: Scene, faces: list[tuple[int, ...]]
) -> tuple[Depths, dict[tuple[int, int], set[int]]]:
    """The nearest depth of each pixel, face by face in float64, and a pixel's possible rows: the corners of
    what is as near as that. Points in no face are a pixel each, others where nothing else is seen."""
    view, (width, height) = scene.surface.view, scene.surface.size
    pixels, depths = view.project(scene.positions + scene.pose.origin - view.origin)
    picture = np.full((height, width), np.inf)
    shown: dict[tuple[int, int], set[int]] = {}

    def show(y: int, x: int, depth: float, rows: set[int]) -> None:
        if depth < picture[y, x] - 1e-5:
            shown[y, x] = set()
        if depth < picture[y, x] + 1e-5:
            shown[y, x] |= rows
        picture[y, x] = min(picture[y, x], depth)

    for face in faces:
        corners = list(face)
        if (depths[corners] < view.near).any():
            continue
        for y, x, shares in pixels_inside(pixels[corners], (width, height)):
            show(y, x, 1 / (shares @ (1 / depths[corners])), set(corners))
    corners_of_any = {row for face in faces for row in face}
    seen = set(np.unique(scene.rows).tolist()) - {NOTHING}
    for rows in (seen - corners_of_any, seen & corners_of_any):
        covered = np.isfinite(picture)  # by faces, and points of none
        for row in rows:
            x, y = np.floor(pixels[row]).astype(int)
            is_in = depths[row] >= view.near and 0 <= x < width and 0 <= y < height
            if is_in and not (row in corners_of_any and covered[y, x]):
                show(y, x, depths[row], {row})
    return picture, shown


def assert_drawn(scene: Scene, faces: list[tuple[int, ...]]) -> None:
    picture, shown = plain_picture(scene, faces)
    depth, rows = scene.surface.depth, scene.surface.row
    assert (np.isfinite(picture) != np.isfinite(depth)).mean() < 2e-3  # pixels on an edge
    both = np.isfinite(picture) & np.isfinite(depth)
    assert both.sum() > 500
    same = both & (np.abs(depth - np.where(both, picture, 0)) < 1e-4)
    assert same.sum() > 0.995 * both.sum()
    for y, x in np.argwhere(same):
        assert int(rows[y, x]) in shown[y, x]


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("longest", [1.5, LONGEST])
def test_faces_are_those_of_plain_loops(renderer: Renderer, name: str, longest: float) -> None:
    scene = Scene.of(renderer, bumpy(1500), CAMERAS[name], edge=60 if name == "grid" else 40)
    splats = drawn(renderer, scene, longest)
    faces = kept(scene, splats, longest)
    assert 100 < len(faces) < len(scene.faces())
    assert_drawn(scene, faces)
    splats.release()


def test_faces_larger_than_the_picture(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Many invocations draw one; the picture is the same as if one had."""
    camera = Camera(eye=(0.05, 0.02, 4.0), target=(0.05, 0, 0), fov_y=5)
    pictures = []
    for large in (faces_module._LARGE, 1 << 30):
        monkeypatch.setattr(faces_module, "_LARGE", large)
        scene = Scene.of(renderer, bumpy(1000), camera, edge=40, size=(320, 240))
        drawn(renderer, scene, 10.0).release()
        pictures.append(scene.surface)
        assert (len(scene.surface.cached(faces_module.FaceLists).large) > 0) == (large < 1 << 30)
    assert np.isfinite(pictures[0].depth).mean() > 0.7
    np.testing.assert_array_equal(pictures[0].depth, pictures[1].depth)
    np.testing.assert_array_equal(pictures[0].row, pictures[1].row)


def test_a_ball_in_front_of_another_one_is_not_joined_to_it(draw: Draw) -> None:
    """No face between the outline of the one and the other."""
    front, back = sphere(10_000, 0.5, (0, 0, 0)), sphere(10_000, 2.0, (0, 0, -5))
    positions = np.concatenate([ball.positions + ball.origin for ball in (front, back)])
    camera = Camera(eye=(0, 0, 3), target=(0, 0, 0), fov_y=50)
    surface = draw(PointCloud.from_arrays(positions), camera, (160, 120), "hpr", params=FACES)
    depth = surface.depth[np.isfinite(surface.depth)]
    assert not ((depth > 3.1) & (depth < 5.9)).any()
    assert (depth < 3.1).sum() > 1000
    assert (depth > 5.9).sum() > 1000


def test_faces_close_a_sphere_and_have_its_normals_and_colors(draw: Draw) -> None:
    ball = sphere(20_000)
    cloud = PointCloud.from_arrays(ball.positions, colors=ball.colors)
    camera, size = Camera.orbit(cloud.bounds(), 40, 25, aspect=4 / 3), (160, 120)
    surface = draw(cloud, camera, size, "hpr", Look(light="head"), FACES)
    depth, normal = sphere_hits(camera, size)
    inside, covered = np.isfinite(depth), np.isfinite(surface.depth)
    assert (inside & ~covered).sum() <= 0.3 * np.count_nonzero(np.diff(inside, axis=1))
    assert (covered & ~inside).sum() <= np.count_nonzero(np.diff(inside, axis=1)), "of points' pixels"
    both = inside & covered & (normal @ camera.rotation()[2] > 0.4)
    np.testing.assert_allclose(surface.depth[both], depth[both], atol=0.05)
    assert np.abs(surface.depth[both] - depth[both]).mean() < 2e-3
    cosine = np.einsum("ijk,ijk->ij", surface.normal, normal)[both]
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean() < 1.5
    assert set(np.unique(surface.row[covered])) <= set(range(len(cloud)))


@pytest.mark.parametrize(
    "target", [(-1, 1, -1), *rarely((1, 0, 0), (1, 1, 0), (1, 1, 1), (0, -1, 1), (-1, 0, -1))]
)
def test_there_is_no_seam_around_an_eye_inside(draw: Draw, target: tuple[float, float, float]) -> None:
    cloud = PointCloud.from_arrays(sphere(20_000).positions)
    camera = Camera(eye=(0, 0, 0), target=target, up=(0.1, 0.2, 1), fov_y=80)
    surface = draw(cloud, camera, (160, 120), "hpr", params=FACES)
    assert np.isfinite(surface.depth).all()


def test_points_alone_are_seen(draw: Draw) -> None:
    """Too far from one another for any face: two at all."""
    cloud = PointCloud.from_arrays([[0.5, 0.25, -2.0], [-0.5, -0.25, -2.0]])
    surface = draw(cloud, looking_down_z(fov_y=90), (64, 48), "hpr", params=FACES)
    assert sorted(surface.id[surface.id != NOTHING].tolist()) == [0, 1]
    np.testing.assert_array_equal(surface.depth[surface.id != NOTHING], 2.0)
