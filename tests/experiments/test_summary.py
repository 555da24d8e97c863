"""The stored table of all renderers with their defaults: no renderer is missing."""

from __future__ import annotations

from experiments.renderers import summary
from experiments.suite import stored_runs
from scenes import DRAWS_POINTS

from viewer.backends import backends
from viewer.bench.baselines import CEILING, FLOOR


def test_every_renderer_has_a_row_with_its_errors() -> None:
    """`python tools/experiment.py summary` measures the rows of a renderer that is new."""
    for run in stored_runs(summary.EXPERIMENT, "summary"):
        rows = run["rows"]
        assert {row["backend"] for row in rows} == {FLOOR, CEILING, *backends()}
        for scene in {row["scene"] for row in rows}:
            drawn = {row["backend"] for row in rows if row["scene"] == scene}
            assert drawn >= {FLOOR, CEILING, *DRAWS_POINTS}, scene
        for row in rows:
            assert row["errors"].keys() >= {"psnr", "normal_median", "depth_median_px"}, row["backend"]
