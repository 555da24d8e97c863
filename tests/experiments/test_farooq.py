"""The page of pyramids: what stands in its cells, what is refused, and what is measured for it."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import pytest
from experiments.farooq_2013 import farooq, pyramids
from experiments.farooq_2013.large_views import measure_large_views, scan_head
from experiments.farooq_2013.playing import measure_playing
from experiments.tables import StoredRun
from tables_of import cells, tables_of

from viewer.bench.report.results import Row
from viewer.bench.run import Bench, BenchSettings
from viewer.bench.scenes import catalog

if TYPE_CHECKING:
    from viewer.drawing.renderer import Renderer

NONE = "\N{EN DASH}"
PARAMS = {"fill": True, **{f"level_{k}": True for k in range(5)}, "primitive": "points", "hide": True}
WHERE = {
    "device": "a card", "driver": "4.6", "timer": "finish", "processors": 4, "version": "0.1.0",
    "date": "2026-01-31", "size": [640, 480], "seed": 0, "repeat": 3,
}  # fmt: skip


def a_row(scene: str, zoom: float, chosen: dict[str, Any], hole: float = 0.5, **changes: Any) -> Row:
    same = ("hole_percent", "through_percent", "depth_median_px", "boundary_p95", "spill_p95", "psnr")
    own = {"hole_scanned_percent": hole, "psnr_scanned": 40 - hole, "wrong_layer_percent": hole}
    return {
        "backend": "pyramidal", "scene": scene, "scene_hash": "0", "n": 9, "noise": 0.0, "zoom": zoom,
        "sweep": "zoom", "params": {**PARAMS, **chosen}, "views": 2, "gpu_ms": {"median": 1.0},
        "errors": {**dict.fromkeys(same, 1.0), **own},
        "times_by_view": {name: [1.0, 3.0] for name in ("gpu_ms", "cpu_ms", "busy_ms")}, **WHERE, **changes,
    }  # fmt: skip


ALONE = {"fill": False, "level_3": False}
DRAWN = [
    a_row("demo-pair", 1.0, ALONE, 30),
    a_row("demo-pair", 1.0, {"level_2": False, "level_3": False, "level_4": False}, 12),
    a_row("demo-pair", 1.0, {}, 8),
    a_row("demo-pair", 1.0, {}, 7, backend="range-mesh", params={}),
    a_row("demo-pair", 4.0, ALONE, 90),
    a_row("armadillo-pair", 4.0, {"hide": False}, 5, sweep="hide"),
    a_row("armadillo-pair", 4.0, {}, 0.25, sweep="hide"),
]
LARGE = [
    {
        "scenario": "extreme close-up", "levels": 5, "primitive": "points", "samples": 27_000_000,
        "measured": 9_000_000, "zoom": 8.0, "ms": 500.0, "unskipped_ms": 2000.0, "covered": 99.6,
        "open_ms": 2500.0, "read_ms": 1500.0, "bytes_per_sample": 10.67, **WHERE,
    }
]  # fmt: skip
PLAYED = [
    {
        "scene": "demo-pair", "poses": 30, "primitive": "points",
        "reading": {"fps": 8.0, "upload_ms": 9.0, "derive_ms": 0.0},
        "playing": {"fps": 12.0, "upload_ms": 4.0, "derive_ms": 0.0}, **WHERE, "size": [960, 640],
    }
]  # fmt: skip


def digest(drawn: list[Row], large: list[Row], playing: list[Row]) -> StoredRun:
    return farooq.EXPERIMENT.digest({"rows": drawn, "large": large, "playing": playing})


def page(runs: list[StoredRun]) -> str:
    return tables_of(farooq.EXPERIMENT, runs)


MADE = digest(DRAWN, LARGE, PLAYED)


def test_holes_stand_by_levels_and_zoom() -> None:
    text = page([MADE])
    holes, psnr, *_ = cells(text, "`demo-pair`", "level 0 alone")
    assert holes[2:] == [NONE, "30.0", NONE, "90.0", NONE]
    assert psnr[3] == "10.0"
    assert cells(text, "", "2 levels")[0][3] == "12.0"
    assert cells(text, "", "5 levels")[0][3] == "8.00"
    assert cells(text, "", "`range-mesh`")[0][3] == "7.00"


def test_hidden_points_say_how_many_times_less_shows() -> None:
    (line,) = cells(page([MADE]), "`armadillo-pair`", "5 levels")
    assert line[2:] == ["5.00", "0.250", "20.0", "1.00", "1.00"]


def test_large_views_stand_under_the_lines_of_the_thesis() -> None:
    text = page([MADE])
    assert [line[6:8] for line in cells(text, "full view, all hole filling")] == [["122", "4.50"]]
    (line,) = cells(text, "", "", "a card", "points")
    assert line[4:] == ["8.00", "100 %", "54.0", "2.00", "500", "2000", "4.00"]
    (line,) = cells(text, "Scan4D, its pyramid")
    assert line[1:3] == ["a card", "10.7"]
    assert line[5:] == ["1.50", "2.50"]
    assert [line[2] for line in cells(text, "triangle strip")] == ["23.0"]


def test_playing_is_told_while_it_is_read_and_after() -> None:
    (line,) = cells(page([MADE]), "a card", "points", "30")
    assert line[3:] == ["960x640", "8.00", "12.0", "4.00", "0"]


def test_pages_are_of_several_machines_too() -> None:
    other = {**MADE, "device": "another card"}
    text = page([MADE, other])
    assert len(cells(text, "another card", "points", "30")) == 1
    assert "**2013**: ATI Radeon HD 5870" in text
    assert "**another card**" in text
    assert page([])  # the thesis' figures alone


def test_levels_are_counted_as_they_are_shown() -> None:
    assert [farooq.levels_of(row) for row in DRAWN[:3]] == [1, 2, 5]


def test_the_figures_of_the_thesis_agree_with_each_other() -> None:
    paper = pyramids.PAPER
    width, height = paper["view_size"]
    samples = paper["views"] * width * height
    for line in paper["scenarios"]:
        assert line["samples_per_second"] == line["frames_per_second"] * samples


@pytest.mark.slow
def test_pods_see_a_head_that_fills_their_views() -> None:
    views = scan_head((60, 90))
    assert [view.depth.shape for view in views] == [(90, 60)] * 2
    assert all(view.valid().mean() > 0.5 for view in views)


# --- what is measured ----------------------------------------------------------------------


def test_every_number_of_levels_is_drawn_at_every_zoom() -> None:
    groups = farooq.groups()
    by_zoom = [group for group in groups if "hide" not in {each.sweep for each in group.contenders}]
    for scene in {group.scene for group in by_zoom}:
        assert [group.zoom for group in by_zoom if group.scene == scene] == list(farooq.ZOOMS)
    for group in groups:
        assert group.scene in catalog.scene_names(None)
        assert (group.noise == 0) == group.scene.endswith("-pair")
    params = [asdict(each.params) for each in by_zoom[0].contenders if each.params]
    drawn = [(each["primitive"], farooq.levels_of({"params": each})) for each in params]
    assert drawn == [*(("points", count) for count in range(1, 6)), ("polygons", 5)]
    assert by_zoom[0].contenders[-1].backend == "range-mesh"


@pytest.mark.slow
def test_more_levels_leave_fewer_holes_and_polygons_are_as_good_as_the_mesh(renderer: Renderer) -> None:
    bench = Bench(renderer, BenchSettings(size=(160, 120), views=2, repeat=1, frames=0))
    (like, *_) = farooq.groups()
    rows = bench.measure(replace(like, scene="torus-pair", zoom=4.0))
    assert not bench.notes
    found = {
        row.get("primitive", "mesh") + str(row.get("levels", "")): row["errors"]
        for row in digest(rows, [], [])["rows"]
    }
    holes = [found[f"points{count}"]["hole_scanned_percent"] for count in range(1, 6)]
    assert holes == sorted(holes, reverse=True)
    assert holes[0] > 80 > 10 > holes[-1]
    assert found["points5"]["psnr_scanned"] > found["points1"]["psnr_scanned"] + 3
    assert found["polygons5"]["psnr_scanned"] > min(found["mesh"]["psnr_scanned"], 50) - 1


@pytest.mark.slow
def test_large_views_are_opened_and_drawn_with_and_without_skipping(renderer: Renderer) -> None:
    bench = Bench(renderer, BenchSettings(repeat=1))
    rows = list(measure_large_views(bench, view_size=(60, 90)))
    assert [row["scenario"] for row in rows[::2]] == [
        line["scenario"] for line in pyramids.PAPER["scenarios"]
    ]
    assert {row["samples"] for row in rows} == {2 * 60 * 90}
    for row in rows:
        assert min(row["ms"], row["unskipped_ms"], row["covered"]) > 0
        assert row["open_ms"] > row["read_ms"] > 0
        assert row["bytes_per_sample"] > 8
    covered = [row["covered"] for row in rows[1::2]]  # of polygons
    assert covered[0] == pytest.approx(covered[-1], rel=0.02)
    assert (
        covered[-1] < covered[1]
    )  # medium; the extreme one is by pixels a sample, here fewer than the full one's


@pytest.mark.slow
def test_sequences_are_played(renderer: Renderer) -> None:
    rows = list(measure_playing(Bench(renderer, BenchSettings()), poses=2))
    assert [row["primitive"] for row in rows] == list(pyramids.PRIMITIVES)
    for row in rows:
        assert row["reading"]["fps"] > 0
        assert row["playing"]["fps"] > 0
    assert digest(DRAWN, LARGE, rows)["playing"][0]["poses"] == 2
