"""The first frame of the scan that is chosen in the dialog, drawn small beside the window."""

from __future__ import annotations

import os
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path

import moderngl
import numpy as np
from imgui_bundle import ImVec2, imgui
from numpy.typing import NDArray

from ...errors import InputError
from ...scan.open import open_scan
from ...scan.preview import preview_picture
from ...task import Task, checkpoint, in_background

SIZE = 320, 240  # pixels
_LARGEST = 256 << 20  # bytes of a file that is read for a preview


@dataclass(frozen=True)
class Preview:
    """A scan in small. picture: (H, W, 4) RGBA, None where it cannot be drawn. words: on it."""

    picture: NDArray[np.uint8] | None
    words: str


def find_preview(scan: str) -> Preview:
    """Read the first frame of a scan and draw it; what is wrong with it in its stead."""
    try:
        with open_scan(scan) as timeline:
            frames = f"{len(timeline)} frames, " if len(timeline) > 1 else ""
            if timeline.files and os.path.getsize(timeline.files[0]) > _LARGEST:
                return Preview(None, f"{frames}too large for a preview")
            checkpoint()
            pose = timeline.pose(0)
            checkpoint()
            return Preview(preview_picture(pose, SIZE), f"{frames}{pose.count:,} points")
    except InputError as error:
        return Preview(None, f"Cannot be opened: {error}")
    except OSError as error:
        return Preview(None, f"Cannot be opened: {error.strerror}")


class Previewer:
    """Draws previews, one at a time: that of the scan asked for last."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._scan: str | None = None
        self._task: Task | None = None
        self._future: Future[Preview] | None = None
        self._found: Preview | None = None
        self._texture: moderngl.Texture | None = None

    @property
    def waits(self) -> bool:
        """Whether one is being drawn."""
        return self._future is not None

    def ask(self, scan: str | None) -> None:
        """Draw this scan instead of any other; None: none. Nothing happens where it is the one already."""
        if scan == self._scan:
            return
        if self._task is not None:
            self._task.cancel()
        self._scan, self._found, self._task, self._future = scan, None, None, None
        self._let_go()
        if scan is not None:
            task = self._task = Task(f"Preview of {Path(scan).name}")
            self._future = in_background(task, lambda: find_preview(scan))

    def advance(self) -> bool:
        """Take in what was drawn; whether there is anything."""
        if self._future is None or not self._future.done():
            return False
        future, self._future, self._task = self._future, None, None
        try:
            self._found = future.result()
        except Exception as error:  # whatever a file brings, the window stays
            self._found = Preview(None, f"Cannot be opened ({type(error).__name__}).")
        if self._found.picture is not None:
            self._texture = self._ctx.texture(SIZE, 4, np.ascontiguousarray(self._found.picture).tobytes())
        return True

    @property
    def words(self) -> str:
        """Words on the scan that was asked for, nothing for none."""
        if self._scan is None:
            return ""
        return "Reading ..." if self._found is None else self._found.words

    def draw_picture(self) -> None:
        """Declare the picture, as wide as there is room."""
        width = imgui.get_content_region_avail().x
        size = ImVec2(width, width * SIZE[1] / SIZE[0])
        if self._texture is not None:
            imgui.image(imgui.ImTextureRef(self._texture.glo), size)
        else:
            imgui.dummy(size)

    def _let_go(self) -> None:
        if self._texture is not None:
            self._texture.release()
            self._texture = None
