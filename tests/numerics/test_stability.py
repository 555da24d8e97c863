"""The numerical stability suite of viewer/bench/numerics.py, for every backend."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import of_variant, variants

from viewer.backends import backends
from viewer.bench.numerics import Difference, Picture, Row, difference, picture, rows
from viewer.renderer import Renderer

ROWS = list(rows())
NOTHING = np.inf


@pytest.mark.parametrize("variant", variants())
@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_the_picture_stays_the_same(renderer: Renderer, row: Row, variant: str) -> None:
    name, setting = of_variant(variant)
    backend = backends()[name]
    found, limit = row.compare(renderer, backend, backend.params(setting)), row.limit_of(backend)
    held = row.tolerance.holds(found)
    if limit and not held:
        pytest.xfail(f"a limit in principle: {limit} ({found})")
    assert held, f"{found}; allowed: {row.tolerance.bound} ({row.tolerance.reason})"


def test_rows_have_names_of_their_own() -> None:
    assert len({row.name for row in ROWS}) == len(ROWS)


def test_limits_of_backends_name_rows() -> None:
    named = {name for backend in backends().values() for name in getattr(backend.module, "LIMITS", {})}
    assert named <= {row.name for row in ROWS}


def test_difference_of_pictures_that_differ_in_known_pixels() -> None:
    depth, color = np.zeros((4, 5)), np.full((4, 5, 3), 100)
    depth[0] = NOTHING
    one = Picture(depth, color)
    assert difference(one, one) == Difference(0, 0, 0)

    gone, back, other = depth.copy(), depth.copy(), color.copy()
    gone[1, 0] = NOTHING
    back[1, 1] += 7
    other[1, 2, 0] += 50
    for changed in (Picture(gone, color), Picture(back, color), Picture(depth, other)):
        assert difference(one, changed) == difference(changed, one)
        assert difference(one, changed).pixels == pytest.approx(1 / 20)

    little = Picture(depth + 0.01, color + 1)
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
