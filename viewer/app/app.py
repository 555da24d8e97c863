"""The app: what there is, and what the user can do with it. Its parts do most of it.

It always shows a scan: lists of others and dialogs lie over it, so that nothing asks whether there is one.
"""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from imgui_bundle import imgui

from ..backends import backend
from ..document.document import Document
from ..document.saved_session import SavedSession, kept
from ..drawing.renderer import Renderer
from ..errors import InputError, Scan4DError
from ..folders import user_folder
from ..gpu.context import Gpu
from ..scan.open import DEMO, open_scan
from ..scan.pose import Pose
from ..scan.timeline import Timeline
from ..task import Task, in_background
from . import keys, settings, theme
from .commands import Commands
from .drawer import Drawer
from .failures import Failures
from .files.browser import Browser
from .files.changes import Changes
from .files.keeping import Keeping
from .files.loading import Loading
from .files.opening import Opened, Opening, begin, find_facts
from .files.preview import Previewer
from .files.same_content import offer_of_change, offer_of_kept
from .files.scans import Scans, title
from .files.sessions import Sessions
from .help import Help
from .keyboard import Keyboard
from .menu import MenuBar
from .notices import Notices, Offer, Problem
from .output.capture import Capture
from .output.exporting import Exporting
from .output.replaying import Replayer
from .panel import Panel
from .playing.ahead import Ahead
from .playing.pacing import Pacing
from .playing.playback import Playback
from .playing.ranging import Ranging
from .playing.thumbnails import Thumbnails
from .scene.bookmarks import Bookmarks
from .scene.choosing import Choosing
from .scene.counting import Counting
from .scene.full_view import FullView
from .scene.glide import Glide
from .scene.legend import ViewMarks
from .scene.naming import Naming
from .scene.pointed import Pointer
from .scene.rendering import Rendering
from .scene.steering import Steering
from .scene.viewport import Viewport
from .session import Session, known_as
from .settings import Settings
from .tasks import Tasks
from .toolbox import Toolbox
from .welcome import Welcome
from .window import Window

log = logging.getLogger(__name__)


