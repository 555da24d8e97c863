"""Goals of the suite "surface": which values meet them, and the table of all."""

from __future__ import annotations

import math

import pytest

from viewer.bench.goals import ESTIMATED, GOALS, Line, SurfaceGoal, table, table_lines
from viewer.bench.report.page import goals_met, three_digits
from viewer.bench.surface_suite import CONDITIONS


def row(condition: str, scene: str, backend: str, **errors: float) -> dict:
    return {"condition": condition, "scene": scene, "backend": backend, "errors": errors}


def line(lines: list[Line], error: str) -> Line:
    (found,) = (line for line in lines if line.goal.error == error)
    return found


def test_goals_are_of_conditions_that_there_are() -> None:
    known = {condition.name for condition in CONDITIONS}
    assert {condition for goal in GOALS for condition in goal.conditions} <= known


@pytest.mark.parametrize(("value", "met"), [(93.0, True), (98.0, True), (92.9, False), (98.1, False)])
def test_a_goal_with_two_bounds(value: float, met: bool) -> None:
    assert SurfaceGoal("held_percent", "true", "%", 98.0, (), low=93.0).meets(value) is met
    assert not SurfaceGoal("held_percent", "true", "%", 98.0, (), low=93.0).meets(math.nan)


def test_values_are_means_over_the_scenes_that_have_one() -> None:
    rows = [
        row("noise 0.3", "torus", "surfels", bias=-0.5, open_percent=1.0, normal_mean=6.0),
        row("noise 0.3", "igea", "surfels", bias=0.1, open_percent=math.nan, normal_mean=4.0),
        row("noise 0.3", "torus", ESTIMATED, normal_mean=2.0),
        row("noise 0.3", "igea", ESTIMATED, normal_mean=4.0),
    ]
    lines = table(rows)
    assert line(lines, "bias").found == {"surfels": pytest.approx(0.3)}, "the sign does not count"
    assert line(lines, "open_percent").found == {"surfels": 1.0}
    assert line(lines, "normal_mean").found == {"surfels": 2.0}, "relative to the estimate"


def test_the_table_marks_what_meets_its_goal() -> None:
    lines = table([row("even", "torus", "surfels", wrong_layer_percent=0.3, spill_p95=3.5)])
    head, *texts = table_lines(lines, three_digits)
    assert "surfels" in head
    assert any("wrong layer, even" in text and "0.300*" in text for text in texts)
    assert any("spill" in text and "3.50 " in text and "≤ 3 px" in text for text in texts)
    kinds = {name: cells[0].kind for name, _, cells in goals_met(
        [row("even", "torus", "surfels", wrong_layer_percent=0.3, spill_p95=3.5, rms=9.0)]
    )["rows"]}  # fmt: skip
    assert kinds["wrong layer: even"] == "held"
    assert kinds["spill, 95th percentile: even"] == "failed"
    assert kinds["distance from the surface, root mean square: even"] == "", "no bound"
