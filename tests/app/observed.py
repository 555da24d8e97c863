"""The app as it is run by tests: it tells after each turn of its loop what it shows, as a line of JSON.

`main` takes a file descriptor that the lines go to, and scans. A line on standard input is a number and what
acting.py is to do, if anything, in JSON. The number comes back as `answered`, in a line that is written when
all events before it have been taken in and that is done; `problem` is what went wrong with it.
"""

from __future__ import annotations

import json
import logging
import os
import queue
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from typing import Any

import glfw
import numpy as np
from acting import Actor
from cut_texts import CutTexts
from imgui_bundle import imgui

from viewer.analysis.words import SURE
from viewer.app import run
from viewer.app.app import App
from viewer.backends import backends
from viewer.document.schema import plain

_SETTLING = 3  # turns in which the window shows what an event has changed, whatever else goes on
FIELDS = ("input_text", "input_text_with_hint")  # functions of ImGui


class Observer:
    """Writes a line for each turn."""

    def __init__(self, stream: int) -> None:
        self._lines = os.fdopen(stream, "w", buffering=1)
        self._asked: queue.SimpleQueue[tuple[int, list[Any]]] = queue.SimpleQueue()
        self._seen = self._answered = self._turns = 0
        self._actor: Actor | None = None
        self._is_acting = False
        self._problem = ""
        self._told = 0
        self._fields: tuple[int, dict[str, str]] = 0, {}  # frame; the text of each field in it, by its label
        for name in FIELDS:
            setattr(imgui, name, self._noting(getattr(imgui, name)))
        self._typed = 0  # characters that came
        imgui.backends.glfw_char_callback = self._counting(imgui.backends.glfw_char_callback)
        self._cut = CutTexts()
        self._track = 0.0  # width of the timeline's track, in heights of the font
        imgui.invisible_button = self._noting_track(imgui.invisible_button)
        threading.Thread(target=self._listen, daemon=True).start()

    def _noting(self, field: Callable[..., tuple[bool, str]]) -> Callable[..., tuple[bool, str]]:
        """A function of ImGui that declares a text field, and notes the field's text."""

        def declare(label: str, *arguments: Any) -> tuple[bool, str]:
            changed, text = field(label, *arguments)
            if self._fields[0] != imgui.get_frame_count():
                self._fields = imgui.get_frame_count(), {}
            self._fields[1][label] = text
            return changed, text

        return declare

    def _counting(self, take: Callable[..., None]) -> Callable[..., None]:
        """A function that takes in a character, and counts it."""

        def take_one(*event: Any) -> None:
            self._typed += 1
            take(*event)

        return take_one

    def _noting_track(self, area: Callable[..., bool]) -> Callable[..., bool]:
        """A function of ImGui that declares an area, and notes how wide the track is."""

        def declare(name: str, size: imgui.ImVec2, *arguments: Any) -> bool:
            if name == "track":
                self._track = size.x / imgui.get_font_size()
            return area(name, size, *arguments)

        return declare

    def _listen(self) -> None:
        for line in sys.stdin:
            self._asked.put(json.loads(line))
            glfw.post_empty_event()

    def look(self, app: App) -> None:
        """Write how it is now. Views jump unless the environment says so: tests count pictures."""
        app.glide.is_wanted = "SCAN4D_GLIDES" in os.environ
        self._answer(app)
        new = app.notices.count - self._told
        self._told += new
        notes = [note.text for note in app.notices.all[len(app.notices.all) - new :]]
        state = {
            "at": time.monotonic(),
            "answered": self._answered,
            "problem": self._problem,
            "is_idle": is_idle(app),
            "notes": notes,
            "shown_notes": [note.text for note in app.notices.shown(time.monotonic())],
            "cut": self._cut.found,
            "track": self._track,
            "typed": self._typed,
            "fields": self._fields[1] if self._fields[0] == imgui.get_frame_count() else {},
            **shown(app),
        }
        self._lines.write(json.dumps(state) + "\n")

    def _answer(self, app: App) -> None:
        """Go on with the actions, or take the next question."""
        if self._actor and self._is_acting:
            if self._actor.step():
                self._is_acting, self._problem = False, self._actor.problem
            app.window.touch()
            glfw.post_empty_event()
            return
        # A turn that began before a question may have looked for events before they came: the next answers,
        # or the one in which ImGui has taken in all of them, a press or a release of a key or button a frame.
        self._turns += 1
        is_queued = imgui.get_current_context().input_events_queue.size() > 0
        if is_queued or (app.window.due and self._turns <= _SETTLING):
            return
        self._answered = self._seen
        with suppress(queue.Empty):
            self._seen, task = self._asked.get_nowait()
            self._turns = 0
            self._problem = ""
            if task:
                self._actor = self._actor or Actor()
                self._actor.begin(*task)
                self._is_acting = True
                app.window.touch()
            glfw.post_empty_event()


