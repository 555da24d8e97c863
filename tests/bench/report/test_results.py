"""Rows of results: the round trip through files, and what a comparison says."""

from __future__ import annotations

import json
import math
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

from viewer.bench.report.results import (
    METRICS,
    Row,
    compare,
    error_metrics,
    read_rows,
    spread,
    write_row,
)
from viewer.errors import InputError


def times(median: float) -> dict[str, float]:
    return {"median": median, "p5": 0.9 * median, "p95": 1.1 * median}


def a_row(errors: dict[str, float] | None = None, ms: float = 10.0, **changes: Any) -> Row:
    row: Row = {
        "backend": "points", "scene": "torus", "scene_hash": "0123456789abcdef", "n": 1000, "noise": 0.0,
        "params": {"size": 2.0}, "sweep": "", "size": [192, 128], "seed": 0, "views": 3,
        "gpu_ms": times(ms), "cpu_ms": times(5.0), "derive_ms": times(1.0), "upload_ms": times(2.0),
        "passes": {"scatter": times(0.75 * ms), "shade": times(0.25 * ms)}, "timer": "finish",
        "bytes_gpu": 28_000, "peak_rss": None, "errors": errors or {"hole_percent": 2.0},
        "errors_by_view": {}, "device": "a device", "driver": "a driver", "version": "0.1.0",
    }  # fmt: skip
    return {**row, **changes}


def written(path: Path, *rows: Row) -> Path:
    with path.open("w", encoding="utf-8") as stream:
        for row in rows:
            write_row(stream, row)
    return path


def test_nan_and_infinity_survive_a_file_of_strict_json(tmp_path: Path) -> None:
    errors = {"hole_percent": math.nan, "psnr": math.inf, "depth_bias": -math.inf, "ssim": 0.1}
    path = written(tmp_path / "results.jsonl", a_row(errors))

    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is not JSON")

    line = json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)
    assert line["errors"] == {
        "hole_percent": None, "psnr": "Infinity", "depth_bias": "-Infinity", "ssim": 0.1,
    }  # fmt: skip
    read = read_rows(path)[0]["errors"]
    assert math.isnan(read.pop("hole_percent"))
    assert read == {"psnr": math.inf, "depth_bias": -math.inf, "ssim": 0.1}


def test_a_folder_stands_for_its_results(tmp_path: Path) -> None:
    written(tmp_path / "results.jsonl", a_row(n=1), a_row(n=2))
    assert [row["n"] for row in read_rows(tmp_path)] == [1, 2]


def test_each_row_is_on_disk_when_it_was_written() -> None:
    class Stream(StringIO):
        flushed = ""

        def flush(self) -> None:
            self.flushed = self.getvalue()

    stream = Stream()
    write_row(stream, a_row())
    assert json.loads(stream.flushed)["backend"] == "points"


def test_what_a_crash_cut_off_is_left_out(tmp_path: Path) -> None:
    path = written(tmp_path / "results.jsonl", a_row(n=1), a_row(n=2))
    text = path.read_text(encoding="utf-8")
    path.write_text(text[:-30], encoding="utf-8")
    assert [row["n"] for row in read_rows(path)] == [1]


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ("{", "is not a row of data"),
        ("[1, 2]", "not a JSON object"),
        ('{"backend": "points"}', "the row has no usable value for scene, scene_hash"),
        (json.dumps({**a_row(), "errors": 3}), "the row has no usable value for errors"),
    ],
)
def test_a_broken_line_is_named(tmp_path: Path, line: str, what: str) -> None:
    path = written(tmp_path / "old.json", a_row())
    path.write_text(path.read_text(encoding="utf-8") + line + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=what) as caught:
        read_rows(path)
    assert str(caught.value.where).endswith("old.json, line 2")


def test_a_missing_or_binary_file_is_one_message(tmp_path: Path) -> None:
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe\x00")
    for name in ("missing.json", "binary.json"):
        with pytest.raises(InputError, match="cannot be read"):
            read_rows(tmp_path / name)


def test_the_spread_of_a_hundred_and_one_steps() -> None:
    assert spread([float(i) for i in range(100, -1, -1)]) == {"median": 50.0, "p5": 5.0, "p95": 95.0}
    assert all(math.isnan(value) for value in spread([]).values())


def test_equal_results_compare_without_a_word() -> None:
    rows = [a_row({"hole_percent": math.nan, "psnr": math.inf, "depth_bias": 0.0})]
    assert compare(rows, rows) == []


