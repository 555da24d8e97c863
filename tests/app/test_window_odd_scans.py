"""Landmarks, measures and curves of odd scans: one frame, and a topology that changes midway."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from virtual_screen import PANEL, RunningApp, Screen, running_app

from viewer.camera import Camera

PLACES = ((-30.0, 18.0), (30.0, 18.0), (0.0, -18.0))  # x and y of landmarks in the first frame
GROWTH = 0.02  # of the surface, from frame to frame
FRAMES = 6
TRACKED = 0.5  # scan units, a fifth of the coarser spacing, that a tracked place may be off


def surface(across: int, scale: float = 1.0) -> dict[str, NDArray]:
    """Hills of always the same form, on a grid of so many points across."""
    down = across * 3 // 4
    x, y = np.meshgrid(np.linspace(-56, 56, across), np.linspace(-42, 42, down))
    z = 4 * np.sin(x / 9) * np.cos(y / 7) + 3 * np.sin(x / 5 + y / 6)
    corner = (np.arange(down - 1)[:, None] * across + np.arange(across - 1)).ravel()
    faces = [[corner, corner + 1, corner + across], [corner + 1, corner + across + 1, corner + across]]
    positions = scale * np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    return {"positions": positions, "faces": np.concatenate([np.stack(each, axis=1) for each in faces])}


def click(app: RunningApp, x: float, y: float) -> None:
    left, top, width, height = app.view()
    place = Camera.from_json(app.state.camera).place_in_picture((x, y, 0.0))
    assert place is not None
    at = int(left + width / 2 + place[0] * height), int(top + height / 2 - place[1] * height)
    app.do(("mousemove", *at), ("click", 1))
    app.settle()


def measured_with_all_there_is(app: RunningApp) -> tuple[list[float], list[float]]:
    """Place landmarks, measure a distance and a path of the last two, draw all paths, go through all that
    curves can show; the values of both."""
    app.press("k")
    for x, y in PLACES:
        click(app, x, y)
    app.press("Escape")
    app.press("d")
    app.choose(PANEL, "Add a measure/##kind", "###path")
    app.act(PANEL, ("item_click", "Add a measure/Add measure"))
    for number in range(len(PLACES)):
        for column in ("traced", "anchors"):
            app.act(PANEL, ("item_click", f"Landmark paths (trajectories)/paths/$${number}/##{column}"))
    app.settle()
    for combo, words in (
        ("mode", ("against", "repeats", "time")),
        ("order", ("speed", "acceleration", "value")),
    ):
        for word in words:
            app.choose("drawer/plotting", f"##{combo}", f"###{word}")
            app.settle()
    app.act(PANEL, ("item_click", "Landmark paths (trajectories)/hold/##value"))
    app.press("End")
    app.press("p")
    app.told("Saved ")
    state = app.settle()
    assert state.landmarks.keys() == {"Landmark 1", "Landmark 2", "Landmark 3"}
    assert not [line for line in app.log().splitlines() if "Traceback" in line or "switched off" in line]
    straight, along = state.measured.values()
    return straight, along


@pytest.mark.slow
def test_a_scan_with_one_frame(screen: Screen, tmp_path: Path) -> None:
    np.savez(tmp_path / "one.npz", **surface(49))
    with running_app(screen, tmp_path, tmp_path / "one.npz") as app:
        app.press("ctrl+5")
        (straight,), (along,) = measured_with_all_there_is(app)
        assert straight == pytest.approx(np.hypot(30, 36), abs=8)
        assert along > straight


@pytest.mark.slow
def test_a_topology_that_changes_midway(screen: Screen, tmp_path: Path) -> None:
    (tmp_path / "scan").mkdir()
    for frame in range(FRAMES):
        across = 49 if frame < FRAMES // 2 else 61
        np.savez(tmp_path / "scan" / f"{frame}.npz", **surface(across, 1 + GROWTH * frame))
    with running_app(screen, tmp_path, tmp_path / "scan") as app:
        app.press("ctrl+5")
        straight, along = measured_with_all_there_is(app)
        scales = 1 + GROWTH * np.arange(FRAMES)
        for values in (straight, along):
            same, other = np.array(values) / values[0] / scales - 1, slice(FRAMES // 2, None)
            assert np.abs(same[: FRAMES // 2]).max() < 5e-3, "followed by the points beside it"
            assert np.abs(same[other]).max() < 2 * TRACKED / values[0]
