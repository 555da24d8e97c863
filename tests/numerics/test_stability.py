"""The numerical stability suite of viewer/bench/numerics.py, for every backend."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes import every_backend, of_variant, variants

from viewer.backends import Backend, Limit, backends
from viewer.bench.numerics import (
    EXACT,
    Difference,
    Outcome,
    RgbdImage,
    Row,
    difference,
    distinct_limits,
    picture,
    rows,
    ways_of,
)
from viewer.renderer import Renderer

ROWS = list(rows())
MOST = 10  # principles that keep rows from holding
NOTHING = np.inf
# What has a limit of its own, and rows that have one for all.
LIMITED = [
    *(pytest.param(row, one, marks=pytest.mark.backend(one.name), id=f"{row.name}-{one}")
      for one in backends().values() for row in ROWS if row.name in one.limits),
    *(pytest.param(row, None, id=row.name) for row in ROWS if row.limit),
]  # fmt: skip


WAYS = [
    pytest.param(one, way, marks=pytest.mark.backend(one.name), id=f"{one}-{next(iter(way.items()))}")
    for one in backends().values() for way in ways_of(one)
]  # fmt: skip


def compare(renderer: Renderer, row: Row, variant: str) -> Outcome:
    name, setting = of_variant(variant)
    return row.compare(renderer, backends()[name], backends()[name].params(setting))


@every_backend
@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_the_picture_stays_the_same(renderer: Renderer, row: Row, name: str) -> None:
    assert_allowed(row, compare(renderer, row, name))


@pytest.mark.slow
@pytest.mark.parametrize(("backend", "way"), WAYS)
@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_other_pictures_stay_the_same(
    renderer: Renderer, row: Row, backend: Backend, way: dict[str, Any]
) -> None:
    """Two passes, sorted splats, pictures without filling: whatever declarations sweep."""
    assert_allowed(row, row.compare(renderer, backend, backend.params(way)))


def test_the_ways_of_surfels_are_among_them() -> None:
    ways = ways_of(backends()["surfels"])
    drawn = [backends()["surfels"].params().passes, *(way["passes"] for way in ways if "passes" in way)]
    assert {"one", "two", "sorted"} <= set(drawn) | ({"two"} if "auto" in drawn else set())


def test_limits_are_of_few_principles() -> None:
    reasons = distinct_limits(backends().values())
    assert len(reasons) <= MOST, "\n".join([f"{len(reasons)} distinct limits", *reasons])


def assert_allowed(row: Row, outcome: Outcome) -> None:
    allowed = f"{row.tolerance.bound} ({row.tolerance.reason})"
    if outcome.limit is not None:
        allowed += f", or {outcome.limit.pixels:.1%} coarsely ({outcome.limit.reason})"
    assert outcome.allowed, f"{outcome.found}, {outcome.coarse:.4%} coarsely; allowed: {allowed}"


@pytest.mark.parametrize(("row", "backend"), LIMITED)
def test_what_has_come_to_hold_is_no_limit(renderer: Renderer, row: Row, backend: Backend | None) -> None:
    """Each limit is one to some picture; else it would hide that the row holds, and goes."""
    names = [name for name in variants() if backend is None or of_variant(name)[0] == backend.name]
    drawn = [(backends()[name], setting) for name, setting in map(of_variant, names)]
    if backend is not None:
        drawn += [(backend, way) for way in ways_of(backend) if row.limit_of(backend, backend.params(way))]
    assert not all(row.compare(renderer, one, one.params(way)).held for one, way in drawn)


def test_an_outcome_is_held_or_within_its_limit_or_fails(renderer: Renderer) -> None:
    """By a picture that is taken sideways: a few pixels of a limit do not allow it, all of them do."""
    still = next(row for row in ROWS if row.name.startswith("translated"))
    row = replace(
        still, variant=lambda shot: replace(shot, camera=shot.camera.orbited(40, 0)), tolerance=EXACT
    )
    points = backends()["points"]
    assert not row.compare(renderer, points).allowed
    assert not replace(row, limit=Limit(0.01, "")).compare(renderer, points).allowed
    outcome = replace(row, limit=Limit(0.9, "")).compare(renderer, points)
    assert outcome.allowed
    assert not outcome.held
    assert 0.01 < outcome.coarse < outcome.found.pixels
    assert replace(still, limit=Limit(0.01, "")).compare(renderer, points).held


def test_rows_have_names_of_their_own() -> None:
    assert len({row.name for row in ROWS}) == len(ROWS)


def test_limits_of_backends_name_rows() -> None:
    named = {name for backend in backends().values() for name in backend.limits}
    assert named <= {row.name for row in ROWS}


def test_difference_of_pictures_that_differ_in_known_pixels() -> None:
    depth, color = np.zeros((4, 5)), np.full((4, 5, 3), 100)
    depth[0] = NOTHING
    one = RgbdImage(depth, color)
    assert difference(one, one) == Difference(0, 0, 0)

    gone, back, other = depth.copy(), depth.copy(), color.copy()
    gone[1, 0] = NOTHING
    back[1, 1] += 7
    other[1, 2, 0] += 50
    for changed in (RgbdImage(gone, color), RgbdImage(back, color), RgbdImage(depth, other)):
        assert difference(one, changed) == difference(changed, one)
        assert difference(one, changed).pixels == pytest.approx(1 / 20)

    little = RgbdImage(depth + 0.01, color + 1)
    found = difference(one, little)
    assert found.pixels == 0
    assert found.depth == pytest.approx(0.01 * 15 / 20)
    assert found.color == 1


def test_another_picture_is_not_within_any_tolerance(renderer: Renderer) -> None:
    """The suite would notice: a shift of a pixel's width is beyond every row that has to hold."""
    row = next(row for row in ROWS if row.name.startswith("translated"))
    shot = row.shot()
    nudge = shot.camera.rotation()[0] / shot.pixels_per_unit()
    nudged = shot.given(positions=shot.arrays["positions"] + nudge)
    for backend in backends().values():
        found = difference(picture(renderer, backend, shot), picture(renderer, backend, nudged))
        assert not any(other.tolerance.holds(found) for other in ROWS if not other.limit)
