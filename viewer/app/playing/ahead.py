"""Poses prepared before they are due: estimates, octrees and noise ahead of the playhead, as reading is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ...document.document import Document
from ...drawing.plan import Effort, Waiting, make_plan
from ...drawing.renderer import Renderer
from ...drawing.request import Request
from ...scan.pose import Pose
from ..part import WindowPart
from ..session import Session
from .playback import Playback

_REACH = 24  # frames looked at beyond those that would be late


@dataclass(eq=False)
class Ahead(WindowPart):
    """Has the renderer's workers prepare the poses that are shown next, as the document draws them."""

    name = "ahead"
    doing = "Preparing"
    turn = -2
    session: Session
    playback: Playback
    renderer: Renderer

    def __post_init__(self) -> None:
        self._asked: Any = None
        self.playback.is_prepared = self.is_prepared
        self.renderer.steps_to = self._steps_to

    def is_prepared(self, pose: Pose) -> bool:
        """Whether a pose can be drawn as the document has it, but for what its view alone needs."""
        request = self._request(pose)
        if request is None:
            return True
        return not isinstance(make_plan(self.renderer, request, None, Effort.NONE), Waiting)

    def advance(self, now: float) -> None:
        """Take in what was prepared, and ask for what is shown next; what is not any more is dropped."""
        playback, document = self.playback, self.session.document
        asked = (playback.jumps, playback.timeline, *_how(document))
        ahead = [playback.timeline.ready(index) for index in reversed(self._next())]  # the next one used last
        requests = [self._request(pose) for pose in (playback.pose, *reversed(ahead)) if pose is not None]
        wanted = [request for request in requests if request is not None]
        self.renderer.work.prepare_ahead(wanted, afresh=asked != self._asked)
        self._asked = asked

    def _next(self) -> list[int]:
        """The frames to prepare, the most urgent first; while playing in real time those that would be late
        come after all others, the latest last."""
        playback, session = self.playback, self.session
        player, count, index = playback.player, len(playback.span), session.index
        if not player.playing:
            return [index]
        late = 0
        if not (session.pace.every_frame or playback.is_held):
            late = min(math.ceil(self.renderer.work.latency * player.rate), count - 1)
        steps = [*range(late, min(late + _REACH, count)), *reversed(range(late))]
        frames = [playback.after(index, step) for step in steps]
        return [frame for frame in frames if frame is not None]

    @property
    def ready(self) -> int:
        """How many of the next frames can be drawn, up to the first that cannot; 0 while none follows."""
        playback = self.playback
        if not playback.player.playing:
            return 0
        for step in range(1, min(_REACH, len(playback.span))):
            index = playback.after(self.session.index, step)
            pose = None if index is None else playback.timeline.ready(index)
            if pose is None or not self.is_prepared(pose):
                return step - 1
        return min(_REACH, len(playback.span)) - 1

    def _request(self, pose: Pose) -> Request | None:
        """The picture to draw of a pose, without layers: nothing is prepared of them, and they are found for
        the pose that is shown alone. None before there is a camera."""
        return None if self.session.document.camera is None else self.session.document.request(pose)

    def _steps_to(self, pose: Pose) -> int:
        """How many frames playing shows before a pose; 0 for all while it does not play."""
        if not self.playback.player.playing:
            return 0
        return self.playback.steps_to(pose.index, self.session.index)


def _how(document: Document) -> tuple[Any, ...]:
    """The fields of a document that decide what is prepared."""
    return document.backend, document.params, document.configuration, document.look
