"""Gaussian splats: colours, opacity, ellipses and normals of the columns that training programs write."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.scan.contents import PointContents
from viewer.scan.reading import splats
from viewer.scan.reading.cloud import assemble
from viewer.scan.reading.corrections import Corrections
from viewer.scan.reading.sequence import Decided

RNG = np.random.default_rng(6)
NAMES = ["x", "y", "z", "nx", "ny", "nz", *splats.COLORS, "opacity", *splats.SCALES, *splats.ROTATION]


def quaternion(axis: np.ndarray, angle: float) -> np.ndarray:
    return np.append(np.cos(angle / 2), np.sin(angle / 2) * axis / np.linalg.norm(axis))


def turned(rotation: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """A vector turned by a quaternion w x y z: q v q*, written out."""
    w, v = rotation[0], rotation[1:]
    return vector + 2 * np.cross(v, np.cross(v, vector) + w * vector)


def test_columns_are_found_in_any_case_and_only_all_together() -> None:
    found = splats.splat_columns([name.upper() for name in NAMES])
    assert found is not None
    assert found.scales == ("SCALE_0", "SCALE_1", "SCALE_2")
    assert splats.splat_columns([name for name in NAMES if name != "rot_2"]) is None
    assert splats.splat_columns([name for name in NAMES if name != "scale_1"]) is None
    of_two = splats.splat_columns([name for name in NAMES if name != "scale_2"])
    assert of_two is not None
    assert of_two.scales == ("scale_0", "scale_1")


@pytest.mark.parametrize("scales", [2, 3])
def test_splats_without_opacity_are_opaque(scales: int) -> None:
    names = [*splats.COLORS, *splats.SCALES[:scales], *splats.ROTATION]
    columns = (
        dict.fromkeys("xyz", np.arange(20.0)) | dict.fromkeys(names, np.zeros(20)) | {"rot_0": np.ones(20)}
    )
    decided = Decided()
    cloud = assemble(PointContents(columns=columns), decided)
    assert decided.reading["splats"].value is True
    assert not cloud.scalars
    assert cloud.axes is not None
    assert cloud.colors is not None
    np.testing.assert_array_equal(cloud.colors[0], (128, 128, 128, 255))


@pytest.mark.parametrize(("count", "text"), [(45, "1 to 3"), (24, "1 to 2"), (9, "1")])
def test_higher_harmonics_are_named_as_unused(count: int, text: str) -> None:
    found = splats.splat_columns([*NAMES, *(f"f_rest_{i}" for i in range(count))])
    assert found is not None
    assert splats.unused(found) == (f"{count} harmonics of degree {text}",)
    assert len(found.all) == 11 + count


def test_colors_are_the_first_harmonic_and_alpha_is_the_logistic_function() -> None:
    harmonics = np.array([[0, 0, 0], [1.7724538, -1.7724538, 0], [9, -9, np.nan]], np.float32)
    found = splats.splat_colors(harmonics, np.array([0, 4, -200], np.float32))
    np.testing.assert_array_equal(found[0], (128, 128, 128, 128))
    np.testing.assert_array_equal(found[1], (255, 0, 128, 250))
    np.testing.assert_array_equal(found[2], (255, 0, 0, 0))


def test_ellipses_are_the_two_longest_half_axes_turned() -> None:
    points = RNG.normal(size=(200, 3))
    rotation = np.array(
        [quaternion(axis, angle) for axis, angle in zip(points, np.arange(200.0), strict=True)]
    )
    lengths = np.exp(RNG.normal(size=(200, 3)))
    axes, normals = splats.splat_ellipses(np.log(lengths), rotation * 3, points)
    order = np.argsort(-lengths, axis=1)
    for row in range(200):
        longest, second, shortest = order[row]
        unit = np.eye(3)
        np.testing.assert_allclose(
            axes[row, :3], turned(rotation[row], unit[longest]) * lengths[row, longest], atol=1e-5
        )
        assert axes[row, 3] == pytest.approx(lengths[row, second], rel=1e-5)
        across = turned(rotation[row], unit[shortest])
        assert abs(normals[row] @ across) == pytest.approx(1, abs=1e-5)
    assert ((points - points.mean(axis=0)) * normals).sum(axis=1).min() >= 0


def test_the_normal_of_a_flat_splat_is_its_third_axis() -> None:
    rotation = np.tile(quaternion(np.array([1.0, 0, 0]), np.pi / 2), (2, 1))
    points = np.array([[0, 5, 0], [0, -5, 0]])
    axes, normals = splats.splat_ellipses(np.log([[1, 2], [3, 2]]), rotation, points)
    np.testing.assert_allclose(normals, [[0, 1, 0], [0, -1, 0]], atol=1e-6)
    np.testing.assert_allclose(axes, [[0, 0, 2, 1], [3, 0, 0, 2]], atol=1e-6)


def test_rows_without_a_rotation_or_with_nan_are_round() -> None:
    rotation = np.array([[0, 0, 0, 0], [1, 0, 0, 0], [1, np.nan, 0, 0], [1, 0, 0, 0]])
    scales = np.array([[0, 0, 0], [np.nan, 0, 0], [0, 0, 0], [0, 0, -1]], np.float64)
    axes, normals = splats.splat_ellipses(scales, rotation, np.ones((4, 3)))
    assert not axes[:3].any()
    assert not normals[:3].any()
    np.testing.assert_allclose(np.abs(normals[3]), (0, 0, 1))


def test_the_record_says_that_points_are_splats() -> None:
    found = splats.splat_columns(NAMES)
    assert splats.decide(found).value is True
    assert splats.decide(None).value is None
    assert splats.decide(found, Corrections.parse({"splats": "no"})).value is False
