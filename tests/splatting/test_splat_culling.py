"""Splats that are hidden, turned away or out of view are left out by chunks; no bit of pictures changes."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewer.backends import backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.gpu import chunks, gl
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.splatting import culling, splat_culling
from viewer.splatting.amplify import Points
from viewer.splatting.splats import Splats
from viewer.view import View

SIZE = (120, 80)
MANY = 60_000
RADII = (1.0, 0.8, 0.6, 0.4, 0.2)
MIDDLE = np.array([1e6, 0, -1e6])
NAMES = ("depth", "id", "color", "normal", "level")


@pytest.fixture(autouse=True)
def few_points(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chunks, "LEAST", 1)


def sphere(rng: np.random.Generator, count: int) -> np.ndarray:
    points = rng.standard_normal((count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def cloud_of(
    points: np.ndarray, normals: np.ndarray, spacing: float, order: str, axes: bool = False
) -> PointCloud:
    """A scan along bands, as a scanner writes it, or by chance, each third point twice."""
    rng = np.random.default_rng(1)
    rows = rng.permutation(len(points))
    if order == "bands":
        rows = np.lexsort(
            (points[:, 0], np.floor(points[:, 1] * 12), np.linalg.norm(points, axis=1).round(1))
        )
    rows = np.repeat(rows, np.resize([1, 1, 2], len(rows)))
    points, normals = points[rows], normals[rows].copy()
    normals[::97] = 0  # not known
    radii = spacing * rng.uniform(1.2, 2.0, len(points))
    halves = np.column_stack([np.cross(normals, [0.0, 0.6, 0.8]) * 2 * radii[:, None], radii])
    return PointCloud.from_arrays(
        points + MIDDLE,
        normals=normals,
        radii=radii,
        axes=halves if axes else None,
        colors=rng.random((len(points), 3)),
    )


def shells(order: str, axes: bool = False, count: int = 9000, radii: tuple[float, ...] = RADII) -> PointCloud:
    """Spheres in one another."""
    normals = sphere(np.random.default_rng(6), count)
    points = normals * np.resize(radii, count)[:, None]
    return cloud_of(points, normals, (4 * np.pi * len(radii) / count) ** 0.5, order, axes)


def crowd(order: str) -> PointCloud:
    """A dozen spheres behind and beside one another."""
    rng = np.random.default_rng(2)
    normals = sphere(rng, 12_000)
    middles = np.stack(np.meshgrid([-0.8, 0.0, 0.8], [-0.4, 0.4], [-0.5, 0.5]), axis=-1).reshape(-1, 3)
    return cloud_of(
        0.35 * normals + np.resize(middles, normals.shape), normals, 0.35 * (4 * np.pi / 1000) ** 0.5, order
    )


def room(order: str) -> PointCloud:
    """A room with a pillar, walls facing inwards."""
    rng = np.random.default_rng(3)
    points = rng.uniform(-1, 1, (8000, 3))
    side = np.abs(points).argmax(axis=1)
    normals = np.zeros_like(points)
    normals[np.arange(len(points)), side] = -np.sign(points[np.arange(len(points)), side])
    points[np.arange(len(points)), side] = -normals[np.arange(len(points)), side]
    turns = rng.uniform(0, 2 * np.pi, 2000)
    pillar = np.stack([np.cos(turns), np.zeros(2000), np.sin(turns)], axis=1)
    upright = rng.uniform(-1, 1, (2000, 1)) * [0, 1, 0]
    return cloud_of(
        np.concatenate([points, 0.3 * pillar + upright]), np.concatenate([normals, pillar]), 0.06, order
    )


def looking(cloud: PointCloud, azimuth: float, nearer: float = 1.0, **changes: Any) -> Camera:
    camera = Camera.orbit(cloud.bounds(), azimuth, 20, aspect=1.5)
    eye, target = np.array(camera.eye), np.array(camera.target)
    return replace(camera, eye=tuple(target + (eye - target) * nearer), **changes)


def views(cloud: PointCloud) -> Iterator[Camera]:
    """Cameras one after another: small turns, large ones, near, inside, and with planes that cut."""
    for azimuth in (0, 1, 2, 5, 40, 41, 200):
        yield looking(cloud, azimuth)
    for azimuth, nearer in ((200, 0.5), (203, 0.5), (205, 0.2), (210, 0.02), (290, 0.02), (90, 4)):
        yield looking(cloud, azimuth, nearer)
    yield looking(cloud, 30, projection="orthographic")
    yield looking(cloud, 32, projection="orthographic")
    yield looking(cloud, 40, 30, fov_y=0.4)
    yield looking(cloud, 50, near=2.2)
    yield looking(cloud, 50, near=1.2, far=2.4)
    away = looking(cloud, 50)
    yield replace(away, target=tuple(2 * np.array(away.eye) - np.array(away.target)))
    yield looking(cloud, 50)


def request_of(pose: Pose, camera: Camera, **params: object) -> Request:
    return Request(pose, camera, "surfels", backend("surfels").params(params), Look(light="head"))


def in_order(renderer: Renderer, request: Request, surface: Surface) -> None:
    """Draw until the points are in an order of use."""
    end = time.monotonic() + 60
    while time.monotonic() < end:
        render_frame(renderer, request, surface)
        if "chunks" in surface.stats.counted:
            return
        time.sleep(0.02)
    raise AssertionError("they are in no order of use")


def assert_same(renderer: Renderer, request: Request, surface: Surface) -> None:
    """The picture of a surface that has none before is of all splats."""
    fresh = Surface(renderer.gpu, surface.size)
    render_frame(renderer, request, fresh)
    assert "chunks" not in fresh.stats.counted
    for name in NAMES:
        np.testing.assert_array_equal(
            getattr(surface, name), getattr(fresh, name), err_msg=f"{name}, {request.camera}"
        )
    np.testing.assert_array_equal(surface.image(), fresh.image())
    fresh.release()


SETTINGS: list[tuple[str, dict[str, object]]] = [
    ("shells", {}),
    ("shells", {"passes": "one", "cull_back": True}),
    ("shells", {"passes": "two", "enlarge": 2.0, "radius_scale": 0.6}),
    ("shells", {"passes": "two_large", "enlarge": 1.5, "cull_back": True, "epsilon": 1.5}),
    ("shells", {"radius": "own", "instancing": "gs"}),
    ("shells", {"instancing": "pull", "passes": "one"}),
    ("dense", {"radius_scale": 0.3, "radius": "own"}),  # of about a pixel
    ("ellipses", {"cull_back": True, "radius": "own"}),
    ("crowd", {}),
    ("crowd", {"passes": "one"}),
    ("crowd", {"instancing": "vbo", "cull_back": True}),
    ("room", {"radius": "own"}),
    ("room", {"passes": "one", "cull_back": True}),
]
QUICK = (SETTINGS[1], SETTINGS[-1])
PICTURES = [
    pytest.param(*setting, marks=[] if setting in QUICK else [pytest.mark.slow]) for setting in SETTINGS
]
SCENES = {
    "shells": shells,
    "dense": lambda order: shells(order, count=MANY),
    "ellipses": lambda order: shells(order, axes=True),
    "crowd": crowd,
    "room": room,
}


@pytest.mark.parametrize("order", ["bands", "chance"])
@pytest.mark.parametrize(("scene", "params"), PICTURES, ids=str)
def test_pictures_are_the_same_to_the_bit(
    renderer: Renderer, scene: str, params: dict[str, object], order: str
) -> None:
    cloud = SCENES[scene](order)
    pose = Pose(0, 0.0, scene, cloud)
    surface = Surface(renderer.gpu, SIZE)
    in_order(renderer, request_of(pose, looking(cloud, 0), **params), surface)
    hidden = away = outside = 0
    for camera in views(cloud):
        request = request_of(pose, camera, **params)
        render_frame(renderer, request, surface)
        told = surface.stats.counted["chunks"]()
        assert sum(told.values()) == -(-len(cloud) // 32)
        hidden, outside = hidden + told["hidden"], outside + told["outside"]
        away += told.get("away", 0)
        assert_same(renderer, request, surface)
    assert outside
    assert hidden
    assert bool(away) == ("cull_back" in params)


@pytest.mark.slow
def test_what_is_hidden_or_turned_away_is_not_drawn(renderer: Renderer) -> None:
    cloud = shells("bands", count=MANY)
    pose, surface = Pose(0, 0.0, "shells", cloud), Surface(renderer.gpu, (600, 400))
    request = request_of(pose, looking(cloud, 0))
    in_order(renderer, request, surface)
    first = surface.stats.counted["chunks"]()
    assert first["hidden"] > 0.6 * sum(first.values()), first
    assert "hidden" in surface.stats.skipped["points"]
    turned = request_of(pose, looking(cloud, 0), cull_back=True)
    render_frame(renderer, turned, surface)
    counted = surface.stats.counted["chunks"]()
    assert counted["away"] > 0.25 * sum(counted.values()), counted
    assert_same(renderer, turned, surface)


@pytest.mark.slow
def test_others_are_shown_as_soon_as_what_hid_them_is_gone(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Through a hole cut into the outermost shell the next one is seen, which was left out at first."""
    cloud = shells("bands", count=MANY)
    camera = looking(cloud, 0)
    pose, surface = Pose(0, 0.0, "shells", cloud), Surface(renderer.gpu, (600, 400))
    request = request_of(pose, camera)
    in_order(renderer, request, surface)
    drawn: list[int] = []
    take = splat_culling.SplatChunks.take

    def noted(chunks: splat_culling.SplatChunks, *given: Any) -> Points:
        points = take(chunks, *given)
        drawn.append(points.count)
        return points

    monkeypatch.setattr(splat_culling.SplatChunks, "take", noted)
    render_frame(renderer, request, surface)
    assert len(drawn) == 1, "nothing new is seen"
    assert drawn[0] < 0.5 * len(cloud)
    distance = float(np.linalg.norm(np.subtract(camera.eye, camera.target)))
    times: list[int] = []
    for near, radius in ((distance - 0.9, 0.8), (distance - 0.7, 0.6), (None, 1.0)):
        drawn.clear()
        cut = replace(request, camera=replace(camera, near=near))
        render_frame(renderer, cut, surface)
        times.append(len(drawn))
        middle = cloud.positions[surface.id[200, 300]] + (cloud.origin - MIDDLE)
        assert np.linalg.norm(middle) == pytest.approx(radius, abs=0.02)
        assert_same(renderer, cut, surface)
    assert times[0] == 2, "what was hidden is seen"


