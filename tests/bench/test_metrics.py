"""Every metric on pictures whose error is known in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.bench import metrics

SIZE = (60, 80)  # rows, columns


def disc(radius: float, center: tuple[float, float] = (30, 40)) -> NDArray[np.bool_]:
    row, column = np.indices(SIZE)
    return np.hypot(row - center[0], column - center[1]) <= radius


def noise(seed: int, low: int = 0, high: int = 256) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(low, high, (*SIZE, 3)).astype(np.uint8)


def directions(seed: int) -> NDArray[np.float64]:
    v = np.random.default_rng(seed).normal(size=(*SIZE, 3))
    return v / np.linalg.norm(v, axis=2, keepdims=True)


# --- coverage ------------------------------------------------------------------------------


def test_a_disc_missing_inside_is_its_area_of_holes_and_moves_no_outline() -> None:
    true, gap = disc(25), disc(6)
    errors = metrics.coverage(true & ~gap, true)
    assert errors["hole_percent"] == 100 * gap.sum() / true.sum()
    assert errors["spill_percent"] == errors["boundary_mean"] == errors["boundary_p95"] == 0


def test_a_slit_is_a_gap_that_does_not_reach_the_outline() -> None:
    true, gap, notch = disc(25), disc(6), disc(6, (30, 65))
    assert metrics.slits(true & ~gap, true) == 100 * gap.sum() / true.sum()
    assert metrics.slits(true & ~notch, true) == 0
    assert metrics.slits(true, true) == 0


@pytest.mark.parametrize("k", [1, 20])
def test_spill_reaches_as_far_as_an_edge_moved(k: int) -> None:
    column = np.indices(SIZE)[1]
    errors = metrics.coverage(column < 40 + k, column < 40)
    assert errors["spill_p95"] == pytest.approx(k, abs=0.05 * k)
    assert metrics.coverage(column < 40 - k, column < 40)["spill_p95"] == 0


def test_a_disc_beside_the_silhouette_is_its_area_of_spill() -> None:
    true, blob = disc(12), disc(4, (30, 70))
    errors = metrics.coverage(true | blob, true)
    assert errors["spill_percent"] == 100 * blob.sum() / true.sum()
    assert errors["hole_percent"] == 0


@pytest.mark.parametrize("k", [1, 3, 7])
def test_an_edge_moved_by_k_pixels_has_a_boundary_error_of_k(k: int) -> None:
    column = np.indices(SIZE)[1]
    errors = metrics.coverage(column < 40 + k, column < 40)
    assert errors["boundary_mean"] == errors["boundary_p95"] == k
    assert errors["spill_percent"] == 100 * k / 40


@pytest.mark.parametrize("k", [2, 5])
def test_a_disc_grown_by_k_pixels_has_a_boundary_error_of_k(k: int) -> None:
    errors = metrics.coverage(disc(15 + k), disc(15))
    assert errors["boundary_mean"] == pytest.approx(k, abs=0.5)  # pixels of a round outline
    assert errors["boundary_p95"] == pytest.approx(k, abs=1)


def test_a_true_hole_that_is_drawn_too_large_is_an_error_of_the_outline() -> None:
    errors = metrics.coverage(disc(25) & ~disc(10), disc(25) & ~disc(7))
    assert errors["boundary_p95"] == pytest.approx(3, abs=1)


def test_nothing_drawn_is_all_hole_and_has_no_outline() -> None:
    errors = metrics.coverage(np.zeros(SIZE, bool), disc(10))
    assert errors["hole_percent"] == 100
    assert math.isnan(errors["boundary_mean"])


# --- depth ---------------------------------------------------------------------------------


def test_a_plane_moved_by_d_has_a_depth_bias_of_d() -> None:
    true = np.where(disc(20), 8.0, np.inf)
    errors = metrics.depth(true + 0.25, true, footprint=np.full(SIZE, 0.5), step=0.1)
    assert (
        errors["depth_bias"] == errors["depth_rmse"] == errors["depth_median"] == errors["depth_p95"] == 0.25
    )
    assert errors["depth_bias_px"] == errors["depth_rmse_px"] == errors["depth_p95_px"] == 0.5
    assert errors["wrong_layer_percent"] == 0  # within four spacings


def test_a_quarter_of_pixels_on_another_sheet_is_a_quarter_of_wrong_layer() -> None:
    true = np.full(SIZE, 5.0)
    drawn = true.copy()
    drawn[:, :20] += 1
    errors = metrics.depth(drawn, true, np.ones(SIZE), step=0.1)
    assert errors["wrong_layer_percent"] == 25
    assert errors["depth_median"] == 0
    assert errors["depth_rmse"] == 0.5


def test_the_sign_of_the_bias_is_positive_behind() -> None:
    true = np.full(SIZE, 5.0)
    assert metrics.depth(true + 1, true, np.ones(SIZE), 1)["depth_bias"] == 1
    assert metrics.depth(true - 1, true, np.ones(SIZE), 1)["depth_bias"] == -1


def test_pixels_that_one_picture_lacks_have_no_depth_error() -> None:
    errors = metrics.depth(np.full(SIZE, np.inf), np.ones(SIZE), np.ones(SIZE), 1)
    assert errors.pop("through_percent") == errors.pop("closed_percent") == 0
    assert all(math.isnan(value) for value in errors.values())


def test_through_counts_what_lies_behind_in_parts_of_the_silhouette() -> None:
    true = np.where(np.indices(SIZE)[1] < 40, 5.0, np.inf)
    drawn = np.full(SIZE, 5.0)
    drawn[:, :10] += 1  # shows through
    drawn[:, 10:20] -= 1  # floats before it
    drawn[:, 20:30] = np.inf  # a hole
    drawn[:, 30:40] += 0.35  # of one sheet still
    errors = metrics.depth(drawn, true, np.ones(SIZE), step=0.1)
    assert errors["through_percent"] == 25
    assert errors["closed_percent"] == 50  # what floats before the surface hides what is behind it
    holes = metrics.coverage(np.isfinite(drawn), np.isfinite(true))["hole_percent"]
    assert holes + errors["through_percent"] + errors["closed_percent"] == 100
    assert errors["wrong_layer_percent"] == pytest.approx(100 * 2 / 3)


# --- normals -------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", [1e-6, 0.1, 10, 90, 150])
def test_normals_turned_by_an_angle(angle: float) -> None:
    true = directions(1)
    side = np.cross(true, directions(2))
    side /= np.linalg.norm(side, axis=2, keepdims=True)
    turned = true * math.cos(math.radians(angle)) + side * math.sin(math.radians(angle))
    errors = metrics.normals(turned, true)
    for kind in ("mean", "median", "p95"):
        assert errors[f"normal_signed_{kind}"] == pytest.approx(angle, rel=1e-6)
        assert errors[f"normal_{kind}"] == pytest.approx(min(angle, 180 - angle), rel=1e-6)


def test_normals_that_point_the_other_way_are_wrong_only_where_signs_count() -> None:
    errors = metrics.normals(-directions(1), directions(1))
    assert errors["normal_p95"] == 0
    assert errors["normal_signed_median"] == 180


def test_zero_normals_have_no_part() -> None:
    true, drawn = directions(1), directions(1)
    drawn[:30] = 0
    drawn[30:, :10] = np.nan
    assert metrics.normals(drawn, true)["normal_signed_mean"] == 0


# --- colour --------------------------------------------------------------------------------


@pytest.mark.parametrize("offset", [1, 8, 60])
def test_psnr_of_a_known_offset(offset: int) -> None:
    true, inside = noise(3, high=256 - 60), disc(20)
    drawn = np.where(inside[..., None], true + offset, true).astype(np.uint8)
    errors = metrics.color(drawn, true, inside)
    assert errors["psnr"] == pytest.approx(20 * math.log10(255 / offset), rel=1e-9)
    share = inside.mean()
    assert errors["psnr_frame"] == pytest.approx(errors["psnr"] - 10 * math.log10(share), rel=1e-9)


def test_ssim_of_flat_pictures_is_its_luminance_term() -> None:
    a, b = 100, 140
    pictures = (np.full((*SIZE, 3), value, np.uint8) for value in (a, b))
    errors = metrics.color(*pictures, inside=disc(20))
    stabiliser = (0.01 * 255) ** 2
    expected = (2 * a * b + stabiliser) / (a**2 + b**2 + stabiliser)
    assert errors["ssim"] == pytest.approx(expected, rel=1e-6)
    assert errors["ssim_frame"] == pytest.approx(expected, rel=1e-6)


def test_flip_of_black_and_white_is_nearly_one() -> None:
    pytest.importorskip("flip_evaluator", reason="no wheel of flip-evaluator for this platform")
    black = np.zeros((*SIZE, 3), np.uint8)
    assert metrics.color(black + np.uint8(255), black, disc(20))["flip_frame"] > 0.9


def test_alpha_has_no_part() -> None:
    true = np.dstack([noise(3), np.full(SIZE, 255, np.uint8)])
    drawn = np.dstack([noise(3), np.zeros(SIZE, np.uint8)])
    assert metrics.color(drawn, true, disc(20))["psnr_frame"] == math.inf


def test_pictures_below_the_window_of_ssim_have_none() -> None:
    small = noise(3)[:8, :8]
    errors = metrics.color(small, small, np.ones((8, 8), bool))
    assert math.isnan(errors["ssim"])
    assert errors["psnr"] == math.inf


@pytest.mark.parametrize(
    "changed",
    [np.s_[30:45, 20:60], np.s_[:5, :9], np.s_[40:, 50:], np.s_[30:31, 79:80], np.s_[:, 40:41]],
    ids=["inside", "corner", "other corner", "a pixel at the edge", "a column"],
)
def test_looking_only_where_pictures_differ_changes_nothing(
    monkeypatch: pytest.MonkeyPatch, changed: tuple[slice, slice]
) -> None:
    true = noise(3)
    drawn = true.copy()
    drawn[changed] = noise(4)[changed]
    found = metrics.color(drawn, true, disc(20))
    monkeypatch.setattr(metrics, "_box", lambda mask, margin: np.s_[:, :])
    np.testing.assert_equal(found, metrics.color(drawn, true, disc(20)))


@pytest.mark.parametrize("center", [(30, 40), (2, 40), (30, 79)])
def test_looking_only_where_something_is_changes_nothing(
    monkeypatch: pytest.MonkeyPatch, center: tuple[float, float]
) -> None:
    true = disc(15, center) & ~disc(4, center)
    drawn = (disc(14, center) | disc(5, (30, 55))) & (noise(3)[..., 0] > 60)
    found = metrics.coverage(drawn, true)
    monkeypatch.setattr(metrics, "_box", lambda mask, margin: np.s_[:, :])
    assert found == metrics.coverage(drawn, true)


# --- visibility ----------------------------------------------------------------------------


@pytest.mark.parametrize(("wrong", "correct", "percent"), [(9035, 58037, 15), (9507, 56830, 16)])
def test_visibility_error_as_published(wrong: int, correct: int, percent: int) -> None:
    true = np.arange(wrong + correct) % 2 == 0
    found = true.copy()
    found[:wrong] ^= True
    errors = metrics.visibility(found, true)
    assert errors["false_positives"] + errors["false_negatives"] == wrong
    assert abs(errors["false_positives"] - errors["false_negatives"]) <= 1
    assert errors["correct"] == correct
    assert int(errors["visibility_error_percent"]) == percent


def test_false_positives_are_points_wrongly_found_visible() -> None:
    found, true = np.array([True, True, True, False]), np.array([True, False, False, True])
    errors = metrics.visibility(found, true)
    assert (errors["false_positives"], errors["false_negatives"], errors["correct"]) == (2, 1, 1)
    assert errors["visibility_error_percent"] == 300


# --- flicker -------------------------------------------------------------------------------


def test_flicker_is_the_change_beyond_the_true_one() -> None:
    image, normal = noise(4, high=200), directions(5)
    z = np.zeros((*SIZE, 3)) + np.array([0, 0, 1.0])
    tilted = np.zeros((*SIZE, 3)) + np.array([0, math.sin(math.radians(10)), math.cos(math.radians(10))])
    still = {"image": image, "normal": normal}
    pixels = (np.arange(image[..., 0].size), np.arange(image[..., 0].size))
    brighter = {"image": image + np.uint8(51), "normal": normal}
    assert metrics.flicker((still, brighter), (still, still), pixels)["flicker_color"] == pytest.approx(0.2)
    assert metrics.flicker((still, brighter), (still, brighter), pixels)["flicker_color"] == 0
    turned = metrics.flicker(({**still, "normal": z}, {**still, "normal": tilted}), (still, still), pixels)
    assert turned == {"flicker_color": 0, "flicker_normal": pytest.approx(10)}


def test_flicker_follows_the_points_through_the_pictures() -> None:
    image, normal = noise(4), directions(5)
    first = {"image": image, "normal": normal}
    second = {"image": np.roll(image, 3, axis=1), "normal": np.roll(normal, 3, axis=1)}
    places = np.arange(image[..., 0].size).reshape(SIZE)
    pixels = places[:, :-3].ravel(), places[:, 3:].ravel()
    errors = metrics.flicker((first, second), (first, first), (pixels[0], pixels[0]))
    assert errors["flicker_color"] > 0.1
    followed = metrics.flicker((first, second), (first, second), pixels)
    assert followed == {"flicker_color": 0, "flicker_normal": 0}


# --- several views -------------------------------------------------------------------------


def test_errors_of_views_become_one() -> None:
    errors = metrics.aggregate(
        {
            "hole_percent": [2, 4, math.nan],
            "depth_rmse": [3, math.nan, 4],
            "depth_median": [3, math.nan, 4],
            "psnr": [10 * math.log10(255**2 / squares) for squares in (1, 3)],
            "psnr_frame": [math.inf, 10 * math.log10(255**2 / 4)],
            "normal_mean": [math.nan, math.nan],
        }
    )
    assert errors["hole_percent"] == 3
    assert errors["depth_rmse"] == pytest.approx(math.sqrt(25 / 2))
    assert errors["depth_median"] == 3.5
    assert errors["psnr"] == pytest.approx(10 * math.log10(255**2 / 2))
    assert errors["psnr_frame"] == pytest.approx(10 * math.log10(255**2 / 2))
    assert math.isnan(errors["normal_mean"])


def test_points_of_all_views_are_counted_together() -> None:
    views = [(1, 1, 10), (0, 3, 90)]
    keys = ("false_positives", "false_negatives", "correct")
    by_view: dict[str, list[float]] = {key: [view[i] for view in views] for i, key in enumerate(keys)}
    errors = metrics.aggregate(by_view | {"visibility_error_percent": [20, 100 * 3 / 90]})
    assert [errors[key] for key in keys] == [1, 4, 100]
    assert errors["visibility_error_percent"] == 5


def test_equal_pictures_in_all_views_are_without_noise() -> None:
    assert metrics.aggregate({"psnr": [math.inf, math.inf]})["psnr"] == math.inf
    assert math.isnan(metrics.aggregate({"psnr": [math.nan]})["psnr"])
