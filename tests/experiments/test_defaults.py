"""What beats a default and what does not: by error, by time, by what a parameter affects."""

from __future__ import annotations

from typing import Any

import pytest
from experiments.renderers.defaults import EXPERIMENT, beats, default_groups
from experiments.suite import stored_runs
from experiments.tables import StoredRun, put_tables

from viewer.backends import backend
from viewer.bench.report.results import Row
from viewer.bench.run import BenchSettings

ERRORS = {
    "closed_percent": 99.0, "spill_percent": 2.0, "wrong_layer_percent": 1.0, "depth_median_px": 0.2,
    "depth_p95_px": 1.0, "normal_median": 3.0, "normal_p95": 9.0, "psnr": 30.0,
}  # fmt: skip


def a_row(sweep: str, value: Any = 1.0, ms: float = 10.0, **errors: float) -> Row:
    spread = {"median": ms, "p5": ms, "p95": ms}
    return {
        "backend": "surfels", "scene": "bunny", "scene_hash": "0", "n": 34_834, "noise": 0.0, "sweep": sweep,
        "params": {"radius_scale": 1.0, "instancing": "auto", **({sweep: value} if sweep else {})},
        "size": [96, 64], "seed": 0, "views": 3, "repeat": 1, "gpu_ms": spread, "derive_ms": spread,
        "upload_ms": spread, "errors": {**ERRORS, **errors}, "device": "a card", "driver": "4.6",
        "timer": "query", "processors": 4, "version": "0.1.0", "date": "2026-01-31",
        "times_by_view": {"gpu_ms": [ms, 2 * ms, 3 * ms], "busy_ms": [1.0, 1.0, 1.0]},
    }  # fmt: skip


def digest(rows: list[Row]) -> StoredRun:
    return EXPERIMENT.digest({"rows": rows})


def found(*rows: Row) -> list[set[str]]:
    return [set(beats(row)) for row in digest([a_row(""), *rows])["rows"]]


@pytest.mark.parametrize(
    ("row", "better"),
    [
        (a_row("radius_scale", 0.5, normal_median=2.0), {"normal_median"}),
        (a_row("radius_scale", 0.5, closed_percent=99.9, psnr=33.0), {"open_percent", "rms"}),
        (a_row("radius_scale", 0.5, normal_median=2.9), set()),  # within the margin
        (a_row("radius_scale", 0.5, normal_median=2.0, spill_percent=3.0), set()),  # worse in another
        (a_row("radius_scale", 0.5, ms=11.0, normal_median=2.0), set()),  # slower
        (a_row("radius_scale", 0.5, ms=10.4, normal_median=2.0), {"normal_median"}),
        (a_row("radius_scale", 0.5, ms=5.0), set()),  # faster alone: a choice of quality
        (a_row("instancing", "gs", ms=5.0), {"time"}),
        (a_row("instancing", "gs", ms=9.8), set()),
        (a_row("instancing", "gs", ms=5.0, normal_median=4.0), set()),  # another picture
    ],
)
def test_what_beats_a_default(row: Row, better: set[str]) -> None:
    assert found(row) == [better]


def test_a_value_that_takes_long_to_prepare_beats_nothing() -> None:
    slow = a_row("radius_scale", 0.5, normal_median=2.0)
    slow["derive_ms"] = {"median": 100.0, "p5": 100.0, "p95": 100.0}
    assert found(slow) == [set()]


def test_the_page_lists_what_beats_with_what_it_gains() -> None:
    rows = [a_row(""), a_row("radius_scale", 0.5, ms=9.0, normal_median=2.0), a_row("instancing", "gs")]
    parts = EXPERIMENT.made([digest(rows)])
    (line,) = [line for line in parts["beaten"].splitlines() if "bunny" in line]
    assert "| `surfels` | `radius_scale` | 1.0 | 0.5 | normal_median 3.00 → 2.00 | 0.90 |" in line
    assert "| `bunny` | 34\N{NARROW NO-BREAK SPACE}834 | `surfels` | 2 | 2 |" in parts["tried"]
    assert EXPERIMENT.made([digest([rows[0], rows[2]])])["beaten"] == "No default is beaten."


def test_every_offered_value_of_the_default_backend_is_tried() -> None:
    (group,) = default_groups(BenchSettings(), ["sheets-bare"])
    floor, usual, *others = group.contenders
    assert (floor.backend, usual.backend, usual.sweep) == ("gl-points", "auto_splats", "")
    tried = {(one.sweep, getattr(one.params, one.sweep)) for one in others}
    assert len(tried) == len(others)
    assert {("k", 6), ("k", 20), ("elliptical", True), ("passes", "one"), ("instancing", "tbo")} <= tried
    assert all(getattr(usual.params, name) != value for name, value in tried)


def test_each_default_that_is_beaten_has_a_reason_to_stay() -> None:
    runs = stored_runs(EXPERIMENT, "defaults")
    beaten = [row for run in runs for row in run["rows"] if beats(row)]
    assert runs
    assert [row for row in beaten if row["parameter"] not in backend(row["backend"]).default_reasons] == []


def test_tables_are_put_between_their_marks() -> None:
    page = "a\n<!-- one -->\nold\n<!-- /one -->\nb\n"
    assert put_tables(page, {"one": "new\nnewer"}) == "a\n<!-- one -->\nnew\nnewer\n<!-- /one -->\nb\n"
    with pytest.raises(ValueError, match="two"):
        put_tables(page, {"two": ""})
