"""What tools draw over the picture: lines, points, labels; and where places of the scan are on the screen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from imgui_bundle import ImVec2, imgui
from numpy.typing import NDArray

from ...camera import Camera
from ...geometry import Vector
from ...output.overlays import DOT_RADIUS, DOT_ROOM, LINE_THICK, MARK_RADIUS, dotted
from .. import theme
from .labels import Box, Line, free_place, usual_place

_CROSS = _INK = 0xFFFFFF
_OUTLINE = 0x000000  # so that what is light is seen on any surface
_POINT = 0.28  # radius, in heights of the font
_GAP = 0.5  # between a line and its label
_HEAD = 2.6  # of the view's head, where the prompt is
_LOUPE, _LOUPE_AWAY = 4.5, 1.2  # half its side, and how far from its middle it is; the latter in sides
_MAGNIFIED = 6.0  # screen pixels for one of the picture, in a loupe


class ViewPlace:
    """The view on the screen, and where places of the scan are in it.

    box: the view. is_hovered: whether the mouse is over the view and nothing else. Places on the screen are
    ImGui's.
    """

    def __init__(self, camera: Camera, corner: ImVec2, size: ImVec2, is_hovered: bool = False) -> None:
        """corner: of the view, upper left."""
        self.camera, self.corner, self.size = camera, corner, size
        self.is_hovered = is_hovered
        self.box = Box(corner, corner + size)

    def on_screen(self, position: Vector) -> ImVec2 | None:
        """A place of the scan on the screen; None behind the eye. position: float64, scan units."""
        place = self.camera.place_in_picture(position)
        if place is None:
            return None
        return self.corner + self.size * 0.5 + ImVec2(place[0] * self.size.y, -place[1] * self.size.y)

    def all_on_screen(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Places of the scan on the screen, (N, 2); NaN behind the eye, and where a position is. positions:
        (N, 3), scan units."""
        middle = self.corner + self.size * 0.5
        places = self.camera.places_in_picture(positions) * (self.size.y, -self.size.y)
        return places + np.array([middle.x, middle.y])

    def lengths_on_screen(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """How long a scan unit is on the screen at places (N, 3), (N,); NaN behind the eye."""
        return self.size.y / self.camera.heights_at(positions)


def _like_runs(joined: NDArray[np.bool_], styles: Sequence[object]) -> Iterator[tuple[int, int]]:
    """The runs of joined places whose lines are of one style: the first and the last place of each."""
    start = 0
    for at, is_joined in enumerate(joined.tolist()):
        if at > start and (not is_joined or styles[at] != styles[start]):
            yield start, at
        if not is_joined or at == start or styles[at] != styles[start]:
            start = at + (not is_joined)
    if len(joined) > start:
        yield start, len(joined)


class Label:
    """Lines of text on a plate. line: beside which, on the screen. faint: whether it is dimmed."""

    def __init__(self, texts: Sequence[str], line: Line, faint: bool = False) -> None:
        self.texts, self.line, self.faint = texts, line, faint
        em = imgui.get_font_size()
        self._pad = ImVec2(0.4 * em, 0.2 * em)
        extents = [imgui.calc_text_size(text) for text in texts]
        self.size = ImVec2(max(e.x for e in extents), sum(e.y for e in extents)) + self._pad * 2

    def in_short(self) -> Label:
        """A label of what stands before the colon alone, such as its number."""
        return Label([self.texts[0].partition(":")[0]], self.line, self.faint)

    def draw_at(self, corner: ImVec2) -> ImVec2:
        """Draw it with its upper left corner there; returns where the next one below it begins."""
        self.draw(Box(corner, corner + self.size))
        return corner + ImVec2(0, self.size.y + self._pad.y)

    def draw(self, box: Box) -> None:
        """Text in the theme's colours on a plate of the theme, which is read on any picture."""
        draw_list = imgui.get_window_draw_list()
        draw_list.add_rect_filled(
            box.low, box.high, imgui.get_color_u32(imgui.Col_.window_bg, 0.92), self._pad.x
        )
        at = box.low + self._pad
        for number, text in enumerate(self.texts):
            color = imgui.Col_.text_disabled if number or self.faint else imgui.Col_.text
            draw_list.add_text(at, imgui.get_color_u32(color), text)
            at.y += imgui.calc_text_size(text).y


class Canvas:
    """Draws over the picture, into the current ImGui window. Colours are 0xRRGGBB, alpha is 0..1.

    One canvas serves all tools in a frame, so that labels keep off the points and labels of them all. em: the
    height of the font.
    """

    def __init__(self, view: ViewPlace, image: int | None = None) -> None:
        """image: the texture of the picture; None where there is none."""
        self._view, self._image = view, image
        self._taken: list[Box] = []
        self.em = imgui.get_font_size()

    def line(self, start: ImVec2, stop: ImVec2, color: int, alpha: float = 1.0) -> None:
        """A line between two places on the screen."""
        draw_list, thick = imgui.get_window_draw_list(), LINE_THICK * self.em
        draw_list.add_line(start, stop, theme.packed(_OUTLINE, 0.6 * alpha), thick + 2)
        draw_list.add_line(start, stop, theme.packed(color, alpha), thick)

    def point(self, place: ImVec2, color: int, alpha: float = 1.0) -> None:
        """A disc at a place on the screen."""
        draw_list, radius = imgui.get_window_draw_list(), _POINT * self.em
        draw_list.add_circle_filled(place, radius + 1, theme.packed(_OUTLINE, 0.6 * alpha))
        draw_list.add_circle_filled(place, radius, theme.packed(color, alpha))
        self._take(place)

    def ring(self, place: ImVec2, color: int, alpha: float = 1.0) -> None:
        """A ring round a place on the screen."""
        draw_list, radius, thick = imgui.get_window_draw_list(), _POINT * self.em, LINE_THICK * self.em
        draw_list.add_circle(place, radius, theme.packed(_OUTLINE, 0.6 * alpha), thickness=thick + 2)
        draw_list.add_circle(place, radius, theme.packed(color, alpha), thickness=thick)
        self._take(place)

    def path(
        self,
        places: NDArray[np.float64],
        colors: Sequence[int],
        alphas: NDArray[np.float64],
        *,
        dots: bool = True,
    ) -> None:
        """A line through places on the screen, (N, 2), with a dot at each where there is room; NaN: a gap.

        colors, alphas: N each; of the dots, and of the line from each place on. It costs little where they
        are the same for many places in a row. dots: whether there are any.
        """
        there = np.logical_and.reduce(np.isfinite(places), axis=1)
        joined, points = there[:-1] & there[1:], places.tolist()
        draw_list, thick = imgui.get_window_draw_list(), LINE_THICK * self.em
        if not dots and there.all() and len(set(colors)) == 1 and (alphas == alphas[0]).all():
            for color, alpha, more in ((_OUTLINE, 0.6, 2), (colors[0], 1.0, 0)):
                ink = theme.packed(color, alpha * float(alphas[0]))
                draw_list.add_polyline(points, ink, thick + more, 0)
            return
        asked = list(zip(colors, alphas.tolist(), strict=True))
        of_ink = {ink: theme.packed(*ink) for ink in set(asked)}
        inks = [of_ink[ink] for ink in asked]
        for start, stop in _like_runs(joined, alphas.tolist()):
            color = theme.packed(_OUTLINE, 0.6 * float(alphas[start]))
            draw_list.add_polyline(points[start : stop + 1], color, thick + 2, 0)
        for start, stop in _like_runs(joined, inks):
            draw_list.add_polyline(points[start : stop + 1], inks[start], thick, 0)
        if not dots:
            return
        for at in np.flatnonzero(dotted(places, DOT_ROOM * self.em)):
            draw_list.add_circle_filled(points[at], DOT_RADIUS * self.em, inks[at])

    def marks(
        self,
        places: NDArray[np.float64],
        color: int,
        alphas: NDArray[np.float64],
        reaches: NDArray[np.float64],
    ) -> None:
        """Discs at many places on the screen, (N, 2), of opacity (N,), each in a ring of a radius (N,) where
        that is wider than the disc. Labels do not keep off them."""
        draw_list, radius, thick = (
            imgui.get_window_draw_list(),
            MARK_RADIUS * self.em,
            0.6 * LINE_THICK * self.em,
        )
        colors = {alpha: theme.packed(color, alpha) for alpha in set(alphas.tolist())}
        outlines = {alpha: theme.packed(_OUTLINE, 0.7 * alpha) for alpha in colors}
        for (x, y), alpha, reach in zip(places.tolist(), alphas.tolist(), reaches.tolist(), strict=True):
            place = ImVec2(x, y)
            draw_list.add_circle_filled(place, radius + 1, outlines[alpha])
            draw_list.add_circle_filled(place, radius, colors[alpha])
            if reach > radius:
                draw_list.add_circle(place, reach, colors[alpha], thickness=thick)

    def names(self, texts: Sequence[str], places: NDArray[np.float64], alphas: NDArray[np.float64]) -> None:
        """Texts at the right of places on the screen, (N, 2), of opacity (N,): the first ones, and of the
        others those that cover no text before them."""
        draw_list, line = imgui.get_window_draw_list(), imgui.get_text_line_height()
        corners = (places + np.array([1.6 * MARK_RADIUS * self.em, -line / 2])).tolist()
        inks = {
            alpha: (theme.packed(_OUTLINE, alpha), theme.packed(_INK, alpha))
            for alpha in set(alphas.tolist())
        }
        taken: set[tuple[int, int]] = set()  # cells as high as a line, and half as wide
        for text, (left, top), alpha in zip(texts, corners, alphas.tolist(), strict=True):
            row, column = int(top / line), int(2 * left / line)
            if (row, column) in taken or (row + 1, column) in taken:
                continue
            columns = range(column, int(2 * (left + imgui.calc_text_size(text).x) / line) + 1)
            cells = {(each, at) for at in columns for each in (row, row + 1)}
            if taken.isdisjoint(cells):
                taken |= cells
                outline, ink = inks[alpha]
                draw_list.add_text(ImVec2(left + 1, top + 1), outline, text)
                draw_list.add_text(ImVec2(left, top), ink, text)

    def loupe(self, place: ImVec2) -> None:
        """The picture about a place on the screen, magnified in a square beside it, with a cross in its
        middle; nothing where there is no picture."""
        if self._image is None:
            return
        view, half = self._view, _LOUPE * self.em
        away = 2 * half * _LOUPE_AWAY
        across = away if place.x + away + half < view.box.high.x else -away
        up = -away if place.y - away - half > view.box.low.y else away
        middle = place + ImVec2(across, up)
        low, high = middle - ImVec2(half, half), middle + ImVec2(half, half)
        at, reach = (place - view.corner) / view.size, ImVec2(half, half) / _MAGNIFIED / view.size
        draw_list = imgui.get_window_draw_list()
        draw_list.add_image(imgui.ImTextureRef(self._image), low, high, at - reach, at + reach)
        draw_list.add_rect(low, high, imgui.get_color_u32(imgui.Col_.border), thickness=LINE_THICK * self.em)
        for arm in (ImVec2(half, 0), ImVec2(0, half)):
            for thick, color in ((3.0, theme.packed(_OUTLINE, 0.5)), (1.0, theme.packed(_CROSS))):
                for side in (1, -1):
                    draw_list.add_line(middle + arm * (0.15 * side), middle + arm * side, color, thick)

    def _take(self, place: ImVec2) -> None:
        side = 2 * _POINT * self.em + 2
        self._taken.append(Box.around(place, ImVec2(side, side)))

    def labels(self, labels: Sequence[Label]) -> None:
        """Labels beside their lines, off each other and all points; in short where there is no room, and then
        in full under the mouse."""
        lines, view = [label.line for label in labels], self._view
        area = Box(view.box.low + ImVec2(0, _HEAD * self.em), view.box.high)
        for label in labels:
            short, gap = label.in_short(), _GAP * self.em
            if (box := free_place(label.size, label.line, gap, area, self._taken, lines)) is not None:
                label.draw(box)
            else:
                box = free_place(short.size, label.line, gap, area, self._taken, lines)
                box = box or usual_place(short.size, label.line, gap, area)
                short.draw(box)
                if view.is_hovered and imgui.is_mouse_hovering_rect(box.low, box.high):
                    imgui.set_tooltip("\n".join(label.texts))
            self._taken.append(box)
