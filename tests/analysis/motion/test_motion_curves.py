"""Curves of a known motion: turns and shifts along the axes of the subject, their ±, and gaps."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from viewer.analysis.measures.curves import unit_of
from viewer.analysis.motion.axes import anatomical_axes
from viewer.analysis.motion.curves import LOST, PATH, RESIDUAL, SHIFTS, TURNS, motion_curves, path_curves
from viewer.analysis.motion.displacements import MeanPath
from viewer.analysis.motion.stabilise import FEW, FrameMotion
from viewer.analysis.track import Known
from viewer.rigid import Rigid, rigid_matrix

MIDDLE = np.array([10.0, 20.0, 30.0])


def about_middle(turn: tuple[float, float, float], shift: tuple[float, float, float]) -> Rigid:
    rotation = Rotation.from_rotvec(turn, degrees=True).as_matrix()
    return Rigid(rigid_matrix(rotation, MIDDLE + shift - rotation @ MIDDLE))


def test_curves_are_along_the_axes_of_the_subject_and_have_its_gaps() -> None:
    axes = anatomical_axes("+z", 90.0)
    covariance = np.diag([0.01, 0.04, 0.09, *np.radians([1.0, 2.0, 3.0]) ** 2])
    known = {
        0: FrameMotion(about_middle((0, 0, 12.0), (1.0, 2.0, 3.0)), covariance, residual=0.2),
        2: FrameMotion.gap(FEW),
    }
    curves = motion_curves(known, np.arange(4) / 25, MIDDLE, axes)
    assert list(curves) == [*TURNS, *SHIFTS, RESIDUAL]
    turns, shifts = ([curves[name].values[0] for name in names] for names in (TURNS, SHIFTS))
    np.testing.assert_allclose(turns, axes @ [0, 0, 12.0], atol=1e-9)
    np.testing.assert_allclose(shifts, axes @ [1.0, 2.0, 3.0], atol=1e-9)
    vertical = curves[TURNS[1]]
    assert vertical.values[0] == pytest.approx(12.0)
    assert vertical.sigmas[0] == pytest.approx(3.0)
    assert curves[SHIFTS[1]].sigmas[0] == pytest.approx(0.3)
    assert curves[RESIDUAL].values[0] == 0.2
    assert vertical.known.tolist() == [Known.TRACKED, Known.PENDING, Known.GAP, Known.PENDING]
    assert np.isnan(vertical.values[1:]).all()
    assert vertical.note(2) == FEW
    assert [unit_of(curves[name].quantity, "mm") for name in (TURNS[0], SHIFTS[0])] == ["°", "mm"]


def test_the_mean_path_of_a_region_begins_at_0_and_has_gaps() -> None:
    axes, times = anatomical_axes("+z", 90.0), np.arange(4) / 25
    positions = MIDDLE + np.array([[1.0, 0, 0], [4, 4, 0], [np.nan] * 3, [1, 0, 2]])
    path = MeanPath(positions, np.array([0, 0.1, np.nan, 0.2]), np.ones(4))
    recorded = path_curves(path, 0, times, axes)
    assert tuple(recorded) == PATH
    along = np.array([recorded[name].values for name in PATH[:3]])
    np.testing.assert_allclose(along[:, 1], axes @ [3.0, 4, 0], atol=1e-9)
    distance = recorded[PATH[3]]
    np.testing.assert_allclose(distance.values, [0, 5, np.nan, 2], atol=1e-9)
    np.testing.assert_allclose(distance.sigmas, [0, 0.1, np.nan, 0.2])
    assert distance.note(2) == LOST
    still = (Rigid(), Rigid(rigid_matrix(np.eye(3), np.array([0, -4.0, 0]))), Rigid(), None)
    seen = path_curves(path, 0, times, axes, still)[PATH[3]]
    np.testing.assert_allclose(seen.values, [0, 3, np.nan, np.nan], atol=1e-9)
    assert "not stabilised" in seen.note(3)
