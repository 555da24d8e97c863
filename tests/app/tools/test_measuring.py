"""What the window says of distances, and where it draws them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from imgui_bundle import ImVec2

from viewer.analysis.surface_point import SurfacePoint
from viewer.app.clicks import Clicks
from viewer.app.followed import Followed
from viewer.app.scene.canvas import ScreenView
from viewer.app.session import Session
from viewer.app.tool_context import ToolContext
from viewer.app.tools.measuring import DistanceRow, Tool
from viewer.app.tools.measuring.panel import snap_words
from viewer.camera import Camera
from viewer.document.landmarks import Landmarks
from viewer.scan.units import Scale

PLACE = ScreenView(Camera(eye=(0, 0, 4)), ImVec2(100, 50), ImVec2(300, 200))


def end(id: int | None) -> SurfacePoint:
    return SurfacePoint(0, 0.0, (0, 0, 0), id, None, 0)


@pytest.mark.parametrize(
    ("ids", "words"),
    [
        ((3, 12), "at points 3 and 12"),
        ((None, 12), "at point 12 and on the surface"),
        ((0, None), "at point 0 and on the surface"),
        ((None, None), "on the surface"),
    ],
)
def test_it_says_where_the_ends_are(ids: tuple[int | None, int | None], words: str) -> None:
    assert snap_words((end(ids[0]), end(ids[1]))) == words


def test_a_distance_on_averaged_points_says_so() -> None:
    first, second = replace(end(3), averaged=8), replace(end(4), position=(1, 0, 0))
    for ends, is_averaged in (((first, second), True), ((end(3), second), False)):
        made = Landmarks().with_distance([ends[0]], [ends[1]])
        (measure,) = made.distances
        assert made.is_averaged(measure) == is_averaged
        words = DistanceRow(measure, 1.0, 0.1, "placed", ends).words(Scale("mm", 1.0))
        assert words.endswith("mm (95 %), averaged") == is_averaged


def test_two_ends_make_a_distance_of_the_document() -> None:
    session = Session("scan")
    unused: Any = None
    clicks = Clicks(unused)
    context = ToolContext("measuring", session, unused, unused, clicks, Followed(), unused, print, list)
    measuring = Tool(context)
    first, second = end(3), replace(end(4), position=(1, 0, 0))
    measuring.set_end(first)
    assert (measuring.begun, measuring.made.all) == (first, ())
    measuring.set_end(first)
    assert (measuring.begun, measuring.made.all) == (first, ()), "the same place twice is no distance"
    measuring.set_end(second)
    assert (measuring.begun, measuring.made) == (None, Landmarks().with_distance([first], [second]))
    measuring.clear()
    assert measuring.made == Landmarks()
    for name, count in (("Clear distances", 1), ("Measure", 0)):
        assert session.history.undoes == name
        session.history.undo()
        assert len(measuring.made.distances) == count
    measuring.clear()
    assert session.history.redoes is not None, "clearing nothing is no change"


@pytest.mark.parametrize(
    ("line", "seen"),
    [
        ((120, 60, 380, 240), (120, 60, 380, 240)),
        ((0, 100, 200, 100), (100, 100, 200, 100)),
        ((200, 150, 200, 550), (200, 150, 200, 250)),
        ((0, 0, 500, 300), (100, 60, 400, 240)),
        ((0, 10, 500, 20), None),
        ((90, 0, 90, 300), None),
        ((0, 150, 80, 350), None),
        ((150, 150, 150, 150), (150, 150, 150, 150)),
    ],
)
def test_a_label_stands_at_the_part_of_its_line_that_is_in_the_view(
    line: tuple[float, ...], seen: tuple[float, ...] | None
) -> None:
    for start, stop in (((0, 1), (2, 3)), ((2, 3), (0, 1))):
        found = PLACE.box.clipped(*(ImVec2(*(line[i] for i in corner)) for corner in (start, stop)))
        if seen is None:
            assert found is None
        else:
            assert found is not None
            wanted = [seen[i] for i in (*start, *stop)]
            assert [v for place in found for v in (place.x, place.y)] == pytest.approx(wanted)


def test_places_of_the_scan_are_where_the_picture_shows_them() -> None:
    middle = PLACE.on_screen((0, 0, 0))
    assert middle is not None
    assert (middle.x, middle.y) == (250, 150)
    above = PLACE.on_screen((0.1, 0.2, 0))
    assert above is not None
    assert above.x > 250
    assert above.y < 150
    assert PLACE.on_screen((0, 0, 5)) is None, "behind the eye"
    all_places = PLACE.all_on_screen(np.array([[0, 0, 0], [0.1, 0.2, 0], [0, 0, 5], [np.nan, 0, 0]]))
    assert all_places[:2] == pytest.approx(np.array([[middle.x, middle.y], [above.x, above.y]]), abs=1e-4)
    assert np.isnan(all_places[2:]).all()
