"""A picture that goes to a file: drawn in slices, so that the window goes on meanwhile."""

from __future__ import annotations

from ...drawing.frame import draw_plan, supersample
from ...drawing.plan import Effort, Failed, Waiting, make_plan
from ...drawing.renderer import Renderer
from ...drawing.request import Request
from ...look import SAMPLES
from ...picture.surface import Surface
from ...task import Task

_UPLOAD_MS = 20.0  # that one slice may spend on uploading a pose


class UnsavedPicture:
    """The picture of a request with all of its samples, whatever the view shows meanwhile.

    task: how far it is, and whether it was given up.
    """

    def __init__(self, renderer: Renderer, request: Request, size: tuple[int, int]) -> None:
        """size: width and height, pixels."""
        self.request, self.task = request, Task("Drawing the picture to save")
        self._renderer, self._size = renderer, size
        self._surface: Surface | None = None
        self._slices = 0

    def advance(self) -> Surface | None:
        """Draw a slice, which takes about as long as one picture; what it is drawn on, once it is complete.
        Raises what drawing does."""
        planned = make_plan(self._renderer, self.request, self._size, Effort.BEGIN, _UPLOAD_MS)
        if isinstance(planned, Failed):
            raise planned.error
        if isinstance(planned, Waiting):
            return None
        if self._surface is None:
            self._surface = Surface(self._renderer.gpu, self._size)
        surface = self._surface
        if self._slices:
            is_rough = supersample(self._renderer, self.request, surface, wait=False)
        else:
            is_rough = draw_plan(planned, surface)
        self._renderer.gpu.ctx.finish()  # so that a turn of the window's loop takes no more than this
        if self._slices or not is_rough:  # the first one may take several calls
            self._slices += 1
        samples = SAMPLES[self.request.look.quality]
        self.task.report(min(self._slices / samples, 1.0))
        return None if is_rough or (samples > 1 and self._slices == 1) else surface

    def release(self) -> None:
        """Let go of what is its own on the GPU."""
        if self._surface is not None:
            self._surface.release()
