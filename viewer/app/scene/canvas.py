"""What tools draw over the picture: lines, points, labels; and how the scan lies on the screen."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from imgui_bundle import ImVec2, imgui
from numpy.typing import NDArray

from ...camera import Camera
from ...geometry import Vector
from ...output import labels as placing
from ...output.overlays import (
    DIM_LINE,
    DOT_RADIUS,
    DOT_ROOM,
    HALO,
    HALO_OPACITY,
    LABEL_EDGE,
    LEADER_OPACITY,
    LEADER_THICK,
    LINE_THICK,
    MARK_RADIUS,
    NAME_GAP,
    StateMark,
    dotted,
    mark_radius,
    runs_of,
)
from .. import theme, widgets
from .viewport import Viewport

_CROSS = _INK = 0xFFFFFF
_OUTLINE = 0x000000  # so that what is light is seen on any surface
_POINT = 0.28  # radius, in heights of the font
_LINES, _POINTS, _TOP = range(3)  # layers of what is drawn
_RING = 0.066  # thickness of a ring of uncertainty
_MOST_MARKS = 2000  # positions that labels avoid; of more, some
_LOUPE, _LOUPE_AWAY = 4.5, 1.2  # half its side, and how far from its middle it is; the latter in sides
_MAGNIFIED = 6.0  # screen pixels for one of the picture, in a loupe


Line = tuple[ImVec2, ImVec2]


@dataclass(frozen=True)
class Box:
    """A rectangle on the screen. low: its upper left corner. high: its lower right one."""

    low: ImVec2
    high: ImVec2

    def clipped(self, start: ImVec2, stop: ImVec2) -> Line | None:
        """The part of a line that is in the box, None where none is."""
        begin, end, along = 0.0, 1.0, stop - start
        for first, step, low, high in (
            (start.x, along.x, self.low.x, self.high.x),
            (start.y, along.y, self.low.y, self.high.y),
        ):
            if step:
                enter, leave = sorted(((low - first) / step, (high - first) / step))
                begin, end = max(begin, enter), min(end, leave)
            elif not low <= first <= high:
                return None
        return (start + along * begin, start + along * end) if begin <= end else None


class ScreenView:
    """The view on the screen, and where positions of the scan are in it.

    box: the view. is_hovered: whether the mouse is over the view and nothing else. Positions on the screen
    are ImGui's.
    """

    def __init__(self, camera: Camera, corner: ImVec2, size: ImVec2, is_hovered: bool = False) -> None:
        """corner: of the view, upper left."""
        self.camera, self.corner, self.size = camera, corner, size
        self.is_hovered = is_hovered
        self.box = Box(corner, corner + size)

    def on_screen(self, position: Vector) -> ImVec2 | None:
        """The position on the screen of one in the scan; None behind the eye. position: float64, scan
        units."""
        seen = self.camera.place_in_picture(position)
        if seen is None:
            return None
        return self.corner + self.size * 0.5 + ImVec2(seen[0] * self.size.y, -seen[1] * self.size.y)

    def all_on_screen(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Positions of the scan on the screen, (N, 2); NaN behind the eye, and where a position is.
        positions: (N, 3), scan units."""
        middle = self.corner + self.size * 0.5
        places = self.camera.places_in_picture(positions) * (self.size.y, -self.size.y)
        return places + np.array([middle.x, middle.y])

    def shows(self, places: NDArray[np.float64]) -> bool:
        """Whether the view shows any of these positions on the screen, (N, 2)."""
        low, high = (self.box.low.x, self.box.low.y), (self.box.high.x, self.box.high.y)
        return bool(((places >= low) & (places <= high)).all(axis=1).any())

    def lengths_on_screen(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """How long a scan unit is on the screen at positions (N, 3), (N,); NaN behind the eye."""
        return self.size.y / self.camera.heights_at(positions)


def _like_runs(joined: NDArray[np.bool_], styles: Sequence[object]) -> Iterator[tuple[int, int]]:
    """The runs of joined positions whose lines are of one style: the first and the last position of each."""
    start = 0
    for at, is_joined in enumerate(joined.tolist()):
        if at > start and (not is_joined or styles[at] != styles[start]):
            yield start, at
        if not is_joined or at == start or styles[at] != styles[start]:
            start = at + (not is_joined)
    if len(joined) > start:
        yield start, len(joined)


class Label:
    """Lines of text on a plate. line: (N, 2), the positions on the screen of what it belongs to. color: that
    of the line. faint: whether it is dimmed."""

    def __init__(
        self, texts: Sequence[str], line: NDArray[np.float64], color: int = _INK, faint: bool = False
    ) -> None:
        self.line, self.color, self.faint = line, color, faint
        em = imgui.get_font_size()
        self._pad = ImVec2(0.4 * em, 0.2 * em)
        self._forms = placing.forms_of(texts)

    @property
    def text(self) -> str:
        """The first line."""
        return self._forms[0][0]

    @property
    def key(self) -> str:
        """The key that tells the label from others: what stands before the colon, such as its number."""
        return self.text.partition(":")[0]

    @property
    def sizes(self) -> tuple[tuple[float, float], ...]:
        """Width and height of each of its forms."""
        forms = ([imgui.calc_text_size(line) for line in lines] for lines in self._forms)
        extents = [
            ImVec2(max(e.x for e in lines), sum(e.y for e in lines)) + self._pad * 2 for lines in forms
        ]
        return tuple((extent.x, extent.y) for extent in extents)

    def draw_at(self, corner: ImVec2) -> ImVec2:
        """Draw it with its upper left corner there; returns where the next one below it begins."""
        size = ImVec2(*self.sizes[0])
        self.draw(Box(corner, corner + size))
        return corner + ImVec2(0, size.y + self._pad.y)

    def draw(self, box: Box, form: int = 0) -> None:
        """Text in the theme's colours on a plate of the theme, which is read on any picture."""
        draw_list = imgui.get_window_draw_list()
        draw_list.add_rect_filled(
            box.low, box.high, imgui.get_color_u32(imgui.Col_.window_bg, 0.92), self._pad.x
        )
        edge = ImVec2(box.low.x + max(2.0, LABEL_EDGE * imgui.get_font_size()), box.high.y)
        draw_list.add_rect_filled(box.low, edge, theme.packed(self.color, DIM_LINE if self.faint else 1.0))
        at = box.low + self._pad
        for number, text in enumerate(self._forms[form]):
            color = imgui.Col_.text_disabled if (number and not form) or self.faint else imgui.Col_.text
            draw_list.add_text(at, imgui.get_color_u32(color), text)
            at.y += imgui.calc_text_size(text).y


class Canvas:
    """Draws over the picture, into the current ImGui window. Colours are 0xRRGGBB, alpha is 0..1.

    One canvas serves all tools in a frame, so that labels avoid the points and labels of them all. Points
    lie over lines, labels over points, and the loupe over all; `draw_labels` is called last. em: the height
    of the font.
    """

    def __init__(self, view: ScreenView, viewport: Viewport) -> None:
        """viewport: has the picture that is drawn over."""
        self._view, self._viewport = view, viewport
        self._labels: list[Label] = []
        self._marks: list[NDArray[np.float64]] = []  # that labels avoid, (N, 2) each, on the screen
        self.em = imgui.get_font_size()
        imgui.get_window_draw_list().channels_split(_TOP + 1)

    @contextmanager
    def _layer(self, layer: int = _POINTS) -> Iterator[imgui.ImDrawList]:
        draw_list = imgui.get_window_draw_list()
        draw_list.channels_set_current(layer)
        yield draw_list
        draw_list.channels_set_current(_LINES)

    def line(self, start: ImVec2, stop: ImVec2, color: int, alpha: float = 1.0) -> None:
        """A line between two positions on the screen."""
        self._mark(*(start + (stop - start) * (n / 8) for n in range(9)))
        self._stroke([start, stop], [(color, alpha)] * 2)

    def _stroke(
        self, points: list[Any], inks: Sequence[tuple[int, float]], thick: float = LINE_THICK
    ) -> None:
        """Draw a line on a dark halo through positions on the screen, ImVec2 or pairs. inks: the colour and
        opacity of the line from each position on."""
        draw_list, width = imgui.get_window_draw_list(), thick * self.em
        halo = width + 2 * max(HALO * self.em, 1.0)
        joined = np.ones(len(points) - 1, bool)
        for first, last in _like_runs(joined, [alpha for _, alpha in inks]):
            dark = theme.packed(_OUTLINE, HALO_OPACITY * inks[first][1])
            draw_list.add_polyline(points[first : last + 1], dark, halo, 0)
        for first, last in _like_runs(joined, inks):
            draw_list.add_polyline(points[first : last + 1], theme.packed(*inks[first]), width, 0)

    def point(self, at: ImVec2, color: int, alpha: float = 1.0) -> None:
        """A disc at a position on the screen."""
        radius = _POINT * self.em
        with self._layer() as draw_list:
            draw_list.add_circle_filled(at, radius + 1, theme.packed(_OUTLINE, 0.6 * alpha))
            draw_list.add_circle_filled(at, radius, theme.packed(color, alpha))
        self._mark(at)

    def ring(self, at: ImVec2, color: int, alpha: float = 1.0) -> None:
        """A ring round a position on the screen."""
        radius, thick = _POINT * self.em, LINE_THICK * self.em
        with self._layer() as draw_list:
            draw_list.add_circle(at, radius, theme.packed(_OUTLINE, 0.6 * alpha), thickness=thick + 2)
            draw_list.add_circle(at, radius, theme.packed(color, alpha), thickness=thick)
        self._mark(at)

    def path(
        self,
        places: NDArray[np.float64],
        colors: Sequence[int],
        alphas: NDArray[np.float64],
        *,
        dots: bool = True,
    ) -> None:
        """A line through positions on the screen, (N, 2), with a dot at each where there is room; NaN: a gap.

        colors, alphas: N each; of the dots, and of the line from each position on. It costs little where they
        are the same for many places in a row. dots: whether there are any.
        """
        there = np.logical_and.reduce(np.isfinite(places), axis=1)
        self._marks.append(places[there])
        points, inks = places.tolist(), list(zip(colors, alphas.tolist(), strict=True))
        for run in runs_of(places):
            if run.stop - run.start > 1:
                self._stroke(points[run], inks[run])
        if dots:
            draw_list, packed = imgui.get_window_draw_list(), {ink: theme.packed(*ink) for ink in set(inks)}
            for at in np.flatnonzero(dotted(places, DOT_ROOM * self.em)):
                draw_list.add_circle_filled(points[at], DOT_RADIUS * self.em, packed[inks[at]])

    def marks(
        self,
        places: NDArray[np.float64],
        mark: StateMark,
        alphas: NDArray[np.float64],
        reaches: NDArray[np.float64],
        *,
        are_corners: bool = False,
    ) -> None:
        """Draw a mark at many positions on the screen, (N, 2), of opacity (N,), each in a ring of a radius
        (N,) where that is wider than the mark. are_corners: whether they are corners of regions, and
        smaller."""
        self._marks.append(places)
        radius = mark_radius(mark.sides, is_corner=are_corners) * self.em
        thick = _RING * self.em
        colors = {alpha: theme.packed(mark.color, alpha) for alpha in set(alphas.tolist())}
        outlines = {alpha: theme.packed(_OUTLINE, HALO_OPACITY * alpha) for alpha in colors}
        with self._layer() as draw_list:
            for (x, y), alpha, reach in zip(places.tolist(), alphas.tolist(), reaches.tolist(), strict=True):
                at = ImVec2(x, y)
                widgets.fill_mark(draw_list, at, radius + 1.5, mark.sides, outlines[alpha])
                widgets.fill_mark(draw_list, at, radius, mark.sides, colors[alpha])
                if reach > radius:
                    draw_list.add_circle(at, reach, colors[alpha], thickness=thick)

    def names(self, texts: Sequence[str], places: NDArray[np.float64], alphas: NDArray[np.float64]) -> None:
        """Texts at the right of positions on the screen, (N, 2), of opacity (N,): the first ones, and of the
        others those that cover no text before them and no mark."""
        height = imgui.get_text_line_height()
        corners = places + np.array([(MARK_RADIUS + NAME_GAP) * self.em, -height / 2])
        marks = np.concatenate([np.empty((0, 2)), *self._marks])
        free = placing.free_names(texts, corners, height, lambda text: imgui.calc_text_size(text).x, marks)
        with self._layer() as draw_list:
            for number in free:
                (left, top), alpha = corners[number].tolist(), float(alphas[number])
                outline, ink = theme.packed(_OUTLINE, alpha), theme.packed(_INK, alpha)
                draw_list.add_text(ImVec2(left + 1, top + 1), outline, texts[number])
                draw_list.add_text(ImVec2(left, top), ink, texts[number])

    def loupe(self, at: ImVec2) -> None:
        """Draw the picture about a position on the screen, magnified in a square beside it, with a cross in
        its middle; nothing where that shows no surface."""
        view, half, image = self._view, _LOUPE * self.em, self._viewport.image
        ratio = self._viewport.size[1] / view.size.y  # pixels of the picture
        x, y = ((at.x - view.corner.x) * ratio, (at.y - view.corner.y) * ratio)
        reached = round(half / _MAGNIFIED * ratio)
        if image is None or not self._viewport.probe.shows_near((math.floor(x), math.floor(y)), reached):
            return
        away = 2 * half * _LOUPE_AWAY
        across = away if at.x + away + half < view.box.high.x else -away
        up = -away if at.y - away - half > view.box.low.y else away
        middle = at + ImVec2(across, up)
        low, high = middle - ImVec2(half, half), middle + ImVec2(half, half)
        picked, reach = (at - view.corner) / view.size, ImVec2(half, half) / _MAGNIFIED / view.size
        border, thick = imgui.get_color_u32(imgui.Col_.border), LINE_THICK * self.em
        with self._layer(_TOP) as draw_list:
            draw_list.add_image(imgui.ImTextureRef(image), low, high, picked - reach, picked + reach)
            draw_list.add_rect(low, high, border, thickness=thick)
            for arm in (ImVec2(half, 0), ImVec2(0, half)):
                for thick, color in ((3.0, theme.packed(_OUTLINE, 0.5)), (1.0, theme.packed(_CROSS))):
                    for side in (1, -1):
                        draw_list.add_line(middle + arm * (0.15 * side), middle + arm * side, color, thick)

    def _mark(self, *positions: ImVec2) -> None:
        """Have labels avoid positions on the screen."""
        self._marks.append(np.array([(position.x, position.y) for position in positions]))

    def labels(self, labels: Sequence[Label]) -> None:
        """Labels of lines; `draw_labels` lays them all out together."""
        self._labels.extend(labels)

    def draw_labels(self, laid_out: placing.LabelPlaces, taken: Sequence[placing.Box]) -> None:
        """Draw the labels of all tools off the subject and off each other, each with a leader from its line.

        laid_out: those in the frames before. taken: boxes in the view where other things are.
        """
        view, corner = self._view, np.array([self._view.corner.x, self._view.corner.y])
        marks = np.concatenate([np.empty((0, 2)), *self._marks]) - corner
        marks = marks[:: len(marks) // _MOST_MARKS + 1]
        size = view.size.x, view.size.y
        ground = placing.LabelGround(size, self.em, self._viewport.probe.covered, marks, taken, view.camera)
        labels = placing.said_once(self._labels, lambda one: one.text)
        asked = [placing.Callout(one.key, one.sizes, one.line - corner) for one in labels]
        placed = laid_out.place(asked, ground)
        with self._layer() as draw_list:
            for label, laid in zip(labels, placed, strict=True):
                if laid.leader is not None:
                    alpha = 0.5 * LEADER_OPACITY if label.faint else LEADER_OPACITY
                    ends = [ImVec2(*(np.array(end) + corner).tolist()) for end in laid.leader]
                    self._stroke(ends, [(label.color, alpha)] * 2, LEADER_THICK)
            for label, laid in zip(labels, placed, strict=True):
                left, top, right, bottom = laid.box
                label.draw(
                    Box(view.corner + ImVec2(left, top), view.corner + ImVec2(right, bottom)), laid.form
                )
        draw_list.channels_merge()
