"""What the window says of landmarks in a frame, and which a click sets."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from viewer.analysis.landmarks import Landmark
from viewer.analysis.measures import Measure
from viewer.analysis.surface_point import SurfacePoint
from viewer.analysis.track import Known, Track
from viewer.app.clicks import Clicks
from viewer.app.followed import Followed
from viewer.app.session import Session
from viewer.app.tool_context import ToolContext
from viewer.app.tools.landmarks import Settings, Tool
from viewer.app.tools.landmarks.corners import regions_of
from viewer.app.tools.landmarks.shown import ShownLandmarks
from viewer.app.tools.landmarks.words import corners_words, gap_spans, placed_words, position_words
from viewer.document.landmarks import Landmarks
from viewer.scan.units import Scale

TIMES = np.arange(4) / 10
MM = Scale.of("mm", None)


def spot(frame: int) -> SurfacePoint:
    covariance = (0.01, 0.0, 0.0, 0.04, 0.0, 0.01)
    return SurfacePoint(frame, frame / 10, (1.0, 2.0, 3.0), None, 0.5, 0, covariance)


def track(*known: Known, reasons: dict[int, str] | None = None) -> Track:
    empty = Track.pending(TIMES)
    there = np.array(known) >= Known.TRACKED
    positions, covariances = empty.positions.copy(), empty.covariances.copy()
    positions[there], covariances[there] = (4.0, 5.0, 6.0), np.diag([1.0, 0.25, 0.04])
    return Track(TIMES, positions, covariances, np.array(known, np.uint8), reasons or {})


PLACED = Landmark("placed", keys=(spot(0),), missing=(3,))
ALL = (PLACED, Landmark("later"), Landmark("left out", skipped=True))
TRACKS = {
    "placed": track(Known.PLACED, Known.TRACKED, Known.GAP, Known.GAP, reasons={2: "hidden"}),
}


def test_states_in_each_frame() -> None:
    shown = [ShownLandmarks.of(ALL, TRACKS, frame) for frame in range(4)]
    words = ["placed", "tracked", "no data: hidden", "not visible in this frame"]
    assert [one.state(0) for one in shown] == words
    assert [one.is_there.tolist() for one in shown] == [[known, False, False] for known in (1, 1, 0, 0)]
    assert (shown[0].state(1), shown[0].state(2)) == ("not placed", "skipped")
    assert ShownLandmarks.of(ALL, {}, 1).state(0) == "not tracked yet"
    assert not np.isfinite(shown[2].positions).any(), "a gap is nowhere"


def test_a_key_counts_before_what_was_tracked_until_it_is_tracked_anew() -> None:
    moved = replace(PLACED, keys=(spot(0), spot(1)))
    shown = ShownLandmarks.of((moved,), TRACKS, 1)
    assert (shown.state(0), shown.positions[0].tolist()) == ("placed", [1.0, 2.0, 3.0])


def test_places_are_told_as_well_as_they_are_known() -> None:
    shown = ShownLandmarks.of(ALL, TRACKS, 0)
    assert shown.sure[0] == pytest.approx(1.96 * 0.2)
    assert position_words(shown, 0, MM) == "1.00, 2.00, 3.00 ± 0.39 mm"
    assert position_words(shown, 0, Scale.of("mm", "cm")) == "0.100, 0.200, 0.300 ± 0.039 cm"
    assert position_words(shown, 1, MM) == "", "where it is not known"


def test_gaps_are_marked_in_runs() -> None:
    other = Landmark("other", keys=(spot(0),))
    tracks = {**TRACKS, "other": track(Known.PLACED, Known.TRACKED, Known.TRACKED, Known.GAP)}
    spans = gap_spans((PLACED, other), tracks, {})
    assert [(span.frames, span.words) for span in spans] == [
        (range(2, 3), "No data for placed"),
        (range(3, 4), "No data for placed, other"),
    ]
    assert [span.frames for span in gap_spans((PLACED,), TRACKS, {})] == [range(2, 4)]


def tool_on(session: Session) -> Tool:
    playback: Any = SimpleNamespace(pose=None)
    unused: Any = None
    clicks = Clicks(unused)
    clicks.owner = "landmarks"
    context = ToolContext(
        "landmarks", session, playback, unused, clicks, Followed(), unused, print, list, Settings()
    )
    return Tool(context)


def test_corners_of_regions_are_listed_below_them_and_bear_no_names_of_their_own() -> None:
    corners = tuple(Landmark(f"Region 1.{number}", keys=(spot(0),)) for number in range(1, 5))
    names = tuple(one.name for one in corners)
    area, lip = Measure("Region 1, area", "area", names), Measure("lip", "area", ("a1", "a2", "a3"))
    others = Measure("mouth", "perimeter", ("chR", "ls", "chL")), Measure("way", "path", ("b1", "b2", "b3"))
    assert regions_of((area, lip, *others)) == {
        **dict.fromkeys(names, "Region 1"), **dict.fromkeys(("a1", "a2", "a3"), "lip")
    }  # fmt: skip
    session = Session("scan")
    tool = tool_on(session)
    all_ = (Landmark("sn", keys=(spot(0),)), replace(corners[0], missing=(0,)), *corners[1:], Landmark("chR"))
    session.change("Begin", Landmarks(all_, measures=(area, *others)))
    assert tool.rows() == [0, "Region 1", 5]
    tool.open_regions.add("Region 1")
    assert tool.rows() == [0, "Region 1", 1, 2, 3, 4, 5]
    drawn = tool.drawn(0).landmarks
    assert [(one.name, one.is_corner) for one in drawn] == [
        ("sn", False), ("Region 1", True), ("", True), ("", True),
    ]  # fmt: skip
    assert corners_words(["placed"] * 3) == "3 corners: placed"
    assert corners_words(["tracked", "no data: hidden", "tracked"]) == "3 corners: 2 tracked, 1 no data"
    tracks = {name: track(Known.PLACED, Known.GAP, Known.GAP, Known.GAP) for name in names}
    (span,) = gap_spans(corners, tracks, tool.regions)
    assert span.words == "No data for Region 1"


def test_when_no_landmark_waits_the_prompt_counts_those_that_are_not_placed() -> None:
    skipped, hidden = Landmark("skipped", skipped=True), Landmark("hidden", missing=(3,))
    assert placed_words([PLACED, PLACED]) == "All landmarks are placed"
    assert placed_words([PLACED, skipped]) == "1 of 2 landmarks are placed, 1 skipped"
    assert placed_words([PLACED, skipped, hidden]) == "1 of 3 landmarks are placed, 1 skipped, 1 not visible"


def test_a_correction_can_be_removed_where_there_is_one() -> None:
    session = Session("scan")
    tool = tool_on(session)
    session.change(
        "Begin", Landmarks((Landmark("a", keys=(spot(0),)), Landmark("b", keys=(spot(0), spot(2)))))
    )
    assert "Select" in tool.why_no_correction()
    tool.selected = "a"
    assert "only" in tool.why_no_correction()
    tool.selected = "b"
    assert tool.why_no_correction() == ""
    session.index = 1
    assert "frame 2" in tool.why_no_correction()


def test_clicks_set_what_is_next() -> None:
    session = Session("scan")
    tool = tool_on(session)
    session.change("Begin", Landmarks(ALL, template="own"))
    target = tool.target
    assert target is not None
    assert target.name == "later"
    tool.set_missing()
    assert tool.target is None, "what is missing here is not placed here"
    session.history.undo()
    tool.skip()
    assert (tool.made.all[1].state, tool.target) == ("skipped", None)
    session.history.undo()
    target = tool.target
    assert target is not None
    assert target.name == "later", "what is taken back is next again"
    session.change("Place", tool.made.with_landmark(target.with_key(spot(0))))
    assert tool.target is None
    tool.rename("final")
    assert [one.name for one in tool.made.all] == ["placed", "final", "left out"]
