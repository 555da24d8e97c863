"""Landmarks and lines over a picture: what tools draw in a frame, as plain values, and images of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..analysis.deviation import chosen
from ..analysis.deviation.chosen import ReferenceChoice
from ..analysis.motion import distances
from ..analysis.motion.quantities import QUANTITIES
from ..analysis.track import Known
from ..camera import Camera
from ..geometry import Vector
from ..rigid import STILL, Rigid
from .labels import free_names

LINE_COLOR = 0x58D6F0  # of distances that were clicked, in the window as well


class StateMark(NamedTuple):
    """How the state of a landmark is shown. sides: of a polygon with a corner at the right, 0: a disc."""

    color: int  # 0xRRGGBB
    sides: int


# Distinct with protanopia, deuteranopia and tritanopia too: by the colour, and by the shape.
STATE_MARKS = {
    Known.PLACED: StateMark(0x22D6A4, 0),
    Known.CARRIED: StateMark(0xFFD21F, 4),
    Known.TRACKED: StateMark(0xFFD21F, 4),
    Known.GAP: StateMark(0xD55E00, 3),
    Known.PENDING: StateMark(0x858B95, 6),
}
LINE_SLACK = 0.01  # of the scan's radius: how far before a place a surface may be that a line lies on
DIM_LINE, DIM_LANDMARK = 0.5, 0.35  # opacity where something is hidden
HALO_OPACITY, LEADER_OPACITY, BAND_OPACITY = 0.75, 0.8, 0.3
_DIGITS = 6  # of places, in the radius of the scan

# In heights of the text:
LINE_THICK, DOT_RADIUS, MARK_RADIUS, END_RADIUS = 0.15, 0.18, 0.25, 0.28
CORNER_SHARE = 0.55  # of a mark's radius, that of a region's corner has
MOST_NAMED = 16  # landmarks in view whose names stand beside the subject; of more, beside their marks
HALO, LEADER_THICK, LABEL_EDGE = 0.1, 0.08, 0.2  # dark beside lines; of a leader; of a label's coloured edge
DOT_ROOM = 0.4  # how far apart dots are at least
NAME_GAP = 0.15  # between a landmark and its name
_RING_THICK = 0.066


# --- as values ------------------------------------------------------------------------------


@dataclass(frozen=True)
class DrawnLandmark:
    """A landmark in a frame. place: scan units. name: "" where none is shown. is_placed: whether it was set
    there, not tracked. sure: how far off it is at most with 95 %, and spacing: of the points around it, scan
    units; 0 where not known. is_corner: whether it is a corner of a region, which the name is of then."""

    place: Vector
    name: str
    is_placed: bool
    sure: float = 0.0
    spacing: float = 0.0
    is_corner: bool = False


@dataclass(frozen=True)
class DrawnPath:
    """A line through places without a gap. places: scan units, at least one. colors: 0xRRGGBB, of the line
    from each place on, or one for all. has_dots: whether there is a dot at each place where there is room.
    name, value: that stand beside it, "" for nothing. has_ends: whether both ends have a larger dot, and all
    of the line is faint while one of them is hidden. slack: how far before a place the surface may be that
    is its own, scan units; 0: `LINE_SLACK` of the scan's radius."""

    places: tuple[Vector, ...]
    colors: tuple[int, ...]
    has_dots: bool = False
    name: str = ""
    value: str = ""
    has_ends: bool = False
    slack: float = 0.0


@dataclass(frozen=True)
class DrawnCurve:
    """A curve of a plot. unit: of its values, one for each frame, None where not known. color: 0xRRGGBB.
    band: how far to either side the curve may be off, likewise; empty for no band."""

    name: str
    unit: str
    color: int
    values: tuple[float | None, ...]
    band: tuple[float | None, ...] = ()


@dataclass(frozen=True)
class DrawnPlot:
    """A plot of curves that a tool shows below the picture. x: the abscissa in each frame, None where not
    known. x_label: its name and unit."""

    x_label: str
    x: tuple[float | None, ...]
    curves: tuple[DrawnCurve, ...]

    def without_names(self) -> DrawnPlot:
        """Leave out the names of measures."""
        _, bracket, unit = self.x_label.rpartition("[")
        return replace(
            self, x_label=bracket + unit, curves=tuple(replace(one, name="") for one in self.curves)
        )


