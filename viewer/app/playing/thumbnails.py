"""Small pictures of frames, over the timeline: drawn beside the window, of what the mouse points at."""

from __future__ import annotations

from collections import OrderedDict
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import moderngl
import numpy as np
from imgui_bundle import ImVec2, imgui
from numpy.typing import NDArray

from ...camera import Camera
from ...errors import InputError
from ...scan.preview import preview_picture
from ...scan.timeline import Timeline, TimelineClosed
from ...task import Cancelled, Task, in_background
from ..part import WindowPart
from ..scene.activity import Activity
from ..window import Window

_HEIGHT = 120  # pixels of a picture
_NARROWEST, _WIDEST = 0.7, 1.8  # its width / height
_SHOWN = 8.0  # its height on the screen, in heights of the font
_MOST = 64  # pictures that are kept

Picture = NDArray[np.uint8]


class _Work(NamedTuple):
    frame: int
    task: Task
    future: Future[Picture | None]


@dataclass(eq=False)
class Thumbnails(WindowPart):
    """Pictures of the frames of one scan by one camera. One is drawn at a time, so that one frame at most is
    read for this; a frame that is not in memory takes no room there."""

    name = "thumbnails"
    doing = "Drawing thumbnails"
    window: Window
    activity: Activity

    def __post_init__(self) -> None:
        self._of: tuple[Timeline, Camera, int] | None = None  # scan, camera, width of the pictures
        self._there: OrderedDict[int, moderngl.Texture | None] = OrderedDict()  # by frame, last used last;
        # None of one that cannot be drawn
        self._wanted: int | None = None  # frame
        self._work: _Work | None = None

    def __len__(self) -> int:
        return sum(texture is not None for texture in self._there.values())

    @property
    def waits(self) -> bool:
        """Whether one is being drawn, or asked for."""
        return self._work is not None or self._wanted is not None

    def draw(self, timeline: Timeline, frame: int, camera: Camera, aspect: float) -> None:
        """Declare the picture of a frame, or its room until it is there. aspect: of the view."""
        width = round(_HEIGHT * min(max(aspect, _NARROWEST), _WIDEST))
        if self._of != (timeline, camera, width):
            self.clear()
            self._of = timeline, camera, width
        height = _SHOWN * imgui.get_font_size()
        size = ImVec2(height * width / _HEIGHT, height)
        if frame not in self._there:
            self._wanted = frame
            imgui.dummy(size)
            return
        self._there.move_to_end(frame)
        texture = self._there[frame]
        if texture is not None:
            imgui.image(imgui.ImTextureRef(texture.glo), size)

    def advance(self, now: float) -> bool:
        """Take in what was drawn, and draw what was asked for last while nothing else reads or draws;
        whether there is another."""
        is_new = self._take()
        wanted, of = self._wanted, self._of
        if self._work is not None:
            if wanted is not None and wanted != self._work.frame:
                self._work.task.cancel()
        elif wanted is not None and of is not None and self.activity.is_idle:
            self._wanted = None
            task = Task("Picture of a frame")
            self._work = _Work(wanted, task, in_background(task, lambda: _picture(*of, wanted)))
        return is_new

    def _take(self) -> bool:
        """Keep a picture that is done; whether there is one."""
        if self._work is None or not self._work.future.done():
            return False
        frame, task, future = self._work
        self._work = None
        if task.cancelled:
            return False
        picture = None
        with suppress(Cancelled):
            picture = future.result()
        texture = None
        if picture is not None:
            height, width = picture.shape[:2]
            texture = self.window.ctx.texture((width, height), 4, np.ascontiguousarray(picture).tobytes())
        self._there[frame] = texture
        if self._wanted == frame:
            self._wanted = None
        while len(self._there) > _MOST:
            _release(self._there.popitem(last=False)[1])
        return True

    def close(self) -> None:
        """Let go of all pictures."""
        self.clear()

    def clear(self) -> None:
        """Let go of all pictures, and of one that is being drawn."""
        if self._work is not None:
            self._work.task.cancel()
        for texture in self._there.values():
            _release(texture)
        self._there.clear()
        self._of = self._wanted = None


def _picture(timeline: Timeline, camera: Camera, width: int, frame: int) -> Picture | None:
    """Read a frame where it is not in memory, and draw it; None of one that cannot be."""
    try:
        return preview_picture(timeline.visit(frame), (width, _HEIGHT), camera)
    except (InputError, TimelineClosed):
        return None


def _release(texture: moderngl.Texture | None) -> None:
    if texture is not None:
        texture.release()