def is_idle(app: App) -> bool:
    """Whether nothing goes on and all that was asked for is shown."""
    playback = app.playback
    goes_on = (
        app.window.due, playback.player.playing, playback.waiting, app.steering.turntable.is_on,
        app.glide.is_on,
        app.tasks.all, app.tools.followed.is_busy, app.scans.waits, app.browser.waits,
        app.choosing.is_due,
        app.session.document.reading != app.opener.reading,
        playback.pose is not None and not app.viewport.is_complete,
        playback.pose is not None and not (app.viewport.is_refined or app.steering.moves),
    )  # fmt: skip
    return not any(goes_on)


def shown(app: App) -> dict[str, Any]:
    """What the window shows."""
    viewport, surface, document = app.viewport, app.viewport.surface, app.session.document
    left, bottom, width, height = viewport.rectangle
    state: dict[str, Any] = {
        **asdict(app.session.pace),
        "scan": app.session.scan,
        "is_opening": app.opener.job.scan is not None,
        "view": (left, app.window.buffer_size[1] - bottom - height, width, height),
        "place": app.window.placement and asdict(app.window.placement),
        "size": app.window.buffer_size,
        "windows": imgui.get_frame_count(),
        "pictures": viewport.number,
        "jobs": app.renderer.work.unfinished,
        "held_bytes": app.renderer.held_bytes,
        "ready_ahead": app.ahead.ready,
        "is_preview": viewport.is_preview,
        "dropped": app.playback.dropped,
        "counted": app.counting.counts is not None,
        "is_playing": app.playback.player.playing,
        "is_recording": app.capture.recorder is not None,
        "pointed": app.pointer.words,
        "unit": app.playback.unit,
        "words": app.view.words_over(),
        "renderer": backends()[app.rendering.backend].title if app.rendering.backend else None,
        "caption": app.switching.caption,
        "shown_notes": [note.text for note in app.notices.shown(time.monotonic())],
        "latest_note": app.notices.latest,
        "loading": app.loading.awaited and app.loading.awaited.words,
        "theme": app.window_look.theme,
        "is_replaying": app.replayer.is_on,
        "is_welcomed": app.welcome.is_over,
        "is_browser_open": app.browser.is_open,
        "pages": app.help.open,
        "lists": imgui.get_current_context().open_popup_stack.size(),
        "works": [task.name for task in app.tasks.shown],
        "refusal": app.browser.refusal,
        "is_export_open": app.exporting.is_open,
        "is_saving": app.capture.task is not None,
        "is_exporting": app.exporting.task is not None,
        "asks_before_closing": app.exporting.is_leaving,
        "clicking": app.tools.clicking,
        "prompt": app.tools.prompt,
        "labels": plain(app.tools.label_places.spots),
        "is_under_way": app.tools.is_under_way,
        "landmarks": landmarks(app),
        "followed": {name: track.is_whole for name, track in app.tools.followed.tracks.items()},
        "measured": {name: one.values.tolist() for name, one in app.tools.followed.series.items()},
        "curves": {name: one.values.tolist() for name, one in app.tools.followed.all_curves.items()},
        "distances": distances(app),
        "camera": document.camera and document.camera.to_json(),
        "document": plain(document),
        "range_note": app.ranging.words(),
        "thumbnails": len(app.thumbnails),
        "scan_rate": app.pacing.rate,
        "average": app.averaging.words,
        "is_step_open": app.session.history._merging is not None,
        "knows_files": app.changes._known is not None,
        "undoes": app.session.history.undoes,
        "redoes": app.session.history.redoes,
        "record": app.rereading.record.to_json()["decisions"],
        "extent": app.playback.pose and np.ptp(app.playback.pose.sample, axis=0).tolist(),
    }
    if viewport.is_there and viewport.request is not None and surface is not None:
        state |= {
            "frame": viewport.request.pose.index,
            "backend": surface.stats.backend,
            "color_range": surface.color_range,
            "moved": viewport.request.layers.world_from_pose.matrix.tolist(),
            "shown_time": viewport.request.pose.time,
            "pixels": surface.size,
            "samples": surface.stats.samples,
            "points": len(viewport.request.pose.cloud) - surface.stats.left_out,
        }
    return state


def distances(app: App) -> list[dict[str, Any]]:
    """The distances as they are in the frame that is shown."""
    tool = app.tools._slots["measuring"].tool
    return [] if tool is None else [
        {
            "name": row.measure.name,
            "ends": [asdict(end) for end in row.ends],
            "positions": [
                app.tools.followed.tracks[name].positions[app.playback.pose.index].tolist()
                for name in row.measure.landmarks
            ],
            "distance": row.value,
            "uncertainty": SURE * row.sigma,
            "state": row.state,
        }
        for row in tool.rows()
    ]  # fmt: skip


def landmarks(app: App) -> dict[str, Any]:
    """State and place of each landmark in the frame that is shown, by name."""
    tool = app.tools._slots["landmarks"].tool
    if tool is None:
        return {}
    stands = tool.shown
    return {
        landmark.name: (stands.state(number), stands.positions[number].tolist())
        for number, landmark in enumerate(stands.landmarks)
    }


def main() -> None:
    """Run the window; the arguments are the file descriptor and the scans."""
    logging.basicConfig(format="%(message)s")
    logging.getLogger("viewer").setLevel(logging.DEBUG)
    sys.exit(run(sys.argv[2:], watch=Observer(int(sys.argv[1])).look))
