"""Statistics of a frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass
class Stats:
    """Statistics of a frame. Times in milliseconds.

    backend: the one that drew. upload_ms, derive_ms: what this frame spent on preparing its pose, estimates
    included. uploaded_bytes: of arrays of its points that came to the GPU. shared: names of those that were
    there already, as another pose has the same. passes: (name, ms on the GPU), empty while timers are off.
    gpu_ms: of all passes. frame_ms: from the frame's start to its end on the GPU, 0 while timers are off.
    skipped: what was not computed -> why. counted: what was looked at, as tiles -> a function that reads
    how many of it became what; it waits for the GPU, and tells of the last picture of its surface. chosen:
    parameter -> what "auto" stood for. samples: of each pixel, whose mean the picture shows (see
    `frame.supersample`). faces_away: whether points that face away from the eye were left out. share: of
    the points that needed to be drawn, by the order of picture/sample.py. asked: the share that the picture
    has once it is refined, less than 1 on a coarser level of detail. known: of all points, how many it or
    the pictures went through whose points it draws again (see `FrameView.before`). left_out: the points
    that are in `asked` and not in `share`. simplified: whether it is drawn more simply than a picture at
    rest would be, as `FrameView.moving` allows; the window draws it anew then. coarseness: the largest size,
    as a share of the picture's height, of what a later call replaces by finer parts; 0: nothing.
    """

    backend: str = ""
    gpu_ms: float = 0.0
    frame_ms: float = 0.0
    cpu_ms: float = 0.0
    upload_ms: float = 0.0
    derive_ms: float = 0.0
    uploaded_bytes: int = 0
    shared: tuple[str, ...] = ()
    passes: list[tuple[str, float]] = field(default_factory=list)
    skipped: dict[str, str] = field(default_factory=dict)
    counted: dict[str, Callable[[], dict[str, int]]] = field(default_factory=dict)
    chosen: dict[str, str] = field(default_factory=dict)
    faces_away: bool = False
    share: float = 1.0
    asked: float = 1.0
    known: float = 1.0
    left_out: int = 0
    simplified: bool = False
    samples: int = 1
    coarseness: float = 0.0

    @property
    def is_sample(self) -> bool:
        """Whether fewer points are drawn than it asks for: a preview."""
        return self.share < self.asked
