"""Which controls of the appearance change nothing, and are grey."""

from __future__ import annotations

from dataclasses import replace

import pytest
from scenes import sphere

from viewer.app.panel.appearance import idle_parameters
from viewer.look import Look
from viewer.scan.pose import Pose

COLORED = Pose(0, 0.0, "ball", sphere(50))
BARE = Pose(0, 0.0, "ball", replace(sphere(50), colors=None))
LIGHT = {"ambient", "diffuse", "specular", "shininess"}
EDGES = {"eye_dome_strength", "eye_dome_radius"}
MAP = {"color_map", "range", "low", "high"}


@pytest.mark.parametrize(
    ("look", "pose", "is_here", "why_unlit", "idle"),
    [
        (Look(), COLORED, True, "", {"plain"} | EDGES),
        (Look(), BARE, True, "", EDGES),
        (Look(color_by="plain"), COLORED, True, "", EDGES),
        (Look(color_by="height"), BARE, True, "", {"plain"} | EDGES),
        (Look(color_by="gone"), COLORED, False, "", {"plain"} | MAP | EDGES),
        (Look(color_by="gone"), BARE, False, "", MAP | EDGES),
        (Look(), BARE, True, "no normals", LIGHT),
        (Look(light="head"), BARE, True, "no normals", EDGES),
        (Look(light="head", eye_dome=True), BARE, True, "no normals", set()),
        (Look(light="flat"), BARE, True, "", EDGES),
    ],
)
def test_what_changes_nothing_says_why(
    look: Look, pose: Pose, is_here: bool, why_unlit: str, idle: set[str]
) -> None:
    found = idle_parameters(look, pose, is_here, why_unlit)
    assert set(found) == idle
    assert all(found.values())
