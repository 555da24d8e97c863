"""The ways of landmarks are found once, and forgotten where nobody asks for them any more."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from viewer.analysis.track import Known, Track
from viewer.app.followed import Followed
from viewer.app.tools.plotting.choices import ANCHORS, CurveChoices, Settings
from viewer.app.tools.plotting.paths import Paths
from viewer.rigid import STILL, Rigid, rigid_matrix

TIMES = np.arange(30) / 30
PLACES = {"a": (0, 0, 0), "b": (1, 0, 0), "c": (0, 1, 0)}


def track_at(place: tuple[int, int, int]) -> Track:
    positions = np.tile(np.array(place, np.float64), (30, 1))
    return Track(TIMES, positions, np.zeros((30, 3, 3)), np.full(30, Known.TRACKED, np.uint8))


@pytest.fixture
def ways() -> Paths:
    followed = Followed()
    followed.take_tracks({name: track_at(place) for name, place in PLACES.items()})
    context: Any = SimpleNamespace(followed=followed, timeline=TIMES)
    return Paths(context)


def test_what_is_asked_for_again_is_the_same(ways: Paths) -> None:
    settings, choices = Settings(coordinates=ANCHORS), CurveChoices(traced=("a", "b"), anchors=tuple(PLACES))
    found, still = ways.trajectories(settings, choices), ways.still(choices)
    again = ways.trajectories(settings, choices)
    assert all(again[name] is found[name] for name in ("a", "b"))
    assert ways.still(choices) is still


def test_paths_follow_the_stabilised_scan_and_have_its_gaps(ways: Paths) -> None:
    settings, choices = Settings(), CurveChoices(traced=("a",))
    recorded = ways.trajectories(settings, choices)["a"]
    shift = Rigid(rigid_matrix(np.eye(3), np.array([0.0, 0.0, 5.0])))
    ways._context.followed.still = (STILL, None, *[shift] * 28)
    positions = ways.trajectories(settings, choices)["a"].positions
    assert np.isnan(positions[1]).all()
    np.testing.assert_allclose(positions[2:] - recorded.positions[2:], np.tile([0.0, 0.0, 5.0], (28, 1)))
    assert ways.drawn(settings, choices, 1, 10.0).trajectories == (), "a gap has no place for them"
    assert (ways.drawn(settings, choices, 2, 10.0).held.matrix == shift.inverse.matrix).all()


@pytest.mark.parametrize("change", [{"traced": ("b",)}, {"traced": ()}, {"seconds": 0.5}])
def test_ways_that_are_not_traced_any_more_are_forgotten(ways: Paths, change: dict[str, Any]) -> None:
    settings, choices = Settings(), CurveChoices(traced=("a",))
    former = weakref.ref(ways.trajectories(settings, choices)["a"])
    if "seconds" in change:
        ways.trajectories(replace(settings, **change), choices)
    else:
        ways.trajectories(settings, replace(choices, **change))
    gc.collect()
    assert former() is None