@dataclass(frozen=True)
class Stabilised:
    """How a tool removed the motion of the subject from a frame. region: that counts as rigid, in words
    without names. reference: the frame that others are brought to. is_gap: whether the frame's motion is not
    known, so that it stands as recorded."""

    region: str
    reference: int
    is_gap: bool = False


@dataclass(frozen=True, eq=False)
class FollowedMarks:
    """Numbers of followed points in a frame, by what they are found from again.

    reference: the frame whose points are followed. motions: by frame, as it is shown: of all frames that the
    numbers depend on; one whose motion is not known is left out.
    """

    reference: int
    motions: Mapping[int, Rigid]


@dataclass(frozen=True, eq=False)
class DeviationMarks:
    """Deviations of a frame, by what they are found from again. motion: from the frame to the reference; None
    in a gap."""

    reference: ReferenceChoice
    motion: Rigid | None


@dataclass(frozen=True)
class DrawnMarks:
    """Landmarks and lines that tools draw over a frame, in the scan's coordinates.

    held: the motion that brings the trajectories to where they are about this frame. plot: None where none is
    shown. stabilised: None where the frame stands as recorded. followed: None unless the colours are numbers
    of followed points. deviation: likewise of deviations.
    """

    landmarks: tuple[DrawnLandmark, ...] = ()
    trajectories: tuple[DrawnPath, ...] = ()
    held: Rigid = STILL
    measure_lines: tuple[DrawnPath, ...] = ()
    plot: DrawnPlot | None = None
    stabilised: Stabilised | None = None
    followed: FollowedMarks | None = None
    deviation: DeviationMarks | None = None

    @property
    def replayable(self) -> tuple[str, ...]:
        """The numbers of tools that a recording can compute again, and so colour by."""
        of_motion = () if self.stabilised is None else (distances.NAME,)
        of_points = () if self.followed is None else tuple(QUANTITIES)
        return (*of_motion, *of_points, *(() if self.deviation is None else (chosen.NAME,)))

    def with_more(self, other: DrawnMarks) -> DrawnMarks:
        """Add the marks of another tool."""
        return DrawnMarks(
            (*self.landmarks, *other.landmarks), (*self.trajectories, *other.trajectories),
            other.held.after(self.held), (*self.measure_lines, *other.measure_lines),
            other.plot or self.plot, other.stabilised or self.stabilised, other.followed or self.followed,
            other.deviation or self.deviation,
        )  # fmt: skip


NOTHING_DRAWN = DrawnMarks()


def rounded(places: NDArray[np.float64], radius: float) -> tuple[Vector, ...]:
    """Places (N, 3) with no more digits than tell them apart in a scan of this radius."""
    decimals = _DIGITS - math.ceil(math.log10(radius)) if radius > 0 else _DIGITS
    return tuple((x, y, z) for x, y, z in np.round(places, max(decimals, 0)).tolist())


def runs_of(places: NDArray[np.float64]) -> list[slice]:
    """The runs of places (N, 3) without a gap, which NaN is."""
    there = np.concatenate([[False], np.isfinite(places).all(axis=1), [False]])
    starts, stops = (np.flatnonzero(there[1:] & ~there[:-1]), np.flatnonzero(~there[1:] & there[:-1]))
    return [slice(start, stop) for start, stop in zip(starts.tolist(), stops.tolist(), strict=True)]


# --- in a picture ---------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Overlay:
    """Places of a picture's landmarks and lines, where the scan is moved to.

    places: (N, 3), those of all landmarks, then of all paths. slacks: (N,), how far before each the surface
    may be that is its own. seen: (N,), which have nothing before them.
    """

    landmarks: tuple[DrawnLandmark, ...]
    paths: tuple[DrawnPath, ...]
    places: NDArray[np.float64]
    slacks: NDArray[np.float64]
    seen: NDArray[np.bool_]

    @classmethod
    def of(
        cls,
        landmarks: Sequence[tuple[DrawnLandmark, Vector, float]],
        paths: Sequence[tuple[DrawnPath, NDArray[np.float64]]],
        slack: float,
    ) -> Overlay:
        """landmarks: each with its place and slack. paths: each with its places. slack: of paths that have
        none of their own."""
        lines = [places for _, places in paths]
        places = np.concatenate([np.array([place for _, place, _ in landmarks]).reshape(-1, 3), *lines])
        of_landmarks = np.array([own for *_, own in landmarks], float)
        slacks = np.concatenate(
            [of_landmarks, *(np.full(len(places), path.slack or slack) for path, places in paths)]
        )
        named, drawn = tuple(one for one, *_ in landmarks), tuple(one for one, _ in paths)
        return cls(named, drawn, places, slacks, np.ones(len(places), bool))

    def with_seen(
        self, find: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.bool_]]
    ) -> Overlay:
        """The overlay with what `find` tells of places and slacks as what is seen."""
        return replace(self, seen=find(self.places, self.slacks)) if len(self.places) else self


