"""The page of Table II: what stands in its cells, and what is refused."""

from __future__ import annotations

from typing import Any

from experiments.slomp_2014 import feeds
from experiments.tables import StoredRun
from tables_of import tables_of

from viewer.bench.report.results import Row


def a_row(feed: str, gpu: list[float], busy: list[float], **changes: Any) -> Row:
    spread = {"median": 1.0, "p5": 1.0, "p95": 1.0}
    return {
        "backend": "surfels", "scene": "crane", "scene_hash": "0", "n": 88_315, "noise": 0.0,
        "sweep": "instancing", "params": {"instancing": feed, "enlarge": 2.0, "cull_back": True},
        "size": [1920, 1280], "seed": 0, "views": len(gpu), "repeat": 3,
        "gpu_ms": spread, "errors": {}, "device": "a card", "driver": "4.6",
        "timer": "finish", "processors": 4, "version": "0.1.0", "date": "2026-01-31",
        "covered_by_view": [25.04, 84.6][: len(gpu)],
        "times_by_view": {"gpu_ms": gpu, "cpu_ms": gpu, "busy_ms": busy}, **changes,
    }  # fmt: skip


ROWS = [
    a_row("", [1.0, 1.0], [2.0, 2.0], backend="gl-points", params={}),
    a_row("gs", [10.0, 30.0], [40.0, 80.0]),
    a_row("vbo", [40.0, 60.0], [60.0, 120.0]),
]


def digest(rows: list[Row]) -> StoredRun:
    return feeds.EXPERIMENT.digest({"rows": rows})


def page(runs: list[StoredRun]) -> str:
    return tables_of(feeds.EXPERIMENT, runs)


def cells(text: str, machine: str) -> list[list[str]]:
    """The cells of the lines of a machine, beginning with it: of the times, then of the ratios."""
    lines = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if "|" in line]
    return [line[3:] for line in lines if line[3] == machine]


def test_times_are_means_and_ratios_medians_over_the_views() -> None:
    text = page([digest(ROWS)])
    assert "| scan | points | covered | machine | `gs` | `ubo` | `tbo` | `vbo` | `gl-points` |" in text
    times, ratios = cells(text, "a card")
    assert times == ["a card", "20.0", "", "", "50.0", "1.00"]
    assert ratios == ["a card", "1.00", "", "", "3.00", "0.07"]  # of 4 and 2; of 0.1 and 0.03
    times, ratios = cells(text, "its processors")
    assert times == ["its processors", "15.0", "", "", "22.5", "0.500"]
    assert ratios[4] == "1.50"


def test_the_papers_figures_stand_as_it_prints_them() -> None:
    times, ratios = cells(page([]), "2014")[::5]
    assert times[1:] == ["4.518", "7.461", "7.873", "13.11"]
    assert ratios[1:] == ["1.00", "1.65", "1.74", "2.90"]
    assert cells(page([]), "2014")[3][4] == "14.40"


def test_the_pictures_say_how_much_of_them_is_covered() -> None:
    assert page([digest(ROWS)]).count("|  |  | 25 to 85 % | a card |") == 2


def test_timer_queries_need_no_line_of_the_processors() -> None:
    text = page([digest([{**row, "timer": "query"} for row in ROWS])])
    assert not cells(text, "its processors")
    assert len(cells(text, "a card")) == 2


def test_a_run_that_was_stopped_says_how_many_views_it_has() -> None:
    stopped = [a_row("gs", [10.0], [40.0], n=87_003, scene="owlii")]
    assert "each scan has 1 or 2 views" in " ".join(page([digest([*ROWS, *stopped])]).split())


def test_a_driver_without_geometry_shaders_has_times_alone() -> None:
    times, ratios = cells(page([digest([ROWS[0], ROWS[2]])]), "a card")
    assert (times[1], times[4]) == ("", "50.0")
    assert set(ratios[1:]) == {""}


def test_machines_stand_under_each_other() -> None:
    other = digest([{**row, "device": "another card"} for row in ROWS])
    text = page([digest(ROWS), {**other, "note": "While other programs ran."}])
    assert len(cells(text, "a card")) == len(cells(text, "another card")) == 2
    assert " ".join(text.split()).count("While other programs ran.") == 1
