"""The page of splats found in each picture: what stands in its cells, what is refused, what is measured."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from experiments.preiner_2012 import fits, preiner, searches
from experiments.tables import StoredRun
from scenes import sphere, sphere_mesh
from tables_of import cells, tables_of

from viewer.bench.report.results import Row
from viewer.bench.run import Bench, BenchSettings
from viewer.bench.scenes import catalog
from viewer.camera import Camera
from viewer.mesh.reference import trace
from viewer.scan.pose import Pose

if TYPE_CHECKING:
    from viewer.drawing.renderer import Renderer

WHERE = {
    "device": "a card", "driver": "4.6", "timer": "finish", "processors": 4, "version": "0.1.0",
    "date": "2026-01-31", "size": [1760, 900], "seed": 0, "repeat": 3,
}  # fmt: skip
PARAMS = {"k": 10, "hidden_neighbors": True, "adaptive": False, "cull": True, "refine": True}


def a_picture(scene: str, psnr: float, backend: str = "auto_splats", sweep: str = "", **params: Any) -> Row:
    same = (
        "hole_percent",
        "through_percent",
        "wrong_layer_percent",
        "spill_p95",
        "normal_median",
        "normal_p95",
    )
    return {
        "backend": backend, "scene": scene, "scene_hash": "0", "n": 5000, "noise": 0.0, "zoom": None,
        "sweep": sweep, "params": {**PARAMS, **params}, "views": 2, "gpu_ms": {"median": 1.0},
        "errors": {**dict.fromkeys(same, 1.0), "psnr": psnr, "flicker_orbit_normal": 0.5},
        "times_by_view": {name: [10.0, 30.0] for name in ("gpu_ms", "cpu_ms", "busy_ms")}, **WHERE,
    }  # fmt: skip


def a_search(k: int, cull: bool, trees: dict[str, float]) -> Row:
    first = {"projection": 10.0, "search": 50.0 if cull else 100.0, "splats": 30.0, "shading": 7.0}
    return {
        "scene": "bunny", "paper": "Bunny", "n": 40_000, "visible": 30_000, "participants": 36_000,
        "params": {"k": k, "cull": cull}, "trees": trees, "first": first, "later": {**first, "search": 25.0},
        "still": {**dict.fromkeys(first, 0.0), "shading": 7.0}, "rounds": [200, 50, 1], **WHERE,
    }  # fmt: skip


def a_fit(scene: str, noise: float, median: float, **params: Any) -> Row:
    angles = {"median": median, "p95": 10 * median}
    return {
        "scene": scene, "noise": noise, "params": {**PARAMS, **params}, "views": 4, "points": 100,
        "band_points": 9,
        "found_inside": angles, "found_band": angles, "open3d_inside": angles, "open3d_band": angles,
        "turned": 0.25, "grown": 0.01, **WHERE,
    }  # fmt: skip


DRAWN = [
    a_picture("bunny", 31),
    a_picture("bunny", 30, sweep="hidden_neighbors", hidden_neighbors=False),
    a_picture("bunny", 32, "precomputed"),
    a_picture("horses", 25, sweep="cull, refine", cull=False, refine=False),
    a_picture("horses", 26, sweep="cull, refine"),
]
TREES = {"all": 1200.0, "visible": 800.0, "all_build": 100.0, "visible_build": 90.0}
SEARCHED = [a_search(10, False, TREES), a_search(10, True, TREES), a_search(20, True, {})]
FITTED = [
    a_fit("bunny", 0.0, 1.5),
    a_fit("bunny", 0.0, 2.5, hidden_neighbors=False),
    a_fit("bunny", 0.5, 9.0),
]
ITERATED = [{"scene": "bunny", "n": 40_000, "left": [30_000, 600, 30, 3], **WHERE}]
MADE = preiner.EXPERIMENT.digest(
    {"rows": DRAWN, "searches": SEARCHED, "iterations": ITERATED, "fits": FITTED}
)


def page(runs: list[StoredRun]) -> str:
    return tables_of(preiner.EXPERIMENT, runs)


def test_searches_stand_under_those_of_the_paper() -> None:
    text = page([MADE])
    assert [line[7:10] for line in cells(text, "Bunny", "2012")] == [["9.00", "1.47", "1.56"]]
    (line, culled) = (line for line in cells(text, "`bunny`", "a card") if len(line) == 11)
    assert line[4:7] == ["no", "1200", "800"]
    assert line[7:] == ["100", "9.00", "12.0", "8.00"]
    assert culled[4] == "yes"


def test_passes_add_up() -> None:
    lines = [
        line
        for line in cells(page([MADE]), "`bunny`, 40\N{NARROW NO-BREAK SPACE}000", "a card")
        if line[2].isdigit()
    ]
    assert [line[2] for line in lines] == ["10", "20"]
    for line in lines:
        assert sum(map(float, line[3:-1])) == pytest.approx(float(line[-1]), rel=0.02)


def test_lists_before_a_pass_are_of_its_stage() -> None:
    names = ["depth", "id", "compact", "nearest", "count", "arrange", "search", "count", "show", "shade"]
    taken = searches.by_stage([(name, 2.0**place) for place, name in enumerate(names)])
    assert taken == {"projection": 3.0, "search": 124.0, "splats": 384.0, "shading": 512.0}


def test_rounds_are_shares_of_the_first() -> None:
    text, title = page([MADE]), "`bunny`, 40\N{NARROW NO-BREAK SPACE}000"
    rounds, iterations = (next(line for line in cells(text, title) if len(line) == count) for count in (4, 5))
    assert rounds[1:] == ["100", "25.0", "0.500"]
    assert iterations[1:] == ["100", "2.00", "0.100", "0.0100"]


def test_fits_with_and_without_hidden_neighbours() -> None:
    with_, without = (cells(page([MADE]), "`bunny`", word)[0] for word in ("yes", "no"))
    assert (with_[3], without[3]) == ("1.50", "2.50")
    assert with_[-2:] == ["0.250", "1.00"]
    assert [line[2:4] for line in cells(page([MADE]), "`bunny`", "0.5")] == [["10", "9.00"]]


def test_pictures_stand_beside_those_of_all_points() -> None:
    text = page([MADE])
    assert [line[7] for line in cells(text, "", "", "planes of all points")] == ["32.0"]
    assert [line[-1] for line in cells(text, "`horses`", "no", "no")] == ["5.00"]  # of four processors
    timed = page([{**MADE, "timer": "query"}])
    assert [line[-1] for line in cells(timed, "`horses`", "no", "no")] == ["20.0"]
    assert [line[7] for line in cells(text, "`horses`", "yes", "yes")] == ["26.0"]


def test_pages_are_of_several_machines() -> None:
    other = {**MADE, "device": "another card"}
    text = page([MADE, other])
    assert len([line for line in cells(text, "`bunny`", "another card") if len(line) == 11]) == 2
    assert "**2012**: GeForce GTX 580" in text
    assert "**another card**" in text
    assert page([])  # the text and the paper's machine


def test_the_figures_of_the_paper_agree_with_each_other() -> None:
    for line in preiner.PAPER["scenes"]:
        if line["tree_ms"]:
            overall = line["tree_ms"] / line["search_ms"]
            assert line["overall"] == pytest.approx(overall, abs=0.01)
            assert line["per_point"] == pytest.approx(overall * line["pixels"] / line["points"], abs=0.01)


# --- what is measured ----------------------------------------------------------------------


def test_every_scene_of_the_suite_is_known() -> None:
    known = catalog.scene_names(None)
    named = {
        *(group.scene for group in preiner.groups()),
        *fits.SCENES,
        *(each.scene for each in searches.SCENES),
    }
    assert named <= set(known)
    papers = {line["name"] for line in preiner.PAPER["scenes"]}
    assert {each.paper for each in searches.SCENES} - {""} == papers


def test_points_near_the_outline_of_a_sphere_are_at_its_silhouette() -> None:
    mesh, cloud = sphere_mesh(), sphere(3000)
    camera, size = Camera((0.0, 0.0, 4.0)), (200, 200)
    reference = trace(mesh, camera, size)
    pixels, depth = reference.view.project(cloud.positions.astype(np.float64))
    rows = np.flatnonzero(depth < 4 - 0.25)  # what faces the camera; the outline is there
    from_middle = np.linalg.norm(pixels[rows] - 100, axis=1)
    outline = np.sqrt(reference.covered.sum() / np.pi)
    at = fits.at_silhouettes(reference, cloud, rows, 0.1)
    assert at[from_middle > outline - 2].all()
    assert not at[from_middle < outline - 5].any()


def test_noise_moves_points_along_their_normals() -> None:
    cloud = sphere(3000)
    moved = fits.noisy(cloud, 0.5, 0)
    off = np.linalg.norm(moved.positions, axis=1) - 1
    spacing = np.sqrt(4 * np.pi / 3000)
    assert off.std() == pytest.approx(0.5 * spacing, rel=0.15)
    assert fits.noisy(cloud, 0.0, 0) is cloud


def test_fits_of_a_sphere_are_nearly_right(renderer: Renderer) -> None:
    found = fits.fit_errors(
        sphere(4000),
        sphere_mesh(),
        BenchSettings(size=(320, 240), views=2),
        {"k": 10, "hidden_neighbors": True, "adaptive": False},
    )
    assert found["found_inside"]["median"] < 1
    assert found["found_inside"]["p95"] < 3
    assert found["open3d_inside"]["median"] == pytest.approx(found["found_inside"]["median"], rel=0.1)
    assert found["points"] > found["band_points"] > 0
    assert found["turned"] < 0.5


@pytest.mark.slow
def test_searches_are_timed_beside_trees(renderer: Renderer) -> None:
    bench = Bench(renderer, BenchSettings(size=(320, 240), repeat=1))
    pose, camera = Pose(0, 0.0, "sphere", fits.bare(sphere(4000))), Camera((0.0, 0.0, 4.0))
    rows = list(searches.search_rows(bench, pose, camera, searches.Searched("sphere", 1.0)))
    assert [row["params"]["k"] for row in rows] == [10, 10, *searches.KS[1:]]
    for row in rows[:2]:
        assert row["trees"]["visible"] > 0
        assert 4000 > row["rounds"][0] > 1000
        assert row["rounds"] == sorted(row["rounds"], reverse=True)
        assert row["first"]["search"] > 2 * row["still"]["search"]
    assert not rows[2]["trees"]


def test_precomputed_planes_are_those_of_the_nearest_points() -> None:
    cloud, camera = sphere(4000, center=(3, 0, 0)), Camera((3.0, 0.0, 5.0), (3.0, 0.0, 0.0))
    found = preiner.with_planes(cloud, camera, 10)
    towards = np.sign(np.einsum("ij,ij->i", cloud.normals, np.array([3.0, 0, 5]) - cloud.world()))
    cosine = np.einsum("ij,ij->i", found.normals, cloud.normals) * towards
    assert np.quantile(cosine, 0.02) > np.cos(np.radians(2))
    # k of n points are within the radius on a sphere: pi r^2 = 4 pi k / n, and splats are 2 r / sqrt(k).
    assert np.median(found.radii) == pytest.approx(2 * np.sqrt(4 / 4000), rel=0.1)
    few = sphere(3)
    assert np.isfinite(preiner.with_planes(few, camera, 10).normals).all()
