"""The renderer: what lives longer than a frame."""

from __future__ import annotations

from functools import cache

from ..gpu.context import Gpu, headless
from ..scan.cache import default_budget
from .residents import Residents
from .work import BackgroundWork

_GIGABYTE = 1 << 30


class Renderer(Residents):
    """The poses on the GPU, and the work that prepares them.

    gpu: None opens a headless context (raises NoOpenGLError). budget_bytes: None is 1 GiB on hardware. On
    software drivers the GPU's memory is the one that the timeline's cache uses, so it is half of that cache.
    """

    def __init__(self, gpu: Gpu | None = None, budget_bytes: int | None = None) -> None:
        gpu = gpu or headless()
        super().__init__(gpu, budget_bytes or (default_budget() // 2 if gpu.software else _GIGABYTE))
        self.work = BackgroundWork(self)

    def release(self) -> None:
        """Delete every pose and stop the workers. The context stays open."""
        super().release()
        self.work.close()
        self.gpu.collect()


@cache
def shared_renderer() -> Renderer:
    """The headless renderer that `viewer.render` and the command line draw with."""
    return Renderer()
