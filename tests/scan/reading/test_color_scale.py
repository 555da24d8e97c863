"""The scale of colours: by type, by the largest value, and by several frames together."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan.reading import colors
from viewer.scan.reading.colors import ColorScale, decide, evidence_of, scale_of
from viewer.scan.reading.corrections import Corrections


@pytest.mark.parametrize(
    ("values", "dtype", "wanted"),
    [
        ([0, 1], "u1", ColorScale(255, True)),
        ([0, 200], "u2", ColorScale(255, False)),
        ([0, 256], "u2", ColorScale(65535, True)),
        ([0, 200], "i4", ColorScale(255, False)),
        ([0, 40000], "u4", ColorScale(65535, True)),
        ([0, 0.5], "f4", ColorScale(1, True)),
        ([0, 1], "f4", ColorScale(1, False)),
        ([0, 0.9, 0.3, 1.02], "f4", ColorScale(1, True)),
        ([0, 2, 1, 1], "f8", ColorScale(255, False)),
        ([0, 255], "f8", ColorScale(255, True)),
        ([0.5, 254.5], "f8", ColorScale(255, True)),
        ([0, 256], "f8", ColorScale(65535, True)),
        ([np.nan, 0.5], "f4", ColorScale(1, True)),
        ([np.inf, 200], "f4", ColorScale(255, False)),
        ([False, True], "?", ColorScale(1, True)),
    ],
)
def test_the_scale_follows_the_type_and_the_largest_value(
    values: list[float], dtype: str, wanted: ColorScale
) -> None:
    assert scale_of(evidence_of(np.array(values, dtype)[:, None])) == wanted


@pytest.mark.parametrize("order", [1, -1])
def test_a_dark_frame_has_the_scale_of_the_bright_ones(order: int) -> None:
    frames = [np.full((5, 3), value, np.uint16) for value in (250, 40000)][::order]
    decision = decide([evidence_of(each) for each in frames])
    assert (decision.value, decision.source) == (65535, "file")


def test_a_scale_that_nothing_tells_is_assumed_with_the_others_to_choose_from() -> None:
    decision = decide([evidence_of(np.full((5, 3), 200, np.uint16))] * 3)
    assert (decision.value, decision.source) == (255, "assumed")
    assert decision.alternatives == ("65535", "none")


def test_a_frame_brighter_than_the_scale_contradicts_it() -> None:
    bright, dark = (evidence_of(np.full((5, 3), value, np.uint16)) for value in (40000, 200))
    assert colors.contradicts(bright, 255)
    assert not colors.contradicts(dark, 255)
    assert not colors.contradicts(dark, 65535)


def test_the_user_states_the_scale() -> None:
    evidence = [evidence_of(np.full((5, 3), 200, np.uint16))]
    assert decide(evidence, Corrections.parse({"colors": "65535"})).value == 65535
    assert decide(evidence, Corrections.parse({"colors": "none"})).value == "none"
    with pytest.raises(InputError, match="no colours"):
        decide([], Corrections.parse({"colors": "255"}))


def test_no_colors_no_scale() -> None:
    assert decide([]).value is None
