"""The paths of landmarks over the picture, in the scan's coordinates or held still by anchors."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ....analysis.curves import Smoothing
from ....analysis.track import Track
from ....analysis.trajectories import Trajectory, stabilising, trajectory_of
from ....errors import InputError
from ....look import color_table
from ....output.overlays import DIM_LINE, NOTHING_DRAWN, DrawnMarks, DrawnPath, rounded, runs_of
from ....output.plots import color_of_path
from ....rigid import STILL, Rigid
from ...scene.canvas import Canvas, ScreenView
from ...tool_context import ToolContext
from .._cached import Cached
from .._seen import seen_in_view
from .choices import ANCHORS, CurveChoices, Settings

Still = tuple[Rigid | None, ...]
SPEED_MAP = "viridis"
_LEVELS = 16  # of speed that have colours of their own


class Paths:
    """The paths of the landmarks that are ticked. problem: why they are not held still, "" where nothing is
    wrong. fastest: the speed that has the last colour, scan units a second."""

    def __init__(self, context: ToolContext) -> None:
        self.problem = ""
        self.fastest = 0.0
        self._context = context
        self._cached = Cached()
        self._all: tuple[Trajectory, ...] = ()  # that were asked for last, with what is found of them:
        self._by_speed: list[list[int]] | None = None  # colours
        self._drawn: tuple[object, tuple[DrawnPath, ...]] | None = None
        self._laid: object = None
        self._seen: tuple[object, NDArray[np.bool_]] = None, np.empty(0, bool)

    def still(self, choices: CurveChoices) -> Still | None:
        """The motion of each frame that holds the scan still: that of the stabilised scan, else that of the
        anchors; None where these do not tell one."""
        if self._context.followed.still is not None:
            return self._context.followed.still
        tracks, anchors = self._context.followed.tracks, self._anchors(choices)
        return self._cached.of(
            ("still", anchors), tuple(tracks[name] for name in anchors), lambda: self._found(tracks, anchors)
        )

    def _anchors(self, choices: CurveChoices) -> tuple[str, ...]:
        return tuple(name for name in choices.anchors if name in self._context.followed.tracks)

    def _found(self, tracks: Mapping[str, Track], anchors: tuple[str, ...]) -> Still | None:
        try:
            self.problem, found = "", stabilising(tracks, anchors)
        except InputError as error:
            self.problem, found = str(error), None
        return found

    def hold(self, settings: Settings, choices: CurveChoices) -> bool:
        """Have the scan held still where that is chosen and it is not stabilised; whether that has changed
        something."""
        holds = settings.hold and self._context.followed.still is None
        still = self.still(choices) if holds else None
        wanted = None if still is None else (self._context.timeline, still)
        if wanted == self._laid:
            return False
        self._laid = wanted
        self._context.lay(motion=None if still is None else lambda index: still[index] or STILL)
        return True

    def _still_of_paths(self, settings: Settings, choices: CurveChoices) -> Still | None:
        """The motions that are removed from paths; None where these are as recorded."""
        is_removed = settings.coordinates == ANCHORS or self._context.followed.still is not None
        return self.still(choices) if is_removed else None

    def trajectories(self, settings: Settings, choices: CurveChoices) -> dict[str, Trajectory]:
        """The paths of the landmarks that are ticked, by name."""
        tracks, smoothing = self._context.followed.tracks, settings.smoothing
        still = self._still_of_paths(settings, choices) if choices.traced else None
        found = {}
        for name in choices.traced:
            if (track := tracks.get(name)) is not None and len(track.times) == len(self._context.timeline):
                found[name] = self._cached.of(
                    (name, smoothing), (track, still), partial(_trajectory_of, track, smoothing, still)
                )
        self._cached.forget_others(
            {("still", self._anchors(choices)), *((name, smoothing) for name in found)}
        )
        if (now := tuple(found.values())) != self._all:
            self._all, self._by_speed, self._drawn = now, None, None
            speeds = [np.nanmax(one.speeds) for one in now if np.isfinite(one.speeds).any()]
            self.fastest = float(max(speeds, default=0.0))
        return found

    def draw(self, settings: Settings, choices: CurveChoices, canvas: Canvas, view: ScreenView) -> None:
        """Draw them, as they lie about the pose that is shown."""
        pose, context = self._context.pose, self._context
        if not settings.trajectories or pose is None:
            return
        found = self.trajectories(settings, choices)
        if not found:
            return
        held = self._held(settings, choices, pose.index)
        if held is None:
            return
        motion = context.motion(pose).after(held)
        shown = context.viewport.request if context.viewport.is_there else None
        places = motion.points(np.concatenate([one.positions for one in self._all]))
        if self._seen[0] != (shown, self._all):
            self._seen = (shown, self._all), seen_in_view(context, places)
        alphas = np.split(np.where(self._seen[1], 1.0, DIM_LINE), len(found))
        on_screen = np.split(view.all_on_screen(places), len(found))
        for each in zip(on_screen, self._colors(settings), alphas, strict=True):
            canvas.path(*each)

    def _held(self, settings: Settings, choices: CurveChoices, frame: int) -> Rigid | None:
        """The motion of paths to where they lie about a frame; None where nobody knows how the anchors lie in
        it."""
        still = self._still_of_paths(settings, choices)
        if still is None:
            return STILL
        now = still[frame] if frame < len(still) else None
        return None if now is None else now.inverse

    def drawn(self, settings: Settings, choices: CurveChoices, frame: int, radius: float) -> DrawnMarks:
        """The paths about a frame, for pictures that are saved. radius: of the scan."""
        found = self.trajectories(settings, choices) if settings.trajectories else {}
        held = self._held(settings, choices, frame)
        if not found or held is None:
            return NOTHING_DRAWN
        if self._drawn is None or self._drawn[0] != (settings.by_speed, radius):
            paths = (
                DrawnPath(rounded(one.positions[run], radius), tuple(colors[run]), has_dots=True)
                for one, colors in zip(self._all, self._colors(settings), strict=True)
                for run in runs_of(one.positions)
            )
            self._drawn = (settings.by_speed, radius), tuple(paths)
        return DrawnMarks(trajectories=self._drawn[1], held=held)

    def _colors(self, settings: Settings) -> list[list[int]]:
        """The colours of the paths in each frame, 0xRRGGBB."""
        if not settings.by_speed:
            return [[color_of_path(number)] * len(one.positions) for number, one in enumerate(self._all)]
        if self._by_speed is None:
            self._by_speed = [self._speed_colors(one) for one in self._all]
        return self._by_speed

    def _speed_colors(self, one: Trajectory) -> list[int]:
        """The colours of a path by its speed, 0xRRGGBB; that of rest where the speed is not known."""
        share = np.nan_to_num(one.speeds) / self.fastest if self.fastest else np.zeros(len(one.speeds))
        levels = np.round(np.clip(share, 0, 1) * (_LEVELS - 1)) / (_LEVELS - 1)
        red, green, blue = color_table(SPEED_MAP)[np.round(levels * 255).astype(int), :3].astype(int).T
        return (red << 16 | green << 8 | blue).tolist()


def _trajectory_of(track: Track, smoothing: Smoothing, still: Still | None) -> Trajectory:
    return trajectory_of(track, smoothing.wide_enough(track.times), still)
