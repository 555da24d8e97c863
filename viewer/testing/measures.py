"""The contract of measures: values that do not depend on where the subject stands, and grow with it."""

from __future__ import annotations

from functools import partial
from itertools import product
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from ..analysis.measures import Quantity
from ..analysis.measures.kinds import MeasureKind, measure_kinds
from ..analysis.measures.surface import Found, PoseSurface, Refused
from ..errors import unknown_name
from ..scan.points import PointCloud
from ..scan.pose import Pose
from .check import Check
from .scenes import sphere

_POWER = {"length": 1, "angle": 0, "area": 2, "volume": 3}  # of lengths, in each quantity
_FRAMES, _MORE = 5, 3  # frames of landmarks; landmarks beyond the least number
_AWAY = (300.0, -200.0, 100.0)
_RADIUS, _CAP = 20.0, 0.6  # of a ball, and the angle of a cap around which landmarks lie, radians


def measure_checks(kind: str) -> list[Check]:
    """The contract of the kind of measure of this name, for each combination of its options.

    Raises InputError for an unknown name.
    """
    if kind not in (kinds := measure_kinds()):
        raise unknown_name("kind of measure", kind, kinds)
    found = kinds[kind]
    checks = [Check("it_declares_itself", kind, partial(_it_declares_itself, found))]
    functions = _ON_SURFACES if found.needs_surface else _OF_POINTS
    for values in product(*found.choices.values()):
        options = dict(zip(found.choices, values, strict=True))
        variant = ",".join([kind, *values])
        checks += [Check(f.__name__[1:], kind, partial(f, found, options), variant) for f in functions]
    return checks


def _it_declares_itself(kind: MeasureKind) -> None:
    assert kind.name.isidentifier(), "the name must be an identifier, for files and commands"
    assert kind.title
    assert kind.about
    assert kind.quantity in get_args(Quantity)
    assert kind.least >= 1
    assert kind.most is None or kind.most >= kind.least
    for name, values in kind.choices.items():
        assert isinstance(values, tuple), f"the values of {name} must be a tuple of texts"
        assert values
    assert not (kind.needs_surface and kind.lines), (
        "a measure on the surface must return its lines with the value"
    )


# --- measures of landmarks ------------------------------------------------------------------------


def _it_has_a_value_a_frame(kind: MeasureKind, options: dict[str, str]) -> None:
    positions = _landmarks(kind)
    values = _values(kind, positions, options)
    assert np.isfinite(values).all(), "random landmarks must have values"
    for frame in range(_FRAMES):
        alone = _values(kind, positions[frame : frame + 1], options)
        np.testing.assert_allclose(alone, values[frame : frame + 1], rtol=1e-9)


def _it_does_not_depend_on_where_the_subject_stands(kind: MeasureKind, options: dict[str, str]) -> None:
    positions = _landmarks(kind)
    moved = positions @ _rotation().T + _AWAY
    np.testing.assert_allclose(
        _values(kind, moved, options), _values(kind, positions, options), rtol=1e-6, atol=1e-9
    )


def _it_grows_with_the_subject(kind: MeasureKind, options: dict[str, str]) -> None:
    positions = _landmarks(kind)
    grown = 2.0 ** _POWER[kind.quantity] * _values(kind, positions, options)
    np.testing.assert_allclose(_values(kind, 2 * positions, options), grown, rtol=1e-6, atol=1e-9)


def _landmarks_in_one_place_are_no_error(kind: MeasureKind, options: dict[str, str]) -> None:
    _values(kind, np.ones_like(_landmarks(kind)), options)


def _its_lines_can_be_drawn(kind: MeasureKind, options: dict[str, str]) -> None:
    if kind.lines is not None:
        _assert_lines(kind.lines(_landmarks(kind)[0], options))


# --- measures of a surface ------------------------------------------------------------------------


def _it_has_a_value_or_a_reason(kind: MeasureKind, options: dict[str, str]) -> None:
    found = _on_ball(kind, options)
    if isinstance(found, Refused):
        assert found.reason, "a refusal must say why"
        return
    assert np.isfinite(found.value)
    assert found.deviation >= 0
    assert found.gradient.shape == (len(_around_a_cap(kind)), 3)
    assert np.isfinite(found.gradient).all()
    _assert_lines(found.lines)


def _it_is_the_same_elsewhere_and_grows_with_the_surface(kind: MeasureKind, options: dict[str, str]) -> None:
    here = _on_ball(kind, options)
    for away, scale in ((_AWAY, 1.0), ((0, 0, 0), 2.0)):
        there = _on_ball(kind, options, away, scale)
        assert type(there) is type(here)
        if isinstance(here, Found) and isinstance(there, Found):
            expected = scale ** _POWER[kind.quantity] * here.value
            np.testing.assert_allclose(there.value, expected, rtol=0.02)


_OF_POINTS = (
    _it_has_a_value_a_frame,
    _it_does_not_depend_on_where_the_subject_stands,
    _it_grows_with_the_subject,
    _landmarks_in_one_place_are_no_error,
    _its_lines_can_be_drawn,
)
_ON_SURFACES = (_it_has_a_value_or_a_reason, _it_is_the_same_elsewhere_and_grows_with_the_surface)


def _count(kind: MeasureKind) -> int:
    return kind.least + _MORE if kind.most is None else kind.most


def _landmarks(kind: MeasureKind) -> NDArray[np.float64]:
    """Landmarks at random, (T, K, 3)."""
    return np.random.default_rng(3).normal(size=(_FRAMES, _count(kind), 3))


def _values(kind: MeasureKind, positions: NDArray[np.float64], options: dict[str, str]) -> NDArray:
    compute: Any = kind.compute
    with np.errstate(all="ignore"):
        values = np.asarray(compute(positions, options))
    assert values.shape == (len(positions),), f"values have shape {values.shape}, expected one per frame"
    return values


def _rotation() -> NDArray[np.float64]:
    """A rotation at random, (3, 3)."""
    turned = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    return turned * np.linalg.det(turned)


def _around_a_cap(kind: MeasureKind) -> NDArray[np.float64]:
    """Landmarks around a cap of the ball, (K, 3)."""
    turns = 2 * np.pi * np.arange(_count(kind)) / _count(kind)
    ring = [np.sin(_CAP) * np.cos(turns), np.sin(_CAP) * np.sin(turns), np.full(len(turns), np.cos(_CAP))]
    return _RADIUS * np.stack(ring, axis=1)


def _on_ball(
    kind: MeasureKind, options: dict[str, str], away: tuple[float, ...] = (0, 0, 0), scale: float = 1.0
) -> Found | Refused:
    ball = sphere(4000, _RADIUS)
    cloud = PointCloud.from_arrays(scale * ball.world() + away, normals=ball.normals)
    compute: Any = kind.compute
    found = compute(PoseSurface(Pose.of(0, 0.0, "ball", cloud)), scale * _around_a_cap(kind) + away, options)
    assert isinstance(found, Found | Refused), (
        f"the measure returns a {type(found).__name__}, not Found or Refused"
    )
    return found


def _assert_lines(lines: Any) -> None:
    for line in lines:
        assert np.ndim(line) == 2, "a line must be an array of positions (P, 3)"
        assert np.shape(line)[1] == 3
        assert np.isfinite(line).all()
