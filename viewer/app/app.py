"""The app: what the user can do, and the loop that draws only when something changed."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

from ..backends import backends
from ..camera import Camera
from ..errors import InputError
from ..export import write_picture
from ..files import free_file, user_folder
from ..gpu.context import Gpu
from ..look import Look
from ..pick import Picked
from ..recording import Entry, Recorder, fingerprint
from ..scan.open import open_scan
from ..scan.timeline import Timeline
from . import keys, layout, levels, navigation, theme
from .help import Help
from .notices import Notices
from .picture import Picture
from .playback import Playback
from .pointed import describe
from .session import Session
from .window import Window

log = logging.getLogger(__name__)

_WATCH = 0.25  # seconds between looks at what workers have done while nothing is awaited
_AWAIT = 0.015  # the same while a pose or a scan is awaited


class App:
    """What the window shows and can do. Panels read it and call its commands.

    session: what the user has chosen. playback: the scan. picture: the 3D view.
    recorder: takes down what is shown, None while nothing is recorded.
    theme: of the panels. notices: what the user was told. keys: which do what. help: its open pages.
    pointed: what the mouse points at, None where at nothing; pointed_words: the same in words.
    gesture: what a drag in the view does, None without one.
    """

    def __init__(
        self,
        window: Window,
        scans: Sequence[str],
        timeline: Timeline,
        *,
        unit: str | None = None,
        fps: float | None = None,
        up: str = "+y",
    ) -> None:
        self.scans = list(scans)
        self.session = Session(self.scans[0], look=Look(up=up))
        self.theme = theme.DEFAULT
        self.notices = Notices()
        self.help: Help = Help()
        self.keys, problems = keys.load(self._keys_file)
        for problem in problems:
            self.note(problem)
        self.pointed: Picked | None = None
        self.pointed_words: list[str] = []
        self.gesture: str | None = None
        self.recorder: Recorder | None = None
        self.opening: str | None = None
        self._opening: Future[Timeline] | None = None
        self._unit, self._fps, self._up = unit, fps, up
        self._worker = ThreadPoolExecutor(2, thread_name_prefix="open")
        self._reported: Any = None
        self.window = window
        self.picture = Picture(Gpu(window.ctx))
        self._view_place = (0, 0, *window.buffer_size)  # left, bottom, width, height: pixels
        if self.picture.gpu.software:
            self.note(f"Drawn in software ({self.picture.gpu.device}); a graphics card is faster.")
        self.playback: Playback = self._start(timeline)

    # --- commands ---------------------------------------------------------------------

    def note(self, text: str) -> None:
        """Tell the user something."""
        self.notices.tell(text)

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

    def fit(self) -> None:
        """Show all of the current pose, from the same side."""
        if self.playback.pose and self.session.camera:
            bounds = self.picture.bounds(self.playback.pose)
            self.session.camera = self.session.camera.fit(bounds, self._aspect)
            self.session.pivot = None

    def look_from(self, side: str) -> None:
        """Show all of the current pose from a side of `navigation.VIEWS`."""
        if self.playback.pose and self.session.camera:
            bounds = self.picture.bounds(self.playback.pose)
            camera, aspect = self.session.camera, self._aspect
            self.session.camera = navigation.view_from(side, camera, bounds, aspect, self._up)
            self.session.pivot = None

    def project(self, projection: str) -> None:
        """Show the same in a projection of `camera.PROJECTIONS`."""
        if self.session.camera:
            self.session.camera = self.session.camera.projected(projection)

    def switch_projection(self) -> None:
        """Perspective to orthographic and back."""
        if self.session.camera:
            self.project("perspective" if self.is_orthographic else "orthographic")

    @property
    def is_orthographic(self) -> bool:
        """Whether the camera is."""
        camera = self.session.camera
        return camera is not None and camera.projection == "orthographic"

    def point_at(self, pixel: tuple[int, int] | None) -> None:
        """Take in which pixel of the view is under the mouse, None where the mouse is elsewhere."""
        picked = self.picture.pick(pixel) if pixel else None
        if picked is self.pointed:
            return
        self.pointed, self.pointed_words = picked, []
        if picked is not None and self.picture.request is not None:
            pose, timeline = self.picture.request.pose, self.playback.timeline
            frame = f"frame {pose.index + 1}/{len(timeline)}"
            self.pointed_words = describe(picked, frame, timeline.unit, self.picture.bounds(pose).radius)
        log.debug("under the mouse: %s", "; ".join(self.pointed_words))

    def set_pivot(self) -> None:
        """Orbit about the surface under the mouse from now on; the picture stays as it is."""
        if self.pointed and self.session.camera:
            x, y, z = (float(v) for v in self.pointed.position)
            self.session.pivot = x, y, z
            self.session.camera = self.session.camera.focused(self.session.pivot)

    @property
    def backend(self) -> str | None:
        """The name of the backend that draws; None before the first pose."""
        return self.session.chosen(self.playback.pose)[0] if self.playback.pose else None

    @property
    def _params(self) -> Any:
        """Its parameters; None before the first pose."""
        return self.session.chosen(self.playback.pose)[1] if self.playback.pose else None

    @_params.setter
    def _params(self, params: Any) -> None:
        if self.backend is not None:
            self.session.params[self.backend] = params

    def choose_backend(self, name: str) -> None:
        """Draw with a backend."""
        self.session.backend = name

    def next_backend(self) -> None:
        """Draw with the next backend."""
        if self.backend is not None:
            names = list(backends())
            self.choose_backend(names[(names.index(self.backend) + 1) % len(names)])

    @property
    def levels(self) -> dict[int, bool]:
        """The backend's pyramid levels and whether they are on; empty where it has none."""
        return {} if self._params is None else levels.levels(self._params)

    def toggle_level(self, number: int) -> None:
        """Switch one of the backend's pyramid levels on or off."""
        self._params = levels.toggled(self._params, number)

    @property
    def is_filling(self) -> bool:
        """Whether all levels that fill holes are on."""
        return self._params is not None and levels.is_filling(self._params)

    def toggle_filling(self) -> None:
        """Switch all levels that fill holes on or off."""
        self._params = levels.with_filling(self._params, not self.is_filling)

    @property
    def _keys_file(self) -> Path:
        return user_folder() / keys.FILE

    def write_keys(self) -> None:
        """Write the file of keys where there is none yet, and tell where it is."""
        try:
            if not self._keys_file.exists():
                keys.write_template(self._keys_file)
            self.note(f"The keys are in {self._keys_file}; edit it and start Scan4D again.")
        except InputError as error:
            self.note(str(error))

    def screenshot(self) -> None:
        """Save the picture as it is shown, without panels, in the working directory."""
        surface, entry = self.picture.surface, self._shown()
        if surface is None or entry is None:
            self.note("There is no picture to save.")
        else:
            self._save(".png", lambda path: write_picture(surface, path, entry.description()))

    def toggle_recording(self) -> None:
        """Take down what is shown from now on; or stop, and save it in the working directory."""
        now = time.monotonic()
        if self.recorder is None:
            self.recorder = Recorder(now)
            self._record()
            self.note("Recording what is shown, until you stop it.")
            return
        recorder, self.recorder = self.recorder, None
        if len(recorder):
            self._save(".json", recorder.finish(now).save)
        else:
            self.note("Nothing was shown while recording.")

    def _save(self, suffix: str, write: Callable[[Path], None]) -> None:
        """Write a file under the next free name, and say so."""
        path = free_file(Path.cwd(), suffix)
        try:
            write(path)
            self.note(f"Saved {path}")
        except InputError as error:
            self.note(str(error))

    def _shown(self) -> Entry | None:
        """What the picture shows, None where there is none."""
        surface, request = self.picture.surface, self.picture.request
        if not self.picture.is_there or surface is None or request is None:
            return None
        return Entry.of(request, self.session.scan, self._hash.result(), surface.size)

    def _record(self) -> None:
        """Take down what is shown where that is being recorded."""
        if self.recorder is not None and (entry := self._shown()) is not None:
            self.recorder.note(entry, time.monotonic())

    def open(self, scan: str) -> None:
        """Open another scan on a worker; the current one stays until it is there."""
        if self._opening is None:
            self.opening = scan
            self._opening = self._worker.submit(open_scan, scan, self._unit, self._fps)

    # --- the loop ---------------------------------------------------------------------

    def loop(self) -> None:
        """Run until the window is closed."""
        while not self.window.is_closing:
            self.window.wait(self._patience(time.monotonic()))
            if self._advance(time.monotonic()) or self.window.due:
                self._draw()

    def _patience(self, now: float) -> float:
        """Seconds to wait for events before looking at what else has changed."""
        look = _AWAIT if self.playback.waiting or self._opening else _WATCH
        changes = self.playback.player.until_next(now), self.notices.next_change(now)
        return min(look, *changes, self.picture.better_at - now)

    def _advance(self, now: float) -> bool:
        """Take in what time and workers have brought; True where there is something to show."""
        if self._opening and self._opening.done():
            self._take_opened(self._opening)
        self.playback.advance(now)
        timeline = self.playback.timeline
        for message in timeline.messages[self._messages_read :]:
            self._messages_read += 1
            self.note(message.text)
        told = self.notices.count, len(self.notices.shown(now))
        report = (self.playback.pose, self.session.index, timeline.cached(), told, self.opening)
        changed, self._reported = report != self._reported, report
        return changed or now >= self.picture.better_at

    def _take_opened(self, opening: Future[Timeline]) -> None:
        scan, self.opening, self._opening = self.opening, None, None
        try:
            timeline = opening.result()
        except Exception as error:  # whatever a file brings, the window stays
            log.debug("cannot open %s", scan, exc_info=error)
            self.note(f"Cannot open: {error}")
            return
        assert scan is not None
        self._worker.submit(self.playback.close)  # it may wait for a pose that is being read
        self.session.turn_to(scan)
        self.playback = self._start(timeline)

    def _start(self, timeline: Timeline) -> Playback:
        self.picture.clear()
        self._messages_read = 0
        self._hash = self._worker.submit(fingerprint, timeline.files)  # for what is saved
        self.window.title = f"{timeline.name} - Scan4D"
        return Playback(timeline, self.session)

    def _draw(self) -> None:
        self.window.begin()
        place = self.window.to_pixels(*layout.draw(self))
        left, bottom, width, height = place
        if place != self._view_place:
            self._view_place = place
            top = self.window.buffer_size[1] - bottom - height
            log.debug("view at %d,%d %dx%d pixels", left, top, width, height)
        if self._draw_picture() and not self.moving:
            self.window.touch(frames=1)  # for what the panel says about it
        self.window.fill(self.palette.panel)
        if self.picture.is_there:
            self.picture.present(left, bottom)
        self.window.end()
        log.debug("window drawn")

    def _draw_picture(self) -> bool:
        pose = self.playback.pose
        if pose is None:
            return False
        if self.session.camera is None:
            bounds = self.picture.bounds(pose)
            self.session.camera = Camera.orbit(bounds, aspect=self._aspect, up=self._up)
        drew = self.picture.draw(self.session.request(pose), self._view_size, self.moving)
        if drew:
            self._record()
        return drew

    @property
    def moving(self) -> bool:
        """Whether the scan plays or the camera is dragged."""
        return self.playback.player.playing or self.gesture is not None

    @property
    def _view_size(self) -> tuple[int, int]:
        """In pixels."""
        return max(self._view_place[2], 1), max(self._view_place[3], 1)

    @property
    def _aspect(self) -> float:
        return self._view_size[0] / self._view_size[1]

    def close(self) -> None:
        """Save what is being recorded, and let go of everything but the window."""
        if self.recorder is not None:
            self.toggle_recording()
        self._worker.shutdown(wait=False, cancel_futures=True)
        self.playback.close()
        self.picture.release()
