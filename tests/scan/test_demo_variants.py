"""Variants of the demo: each moves as it is named, by its seed, and the plain demo stays what it was."""

from __future__ import annotations

import numpy as np
import pytest
from demo_surface import rest_of, surface_normal, surface_value

from viewer.errors import InputError
from viewer.scan.demo import DemoSource, motion
from viewer.scan.demo.asset import rest_points
from viewer.scan.demo.variants import VARIANTS, demo_motion
from viewer.scan.open import find_source, is_demo, open_scan

NAMES = [f"demo:{variant}:{seed}" for variant in VARIANTS for seed in (0, 7)]
# Positions of three points in frames of the plain demo, mm, as they were before there were variants.
PLAIN = {
    20: [(5.7727, -116.7972, 64.3745), (54.8686, -22.7456, 52.6679), (-26.3988, 12.8077, 72.7213)],
    48: [(5.7933, -97.9953, 79.9853), (54.9417, -22.271, 52.3539), (-26.3988, 12.8077, 72.7213)],
}


def places(count: int = 1200) -> np.ndarray:
    """Random places (3, count) in and around the head, mm."""
    return np.random.default_rng(3).uniform(-110, 120, (3, count))


def test_the_plain_demo_is_what_it_was() -> None:
    demo = DemoSource()
    for index, positions in PLAIN.items():
        np.testing.assert_allclose(demo.load(index).positions[[5000, 30000, 86000]], positions, atol=1e-3)
    assert demo.motion == motion.TALK
    assert demo.name == demo.load(0).topology == "demo"


@pytest.mark.parametrize("name", NAMES)
def test_motion_of_a_variant_can_be_undone(name: str) -> None:
    schedule, there = demo_motion(name), places()
    for time in np.arange(0.1, motion.PERIOD, 0.45):
        moved, normals, growth = motion.move(there, motion.normalized(there), float(time), schedule)
        np.testing.assert_allclose(rest_of(moved, float(time), schedule), there, atol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(normals, axis=0), 1, atol=1e-12)
        assert growth.min() > 0


@pytest.mark.parametrize("name", NAMES)
def test_points_and_normals_of_a_variant_are_of_its_surface(name: str) -> None:
    demo = DemoSource(name)
    cloud, time = demo.load(20), float(demo.times()[20])
    rows = np.arange(0, len(cloud), 40)
    points = cloud.world(rows)
    value = surface_value(points, time, demo.motion)
    assert value.max() < 2e-4  # mm: float32, turned
    shown = np.abs(value) < 2e-4
    assert shown.mean() > 0.97
    assert cloud.normals is not None
    exact = surface_normal(points[shown], time, demo.motion)
    assert np.quantile((exact * cloud.normals[rows][shown]).sum(axis=1), 0.01) > 0.99999


def test_a_smile_is_of_one_side() -> None:
    corner = np.array([[26.8, -57.3, 78.0], [-26.8, -57.3, 78.0]]).T
    for seed in range(6):
        smile = demo_motion(f"demo:smile:{seed}")
        paths = [motion.move(corner, corner, time, smile)[0] for time in np.arange(0, 2.56, 0.08)]
        less, more = sorted(np.linalg.norm(np.array(paths) - corner, axis=1).max(axis=0))
        assert more > 5
        assert less < 0.3 * more
    sides = {demo_motion(f"demo:smile:{seed}").bends[-1].share.index(1.0) for seed in range(6)}
    assert sides == {0, 1}


def test_a_head_sways_rigidly_by_15_degrees_about_two_axes() -> None:
    sway = demo_motion("demo:sway:4")
    turned = [sway.turned(time) for time in np.arange(0, 2.56, 0.02)]
    for rotation in turned:
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    front, crown = np.array(turned)[:, :, 2], np.array(turned)[:, :, 1]
    to_the_sides = np.degrees(np.arctan2(front[:, 0], front[:, 2]))
    nods = np.degrees(np.arctan2(crown[:, 2], crown[:, 1]))
    for angles in (to_the_sides, nods):
        assert 14 < angles.max() < 21
        assert -21 < angles.min() < -14
    demo = DemoSource("demo:sway:4")
    eyes = slice(rest_points().skin, None)
    rest, moved = rest_points().positions.T[eyes], demo.load(17).world()[eyes]
    np.testing.assert_allclose(
        np.linalg.norm(moved[::50] - moved[7], axis=1),
        np.linalg.norm(rest[::50] - rest[7], axis=1),
        atol=1e-3,
    )


def test_a_cough_is_fast() -> None:
    chin = np.array([[0.0, -90.0, 85.0]]).T
    cough = demo_motion("demo:cough")
    path = np.array([motion.move(chin, chin, frame / 25, cough)[0].ravel() for frame in range(64)])
    assert 5 < np.linalg.norm(np.diff(path, axis=0), axis=1).max() < 12  # mm a frame


def test_seeds_differ_and_repeat() -> None:
    assert demo_motion("demo:sway") == demo_motion("demo:sway:0") != demo_motion("demo:sway:1")
    assert DemoSource("demo:sway:1").load(3).topology == "demo:sway:1"


def test_variants_are_opened_by_name() -> None:
    with open_scan("demo:smile:3") as timeline:
        assert (timeline.name, timeline.unit, len(timeline)) == ("demo:smile:3", "mm", 64)
    assert [is_demo(name) for name in ("demo", "demo:smile", "demos", "demo/a", None)] == [
        True, True, False, False, False,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("demo:smiel", "Did you mean 'smile'"), ("demo:", "unknown variant"), ("demo:sway:-1", "not a seed"),
        ("demo:sway:²", "not a seed"), ("demo:sway:1:2", "not a seed"),
        ("demo:sway:" + "9" * 40, "not a seed"),
    ],
)  # fmt: skip
def test_other_variants_and_seeds_are_refused(name: str, told: str) -> None:
    with pytest.raises(InputError, match=told):
        find_source(name)