class App:
    """All that the window shows and can do. Panels read it and call its commands.

    session: what the user has chosen. playback: the scan. ahead: has its poses prepared. pacing: of its
    frames. ranging: of colours, over its frames. thumbnails: of its frames, over the timeline.
    renderer: what is on the GPU. viewport: the 3D view. marks: what lies over it. rendering: which backend
    draws it. choosing: that one, automatically. naming: it, when the user steps to another one.
    steering: what moves its camera. glide: how the picture follows that. pointer: what the mouse points at in
    it. bookmarks: cameras to go back to. full_view: whether it is alone.
    scans: those to go to without a dialog. browser: the dialog that finds others. sessions: their files.
    changes: of the open one's files. loading: what the view waits for.
    keeping: keeps what is to come back at the next start.
    capture: pictures and recordings of what is shown. replayer: shows recordings again. exporting: pictures
    and films at other sizes.
    panel: at the right. drawer: under the timeline. welcome: the card of the first start. commands: all that
    can be done. keys: which do what. keyboard: which part of the window has it.
    tools: what is in their folder. help: its open pages.
    theme: of the panels. notices: what the user was told. failures: what went wrong in the window itself.
    tasks: work that goes on beside it. counting: of the points that are shown.
    """

    def __init__(
        self,
        window: Window,
        scans: Sequence[str],
        timeline: Timeline,
        remembered: Settings,
        *,
        unit: str | None = None,
        fps: float | None = None,
        up: str | None = None,
        session: SavedSession | None = None,
    ) -> None:
        """up: the up axis; None: as the scan was left. session: to open the first scan with."""
        self.window = window
        log.debug("%s", window.place)
        window.text_scale = remembered.text_scale
        self.set_theme(remembered.theme)
        self.notices = Notices()
        self.failures = Failures(self.note_of_scan)
        self._up, self._unit, self._fps = up, unit, fps
        self._told: set[str] = set()  # what could not be read of documents
        self._has_begun = self._looks_further = False  # whether a frame of any scan was shown, or looked for
        opened = begin(timeline, lambda: self._kept(scans[0]), session)
        document = remembered.document if up is None else remembered.document.with_up(up)
        self.session: Session = Session(scans[0], document, remembered.pace, opened.left)
        self.playback: Playback = Playback(timeline, self.session, opened.first)
        self.renderer = Renderer(Gpu(window.ctx))
        self.viewport = Viewport(self.renderer, (0, 0, *window.buffer_size))
        self.ahead: Ahead = Ahead(self.session, self.playback, self.renderer)
        self.pacing: Pacing = Pacing(self.session, self.playback, fps is not None)
        self.ranging: Ranging = Ranging(self.session)
        self.thumbnails: Thumbnails = Thumbnails(window.ctx)
        self.commands = Commands()
        self.tools: Toolbox = Toolbox(
            self.session, self.playback, self.viewport, self.failures, self.note_of_scan, window.touch,
            self.commands, remembered.tools,
        )  # fmt: skip
        self.keys: keys.Keys
        self.keys, problems = keys.load_keys(self._keys_file, self.commands)
        for problem in problems:
            self.note(problem)
        self.keyboard: Keyboard = Keyboard()
        self.menu_bar = MenuBar()
        self.help: Help = Help(self.commands, self.keys, self.notices, self.renderer.gpu)
        self.scans: Scans = Scans(
            self.session, self.note_of_opening, self.refuse, self.open, scans, remembered.recent
        )
        self.sessions: Sessions = Sessions(
            self.session, self.playback, self.note_of_work, self.refuse, self.open, self.take_up,
            lambda at: self.browser.show(at), window.touch,
        )  # fmt: skip
        self._opening = Opening()
        self.keeping = Keeping(
            self.session, self.playback, self.note, self.remembered, remembered, user_folder() / settings.FILE
        )
        self.pointer: Pointer = Pointer(self.viewport, self.playback, remembered.point_details)
        self.rendering: Rendering = Rendering(self.session, self.playback, self.note_of_scan)
        self.naming: Naming = Naming(self.rendering, self.viewport)
        self.choosing: Choosing = Choosing(self.session, self.playback, self.viewport, self.note_of_scan)
        self.steering: Steering = Steering(
            self.session, self.playback, self.viewport, self.pointer, remembered.cube,
            remembered.turn_seconds, up is not None, self.note_of_scan,
        )  # fmt: skip
        self.glide: Glide = Glide(remembered.glide)
        self.marks: ViewMarks = ViewMarks(
            self.session, self.playback, self.viewport, self.steering, self.ranging, remembered.marks,
            remembered.marks_in_files,
        )  # fmt: skip
        self.bookmarks: Bookmarks = Bookmarks(self.session, self.note_of_scan)
        self.full_view: FullView = FullView(window, self.keys, self.note)
        self.counting = Counting()
        self.panel = Panel(remembered.panel)
        self.drawer = Drawer(remembered.drawer, self.tools)
        self.welcome: Welcome = Welcome(self.session, remembered.welcomed)
        self.capture: Capture = Capture(
            self.session, self.playback, self.viewport, self.note_of_work, lambda: self.marks.of_files,
            lambda *film: self.exporting.film(*film), self.ranging.words, self.tools.drawn,
            self.choosing.choice_of, lambda: self.tools.label_places,
        )  # fmt: skip
        self.replayer: Replayer = Replayer(self)
        self.exporting: Exporting = Exporting(
            self.session, self.playback, self.viewport, self.note_of_work, self.capture.shown,
            remembered.export, remembered.export_marks, window.touch, self.tools.drawn,
        )  # fmt: skip
        self.tasks: Tasks = Tasks(
            self.session, self.playback, self.viewport, self._opening, self.tools, self.exporting,
            self.capture, self.note,
        )  # fmt: skip
        self.loading: Loading = Loading(self.session, self.playback, self.viewport, self._opening)
        self.browser: Browser = Browser(
            self.session, self.scans, self.sessions, self._opening, self.open, self.replayer.replay,
            self.tools.take_file, Previewer(window.ctx),
        )  # fmt: skip
        self.changes: Changes = Changes(self.session, self.note_of_scan, self.open)
        self._slow_devices = remembered.slow_devices
        if (gpu := self.renderer.gpu).software and gpu.device not in self._slow_devices:
            self._slow_devices = (*self._slow_devices, gpu.device)
            self.note(f"Drawn in software ({gpu.device}); a graphics card is faster.")
        self._start(opened)

    # --- commands ---------------------------------------------------------------------

    def note(self, text: str) -> None:
        """Tell the user something."""
        self.notices.tell(text)

    def note_of_scan(self, text: str) -> None:
        """Tell the user something about the open scan, until another one opens."""
        self.notices.tell(text, "scan")

    def note_of_work(self, text: str) -> None:
        """Tell the user what came of something that was done with the open scan, until another one opens; a
        problem or an offer stays."""
        self.notices.tell(text, "" if isinstance(text, (Problem, Offer)) else "scan")

    def note_of_opening(self, text: str) -> None:
        """Tell the user something about what could not be opened, until something else is to be opened."""
        self.notices.tell(text, "opening")

    @property
    def document(self) -> Document:
        """The document of the open scan: what the user has chosen and made for it."""
        return self.session.document

    def undo(self) -> None:
        """Take back the last change of the document; first of all what a tool has begun."""
        if self.tools.is_under_way:
            self.tools.abandon()
        else:
            self.session.history.undo()

    def redo(self) -> None:
        """Make the change again that was undone last."""
        self.tools.abandon()
        self.session.history.redo()

    def quit(self) -> None:
        """Close the window."""
        self.window.close()

    def toggle_play(self) -> None:
        """Play from the current frame, or pause."""
        self.playback.toggle(time.monotonic())

    def change_pace(self, **changes: Any) -> None:
        """Change fields of the `Pace`: speed, direction, loop, mode."""
        self.playback.change(time.monotonic(), **changes)
        log.debug("%s", self.session.pace)

    def change_speed(self, direction: int) -> None:
        """Play faster for 1, slower for -1."""
        self.change_pace(speed=self.session.pace.next_speed(direction))

    def toggle_pace(self, field: str) -> None:
        """Switch a field of the `Pace` on or off: reverse, loop or every_frame."""
        self.change_pace(**{field: not getattr(self.session.pace, field)})

    def set_theme(self, name: str) -> None:
        """Show panels in the colours of one of `theme.PALETTES`; the picture's are the look's."""
        self.theme = name
        theme.set_colors(self.palette)
        self.window.touch()

    def next_theme(self) -> None:
        """Dark to light and back."""
        names = list(theme.PALETTES)
        self.set_theme(names[(names.index(self.theme) + 1) % len(names)])

    def change_text(self, direction: int) -> None:
        """Larger text and widgets for 1, smaller for -1, the usual ones for 0."""
        scales, now = theme.TEXT_SCALES, self.window.text_scale
        beyond = [scale for scale in scales if (scale - now) * direction > 0]
        nearest = min(beyond, key=lambda scale: abs(scale - now), default=now)
        self.window.text_scale = nearest if direction else 1.0
        self.window.touch()

    @property
    def palette(self) -> theme.Palette:
        """The colours of the panels."""
        return theme.PALETTES[self.theme]

    def seek(self, index: int) -> None:
        """Go to a frame; -1 is the last one."""
        self.playback.seek(index % len(self.playback.timeline), time.monotonic())

    def step(self, count: int) -> None:
        """Pause, and go some frames on."""
        self.playback.step(count, time.monotonic())

    @property
    def _keys_file(self) -> Path:
        return user_folder() / keys.FILE

    def write_keys(self) -> None:
        """Write the file of keys where there is none yet, and tell where it is."""
        try:
            if not os.path.exists(self._keys_file):
                keys.write_template(self._keys_file, self.commands)
            self.note(f"The keys are in {self._keys_file}. Edit this file and start Scan4D again.")
        except InputError as error:
            self.note(Problem(str(error)))

    def open(self, scan: str, session: SavedSession | None = None) -> None:
        """Open another scan on a worker, instead of one that is being opened; the current one stays
        until a pose of it is there.

        session: to open it with; None: as it was left.
        """
        self.notices.end("opening")
        left = self.session.left(scan)
        find = (lambda: self._kept(scan)) if left is None else lambda: left
        self._opening.start(scan, title(scan), find, lambda: open_scan(scan, self._unit, self._fps), session)

    def _find_facts(self, pose: Pose) -> None:
        """Find what drawing as it is chosen asks of a pose, on the thread that has read it."""
        name, params = self.session.document.chosen(pose)
        find_facts(pose, of_points=not backend(name).draws_samples(pose, params))

    def _kept(self, scan: str) -> SavedSession | None:
        """Find what was kept of a scan. Raises InputError where that is damaged."""
        found = kept(known_as(scan))
        if found is None or self._up is None:
            return found
        return replace(found, document=found.document.with_up(self._up))

    @property
    def opening(self) -> str | None:
        """The scan that is being opened, as the user named it; None where none is."""
        return self._opening.scan

    def remembered(self) -> Settings:
        """The settings that are to come back at the next start."""
        return Settings.of(
            self.session, window=self.window.place, theme=self.theme, text_scale=self.window.text_scale,
            marks=self.marks.shown, marks_in_files=self.marks.in_files, cube=self.steering.cube.is_shown,
            turn_seconds=self.steering.turntable.seconds, recent=self.scans.recent,
            export=self.exporting.kept, export_marks=self.exporting.marks, tools=self.tools.remembered(),
            panel=self.panel.chosen, drawer=self.drawer.height, glide=self.glide.is_wanted,
            point_details=self.pointer.has_details,
            welcomed=self.welcome.is_over, slow_devices=self._slow_devices,
        )  # fmt: skip

    # --- for the loop -----------------------------------------------------------------

    @property
    def moving(self) -> bool:
        """Whether the scan plays or the camera moves."""
        return self.playback.player.playing or self.steering.moves

    def settle(self, now: float) -> None:
        """End the step of the history that a drag or typing is, once it is over. now: by the clock."""
        goes_on = imgui.is_any_item_active() or self.keys.is_arrow_held
        if self.steering.rests(now) and self.replayer.replaying is None and not goes_on:
            self.session.history.settle()

    def take_opened(self) -> None:
        """Show the scan that has been opened, where one has."""
        asked = self._opening.scan
        try:
            opened = self._opening.take()
        except Scan4DError as error:
            self.scans.look(self.session.scan)
            if not self._has_begun and asked is not None:  # else nothing would be shown
                self.open(self.scans.after(asked) or DEMO)
            self.refuse(f"Cannot open: {error}")
            return
        if opened is not None:
            scan, begun = opened
            # It may wait for a pose that is being read.
            in_background(Task("Closing"), self.playback.timeline.close)
            self.keeping.leave()
            self.notices.end("scan")
            self.session.turn_to(scan, begun.left, self._up)
            self._start(begun)
            self.playback.begin(begun.timeline, begun.first)
            self.browser.opened()
            log.debug("opened %s", scan)

    def _start(self, opened: Opened) -> None:
        timeline, self.session.hash_found, _, left, problem, session = opened
        timeline.finish = self._find_facts
        self.ranging.begin(timeline)
        self.changes.begin(timeline)
        if problem:
            self.note_of_scan(problem)
        if session is not None:
            self.session.take_up(session)
        self._check(session or left)
        if session is None and not (left and left.document.made):
            self._look_for_kept()
        self.viewport.clear()
        self.glide.end()
        self._messages_read = 0
        self.window.title = f"{timeline.name} - Scan4D"
        self.scans.opened(self.session.scan)
        if self._unit:
            self.session.amend(unit=self._unit)
        self.steering.begin_scan(timeline)
        self.tools.abandon()

    def take_up(self, session: SavedSession) -> None:
        """Show the open scan as a session has it."""
        self.browser.opened()
        self.tools.abandon()
        self.session.take_up(session)
        self.seek(min(session.pose, len(self.playback.timeline) - 1))
        self._check(session)
        self.window.touch()

    def _check(self, saved: SavedSession | None) -> None:
        """Tell what could not be read of what was saved, once, and find out beside the window whether the
        scan is the one that it was saved of."""
        problem = saved and saved.problem
        if problem and problem not in self._told:
            self._told.add(problem)
            self.note_of_scan(problem)
        if saved is not None and saved.hash is not None:
            scan, found = self.session.scan, self.session.hash_found
            self.capture.tell_later(partial(offer_of_change, saved, found, partial(self._begin_anew, scan)))

    def _look_for_kept(self) -> None:
        """Offer what is kept of the open scan's files under another name, as soon as it is found."""
        scan = known_as(self.session.scan)
        use = partial(self.sessions.open_with, scan=self.session.scan)
        self.capture.tell_later(partial(offer_of_kept, scan, self.session.hash_found, use))

    def _begin_anew(self, scan: str) -> None:
        """Leave aside what the user made on other files than those of a scan, where it is still open."""
        if scan != self.session.scan:
            return
        self.tools.abandon()
        self.session.change("Start without the saved changes", bookmarks=(), parts={}, unread={})
        self._look_for_kept()

    def pass_on_messages(self) -> None:
        """Tell what the timeline has to say.

        Where the frame that the window began with cannot be read, another one is looked for, as where any
        other scan is opened.
        """
        messages = self.playback.timeline.messages[self._messages_read :]
        self._messages_read += len(messages)
        self._has_begun = self._has_begun or self.playback.pose is not None
        if not self._has_begun and not self._looks_further and self.playback.problem is not None:
            self._looks_further = True
            self.open(self.session.scan)
            self._messages_read = len(self.playback.timeline.messages)
            return
        for message in messages:
            self.note_of_scan(message.text)

    def refuse(self, problem: str) -> None:
        """Tell why what the user asked for was not opened: in the dialog, where that waits for it."""
        if not self.browser.refused(problem):
            self.note_of_opening(Problem(problem))

    def place_view(self, place: tuple[int, int, int, int]) -> None:
        """Take in where the 3D view is: left, bottom, width, height in pixels from the lower left."""
        left, bottom, width, height = place
        place = left, bottom, max(width, 1), max(height, 1)
        if place != self.viewport.place:
            self.viewport.place = place
            top = self.window.buffer_size[1] - bottom - height
            log.debug("view at %d,%d %dx%d pixels", left, top, width, height)

    def close(self) -> None:
        """Save what is being recorded and what is to come back, and let go of everything but the window."""
        for name, end in (
            ("Saving", self.capture.end_recording),
            ("Keeping", self.keeping.close),
            ("Saving pictures", self.capture.close),
            ("Counting", self.counting.cancel),
            ("Putting tools away", self.tools.close),
            ("Exporting", self.exporting.close),
            ("Hiding the window", self.window.hide),  # what is being read may take a moment to stop
            ("Opening", self._opening.cancel),
            ("Ranging", self.ranging.close),
            ("Picturing frames", self.thumbnails.clear),
            ("Looking around", self.steering.extent.close),
            ("Reading", self.playback.close),
            ("Drawing", self.viewport.release),
            ("Preparing", self.renderer.release),
        ):
            with self.failures.told(name):
                end()
