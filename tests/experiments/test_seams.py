"""Seams between views of other gains: the more smoothly a picture passes across them, the less they show."""

from __future__ import annotations

import numpy as np
import pytest
from experiments.farooq_2013.seams import SCALES, detail_psnr, pods_facing, seam_visibility, seams
from numpy.typing import NDArray
from scenes import sphere_hits, sphere_mesh
from scipy.ndimage import gaussian_filter

from viewer.bench.truth.shapes import AnalyticScene, Sphere
from viewer.camera import Camera
from viewer.mesh.reference import trace
from viewer.simulate.scanner import around, rig

SIZE = (128, 96)
SHOWN = np.ones(SIZE[::-1], bool)
X = np.arange(SIZE[0]) - SIZE[0] / 2 + 0.5
LEFT = np.broadcast_to(X < 0, SHOWN.shape)
SEAM = seams(np.stack([LEFT, ~LEFT]).astype(float))
GAIN = np.array([1 / 1.1, 1 / 1.12, 1 / 1.08])


def texture() -> NDArray[np.float64]:
    """Linear colours with detail of all sizes, 0.1 to 0.9."""
    rng = np.random.default_rng(1)
    noise = sum(
        s * gaussian_filter(rng.standard_normal((*SHOWN.shape, 3)), (s, s, 0)) for s in (0.5, 2, 8, 16)
    )
    return 0.1 + 0.8 * (noise - np.min(noise)) / np.ptp(noise)


def passing(width: float) -> NDArray[np.float64]:
    """A gain, (1, W, 3), that passes from the left's to 1 along a ramp of a width, pixels."""
    share = np.clip(0.5 - X / width, 0, 1)[None, :, None]
    return 1 + share * (GAIN - 1)


def test_seams_are_where_the_winner_changes() -> None:
    weights = np.zeros((2, 4, 6))
    weights[0, :, :4], weights[1, :, 2:] = [3, 2, 2, 1], [1, 2, 2, 2]
    expected = np.zeros((4, 6), bool)
    expected[:, 2:4] = True  # the tie at 2 is the first one's
    np.testing.assert_array_equal(seams(weights), expected)
    weights[:, :, 2] = 0
    assert not seams(weights).any(), "what nobody sees has no seam"


def test_a_seam_shows_the_less_the_wider_the_picture_passes_across_it() -> None:
    alike = texture()
    found = [seam_visibility(passing(width) * alike, alike, SHOWN, SEAM) for width in (0.01, 4, 12, 32, 96)]
    for name in ("seam", *(f"seam_{scale}" for scale in SCALES)):
        values = [errors[name] for errors in found]
        assert values == sorted(values, reverse=True)
    total = [errors["seam"] for errors in found]
    assert total[0] > 1.5 * total[2] > 8 * total[3]
    assert total[0] > 500 * total[4], "it is smoother than the gain that is let through"
    for errors in found:
        assert errors["seam"] == pytest.approx(sum(errors[f"seam_{scale}"] for scale in SCALES))


def test_a_hard_cut_has_the_energy_of_a_step() -> None:
    """After a Gaussian of deviation S its gradient is h / (S sqrt(2 pi)) exp(-x^2 / (2 S^2)), less that of
    the smooth gain."""
    height, smooth = 0.1, 16.0
    flat = np.full((*SHOWN.shape, 3), 0.4)
    cut = flat * (1 + height * (X >= 0))[None, :, None]
    errors = seam_visibility(cut, flat, SHOWN, SEAM)
    x = np.arange(-64, 64, 0.01)
    near = np.abs(x) <= 9
    for scale in SCALES:

        def slope(deviation: float) -> NDArray[np.float64]:
            return height * np.exp(-0.5 * (x / deviation) ** 2) / (deviation * np.sqrt(2 * np.pi))

        excess = slope(scale) - slope(np.hypot(scale, smooth))
        expected = (100 * scale) ** 2 * np.square(excess[near]).mean()
        assert errors[f"seam_{scale}"] == pytest.approx(expected, rel=0.1 if scale > 1 else 0.2)


def test_gains_alone_are_no_seam() -> None:
    alike = texture()
    assert seam_visibility(alike, alike, SHOWN, SEAM)["seam"] == 0
    assert seam_visibility(GAIN * alike, alike, SHOWN, SEAM)["seam"] < 1e-20
    hard = seam_visibility(passing(0.01) * alike, alike, SHOWN, SEAM)["seam"]
    rounded = np.rint(alike * GAIN * 255) / 255
    assert seam_visibility(rounded, alike, SHOWN, SEAM)["seam"] < 0.05 * hard


def test_brightness_makes_no_difference_and_what_is_not_shown_has_no_part() -> None:
    alike = texture()
    drawn = passing(6) * alike
    errors = seam_visibility(drawn, alike, SHOWN, SEAM)
    darker = seam_visibility(0.3 * drawn, 0.3 * alike, SHOWN, SEAM)
    assert darker["seam"] == pytest.approx(errors["seam"])
    shown = SHOWN.copy()
    shown[30:50] = False
    parts = seam_visibility(drawn, alike, shown, SEAM)
    drawn[30:50], alike[30:50] = 7.0, 0.0
    assert seam_visibility(drawn, alike, shown, SEAM) == parts
    none = seam_visibility(drawn, alike, shown, np.zeros_like(SEAM))
    assert np.isnan(list(none.values())).all()


def test_fine_detail_is_lost_in_a_double_exposure_and_not_by_a_gradient() -> None:
    true = texture()
    assert detail_psnr(true, true, SHOWN, SHOWN) == np.inf
    double = (true + np.roll(true, 2, axis=1)) / 2
    tinted = true + 0.05 * (X / SIZE[0])[None, :, None]
    inside = SHOWN.copy()
    inside[:, :8], inside[:, -8:] = False, False
    assert detail_psnr(tinted, true, inside, SHOWN) > 30 + detail_psnr(double, true, inside, SHOWN)
    noise = 0.01 * np.random.default_rng(2).standard_normal(true.shape)
    assert detail_psnr(true + noise, true, inside, SHOWN) == pytest.approx(40, abs=1)


def test_pods_face_what_they_see_by_the_cosine_and_nothing_that_is_hidden() -> None:
    scene = AnalyticScene((Sphere(), Sphere(radius=0.15, center=(0.0, 0.0, 1.3))))
    pods = rig(sphere_mesh().bounds, around(2), aspect=1.0)
    camera = Camera.orbit(sphere_mesh().bounds, 0, 0, aspect=SIZE[0] / SIZE[1])
    picture = trace(scene, camera, SIZE)
    weights = pods_facing(scene, picture, pods)
    assert weights.shape == (2, *SHOWN.shape)
    assert (weights[:, ~picture.covered] == 0).all()
    depth, _ = sphere_hits(camera, SIZE)
    large = picture.covered & np.isclose(picture.depth, depth)
    at = np.zeros((*SHOWN.shape, 3))
    at[picture.covered] = picture.positions() + picture.origin
    for own, pod in zip(weights, pods, strict=True):
        ray = np.array(pod.eye) - at
        cosine = np.maximum((at * ray).sum(axis=2) / np.linalg.norm(ray, axis=2), 0)
        seen = large & (own > 0)
        np.testing.assert_allclose(own[seen], cosine[seen], atol=1e-5)
        shadow = large & (own == 0) & (cosine > 0.1)
        assert 20 < shadow.sum() < 0.1 * large.sum(), "the small sphere hides some of the large one"
    np.testing.assert_allclose(weights[0], weights[1, :, ::-1], atol=0.1)  # they stand left and right
