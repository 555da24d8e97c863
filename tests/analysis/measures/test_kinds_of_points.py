"""Measures of landmarks alone, against values that are known."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.analysis.measures import Measure
from viewer.analysis.measures.kinds import kind_of, measure_kinds
from viewer.errors import InputError


def value(kind: str, *places: tuple[float, ...], **options: str) -> float:
    """The value of a kind at places of one frame."""
    measure = Measure("m", kind, tuple(map(str, range(len(places)))), options)
    found = kind_of(measure).compute(np.array([places], float), options)  # type: ignore[call-arg, arg-type]
    assert found.shape == (1,)  # type: ignore[union-attr]
    return float(found[0])  # type: ignore[index]


SQUARE = [(0.0, 0, 0), (1.0, 0, 0), (1.0, 1, 0), (0.0, 1, 0)]


@pytest.mark.parametrize(
    ("kind", "places", "options", "expected"),
    [
        ("distance", [(0, 0, 0), (2, 3, 6)], {}, 7),
        ("distance", [(1, 1, 1), (1, 1, 1)], {}, 0),
        ("angle", [(1, 0, 0), (0, 0, 0), (1, 1, 0)], {}, 45),
        ("angle", [(1, 0, 0), (0, 0, 0), (-1, 1e-9, 0)], {}, 180),
        ("angle", [(1, 0, 0), (1, 0, 0), (0, 1, 0)], {}, np.nan),
        ("plane_angle", [(0, 0, 0), (1, 0, 1), *SQUARE], {}, 45),
        ("plane_angle", [(0, 0, 0), (-1, 0, -1), *SQUARE[:3]], {}, 45),
        ("plane_angle", [(0, 0, 0), (0, 0, 1), (0, 0, 0), (1, 0, 0), (2, 0, 0)], {}, np.nan),
        ("plane_distance", [(5, 6, 7), *SQUARE], {}, 7),
        ("plane_distance", [(5, 6, 7), *SQUARE[2::-1]], {}, -7),
        # the middle of a head that looks to +z: positive on the side of the first of each pair
        ("plane_distance", [(3, 1, 1), (4, 0, 0), (-2, 0, 0), (5, 2, 1), (-3, 2, 1), (1, 9, 3), (1, 9, 3)],
         {"plane": "between"}, 2),
        ("curve", SQUARE, {"shape": "straight"}, 3),
        ("curve", SQUARE, {"shape": "straight", "closed": "yes"}, 4),
        ("curve", [(0, 0, 0), (1, 2, 2), (2, 4, 4)], {}, 6),
        ("curve", [(0, 0, 0), (0, 0, 0), (1, 2, 2)], {}, 3),
    ],
)  # fmt: skip
def test_values(kind: str, places: list, options: dict[str, str], expected: float) -> None:
    assert value(kind, *places, **options) == pytest.approx(expected, abs=1e-7, nan_ok=True)


def test_a_curve_through_a_circle_is_about_as_long() -> None:
    turns = 2 * np.pi * np.arange(12) / 12
    places = [(np.cos(turn), np.sin(turn), 0.5) for turn in turns]
    assert value("curve", *places, closed="yes") == pytest.approx(2 * np.pi, rel=0.002)


def test_a_plane_between_pairs_is_that_of_symmetry() -> None:
    """However it is turned, and with one landmark off."""
    rng = np.random.default_rng(0)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    left = rng.uniform(-50, 50, (6, 3)) + np.array([60, 0, 0])
    pairs = np.stack([left, left * [-1, 1, 1]], axis=1).reshape(-1, 3)
    places = np.concatenate([[[7.0, 3, 2]], pairs]) @ turn.T + 1e4
    assert value("plane_distance", *map(tuple, places), plane="between") == pytest.approx(7)


@pytest.mark.parametrize(
    ("measure", "told"),
    [
        (Measure("m", "distanse", ("a", "b")), "Did you mean 'distance'"),
        (Measure("m", "distance", ("a",)), "takes 2 landmarks, not 1"),
        (Measure("m", "area", ("a", "b")), "takes 3 or more landmarks, not 2"),
        (Measure("m", "curve", ("a", "b"), {"shap": "smooth"}), "unknown option of 'curve' 'shap'"),
        (Measure("m", "curve", ("a", "b"), {"shape": "round"}), "unknown value of 'shape' 'round'"),
    ],
)
def test_measures_that_are_none_are_told(measure: Measure, told: str) -> None:
    with pytest.raises(InputError, match=told):
        kind_of(measure)


def test_kinds_declare_themselves() -> None:
    kinds = measure_kinds()
    assert {kind.quantity for kind in kinds.values()} == {"length", "angle", "area", "volume"}
    assert all(name == kind.name and kind.title and kind.about for name, kind in kinds.items())
