"""Names of units: which can be shown, which are lengths, and frames of one scan in several."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from range_scenes import sphere_view

from viewer.bounds import Bounds
from viewer.errors import InputError
from viewer.scan import formats
from viewer.scan.open import open_scan
from viewer.scan.range_view import RangeView, merge
from viewer.scan.reading.unit import guess_unit
from viewer.scan.units import UNIT_WORDS, Scale, checked_unit, conversion, is_length, usable_unit


def views(unit: str, other: str | None = None) -> tuple[RangeView, ...]:
    """Two pods around a sphere whose radius is a metre, or one of what is no known length."""
    scale = conversion("m", unit) or 1.0
    left, right = sphere_view((0.3, 0, 4)), sphere_view((3, -1, 4), name="right")
    second = (right.scaled(conversion("m", other) or 1.0, other)) if other else right.scaled(scale, unit)
    return left.scaled(scale, unit), second


def save(path: Path, saved: tuple[RangeView, ...]) -> None:
    formats.write(path, merge(saved), saved)


@pytest.mark.parametrize("name", ["mm", "µm", "\u03bcm", "US-ft", "m/s", "x" * 16])
def test_names_that_can_be_shown(name: str) -> None:
    assert checked_unit(name) == usable_unit(name) == name


@pytest.mark.parametrize(
    "name",
    [
        "",
        "  ",
        "x" * 17,
        "m" * 5000,
        "\x1b[31mmm",
        "a\nb",
        "m\u202e",
        "%s%s%s%s%s%s",
        "m%n",
        "##m",
        "m###x",
        "=1+1",
        "-m",
        "+m",
        "@m",
        "<b>m</b>",
        "m\t",
        "two words",
        "12",
    ],
)
def test_names_that_cannot_be_shown(name: str) -> None:
    with pytest.raises(
        InputError, match=r"is not a usable name of a unit\. Use a short name such as mm"
    ) as caught:
        checked_unit(name)
    assert len(str(caught.value)) < 200
    assert usable_unit(name) is None


def test_a_user_gives_a_unit_that_can_be_shown() -> None:
    with (
        pytest.raises(InputError, match="is not a usable name of a unit"),
        open_scan("demo", unit="x" * 5000),
    ):
        pass


def test_conversions() -> None:
    assert conversion("m", "mm") == pytest.approx(1000)
    assert conversion("in", "cm") == pytest.approx(2.54)
    assert conversion("\u03bcm", "µm") == pytest.approx(1)  # two letters that look alike
    assert conversion("ells", "ells") == 1
    assert conversion("ells", "m") is conversion("mm", "units") is None


def test_a_unit_of_a_file_that_cannot_be_shown_is_unknown(tmp_path: Path) -> None:
    save(tmp_path / "f.exr", tuple(replace(view, unit="\x1b[31m" + "m" * 5000) for view in views("m")))
    with open_scan(tmp_path) as scan:
        assert scan.unit == scan.pose(0).views[0].unit == "units"


def test_frames_in_another_unit_are_converted_and_told_once(tmp_path: Path) -> None:
    for index, unit in enumerate(["mm", "m", "mm", "cm"]):
        save(tmp_path / f"f{index}.exr", views(unit))
    with open_scan(tmp_path) as scan:
        assert scan.unit == "mm"
        poses = list(scan)
        for pose in poses:
            assert {view.unit for view in pose.views} == {"mm"}
            radii = np.linalg.norm(pose.cloud.world(), axis=1)
            np.testing.assert_allclose(radii, 1000, rtol=0, atol=1)
        assert [(notice.kind, notice.index) for notice in scan.messages] == [("unit", 1)]
        assert scan.messages[0].text == "f1.exr is in m, but the scan is in mm: Scan4D converts the lengths"


def test_parts_of_one_file_in_two_units(tmp_path: Path) -> None:
    save(tmp_path / "f.exr", views("mm", "m"))
    with open_scan(tmp_path / "f.exr") as scan:
        radii = np.linalg.norm(scan.pose(0).cloud.world(), axis=1)
        np.testing.assert_allclose(radii, 1000, rtol=0, atol=1)
        assert [notice.kind for notice in scan.messages] == ["unit"]
    np.testing.assert_allclose(
        np.linalg.norm(formats.read_points(tmp_path / "f.exr").world(), axis=1), 1000, rtol=0, atol=1
    )


def test_units_that_are_no_lengths_are_told_and_taken_as_they_are(tmp_path: Path) -> None:
    for index, unit in enumerate(["mm", "ells"]):
        save(tmp_path / f"f{index}.exr", views(unit))
    with open_scan(tmp_path) as scan:
        radii = np.linalg.norm(scan.pose(1).cloud.world(), axis=1)
        np.testing.assert_allclose(radii, 1, rtol=0, atol=1e-3)
        assert scan.messages[0].text == (
            "f1.exr is in ells, but the scan is in mm: Scan4D does not convert the lengths"
        )


def test_lengths_are_told_in_another_unit_where_both_are_known() -> None:
    assert Scale.of("m", "mm") == Scale("mm", pytest.approx(1000))
    assert Scale.of("mm", "in") == Scale("in", pytest.approx(1 / 25.4))
    assert Scale.of("m", None) == Scale("m")
    assert Scale.of("units", "mm") == Scale("units"), "nobody knows how long these are"
    assert all(map(is_length, UNIT_WORDS))


@pytest.mark.parametrize(
    ("edges", "up", "guess"),
    [
        ((0.18, 0.25, 0.2), "+y", "m"), ((0.5, 1.8, 0.3), "+y", "m"), ((500, 1800, 300), "+y", "mm"),
        ((180, 250, 200), "+y", "mm"), ((30.0, 20.0, 1.5), "+z", "m"), ((20, 25, 18), "+y", None),
    ],
)  # fmt: skip
def test_a_unit_is_guessed_of_the_size(edges: tuple[float, float, float], up: str, guess: str | None) -> None:
    half = np.array(edges) / 2
    found = guess_unit(Bounds(-half, half), up)
    assert (found and found[0]) == guess


@pytest.mark.parametrize("name", ["%s%s%s%s%s%s", "m\x1b[31m", "=1+1", "##m"])
def test_a_unit_that_is_no_word_is_told_of_any_file_and_is_none(tmp_path: Path, name: str) -> None:
    rig, pods, arrays = tmp_path / "exr", tmp_path / "pods", tmp_path / "arrays.npz"
    rig.mkdir(), pods.mkdir()
    save(rig / "f.exr", tuple(replace(view, unit=name) for view in views("m")))
    np.savez(arrays, depth=np.ones((4, 4), np.float32), fx=4, fy=4, cx=1.5, cy=1.5, unit=name)
    camera = {"fx": 4, "fy": 4, "cx": 1.5, "cy": 1.5, "depth_scale": 1000}
    told = {"unit": name, "pods": [{"name": "left", "range": "left_*.png"} | camera]}
    (pods / "pods.json").write_text(json.dumps(told))
    Image.fromarray(np.full((4, 4), 500, np.uint16)).save(pods / "left_1.png")
    for path in (rig, pods, arrays):
        with open_scan(path) as scan:
            assert scan.unit == scan.pose(0).views[0].unit == "units", path
            assert [notice.kind for notice in scan.messages if "unit" in notice.text] == ["unit"], path
        with open_scan(path, unit="mm") as scan:
            assert scan.unit == "mm"
