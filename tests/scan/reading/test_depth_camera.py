"""The camera of depth pictures: which source wins, and what Scan4D does with one that does not fit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from viewer.errors import InputError
from viewer.scan.contents import StatedCamera
from viewer.scan.reading.camera import PRIMESENSE, CameraSources, DepthCamera, decide_camera
from viewer.scan.reading.record import Decision

STATED = StatedCamera(fx=290, fy=290, cx=159.5, cy=89.5, where="info.txt")
SIZE = (320, 180)


def decided(size: tuple[int, int] = SIZE, **sources: Any) -> tuple[DepthCamera, Decision, Decision]:
    how = {name: sources.pop(name) for name in ("is_whole", "of_color") if name in sources}
    found = decide_camera(CameraSources(**sources), size, **how)
    camera, scale = found.decisions
    assert (camera.key, scale.key) == ("camera", "depth-scale")
    return found.camera, camera, scale


def test_a_stated_camera_is_taken_as_it_is() -> None:
    camera, decision, _ = decided(stated=[STATED])
    assert (camera.fx, camera.cx, camera.cy, camera.assumed) == (290, 160, 90, "")  # centres at +0.5
    assert (decision.source, decision.where, decision.is_marked) == ("neighbour", "info.txt", False)
    assert decision.value["cx"] == 159.5


def test_the_user_wins() -> None:
    mine = replace(STATED, fx=100, where="")
    camera, decision, _ = decided(stated=[STATED], default=PRIMESENSE, kind="TUM", corrected=mine)
    assert camera.fx == 100
    assert (decision.source, decision.where) == ("user", "--read")
    with pytest.raises(InputError, match="outside the picture"):
        decided(corrected=replace(mine, cx=500))


def test_the_better_file_wins_and_in_it_the_camera_for_this_size() -> None:
    other = replace(STATED, fx=200, where="other.txt", width=320, height=180)
    assert decided(stated=[STATED, other])[0].fx == 290
    modes = [replace(STATED, fx=width, width=width, height=width * 9 // 16) for width in (640, 320, 160)]
    assert decided(stated=modes)[0].fx == 320


def test_a_camera_that_cannot_be_gives_way_to_another_file() -> None:
    of_color = replace(STATED, width=640, height=480, where="intrinsic_color.txt")
    camera, decision, _ = decided(stated=[of_color, STATED])
    assert (camera.fx, decision.where) == (290, "info.txt")


@pytest.mark.parametrize("factor", [0.5, 2, 3.2])
def test_a_camera_for_another_size_is_scaled(factor: float) -> None:
    """The corners of both pictures see the same rays."""
    size = (round(320 * factor), round(180 * factor))
    stated = replace(STATED, width=320, height=180, cx=150.0)
    camera, decision, _ = decided(size, stated=[stated])
    assert camera.fx == pytest.approx(290 * factor)
    assert camera.cx / camera.fx == pytest.approx(150.5 / 290)
    assert (size[0] - camera.cx) / camera.fx == pytest.approx((320 - 150.5) / 290)
    assert decision.source == "neighbour"
    assert f"scales the camera to {size[0]} x {size[1]}" in decision.why


def test_a_camera_for_another_aspect_ratio_is_refused() -> None:
    with pytest.raises(
        InputError,
        match=r"the camera is for pictures of 640 x 480 pixels, but this picture has 320 x 180 \(info\.txt\)",
    ):
        decided(stated=[replace(STATED, width=640, height=480)])


@pytest.mark.parametrize("center", [(320, 89.5), (159.5, -0.5), (-3, 50), (159.5, 240)])
def test_a_principal_point_outside_the_picture_is_refused(center: tuple[float, float]) -> None:
    outside = replace(STATED, cx=center[0], cy=center[1])
    with pytest.raises(InputError, match="outside the picture") as caught:
        decided(stated=[outside])
    assert "--read camera=fx,fy,cx,cy" in str(caught.value)
    stated = replace(outside, width=320, height=180)  # of a part of a picture: its file says so
    assert decided(stated=[stated])[0].cx == center[0] + 0.5
    assert decided(stated=[replace(outside, kind="height")])[0].cx == center[0] + 0.5


def test_a_camera_of_larger_colors_is_scaled() -> None:
    of_color = StatedCamera(fx=1450, fy=1450, cx=953, cy=718, where="frame_0.json")
    camera, _, _ = decided((256, 192), stated=[of_color], of_color=(1920, 1440))
    assert camera.fx == pytest.approx(1450 * 256 / 1920)
    assert camera.cx == pytest.approx(953.5 * 256 / 1920)
    for colors in (None, (1920, 1080), (900, 675)):
        with pytest.raises(InputError, match="outside the picture"):
            decided((256, 192), stated=[of_color], of_color=colors)


@pytest.mark.parametrize(("size", "fx"), [((640, 480), 525), ((320, 240), 262.5), ((160, 120), 131.25)])
def test_a_default_fits_its_own_aspect_ratio(size: tuple[int, int], fx: float) -> None:
    camera, decision, _ = decided(size, default=PRIMESENSE, kind="TUM's RGB-D images")
    assert (camera.fx, camera.assumed) == (fx, "")
    assert decision.is_marked
    assert "default camera of TUM's RGB-D images" in decision.why
    assert len(decision.alternatives) == 1


def test_a_default_for_other_pictures_is_passed_over() -> None:
    camera, decision, _ = decided(default=PRIMESENSE, kind="TUM's RGB-D images")
    assert camera.fx == pytest.approx(386.27, abs=0.01)  # 45 degrees across 320 pixels
    assert (camera.cx, camera.cy) == (160, 90)
    assert "assumes a field of view of 45 degrees" in camera.assumed
    assert "for 640 x 480 pixels" in decision.why
    assert "--read camera=" in decision.why
    assert decision.is_marked
    assert decision.alternatives == ("262.5,262.5,159.5,89.5",)


def test_without_any_source_a_field_of_view_is_assumed() -> None:
    camera, decision, _ = decided((180, 320))
    assert camera.fx == pytest.approx(386.27, abs=0.01)
    assert decision.is_marked
    assert "45 degrees" in camera.assumed


def test_the_depth_scale_of_each_source() -> None:
    tum = replace(PRIMESENSE, depth_scale=5000.0)
    scaled = replace(STATED, depth_scale=4000.0)
    known: dict[str, Any] = {"kind": "7-Scenes", "is_known_scale": True}
    for sources, scale, source, where in (
        ({"stated": [STATED], "depth_scale": 3.0}, 3, "user", "--read"),
        ({"stated": [scaled], "default": tum}, 4000, "neighbour", "info.txt"),
        ({"stated": [STATED, scaled]}, 4000, "neighbour", "info.txt"),
        ({"stated": [STATED], "default": tum, "kind": "TUM"}, 5000, "folder", "TUM"),
        ({"stated": [STATED], **known}, 1000, "folder", "7-Scenes"),
        ({"stated": [STATED]}, 1000, "assumed", ""),
        ({"stated": [STATED], "is_whole": False}, 1, "assumed", ""),
    ):
        camera, _, decision = decided(**sources)
        assert (camera.depth_scale, decision.value) == (scale, scale)
        assert (decision.source, decision.where) == (source, where)
    assert decision.is_marked
    assert "1" not in decision.alternatives


def test_unit_and_kind_are_as_stated() -> None:
    assert decided(stated=[STATED])[0].unit == "m"
    stated = replace(STATED, unit="mm", kind="range", distortion=(0.1, 0, 0, 0))
    camera = decided(stated=[stated], default=replace(PRIMESENSE, unit="ft"))[0]
    assert (camera.unit, camera.kind, camera.distortion) == ("mm", "range", (0.1, 0, 0, 0))
    assert camera.of_view["kind"] == "range"