class OverlayPainter(Protocol):
    """An image that lines are drawn on. em: the height of text, pixels. Colours are 0xRRGGBB."""

    em: float

    def width(self, text: str) -> float:
        """Width of a text, pixels."""

    def shaded_text(self, left: float, top: float, text: str, opacity: float) -> None:
        """Write without a plate, so that it is read on any picture."""

    def polyline(
        self,
        places: NDArray[np.float64],
        width: float,
        colors: Sequence[int],
        opacities: NDArray[np.float64],
        dots: NDArray[np.bool_],
        dot: float,
    ) -> None:
        """Draw a line through pixels (N, 2), with discs of a width at those of `dots`; NaN: a gap. Where it
        covers itself, it is no more opaque."""

    def mark(self, place: tuple[float, float], radius: float, sides: int, color: int, opacity: float) -> None:
        """Fill a polygon with a corner at the right, or a disc for 0 sides."""

    def ring(
        self, place: tuple[float, float], radius: float, width: float, color: int, opacity: float
    ) -> None:
        """Draw a circle."""


def mark_radius(sides: int, *, is_corner: bool = False) -> float:
    """The radius of the corners of a mark, in heights of the text: marks of all shapes are about as large.
    is_corner: whether it is a corner of a region."""
    return MARK_RADIUS * (1.0 if sides == 0 else 1.3) * (CORNER_SHARE if is_corner else 1.0)


def dotted(places: NDArray[np.float64], room: float) -> NDArray[np.bool_]:
    """Find which places of a path in a picture, (N, 2), NaN for a gap, have a dot: all where half of the
    steps are as wide as this room, else those that no line joins to another."""
    there = np.logical_and.reduce(np.isfinite(places), axis=1)
    joined = there[:-1] & there[1:]
    steps = np.hypot(*np.diff(places, axis=0)[joined].T)
    if 2 * np.count_nonzero(steps < room) > len(steps):
        there[:-1] &= ~joined
        there[1:] &= ~joined
    return there


@dataclass(frozen=True, eq=False)
class LabelledLine:
    """A line of a picture that has a label. places: (N, 2), pixels. color: 0xRRGGBB."""

    text: str
    places: NDArray[np.float64]
    color: int
    opacity: float


def draw_overlay(
    painter: OverlayPainter, size: tuple[float, float], camera: Camera, overlay: Overlay
) -> tuple[list[LabelledLine], NDArray[np.float64]]:
    """Draw lines and landmarks; returns the lines and landmarks that are to have labels, and all places that
    labels keep off, (N, 2).

    size: (width, height), pixels.
    """
    width, height = size
    pixels = camera.places_in_picture(overlay.places) * (height, -height) + (width / 2, height / 2)
    labelled, start = [], len(overlay.landmarks)
    for path in overlay.paths:
        part = slice(start, start + len(path.places))
        start = part.stop
        seen = overlay.seen[part]
        opacities = np.where(seen[0] & seen[-1] if path.has_ends else seen, np.ones(len(seen)), DIM_LINE)
        _draw_path(painter, path, pixels[part], opacities)
        words = ": ".join(text for text in (path.name, path.value) if text)
        if words and np.isfinite(pixels[part]).all():
            labelled.append(LabelledLine(words, pixels[part], path.colors[0], float(opacities.max())))
    count = len(overlay.landmarks)
    lengths = height / camera.heights_at(overlay.places[:count]) if count else np.empty(0)
    of_landmarks = overlay.landmarks, pixels[:count]
    _draw_landmarks(painter, *of_landmarks, lengths, overlay.seen[:count])
    named = named_in(size, [one.name for one in overlay.landmarks], pixels[:count])
    if len(named) > MOST_NAMED:
        _draw_names(painter, *of_landmarks, overlay.seen[:count], named)
    else:
        labelled += [_labelled_name(overlay, number, pixels[[number]]) for number in named]
    return labelled, pixels[np.isfinite(pixels).all(axis=1)]


