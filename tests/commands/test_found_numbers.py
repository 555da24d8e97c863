"""Numbers that a backend finds, on the command line: asked for, refused, drawn again, without names."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import finding
import numpy as np
import pytest
from command_line import Run
from scenes import sphere
from written import picture

from viewer.backends import backends
from viewer.output.export import read_description
from viewer.scan import formats

SMALL = ("--size", "96x64", "--set", "point_size=3")
FOUND = ("--backend", "finding", "--look", "color_by=slope")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The working directory, with a scan of two frames, of which the second has a scalar `slope`."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(backends(), "finding", finding.BACKEND)
    Path("two").mkdir()
    for index in range(2):
        scalars = {"slope": np.linspace(0, 1, 3000)} if index else {}
        cloud = sphere(3000)
        np.savez(f"two/{index}.npz", positions=cloud.positions, **scalars)
    formats.write(Path("ball.npz"), sphere(3000))


@pytest.mark.parametrize("anonymous", [(), ("--anonymous",)])
def test_a_picture_is_drawn_again(anonymous: tuple[str, ...], run: Run) -> None:
    marks = ("--marks", "color_bar")
    assert run("render", "ball.npz", *SMALL, *FOUND, *marks, *anonymous, "-o", "a.png").err == ""
    told = json.loads(read_description(Path("a.png")))
    assert told["look"]["color_by"] == "slope", "which tells nothing of the scan"
    again = run("render", "ball.npz", "--replay", "a.png", "-o", "again.png")
    assert again.err == ""
    assert Path("again.png").read_bytes() == Path("a.png").read_bytes()
    assert run("render", "ball.npz", *SMALL, "--backend", "finding", *marks, "-o", "b.png").err == ""
    assert (picture(Path("a.png")) != picture(Path("b.png"))).any()


def test_a_scalar_of_one_frame_goes_first_there(run: Run) -> None:
    assert run("render", "two", "--all", *SMALL, *FOUND, "-o", "%d.npz").err == ""
    with np.load("0.npz") as found, np.load("1.npz") as own:
        seen = found["id"] != 0xFFFFFFFF
        np.testing.assert_array_equal(found["id"], own["id"])
        rows = found["id"][seen]
        np.testing.assert_array_equal(found["value"][seen], finding.numbers(sphere(3000))["slope"][rows])
        np.testing.assert_array_equal(own["value"][seen], np.linspace(0, 1, 3000)[rows].astype(np.float32))


def test_other_backends_name_the_one_that_finds_it(run: Run, refused: Callable[..., str]) -> None:
    look = ("--look", "color_by=gap")
    for which in ((), ("--backend", "points")):
        said = refused("render", "ball.npz", *which, *look, "-o", "a.png")
        assert "does not compute 'gap'" in said
        assert "but finding can. Use --backend finding" in said
    assert "unknown colour source 'gop'" in refused(
        "render", "ball.npz", *FOUND, "--look", "color_by=gop", "-o", "a.png"
    )
    assert not list(Path().glob("*.png"))
    points = (*SMALL, "--backend", "points")
    done = run("render", "two", "--all", *points, "--look", "color_by=slope", "-o", "%d.png")
    assert done.code == 0
    assert "frame 1 (0.npz) has no 'slope', so Scan4D uses other colours" in done.err


def test_backends_lists_them(run: Run) -> None:
    assert f"  slope  {finding.VALUES['slope'].help}\n" in run("backends").out
    listed = {one["name"]: one["values"] for one in json.loads(run("backends", "--json").out)}
    assert listed["finding"] == {name: kind.help for name, kind in finding.VALUES.items()}
    assert listed["points"] == {}
