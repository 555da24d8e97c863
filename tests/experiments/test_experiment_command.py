"""Suites as a developer runs them: what they say, write and refuse."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import Run
from missing import leave_out

from viewer.bench.report.results import read_rows


@pytest.mark.slow
def test_the_feeds_are_timed_and_stand_beside_the_papers(run_experiment: Run, tmp_path: Path) -> None:
    """Without the sequences the demo alone."""
    (tmp_path / "data").mkdir()
    small = ("--quick", "--size", "96x64", "--views", 1, "--data", tmp_path / "data")
    done = run_experiment("feeds", *small, "-o", tmp_path / "out")
    assert done.code == 0, done.err
    assert "leaves out crane" in done.err
    assert done.out.splitlines()[-1] == str(tmp_path / "out" / "table-two.md")
    rows = read_rows(tmp_path / "out")
    assert {row["scene"] for row in rows} == {"demo"}
    assert {row["params"].get("instancing") for row in rows} > {"gs", "ubo", "tbo", "vbo"}
    assert all(row["errors"] == {} and row["busy_ms"]["median"] > 0 for row in rows)
    text = (tmp_path / "out" / "table-two.md").read_text(encoding="utf-8")
    assert f"| `demo` | {rows[0]['n']:,} |".replace(",", "\N{NARROW NO-BREAK SPACE}") in text


@pytest.mark.slow
def test_octrees_stand_beside_the_papers(run_experiment: Run, tmp_path: Path) -> None:
    """Without the sequences the demo alone."""
    (tmp_path / "data").mkdir()
    small = ("--quick", "--size", "96x64", "--views", 1, "--data", tmp_path / "data")
    done = run_experiment("octrees", *small, "-o", tmp_path / "out")
    assert done.code == 0, done.err
    assert "leaves out crane" in done.err
    assert done.out.splitlines()[-1] == str(tmp_path / "out" / "octree-tables.md")
    rows = read_rows(tmp_path / "out")
    assert {row["sweep"] for row in rows} == {"instancing", "max_depth"}
    assert all(bool(row["errors"]) == (row["sweep"] == "max_depth") for row in rows)
    assert [row["delta"] for row in read_rows(tmp_path / "out" / "trees.jsonl", {})] == [2, 5, 10, 50]
    assert {row["scene"] for row in read_rows(tmp_path / "out" / "sizes.jsonl", {})} == {"demo"}
    text = (tmp_path / "out" / "octree-tables.md").read_text(encoding="utf-8")
    assert text.count("| `demo` |") == 3  # octrees, and levels with two kinds of cubes
    assert text.count("| `demo`, level 10 |") == 2


@pytest.mark.slow
def test_visible_points_of_a_mesh_of_ones_own_are_judged(
    run_experiment: Run, mesh: Path, tmp_path: Path
) -> None:
    quick = ("hpr", "--quick", "--scene", mesh, "--size", "96x64", "-o", tmp_path / "out")
    assert run_experiment(*quick).code == 0
    page = (tmp_path / "out" / "hpr.md").read_text(encoding="utf-8")
    assert page.count("| exact |") > 2
    for name in (
        "hpr.json",
        "pictures/hpr-errors.png",
        "pictures/hpr-sectors.png",
        "pictures/hpr-growth.png",
    ):
        assert (tmp_path / "out" / name).is_file()
    assert run_experiment(*quick).code == 2  # what is there is not replaced


def test_measuring_takes_the_scenes_that_are_named(run_experiment: Run, tmp_path: Path) -> None:
    file = tmp_path / "ball.obj"
    done = run_experiment("measuring", "--scene", file, "-o", tmp_path / "out")
    assert done.code == 2
    assert f"leaves out {file}" in done.err


def test_what_octrees_are_compared_with_is_needed_for_them_alone(
    run_experiment: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    leave_out(monkeypatch, "DracoPy")
    done = run_experiment("octrees", "-o", tmp_path)
    assert (done.code, "DracoPy" in done.err) == (2, True)