def draw_line(
    painter: OverlayPainter,
    places: NDArray[np.float64],
    colors: Sequence[int],
    opacities: NDArray[np.float64],
    dots: NDArray[np.bool_],
    dot: float,
    thick: float = LINE_THICK,
) -> None:
    """Draw a line on a dark halo, so that it is seen on any picture. Arguments: as of
    `OverlayPainter.polyline`,
    but thick: in heights of the text."""
    width, halo = thick * painter.em, 2 * max(HALO * painter.em, 1.0)
    dark = [0] * len(places)
    painter.polyline(places, width + halo, dark, HALO_OPACITY * opacities, dots, dot + halo if dot else 0.0)
    painter.polyline(places, width, colors, opacities, dots, dot)


def _draw_path(
    painter: OverlayPainter, path: DrawnPath, pixels: NDArray[np.float64], opacities: NDArray[np.float64]
) -> None:
    em, count = painter.em, len(pixels)
    colors = path.colors if len(path.colors) == count else path.colors[:1] * count
    dots, radius = np.zeros(count, bool), END_RADIUS
    dots[[0, -1]] = path.has_ends
    if path.has_dots:
        dots, radius = dotted(pixels, DOT_ROOM * em), DOT_RADIUS
    draw_line(painter, pixels, colors, opacities, dots, 2 * radius * em if dots.any() else 0.0)


def _draw_landmarks(
    painter: OverlayPainter,
    landmarks: Sequence[DrawnLandmark],
    pixels: NDArray[np.float64],
    lengths: NDArray[np.float64],
    seen: NDArray[np.bool_],
) -> None:
    """Draw a mark for each, in a ring of its uncertainty where that is wider and it was tracked. lengths: of
    a scan unit at each, pixels, (N,)."""
    em, at_all = painter.em, np.isfinite(pixels).all(axis=1)
    opacities = np.where(seen, 1.0, DIM_LANDMARK)
    for number in np.flatnonzero(at_all).tolist():
        one, place, opacity = landmarks[number], pixels[number], float(opacities[number])
        color, sides = mark_of(one)
        spot = float(place[0]), float(place[1])
        radius = mark_radius(sides, is_corner=one.is_corner) * em
        painter.mark(spot, radius + 1.5, sides, 0, HALO_OPACITY * opacity)
        painter.mark(spot, radius, sides, color, opacity)
        reach = one.sure * lengths[number]
        if not one.is_placed and reach > MARK_RADIUS * em:
            painter.ring(spot, reach, max(_RING_THICK * em, 1.0), color, opacity)


def mark_of(landmark: DrawnLandmark) -> StateMark:
    """The mark of a landmark that is there."""
    return STATE_MARKS[Known.PLACED if landmark.is_placed else Known.TRACKED]


def named_in(size: tuple[float, float], names: Sequence[str], pixels: NDArray[np.float64]) -> list[int]:
    """Find the landmarks with a name in a picture. pixels: (N, 2), NaN where one is not there."""
    inside = np.logical_and.reduce((pixels >= 0) & (pixels <= size), axis=1)
    return [number for number in np.flatnonzero(inside).tolist() if names[number]]


def _labelled_name(overlay: Overlay, number: int, place: NDArray[np.float64]) -> LabelledLine:
    one = overlay.landmarks[number]
    opacity = 1.0 if overlay.seen[number] else DIM_LANDMARK
    return LabelledLine(one.name, place, mark_of(one).color, opacity)


def _draw_names(
    painter: OverlayPainter,
    landmarks: Sequence[DrawnLandmark],
    pixels: NDArray[np.float64],
    seen: NDArray[np.bool_],
    named: Sequence[int],
) -> None:
    """Write the names of landmarks beside their marks, those that cover no other name or mark."""
    em = painter.em
    corners = pixels[named] + np.array([MARK_RADIUS + NAME_GAP, -0.5]) * em
    texts = [landmarks[number].name for number in named]
    for at in free_names(texts, corners, em, painter.width, pixels[np.isfinite(pixels).all(axis=1)]):
        left, top = corners[at].tolist()
        opacity = 1.0 if seen[named[at]] else DIM_LANDMARK
        painter.shaded_text(left, top, texts[at], opacity)
