"""How good automatic choices are: how they are judged, and the table."""

from __future__ import annotations

from typing import Any

from experiments.renderers.choice import EXPERIMENT, GOALS, judged, with_choices

from viewer.bench.calibrating import laws_of, measure_ways
from viewer.bench.run import Bench, BenchSettings
from viewer.drawing.renderer import Renderer


def row(view: int, key: str, ms: float, error: float, *chosen: str) -> dict[str, Any]:
    return {
        "scene": "ball", "seed": 0, "view": view, "key": key, "scale": 1.0, "ms": ms, "error": error,
        "chosen": list(chosen),
    }  # fmt: skip


ROWS = [
    *(row(0, "slow", 60.0, 0.5), row(0, "good", 40.0, 1.0, "50 ms"), row(0, "fast", 10.0, 3.0)),
    *(row(1, "slow", 45.0, 0.5), row(1, "good", 40.0, 1.0, "50 ms"), row(1, "fast", 10.0, 3.0)),
    *(row(2, "slow", 70.0, 0.5), row(2, "good", 55.0, 1.0, "50 ms"), row(2, "fast", 10.0, 3.0)),
    *(row(3, "slow", 90.0, 0.5), row(3, "good", 80.0, 1.0), row(3, "fast", 51.0, 3.0, "50 ms")),
]  # the best of those in time; another one was better; late; nothing is in time


def test_choices_are_judged_by_what_could_have_been_chosen() -> None:
    found = judged(ROWS, "time", 50.0, "50 ms")
    assert found == {
        "goal": "50 ms", "kind": "time", "views": 4, "possible": 3, "kept": 2, "near": 1, "ratio": 1.5,
        "mean_ratio": round(2**0.5, 4),
    }  # fmt: skip
    assert judged(ROWS, "time", 20.0, "20 ms") is None


def test_an_error_is_judged_by_time() -> None:
    rows = [row(0, "slow", 60.0, 0.2, "1 px"), row(0, "fast", 30.0, 0.9)]
    found = judged(rows, "error", 1.0, "1 px")
    assert found is not None
    assert (found["kept"], found["ratio"]) == (1, 2.0)


def test_the_page_of_choices() -> None:
    where = {
        "device": "a", "driver": "b", "processors": 2, "timer": "finish", "version": "0", "date": "now",
        "size": [9, 9], "repeat": 1,
    }  # fmt: skip
    run = EXPERIMENT.digest({"rows": [{**each, **where} for each in ROWS]})
    assert "| 50 ms | 4 | 3 | 66.7 | 50.0 | 1.50 |" in EXPERIMENT.made([run])["choices"]


def test_each_goal_is_chosen_for(renderer: Renderer) -> None:
    bench = Bench(renderer, BenchSettings(size=(240, 160), views=1, repeat=1, frames=0))
    rows = list(measure_ways(bench, ["sphere"]))
    found = with_choices(rows, laws_of(rows))
    assert [{**row, "chosen": []} for row in found] == [{**row, "chosen": []} for row in rows]
    chosen = [name for row in found for name in row["chosen"]]
    assert sorted(chosen) == sorted(map(str, GOALS))
