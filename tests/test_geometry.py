"""What is up has names, and directions where it is along no axis; the front is at right angles to it."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.geometry import AXES, front_vector, nearest_axis, up_name, up_vector
from viewer.look import Look


@pytest.mark.parametrize("up", [*AXES, "0.1 -0.2 3", "0.5 0.5 0.5", "0.1 -7 0"])
def test_up_and_front_are_unit_vectors_at_right_angles(up: str) -> None:
    above, front = np.array(up_vector(up)), np.array(front_vector(up))
    assert np.linalg.norm(above) == pytest.approx(1)
    assert np.linalg.norm(front) == pytest.approx(1)
    assert above @ front == pytest.approx(0, abs=1e-12)
    assert front @ front_vector(nearest_axis(up_vector(up))) > 0.5
    assert up_vector(up_name(above)) == pytest.approx(above, abs=1e-4)


def test_y_and_z_up_or_down_are_seen_with_x_to_the_right() -> None:
    for up in ("+y", "-y", "+z", "-z"):
        assert np.cross(up_vector(up), front_vector(up)) == pytest.approx([1, 0, 0])


def test_what_is_as_good_as_an_axis_has_its_name() -> None:
    assert up_name((1e-5, 0, 9)) == "+z"
    assert up_name((0, -2, 1e-4)) == "-y"
    assert up_name((0, 3, 4)) == "0.0000 0.6000 0.8000"


@pytest.mark.parametrize("up", ["", "z", "+w", "1 2", "1 2 3 4", "0 0 0", "nan 0 1", "inf 0 0", "a b c"])
def test_what_is_no_direction_is_refused_with_the_axes(up: str) -> None:
    with pytest.raises(InputError, match="up axis"):
        up_vector(up)
    with pytest.raises(InputError):
        Look(up=up)
