"""Measuring: two runs find the same errors, all that is needed to repeat a row stands in it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scenes import DRAWS_POINTS

from viewer.backends import FrameView, backend, points
from viewer.bench.plan import Contender, Group, plan
from viewer.bench.report.results import Row
from viewer.bench.run import LOOK, Bench, BenchSettings
from viewer.bench.scenes.samples import on_torus
from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.drawing.timing import draw
from viewer.errors import InputError
from viewer.gpu.pose import GpuPose
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

SETTINGS = BenchSettings(size=(120, 80), views=3, repeat=1, frames=2)
DEFAULTS = tuple(plan(["torus"], DRAWS_POINTS, counts=(), noises=(), swept_scenes=0)[0].contenders)
TORUS = Group("torus", DEFAULTS, count=20_000)
SPREAD = {"median", "p5", "p95"}


@pytest.fixture(scope="module", params=["few", pytest.param("all", marks=pytest.mark.slow)])
def group(request: pytest.FixtureRequest) -> Group:
    """The torus with a few contenders, or with all that draw points."""
    return FEW if request.param == "few" else TORUS


@pytest.fixture(scope="module")
def measured(renderer: Renderer, group: Group) -> tuple[list[Row], int, int]:
    """Rows of a run, how often it ticked, and how often it said it would."""
    bench, ticks = Bench(renderer, SETTINGS), []
    bench.tick = lambda: ticks.append(None)
    return bench.measure(group), len(ticks), bench.steps(group)


@pytest.fixture(scope="module")
def rows(measured: tuple[list[Row], int, int]) -> list[Row]:
    return measured[0]


def only(*names: str) -> tuple[Contender, ...]:
    """The contenders with these names, of the defaults."""
    return tuple(one for one in DEFAULTS if one.backend in names)


FEW = replace(TORUS, contenders=only("gl-points", "points", "surfels", "mesh"))


def by_backend(rows: list[Row]) -> dict[str, Row]:
    return {row["backend"]: row for row in rows}


@pytest.mark.slow
def test_a_row_says_all_that_is_needed_to_repeat_it(
    rows: list[Row], group: Group, renderer: Renderer
) -> None:
    assert [row["backend"] for row in rows] == [c.backend for c in group.contenders]
    for row in rows:
        assert {
            "backend", "scene", "scene_hash", "n", "noise", "params", "size", "seed", "views", "gpu_ms",
            "cpu_ms", "busy_ms", "same_ms", "first_ms", "derive_ms", "upload_ms", "timer", "bytes_gpu",
            "peak_rss", "errors", "device", "driver", "version",
        } <= row.keys()  # fmt: skip
        assert (row["n"], row["size"], row["views"]) == (20_000, [120, 80], 3)
        assert row["timer"] == renderer.gpu.timers.kind
        for name in ("gpu_ms", "cpu_ms", "same_ms", "first_ms", "derive_ms", "upload_ms"):
            assert row[name].keys() == SPREAD
        assert row["gpu_ms"]["median"] > 0
        assert row["cpu_ms"]["p5"] <= row["cpu_ms"]["median"] <= row["cpu_ms"]["p95"]
        assert row["upload_ms"]["median"] > 0, "every view prepares a pose of its own"
        assert all(len(values) == 3 for values in row["errors_by_view"].values())
        assert row["errors_by_view"].keys() <= row["errors"].keys()
        assert row["bytes_gpu"] > 20_000 * 12
        json.dumps(row)


class Watched(points.PointSquares):
    """The points, and the view of each picture."""

    def __init__(self) -> None:
        super().__init__("watched")
        self.views: list[object] = []

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        self.views.append(frame.view.key)
        return super().draw(pose, frame, surface)


def test_the_first_picture_new_views_and_the_same_view_are_timed(renderer: Renderer) -> None:
    watched = Watched()
    contender = Contender("watched", None, drawn=lambda cloud, _: (cloud, watched))
    settings = replace(SETTINGS, views=1, repeat=3, frames=0)
    (row,) = Bench(renderer, settings).measure(Group("torus", (contender,), count=2_000, judged=False))
    first, *new = watched.views[:-3]
    assert set(watched.views[-3:]) == {first}, "the same view again, as often as `repeat` says"
    assert new[-1] == first, "the judged picture is that of the view"
    assert len(set(new)) == len(new) >= 6, "with timers and without, each new view differs from all others"
    for name in ("first_ms", "gpu_ms", "cpu_ms", "same_ms"):
        assert row[name]["median"] > 0


@pytest.mark.slow
def test_the_time_on_the_gpu_is_that_of_the_passes(rows: list[Row]) -> None:
    for row in rows:
        low, high = (sum(spread[end] for spread in row["passes"].values()) for end in ("p5", "p95"))
        assert 0.9 * low <= row["gpu_ms"]["median"] <= 1.1 * high


@pytest.mark.slow
def test_two_runs_give_identical_errors(rows: list[Row], group: Group, renderer: Renderer) -> None:
    again = Bench(renderer, SETTINGS).measure(group)
    for first, second in zip(rows, again, strict=True):
        np.testing.assert_equal(second["errors"], first["errors"])
        np.testing.assert_equal(second["errors_by_view"], first["errors_by_view"])
        assert second["scene_hash"] == first["scene_hash"]


@pytest.mark.slow
def test_another_seed_looks_from_elsewhere(rows: list[Row], renderer: Renderer) -> None:
    other = Bench(renderer, replace(SETTINGS, seed=1)).measure(replace(TORUS, contenders=DEFAULTS[:1]))
    assert other[0]["errors"]["hole_percent"] != rows[0]["errors"]["hole_percent"]


def test_the_true_mesh_is_the_ceiling_and_gl_points_the_floor(rows: list[Row]) -> None:
    errors = {name: row["errors"] for name, row in by_backend(rows).items()}
    assert errors["mesh"]["hole_percent"] < 0.1
    assert errors["mesh"]["depth_median_px"] < 0.05
    assert errors["mesh"]["wrong_layer_percent"] == 0
    assert errors["mesh"]["normal_mean"] < 0.1
    assert errors["mesh"]["psnr"] > 45
    assert abs(errors["mesh"]["flicker_orbit_color"]) < 1e-3
    for name in errors.keys() & set(DRAWS_POINTS):
        assert errors["gl-points"]["psnr"] < errors[name]["psnr"] + 0.1 < errors["mesh"]["psnr"]


@pytest.mark.slow
def test_a_sequence_flickers_from_pose_to_pose(renderer: Renderer, data_dir: Path) -> None:
    group = Group("horse-gallop", only("mesh", "gl-points"))
    rows = Bench(renderer, replace(SETTINGS, data=data_dir)).measure(group)
    errors = {name: row["errors"] for name, row in by_backend(rows).items()}
    assert abs(errors["mesh"]["flicker_pose_color"]) < 2e-3
    assert errors["gl-points"]["flicker_pose_color"] > 0.01


@pytest.mark.slow
def test_stopping_keeps_the_views_that_all_have_seen(renderer: Renderer) -> None:
    bench, ticks = Bench(renderer, SETTINGS), iter(range(len(FEW.contenders) + 2))

    def tick() -> None:
        if next(ticks, None) is None:
            raise KeyboardInterrupt

    bench.tick = tick
    stopped = bench.measure(FEW)
    assert bench.stopped
    assert [row["views"] for row in stopped] == [1] * len(FEW.contenders)
    assert all(len(row["errors_by_view"]["hole_percent"]) == 1 for row in stopped)


def test_ctrl_c_ends_rows_that_are_found_one_by_one(renderer: Renderer) -> None:
    def rows() -> Iterator[Row]:
        yield {"row": 0}
        raise KeyboardInterrupt

    bench, ticks = Bench(renderer, SETTINGS), []
    bench.tick = lambda: ticks.append(None)
    assert list(bench.until_stopped(rows())) == [{"row": 0}]
    assert bench.stopped
    assert len(ticks) == 1
    assert not list(bench.until_stopped(rows())), "nor does anything else begin"


@pytest.mark.slow
def test_a_backend_that_cannot_draw_a_scene_is_left_out_and_said(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuses(*_: object) -> None:
        raise InputError("needs range views")

    monkeypatch.setattr(backend("points"), "needs", refuses)
    bench = Bench(renderer, SETTINGS)
    rows = bench.measure(replace(TORUS, contenders=only("gl-points", "points", "surfels")))
    assert "points" not in by_backend(rows)
    assert "gl-points" in by_backend(rows)
    assert any("points" in note and "needs range views" in note for note in bench.notes)


@pytest.mark.slow
def test_a_zoom_of_range_views_stands_beside_their_mesh(renderer: Renderer) -> None:
    contenders = (*only("gl-points", "mesh", "pyramidal"), Contender("range-mesh"))
    bench = Bench(renderer, SETTINGS)
    group = Group("torus-pair", contenders, noise=0.0, zoom=4.0, sweep="zoom")
    found = by_backend(bench.measure(group))
    assert not bench.notes
    assert {(row["zoom"], row["sweep"], row["frames"]) for row in found.values()} == {(4.0, "zoom", 2)}
    assert not any("flicker" in name for row in found.values() for name in row["errors"])
    errors = {name: row["errors"] for name, row in found.items()}
    assert errors["gl-points"]["hole_scanned_percent"] > 80  # a point for sixteen pixels
    assert errors["range-mesh"]["hole_scanned_percent"] < 0.01
    assert errors["range-mesh"]["psnr_scanned"] > errors["gl-points"]["psnr_scanned"] + 20
    assert errors["mesh"]["psnr"] > errors["range-mesh"]["psnr"]


@pytest.mark.slow
def test_points_have_no_range_mesh(renderer: Renderer) -> None:
    bench, ticks = Bench(renderer, SETTINGS), []
    bench.tick = lambda: ticks.append(None)
    both = replace(TORUS, contenders=(Contender("gl-points"), Contender("range-mesh")))
    rows = bench.measure(both)
    assert [row["backend"] for row in rows] == ["gl-points"]
    assert len(ticks) == bench.steps(both), "what is left out is no work that is left"
    assert any("leaves out range-mesh" in note for note in bench.notes)


def test_measuring_ticks_as_often_as_it_said(measured: tuple[list[Row], int, int]) -> None:
    _, ticks, said = measured
    assert ticks == said


@pytest.mark.slow
def test_what_is_not_judged_is_timed_alone(renderer: Renderer, tmp_path: Path) -> None:
    ticks: list[None] = []
    bench, timed = Bench(renderer, SETTINGS, tmp_path), replace(FEW, judged=False)
    bench.tick = lambda: ticks.append(None)
    rows = bench.measure(timed)
    assert len(ticks) == bench.steps(timed) == len(FEW.contenders) * SETTINGS.views
    assert all(row["errors"] == row["errors_by_view"] == {} for row in rows)
    assert all(len(times) == SETTINGS.views for row in rows for times in row["times_by_view"].values())
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_pictures_compare_with_the_truth(renderer: Renderer, tmp_path: Path) -> None:
    from PIL import Image

    Bench(renderer, SETTINGS, tmp_path).measure(replace(TORUS, contenders=DEFAULTS[:2]))
    pictures = sorted((tmp_path / "pictures").iterdir())
    assert [path.name for path in pictures] == ["torus--gl-points.png", "torus--mesh.png"]
    for path in pictures:
        with Image.open(path) as picture:
            assert picture.width > 5 * 100


def test_what_a_backend_cannot_draw_is_its_limit(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuses(*_: object) -> None:
        raise InputError("needs range views")

    monkeypatch.setattr(backend("points"), "needs", refuses)
    lines = list(Bench(renderer, SETTINGS).numerics(["points"]))
    assert len(lines) > 50
    assert all(line["limit"] == "needs range views" and not line["held"] for line in lines)


def test_bytes_are_those_on_the_gpu(renderer: Renderer) -> None:
    """Estimated normals count once: 12 bytes for the position and 12 for the normal of each point."""
    bare = replace(torus_cloud(), normals=None, radii=None, colors=None)
    pose, surface = Pose(0, 0.0, "bare", bare), Surface(renderer.gpu, SETTINGS.size)
    draw(renderer, Request(pose, Camera((2.9, 3.4, 4.0)), "points", look=LOOK), surface)
    assert renderer.bytes_of(pose) == 24 * len(bare)


def torus_cloud() -> PointCloud:
    return PointCloud.from_arrays(**on_torus(2000))  # type: ignore[arg-type]