def test_what_never_stays_hidden_is_not_looked_for_each_time(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where each picture shows what the last one hid, drawing twice does not pay, and rests for a while."""
    monkeypatch.setattr(splat_culling, "_MOST_SPARE", 0)
    cloud = shells("bands", radii=(1.0,))
    pose, surface = Pose(0, 0.0, "sphere", cloud), Surface(renderer.gpu, SIZE)
    in_order(renderer, request_of(pose, looking(cloud, 0)), surface)
    pauses = []
    for turn in range(12):
        request = request_of(pose, looking(cloud, 180 * (turn % 2 == 0)))
        render_frame(renderer, request, surface)
        pauses.append(surface.cached(splat_culling._Pictures).pause)
        assert_same(renderer, request, surface)
    assert max(pauses) >= 4, pauses
    assert 0 in pauses


def test_poses_that_play_are_the_same_to_the_bit(renderer: Renderer) -> None:
    """Chunks are those of one pose: each other one is drawn whole at first, wherever it is in between."""
    clouds = [shells("bands"), crowd("chance"), room("chance")]
    poses = [Pose(i, float(i), str(i), cloud) for i, cloud in enumerate(clouds)]
    surface = Surface(renderer.gpu, SIZE)
    for pose, cloud in zip(poses, clouds, strict=True):
        in_order(renderer, request_of(pose, looking(cloud, 0)), surface)
    for turn in range(9):
        pose = poses[turn // 2 % 3]
        request = request_of(pose, looking(clouds[0], 3 * turn))
        render_frame(renderer, request, surface)
        assert ("chunks" in surface.stats.counted) == (turn % 2 == 1)
        assert_same(renderer, request, surface)


@pytest.mark.slow
@pytest.mark.usefixtures("short_spans")
def test_what_is_left_out_does_not_change_how_splats_are_drawn(renderer: Renderer) -> None:
    """Tiles leave all to the rasteriser where many discs are large, which rounds otherwise: in a room whose
    pillar hides much, and some of whose discs are."""
    cloud = room("bands")
    pose, surface = Pose(0, 0.0, "room", cloud), Surface(renderer.gpu, (800, 600))
    given: dict[str, object] = {"radius": "own", "passes": "one"}
    ways = set()
    in_order(renderer, request_of(pose, looking(cloud, 0, 0.2), **given), surface)
    for scale, nearer in ((0.7, 0.2), (1.0, 0.12), (1.5, 0.1), (2.0, 0.08), (10.0, 0.06)):
        request = request_of(pose, looking(cloud, 0, nearer), radius_scale=scale, **given)
        for _ in range(3):
            render_frame(renderer, request, surface)
            assert_same(renderer, request, surface)
        ways.add("tiles" in surface.stats.skipped)
    assert ways == {True, False}


@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=30, deadline=None)
def test_chunks_that_face_away_hold_no_splat_that_faces_the_eye(
    renderer: Renderer, seed: int, perspective: bool
) -> None:
    rng = np.random.default_rng(seed)
    count, chunk = 4096, 32
    normals = sphere(rng, count // chunk).repeat(chunk, axis=0) + rng.uniform(0, 1) * sphere(rng, count)
    points = rng.normal(size=(count // chunk, 3)).repeat(chunk, axis=0) + 0.2 * rng.normal(size=(count, 3))
    cloud = PointCloud.from_arrays(points, normals=normals, radii=np.full(count, 0.05), origin=np.zeros(3))
    gpu_pose = renderer.resident(Pose(0, 0.0, "cones", cloud))
    gpu_pose.cached(chunks.Chunks)._order = chunks.in_file_order(cloud)
    kind: Any = "perspective" if perspective else "orthographic"
    surface, eye = Surface(renderer.gpu, SIZE), rng.normal(size=3) * 3
    camera = Camera(tuple(eye), tuple(rng.normal(size=3)), (0, 1, 0), kind, near=0.01, far=100.0)
    surface.start(gpu_pose, View.of(camera, SIZE, np.zeros(3), cloud.bounds()))
    told = gpu_pose.cached(splat_culling.SplatChunks)
    told.measure(Points(gpu_pose, True, count))
    splats = Splats(1.0, 0.0, 0.7, True, mask_limit=1.0, falloff=1.0, enlarge=1.0, epsilon=1.0)
    told.test(surface, 0, splat_culling.splat_margins(splats, 0.05, told.boxes.slack, True, 0))
    is_away = (told.boxes.seen(surface) & 8).astype(bool).repeat(chunk)
    faces_eye = ~surface.view.faces_away(cloud.positions, normals)
    assert not (is_away & faces_eye).any()
    surface.release()


class Twin:
    """The plain version of chunks/cull.comp for splats, chunk by chunk in float64."""

    def __init__(self, view: View, margins: culling.Margins, told: splat_culling.SplatChunks) -> None:
        self.view, self.margins = view, margins
        self.low, self.high = np.moveaxis(read(told.boxes.boxes, 6).reshape(-1, 2, 3), 1, 0)
        self.cones, self.reaches = read(told._cones, 4), read(told._reaches, 1)[:, 0]

    def scale_at(self, depth: float) -> float:
        return self.view.scale / depth if self.view.perspective else self.view.scale

    def reach(self, chunk: int) -> tuple[bool, np.ndarray, np.ndarray, float]:
        """Whether it is in view, the first and the last pixel of it, and its nearest depth."""
        view, margins, low, high = self.view, self.margins, self.low[chunk], self.high[chunk]
        far = view.depths((low + high) / 2) + np.abs(view.rotation[2]) @ (high - low) / 2
        radius = margins.radius_scale * max(self.reaches[chunk], margins.uniform_radius)
        least = margins.least_radius / self.scale_at(max(far, view.near))
        slack = margins.box_slack + 1.001 * max(radius, least)
        corners = np.array(list(itertools.product(*np.transpose([low - slack, high + slack]))))
        pixels, depths = view.project(corners)
        near, far = depths.min(), depths.max()
        first, last = pixels.min(axis=0), pixels.max(axis=0)
        is_before = not view.perspective or near > max(view.near, 1e-6 * far)
        if not is_before:
            first, last = np.zeros(2), np.array(SIZE, float)
        first = np.maximum(first - margins.pixel_margin, 0)
        last = np.minimum(last + margins.pixel_margin, np.array(SIZE) - 1.0)
        in_view = (first <= last).all() and view.near <= far and near <= view.far
        is_before = is_before and slack * self.scale_at(near) < 60
        return in_view, first.astype(int), np.maximum(last, 0).astype(int), near * (1 - 1e-5) * is_before

    def faces_away(self, chunk: int) -> bool:
        """Whether a sphere round its points and a cone round its normals leave none that faces the eye."""
        center, cone = (self.low[chunk] + self.high[chunk]) / 2, self.cones[chunk]
        to_eye = -(self.view.rotation @ center + self.view.translation)
        radius = 0.5 * np.linalg.norm(self.high[chunk] - self.low[chunk])
        if not self.view.perspective:
            to_eye, radius = np.array([0.0, 0, 1]), 0.0
        far, facing = np.linalg.norm(to_eye), self.view.rotation @ cone[:3] @ to_eye
        across, sine = np.sqrt(max(far**2 - facing**2, 0)), np.sqrt(max(1 - cone[3] ** 2, 0))
        is_beside = cone[3] > 0 and facing < (cone[3] - 1e-4) * far
        return bool(is_beside and facing * cone[3] + across * sine < -radius - 1e-4 * far)

    def first_word(self, chunk: int, before: int) -> int:
        in_view = self.reach(chunk)[0]
        away = in_view and self.margins.cull_back and self.faces_away(chunk)
        hidden = in_view and before & 16 != 0
        listed = in_view and not away and not (self.margins.trusts and hidden)
        return 1 * listed | 4 * in_view | 8 * away | 16 * hidden

    def is_hidden(self, chunk: int, depth: np.ndarray, spare: int) -> bool:
        _, first, last, nearest = self.reach(chunk)
        left, top = np.maximum(first - spare, 0) // 16 * 16
        right, bottom = (last + spare) // 16 * 16 + 16
        far = depth[top:bottom, left:right].max()
        behind = np.inf if np.isinf(far) else self.margins.pixels_behind / self.scale_at(far)
        return bool(far + max(self.margins.behind, behind) < nearest)

    def second_word(self, chunk: int, word: int, depth: np.ndarray) -> int:
        may_show = word & 4 != 0 and word & 8 == 0
        shown = may_show and not self.is_hidden(chunk, depth, 0)
        hidden = may_show and not shown and self.is_hidden(chunk, depth, self.margins.spare_pixels)
        return word & ~16 | 2 * shown | 16 * hidden


def read(texels: gl.BufferTexture, numbers: int) -> np.ndarray:
    return np.frombuffer(texels.buffer.read(), np.float32).reshape(-1, numbers).astype(np.float64)


@pytest.mark.parametrize("perspective", [True, False])
def test_chunks_are_told_apart_as_the_plain_version_does(renderer: Renderer, perspective: bool) -> None:
    rng, chunk, count = np.random.default_rng(8), 32, 4096
    seen_words: set[int] = set()
    different = 0
    for number in range(6):
        normals = sphere(rng, count // chunk).repeat(chunk, axis=0) + 0.3 * sphere(rng, count)
        points = 2 * rng.normal(size=(count // chunk, 3)).repeat(chunk, axis=0)
        points += rng.uniform(0.05, 0.4) * rng.normal(size=(count, 3))
        radii = rng.uniform(0.01, 0.05, count)
        cloud = PointCloud.from_arrays(points, normals=normals, radii=radii, origin=np.zeros(3))
        pose = renderer.resident(Pose(0, 0.0, f"twin {number}", cloud))
        pose.cached(chunks.Chunks)._order = chunks.in_file_order(cloud)
        eye, kind = rng.normal(size=3) * 4, "perspective" if perspective else "orthographic"
        camera = Camera(tuple(eye), tuple(rng.normal(size=3)), (0, 1, 0), kind, near=0.6, far=7.0)
        surface = Surface(renderer.gpu, SIZE)
        surface.start(pose, View.of(camera, SIZE, np.zeros(3), cloud.bounds()))
        told = pose.cached(splat_culling.SplatChunks)
        told.measure(Points(pose, True, count))
        epsilon = (1.0, 30.0)[number % 2]
        scale, culls = rng.uniform(0.5, 2), number != 1
        splats = Splats(scale, 0.03, 0.7, culls, mask_limit=1.0, falloff=1.0, enlarge=1.0, epsilon=epsilon)
        is_even = number % 2 == 0
        margins = splat_culling.splat_margins(splats, 0.05, told.boxes.slack, is_even, 5 * number)
        twin = Twin(surface.view, margins, told)
        before = 16 * rng.integers(0, 2, told.boxes.chunks).astype(np.uint32)
        surface.cached(culling.SeenChunks).of(told.boxes).write(before)
        told.test(surface, culling.START, margins)
        first = told.boxes.seen(surface)
        expected = np.array([twin.first_word(place, int(word)) for place, word in enumerate(before)])
        different += np.count_nonzero(first != expected)

        tiles = rng.uniform(0.5, 5, (5, 8)).astype(np.float32)
        tiles[rng.random(tiles.shape) < 0.1] = np.inf
        depth = tiles.repeat(16, axis=0).repeat(16, axis=1)[: SIZE[1], : SIZE[0]]
        surface.depths.buffer.write(np.ascontiguousarray(depth))
        culling.find_farthest(surface)
        told.test(surface, culling.FIND, margins)
        found = told.boxes.seen(surface)
        expected = np.array([twin.second_word(place, int(word), depth) for place, word in enumerate(first)])
        different += np.count_nonzero(found != expected)
        seen_words |= set(found.tolist()) | set(first.tolist())
        surface.release()
    assert different <= 8, "of 1536 words, where float32 rounds to the other side"
    assert {0, 4, 5, 7, 12, 20, 21} <= seen_words
