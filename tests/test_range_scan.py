"""A range scan from its files to pictures and to other formats."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from range_scenes import looking_at, sphere_view

import viewer
from viewer import cli
from viewer.camera import Camera
from viewer.commands import render as render_command
from viewer.commands._scans import read_poses
from viewer.drawing.frame import render_frame
from viewer.drawing.plan import Effort, Ready, Waiting, make_plan
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.errors import InputError
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan import formats
from viewer.scan.open import open_scan
from viewer.scan.pose import Pose
from viewer.scan.range_view import merge
from viewer.scan.timeline import Timeline

EYES = {"left": (-1.0, 0.0, 4.0), "right": (1.5, 0.5, 4.0)}


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three frames of a unit sphere seen by two pods."""
    folder = tmp_path_factory.mktemp("range")
    for index in range(3):
        views = tuple(
            sphere_view((x, y, z + 0.1 * index), size=(120, 100), name=n) for n, (x, y, z) in EYES.items()
        )
        formats.write(folder / f"f{index}.exr", merge(views), views)
    return folder


@pytest.mark.parametrize("suffix", formats.writable_suffixes())
def test_converts_to_points(suffix: str, scan: Path, tmp_path: Path) -> None:
    assert cli.main(["convert", str(scan), str(tmp_path / f"p%d{suffix}")]) == 0
    with open_scan(scan) as before, open_scan(tmp_path) as after:
        for pose, other in zip(before, after, strict=True):
            assert np.array_equal(other.cloud.world(), pose.cloud.world())
            assert np.array_equal(other.cloud.colors, pose.cloud.colors)
            assert np.array_equal(other.cloud.scalars["view"], pose.cloud.scalars["view"])


def test_converts_to_itself_and_points_do_not(
    scan: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["convert", str(scan), str(tmp_path / "f%d.exr"), "--fps", "25"]) == 0
    for index in range(3):
        name = f"f{index}.exr"
        assert (tmp_path / name).read_bytes() == (scan / name).read_bytes()
    assert cli.main(["convert", "demo", "--pose", "1", str(tmp_path / "demo.exr")]) == 2
    assert "EXR stores range views, but this scan has none" in capsys.readouterr().err
    assert not (tmp_path / "demo.exr").exists()


def test_info_names_the_pods(scan: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["info", str(scan), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["views"] == [{"name": name, "size": [120, 100]} for name in EYES]
    assert facts["unit"] == "mm"
    assert cli.main(["info", str(scan)]) == 0
    assert "right, 120 x 100 pixels" in capsys.readouterr().out


def test_is_drawn_where_it_was_seen(scan: Path) -> None:
    """From the place of a pod: each pixel shows the very depth that the pod measured there."""
    with open_scan(scan) as timeline:
        pose = timeline.pose(0)
    view, size = pose.views[0], 200
    camera = Camera(eye=tuple(view.eye), target=(0, 0, 0), fov_y=2 * np.degrees(np.arctan(0.5)))
    assert np.allclose(looking_at(camera.eye, camera.target), view.world_to_camera)
    surface = viewer.render(pose, camera, (size, size), backend="points", point_size=1)
    row, column = np.nonzero(surface.id < view.depth.size)  # ids of the first view are its pixels
    assert len(row) > 2000
    seen = surface.id[row, column]
    assert surface.depth[row, column] == pytest.approx(view.depth.ravel()[seen], rel=1e-5)
    u, v = seen % view.depth.shape[1] + 0.5, seen // view.depth.shape[1] + 0.5
    assert np.abs(size / 2 + size * (u - view.cx) / view.fx - (column + 0.5)).max() <= 0.51
    assert np.abs(size / 2 + size * (v - view.cy) / view.fy - (row + 0.5)).max() <= 0.51


@pytest.mark.parametrize("backend", ["points", "surfels", "voxels"])
def test_points_are_merged_when_a_backend_draws_them_and_the_picture_is_theirs(
    scan: Path, backend: str, renderer: Renderer
) -> None:
    with open_scan(scan) as timeline:
        pose = timeline.pose(1)
    camera, look = Camera.orbit(pose.bounds, 20, 10), Look(color_by="height", up="+x")
    assert not pose.is_merged
    views = Pose.of(1, pose.time, pose.label, pose.views)
    normals = np.concatenate([view.normals() for view in pose.views])
    points = Pose(1, pose.time, pose.label, merge(pose.views))
    own = Renderer(renderer.gpu)
    if backend != "points":
        own.resident(points).add_estimates({"normals": normals})
    pictures = []
    for one in (views, points):
        surface = Surface(own.gpu, (90, 70))
        while render_frame(own, Request(one, camera, backend, look=look), surface):
            pass
        pictures.append((surface.image(), surface.depth, surface.id))
    for drawn, expected in zip(*pictures, strict=True):
        np.testing.assert_array_equal(drawn, expected)
    assert views.is_merged
    own.release()


def test_a_window_has_points_merged_by_a_worker(scan: Path, renderer: Renderer) -> None:
    with open_scan(scan) as timeline:
        pose = timeline.pose(0)
    own, request = Renderer(renderer.gpu), Request(pose, Camera.orbit(pose.bounds), "points")
    assert isinstance(make_plan(own, request, (64, 48), Effort.NONE), Waiting)
    while not isinstance(make_plan(own, request, (64, 48), Effort.BEGIN, upload_ms=1000), Ready):
        assert own.work.preparing is None or own.work.preparing.name == "Merging range views"
    assert pose.is_merged
    assert isinstance(make_plan(own, request, (64, 48), Effort.NONE), Ready)
    assert own.resident(pose).stored is pose.cloud
    assert own.bytes_of(pose) == (12 + 4) * len(pose.cloud), "positions and colours"
    own.release()


def test_more_points_than_a_renderer_takes_are_not_even_merged(
    scan: Path, renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_scan(scan) as timeline:
        pose = timeline.pose(2)
    monkeypatch.setattr(renderer.gpu, "max_points", 100)
    with pytest.raises(InputError, match="points in one pose, but Discs can draw only 100 on this driver"):
        render_frame(
            renderer, Request(pose, Camera.orbit(pose.bounds), "surfels"), Surface(renderer.gpu, (64, 48))
        )
    assert not pose.is_merged


@pytest.mark.parametrize("out", ["p%d.png", "p%d.npz", "p.mp4"])
def test_a_command_that_draws_range_views_merges_nothing(
    scan: Path, tmp_path: Path, out: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    poses = []

    def noted(timeline: Timeline, indices: list[int], **options: bool) -> Iterator[Pose]:
        for pose in read_poses(timeline, indices, **options):
            poses.append(pose)
            yield pose

    monkeypatch.setattr(render_command, "read_poses", noted)
    arguments = ["--all", "--fps", "25", "--backend", "pyramidal", "--size", "90x70"]
    assert (
        cli.main(["render", str(scan), "-o", str(tmp_path / out), *arguments, "--look", "color_by=view"]) == 0
    )
    assert len(poses) == 3
    assert not any(pose.is_merged for pose in poses)
    assert any(tmp_path.iterdir())
