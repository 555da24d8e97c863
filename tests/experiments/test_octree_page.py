"""The page of Tables III and IV: what stands in its cells, and what is refused."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from experiments.slomp_2014 import octrees
from experiments.slomp_2014.octree_sizes import Sizes
from experiments.tables import StoredRun
from tables_of import tables_of

from viewer.bench.report.results import Row

WHERE = {
    "size": [1920, 1280], "seed": 0, "device": "a card", "driver": "4.6", "timer": "finish", "processors": 4,
    "version": "0.1.0", "date": "2026-01-31",
}  # fmt: skip
ERRORS = {
    "hole_percent": 0.25, "through_percent": 0.75, "spill_percent": 1.5, "depth_median_px": 2.0,
    "depth_p95_px": 4.0, "normal_mean": 6.0, "psnr": 30.0,
}  # fmt: skip


def spread(value: float) -> dict[str, float]:
    return {"median": value, "p5": value / 2, "p95": 2 * value}


def drawn(sweep: str, params: dict[str, Any], gpu: list[float], **changes: Any) -> Row:
    return {
        "backend": "voxels", "scene": "crane", "scene_hash": "0", "n": 88_315, "noise": 0.0, "sweep": sweep,
        "params": {"stop": "depth", **params}, "views": len(gpu), "repeat": 3, "gpu_ms": spread(1.0),
        "errors": {}, "covered_by_view": [25.04, 84.6],
        "times_by_view": {"gpu_ms": gpu, "cpu_ms": gpu, "busy_ms": [8 * ms for ms in gpu]},
        **WHERE, **changes,
    }  # fmt: skip


FEEDS = [
    drawn("instancing", {}, [1.0, 1.0], backend="gl-points"),
    drawn("instancing", {"instancing": "gs", "depth": 10}, [10.0, 30.0]),
    drawn("instancing", {"instancing": "ubo", "depth": 10}, [5.0, 9.0]),
]
LEVELS = [
    drawn("max_depth", {"max_depth": level, "least": least}, [3.0, 5.0], scene="demo", n=10, errors=ERRORS)
    for least in (0.0, 0.4)
    for level in (6, 7)
]
TREE = {
    "scene": "crane", "n": 88_315, "delta": 2, "poses": 2, "depths": [10, 11], "loss": 0.00923,
    "nodes": 149_817.5, "leaves": 87_504.0, "cut": 5000.0,
    "ms": {work: spread(8.0) for work in ("build", "attributes", "cut", "leaves")} | {"sort": spread(0.5)},
    "sorts": {work: spread(15.5) for work in ("build", "attributes", "cut", "leaves")}, **WHERE,
}  # fmt: skip
SIZE = Sizes(
    "crane",
    88_315,
    "2 %",
    10,
    87_504,
    0.01,
    71.0,
    {"intra": 7.42, "draco": 8.75},
    {"encode": 2.5, "decode": 2.25},
)


def digest(drawn: list[Row], trees: list[Row], sizes: list[Row]) -> StoredRun:
    parts = {"rows": drawn, "trees": trees, "levels": drawn, "sizes": sizes}
    return octrees.EXPERIMENT.digest(parts)


def page(runs: list[StoredRun]) -> str:
    return tables_of(octrees.EXPERIMENT, runs)


def measured() -> StoredRun:
    return digest([*FEEDS, *LEVELS], [TREE], [asdict(SIZE)])


def lines(text: str, *cells: str) -> list[list[str]]:
    """The cells of the lines of tables that have all of these."""
    found = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if "|" in line]
    return [line for line in found if {*cells} <= {*line}]


def test_a_tree_stands_below_the_papers() -> None:
    theirs, ours = (
        line[2:] for line in lines(page([measured()]), "2 %") if line[0] == "baseball, `crane`" or not line[0]
    )  # the only one of ours
    assert theirs[:3] == ["2 %", "2014", "0.65 %"]
    assert theirs[3:] == ["11", "192\u202f299", "87\u202f737", "28.47", "", "15.67", "", ""]
    assert ours[:6] == ["2 %", "a card", "0.923 %", "10 to 11", "149\u202f818", "87\u202f504"]
    assert ours[6:] == [*["8.00 (15.50)"] * 4, "0.500"]


def test_the_papers_table_is_whole() -> None:
    text = page([])
    for delta, count in (("2 %", 5), ("5 %", 0), ("10 %", 5), ("50 %", 5)):
        assert len(lines(text, delta, "2014")) == count
    assert len(lines(text, "25 to 85 %", "2014")) == 2 * 5


def test_feeds_stand_beside_the_papers_at_its_level() -> None:
    text = page([measured()])
    assert "| scan | points | covered | machine | `gs` | `ubo` | `tbo` | `vbo` | `gl-points` |" in text
    times, ratios = lines(text, "baseball, `crane`, level 10")
    assert times[3:] == ["2014", "3.594", "2.639", "2.784", "5.788", ""]
    assert ratios[3:] == ["2014", "1.00", "0.73", "0.77", "1.61", ""]
    times, ratios = lines(text, "25 to 85 %", "a card")
    assert times[4:] == ["20.0", "7.00", "", "", "1.00"]
    assert ratios[4:] == ["1.00", "0.40", "", "", "0.07"]


def test_levels_have_time_and_error() -> None:
    first, second = lines(page([measured()]), "6")
    assert first[:5] == ["`demo`", "octants", "a card", "6", "4.00"]
    assert first[5:] == ["8.00", "0.250", "0.750", "1.50", "2.00", "4.00", "6.00", "30.0"]
    assert second[:4] == ["`demo`", "closed", "a card", "6"]
    assert lines(page([measured()]), "7")[0][:4] == ["", "", "", "7"]


def test_sizes_are_told_once() -> None:
    text = page([measured(), measured()])
    assert len(lines(text, "7.42", "8.75", "2.25")) == 1


def test_the_parameters_are_those_that_all_have_in_common() -> None:
    assert "`voxels` and the parameters `stop=depth depth=10" in " ".join(page([measured()]).split())
    deeper = drawn("instancing", {"instancing": "gs", "depth": 11}, [1.0, 1.0], n=101_931)
    assert digest([*FEEDS, deeper], [], [])["params"] == {"stop": "depth"}
