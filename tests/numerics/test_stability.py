"""The numerical stability suite of viewer/bench/numerics.py, for every backend."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes import DRAWS_POINTS, of_variant, variants

from viewer.backends import Backend, Limit, backends
from viewer.backends import backend as find_backend
from viewer.backends.points import PointSquares
from viewer.bench.numerics import EXACT, rows
from viewer.bench.rounding import Rounding
from viewer.bench.shots import RgbdImage, picture
from viewer.bench.stability import Difference, Row, difference
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose
from viewer.splatting.amplify import FEEDS

ROWS = list(rows())
MOST = 7  # principles that keep rows from holding
NOTHING = np.inf
LIMITED = [
    pytest.param(row, one, marks=pytest.mark.backend(one.name), id=f"{row.name}-{one}")
    for one in backends().values() for row in ROWS if row.name in one.limits
]  # fmt: skip


def distinct_limits(backends: Iterable[Backend]) -> list[str]:
    """The reasons of all limits, each once."""
    declared = (limit for one in backends for row in one.limits for limit in one.limits_of(row))
    return list(dict.fromkeys(limit.reason for limit in declared))


def swept_settings(backend: Backend) -> list[dict[str, Any]]:
    """Parameters that make other pictures than the defaults, one at a time: the words and switches that the
    declaration sweeps, and those that its limits speak of."""
    conditions = [limit.when for row in backend.limits for limit in backend.limits_of(row)]
    settings = []
    for parameter in backend.parameters:
        if parameter.affects != "speed" and parameter.type in (bool, str):
            limited = [value for when in conditions for value in when.get(parameter.name, ())]
            settings += [{parameter.name: value} for value in dict.fromkeys([*parameter.sweep, *limited])]
    defaults = backend.params()
    return [
        setting
        for setting in settings
        if any(getattr(defaults, name) != value for name, value in setting.items())
    ]


def marks_of(backend: Backend, way: dict[str, Any]) -> list[pytest.MarkDecorator]:
    """Slow but for another shape, of which nothing else tells."""
    return [pytest.mark.backend(backend.name), *([] if "shape" in way else [pytest.mark.slow])]


WAYS = [
    pytest.param(one, way, marks=marks_of(one, way), id=f"{one}-{next(iter(way.items()))}")
    for one in map(find_backend, DRAWS_POINTS) for way in swept_settings(one)
]  # fmt: skip
# Rows between two others that go further each way, or of which a farther one tells the same.
BETWEEN = {
    *(f"translated by 10^{power}" for power in (3, 4, 5, 7, 8)),
    *(f"scaled by 10^{power}" for power in (-4, -2, 4)),
    *(f"a sphere of 10^{n} times the size, {place}" for n in (4, 6) for place in ("inside", "around")),
    "rotated by a quarter turn", "fitted, scaled by 10^-6", "float32 input", "telephoto x10^3",
    "zoomed in to 1/1000 of the scan's width", "zoomed in to 1/1000 of a splat's width", "zoomed out x10^6",
    "normals that deviate from the y axis by 10^-4 rad", "the list of points 1000 times",
}  # fmt: skip
LONG = {
    ("8192x1 pixels", "hpr"),
    *(("a body, each point 1000 times", name) for name in variants() if name.startswith("surfels")),
}


# Renderers that take long, and draw every fourth row in the quick tests.
QUARTERED = ("auto_splats", "codeword", "hpr", "voxels")


def is_slow(row: Row, name: str) -> bool:
    """Also where another feed brings the same points: tests of instancing compare the pictures of feeds."""
    is_left_out = name.startswith(QUARTERED) and ROWS.index(row) % 4 != 0
    return is_left_out or name.endswith(("=gs", "=ubo")) or row.name in BETWEEN or (row.name, name) in LONG


PICTURES = [
    pytest.param(row, name, marks=[pytest.mark.backend(of_variant(name)[0]), *slow], id=f"{row.name}-{name}")
    for name in variants() for row in ROWS if row.is_for(backends()[of_variant(name)[0]])
    for slow in ([pytest.mark.slow] if is_slow(row, name) else [],)
]  # fmt: skip


@pytest.mark.parametrize(("row", "name"), PICTURES)
def test_the_picture_stays_the_same(renderer: Renderer, row: Row, name: str) -> None:
    name, setting = of_variant(name)
    assert_allowed(renderer, row, backends()[name], setting)


@pytest.mark.parametrize(("backend", "way"), WAYS)
@pytest.mark.parametrize("row", [row for row in ROWS if not row.setting], ids=lambda row: row.name)
def test_other_pictures_stay_the_same(
    renderer: Renderer, row: Row, backend: Backend, way: dict[str, Any]
) -> None:
    """Cubes, two passes, sorted splats, pictures without filling: whatever declarations sweep or limit."""
    assert_allowed(renderer, row, backend, way)


def test_the_ways_of_surfels_are_among_them() -> None:
    ways = swept_settings(backends()["surfels"])
    drawn = [backends()["surfels"].params().passes, *(way["passes"] for way in ways if "passes" in way)]
    assert {"one", "two", "sorted"} <= set(drawn) | ({"two"} if "auto" in drawn else set())


@pytest.mark.parametrize("name", [name for name in variants() if name.endswith(FEEDS)])
def test_a_feed_brings_the_points_of_rows(renderer: Renderer, name: str) -> None:
    """Where another ran in its place, statistics would tell."""
    backend, setting = of_variant(name)
    shot = ROWS[0].shot()
    pose, surface = Pose(0, 0.0, "", shot.cloud()), Surface(renderer.gpu, shot.size)
    render_frame(renderer, Request(pose, shot.camera, backend, backends()[backend].params(setting)), surface)
    assert "instead of" not in surface.stats.chosen.get("instancing", "")
    assert "splat" not in surface.stats.skipped


def test_the_shapes_of_voxels_are_among_them() -> None:
    shapes = {way["shape"] for way in swept_settings(backends()["voxels"]) if "shape" in way}
    assert shapes == {"cubes", "flat_cubes"}


def test_limits_are_of_few_principles() -> None:
    reasons = distinct_limits(backends().values())
    assert len(reasons) <= MOST, "\n".join([f"{len(reasons)} distinct limits", *reasons])


def assert_allowed(renderer: Renderer, row: Row, backend: Backend, setting: dict[str, Any]) -> None:
    params = backend.params(setting)
    outcome = row.compare(renderer, backend, params)
    tolerance = row.tolerance_of(backend, params, Rounding.of(renderer.gpu))
    allowed = f"{tolerance.bound} ({tolerance.reason})"
    if outcome.limit is not None:
        allowed += f", or {outcome.limit.pixels:.1%} coarsely ({outcome.limit.reason})"
    assert outcome.allowed, f"{outcome.found}, {outcome.coarse:.4%} coarsely; allowed: {allowed}"


@pytest.mark.slow
@pytest.mark.parametrize(("row", "backend"), LIMITED)
def test_what_has_come_to_hold_is_no_limit(renderer: Renderer, row: Row, backend: Backend) -> None:
    """Each limit is one to some picture; else it would hide that the row holds, and goes."""
    drawn = [setting for name, setting in map(of_variant, variants()) if name == backend.name]
    ways = [backend.params(way) for way in (*drawn, *swept_settings(backend))]
    limited = [way for way in ways if row.limit_of(backend, way)]
    assert not all(row.compare(renderer, backend, way).held for way in limited)


def test_an_outcome_is_held_or_within_its_limit_or_fails(renderer: Renderer) -> None:
    """By a picture that is taken sideways: a few pixels of a limit do not allow it, all of them do."""
    still = next(row for row in ROWS if row.name.startswith("translated"))
    row = replace(
        still, variant=lambda shot: replace(shot, camera=shot.camera.orbited(40, 0)), tolerance=EXACT
    )

    def limited(share: float) -> Backend:
        class Limited(PointSquares):
            limits = {row.name: Limit(share, "")}  # noqa: RUF012

        return Limited("points")

    assert not row.compare(renderer, backends()["points"]).allowed
    assert not row.compare(renderer, limited(0.01)).allowed
    outcome = row.compare(renderer, limited(0.9))
    assert outcome.allowed
    assert not outcome.held
    assert 0.01 < outcome.coarse < outcome.found.pixels
    assert still.compare(renderer, limited(0.01)).held


def test_a_row_sets_parameters_of_those_that_have_them(renderer: Renderer) -> None:
    still = next(row for row in ROWS if row.name.startswith("translated"))
    row = replace(still, setting={"point_size": 9})
    points, surfels = backends()["points"], backends()["surfels"]
    assert row.is_for(points)
    assert not row.is_for(surfels)
    assert still.is_for(surfels)
    few = replace(still, variant=lambda shot: shot.picked(np.arange(1)))
    small, large = (replace(few, setting={"point_size": size}).compare(renderer, points) for size in (1, 9))
    assert large.found.pixels > 1.2 * small.found.pixels


def test_a_picture_of_nothing_or_of_no_number_does_not_hold(renderer: Renderer) -> None:
    still = next(row for row in ROWS if row.name.startswith("translated"))
    points = backends()["points"]
    away = replace(still, shot=lambda: replace(still.shot(), camera=Camera((0, 0, 9), (0, 0, 20))))
    assert still.compare(renderer, points).held
    assert not away.compare(renderer, points).held
    depth, color = np.zeros((4, 5)), np.zeros((4, 5, 3))
    depth[0, 0] = np.nan
    bad = RgbdImage(depth, color)
    assert difference(bad, bad).pixels == pytest.approx(1 / 20)


def test_sums_of_a_rasteriser_have_a_tolerance_of_their_own() -> None:
    row = next(row for row in ROWS if row.summed)
    surfels, points = backends()["surfels"], backends()["points"]
    assert row.tolerance_of(surfels) == row.tolerance_of(points) == row.tolerance
    assert row.tolerance_of(surfels, surfels.params({"instancing": "tiles"})) == row.tolerance
    assert row.tolerance_of(surfels, surfels.params({"instancing": "gs"})) == row.summed


def test_hardware_may_round_otherwise_but_not_where_the_same_numbers_reach_it() -> None:
    row = next(row for row in ROWS if row.name.startswith("scaled"))
    splats, points, hardware = backends()["surfels"], backends()["points"], Rounding(2.5, 1 / 512)
    errors = [row.tolerance_of(one, driver=hardware).error for one in (points, splats)]
    assert row.tolerance.error < errors[0] < 3 * row.tolerance.error
    assert errors[0] < errors[1] < errors[0] + 1 / 512, "corners are moved"
    assert EXACT.on(hardware, rasterised=True) == EXACT


def test_rows_have_names_of_their_own() -> None:
    assert len({row.name for row in ROWS}) == len(ROWS)
    assert {row.name for row in ROWS} >= BETWEEN | {name for name, _ in LONG}


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
    for backend in map(find_backend, DRAWS_POINTS):
        found = difference(picture(renderer, backend, shot), picture(renderer, backend, nudged))
        assert not any(other.tolerance.holds(found) for other in ROWS)