def test_slower_is_outside_both_spreads() -> None:
    assert compare([a_row(ms=10.0)], [a_row(ms=10.9)]) == []
    assert compare([a_row(ms=10.0)], [a_row(ms=20.0)]) == [
        "slower: points, torus, 1000 points: gpu_ms 10 -> 20 (x2.00)"
    ]
    assert compare([a_row(ms=20.0)], [a_row(ms=10.0)]) == [
        "faster: points, torus, 1000 points: gpu_ms 20 -> 10 (x0.50)"
    ]
    wide = {"median": 20.0, "p5": 9.0, "p95": 30.0}
    assert compare([a_row(ms=10.0)], [a_row(gpu_ms=wide)]) == []


@pytest.mark.parametrize(
    ("name", "before", "after"),
    [
        ("hole_percent", 2.0, 2.1),
        ("psnr", 30.0, 29.0),
        ("psnr", math.inf, 60.0),
        ("ssim", 0.95, 0.9),
        ("depth_bias", 0.1, -0.2),
        ("flicker_orbit_color", -0.01, 0.02),
        ("correct", 100.0, 90.0),
        ("flip", 0.1, math.nan),
    ],
)
def test_each_error_has_its_bad_direction(name: str, before: float, after: float) -> None:
    old, new = [a_row({name: before})], [a_row({name: after})]
    (worse,) = compare(old, new)
    assert worse.startswith(f"worse: points, torus, 1000 points: {name} ")
    (better,) = compare(new, old)
    assert better.startswith("better: ")


def test_less_than_a_hundredth_is_the_same_error() -> None:
    assert compare([a_row({"hole_percent": 2.0})], [a_row({"hole_percent": 2.015})]) == []
    assert compare([a_row({"hole_percent": 0.0})], [a_row({"hole_percent": 1e-9})]) == []


def test_losses_come_before_gains_and_notes() -> None:
    old = [a_row({"psnr": 30.0, "flip": 0.2}), a_row(n=5)]
    new = [a_row({"psnr": 20.0, "flip": 0.1}, ms=50.0), a_row(n=6)]
    assert [line.split(":")[0] for line in compare(old, new)] == [
        "slower", "worse", "better", "the new results do not contain", "the old results do not contain",
    ]  # fmt: skip


def test_times_of_another_device_are_not_compared_but_errors_are() -> None:
    old = [a_row(n=n, ms=1.0) for n in (1, 2)]
    new = [a_row({"hole_percent": 5.0}, n=n, ms=9.0, device="another") for n in (1, 2)]
    lines = compare(old, new)
    assert [line.split(":")[0] for line in lines] == [
        "worse",
        "worse",
        "times not compared, because the machine changed",
    ]
    assert "a device, a driver, finish is now another, a driver, finish" in lines[-1]


def test_another_scene_of_the_same_name_is_not_compared() -> None:
    (line,) = compare([a_row()], [a_row({"hole_percent": 50.0}, scene_hash="f" * 16)])
    assert line == "not compared, because the scene changed (scene_hash): points, torus, 1000 points"


def test_a_swept_parameter_is_in_the_words() -> None:
    row = a_row(sweep="size", params={"size": 4.0}, noise=0.01)
    (line,) = compare([row], [])
    assert line == "the new results do not contain: points, torus, 1000 points, noise 0.01, size=4.0"


def test_preparing_is_deriving_and_uploading() -> None:
    assert METRICS["prepare_ms"].of(a_row()) == 3.0
    assert math.isnan(METRICS["prepare_ms"].of(a_row(derive_ms=times(math.nan))))
    assert math.isnan(METRICS["peak_rss"].of(a_row()))


def test_an_error_that_is_not_known_yet_is_kept() -> None:
    rows = [a_row({"novel": 1.0, "psnr": 2.0})]
    assert [metric.name for metric in error_metrics(rows)] == ["psnr", "novel"]


def test_every_metric_is_in_the_docs() -> None:
    text = (Path(__file__).resolve().parents[3] / "docs/developing/benchmark.md").read_text(encoding="utf-8")
    known = error_metrics([a_row(dict.fromkeys(METRICS, 0.0))])
    assert [metric.name for metric in known if f"`{metric.name}`" not in text] == []


def test_every_view_a_fifth_slower_is_slower_however_different_the_views_are() -> None:
    views = [float(ms) for ms in range(10, 30)]

    def timed(factor: float) -> dict[str, object]:
        times = [ms * factor for ms in views]
        return a_row(gpu_ms=spread(times), times_by_view={"gpu_ms": times})

    assert any("slower" in line and "gpu_ms" in line for line in compare([timed(1)], [timed(1.2)]))
    assert any("faster" in line and "gpu_ms" in line for line in compare([timed(1.2)], [timed(1)]))
    assert compare([timed(1)], [timed(1.04)]) == []
    one_slow = timed(1)
    one_slow["times_by_view"] = {"gpu_ms": [3 * views[0], *views[1:]]}
    assert compare([timed(1)], [one_slow]) == []
