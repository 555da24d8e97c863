"""Code words measured: rows, tables, and what pixels tell."""

from __future__ import annotations

import numpy as np
import pytest
from experiments.marsik_2010 import codeword, words

from viewer.bench.run import Bench, BenchSettings
from viewer.drawing.renderer import Renderer

pytestmark = pytest.mark.backend("codeword")
SIZE = (80, 60)
SETTINGS = BenchSettings(size=SIZE, views=1, repeat=1)


@pytest.mark.slow
def test_rows_become_tables(renderer: Renderer) -> None:
    bench = Bench(renderer, SETTINGS)
    times = list(words.measure_times(bench, ["torus"], 500, [SIZE]))
    pixels = list(words.measure_pixels(bench, ["torus"], 500, SIZE))
    built = list(words.measure_tables(bench))
    truth = list(words.measure_truth(bench, ["torus"], 500, SIZE))
    assert [list(row["busy_ms"]) for row in times] == [[drawing.name for drawing in words.DRAWINGS]]
    assert min(times[0]["wall_ms"].values()) > 0
    assert [(row["projection"], row["quality"]) for row in pixels] == [
        (projection, quality)
        for projection in ("perspective", "orthographic")
        for quality in ("table", "planes", "exact")
    ]
    run = codeword.EXPERIMENT.digest({"times": times, "pixels": pixels, "truth": truth, "tables": built})
    made = codeword.EXPERIMENT.made([run])
    assert all(f"| {drawing.name} |" in made["times"] for drawing in words.DRAWINGS)
    assert "303\N{NARROW NO-BREAK SPACE}748" in made["tables"]


def test_pixels_tell_what_differs(renderer: Renderer) -> None:
    bench = Bench(renderer, SETTINGS)
    rows = list(words.measure_pixels(bench, ["torus"], 2000, (160, 120)))
    table, exact = ([row for row in rows if row["quality"] == name] for name in ("table", "exact"))
    for coarse, fine in zip(table, exact, strict=True):
        assert fine["ids"] <= 0.5 < coarse["ids"]
        assert fine["covered"] <= 0.1 < coarse["covered"] <= 5
        assert fine["depth"] < 1e-4 < coarse["depth"] < 0.1
        assert np.isclose(fine["normal"], 0)


def test_scenes_that_are_not_there_are_left_out(renderer: Renderer) -> None:
    bench = Bench(renderer, SETTINGS)
    assert not list(words.measure_times(bench, ["no-such.ply"], 10))
    assert "leaves out no-such.ply" in bench.notes[0]
