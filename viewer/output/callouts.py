"""Landmarks, lines and their labels over a picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..look import rgba
from .image_painter import ImagePainter
from .labels import Box, Callout, LabelGround, LabelPlaces, forms_of, said_once
from .legend import Legend, MeasuredLine
from .marks import MARGIN, PAD, PLATE, MarkPainter, fitted_text
from .overlays import (
    DIM_LINE,
    LABEL_EDGE,
    LEADER_OPACITY,
    LEADER_THICK,
    LINE_COLOR,
    ToldLine,
    draw_line,
    draw_overlay,
)

# In heights of the text:
_LINE_STEP = 1.2  # from one line of a label to the next
_END = 0.28  # radius of a measured line's ends


def draw_lines(
    painter: ImagePainter, size: tuple[float, float], legend: Legend, taken: Sequence[Box]
) -> None:
    """Draw landmarks and their lines, and the measured lines, and their labels; what has an end behind
    the eye is left out. taken: where other marks are."""
    told: list[ToldLine] = []
    marks = np.empty((0, 2))
    if legend.overlay is not None:
        told, marks = draw_overlay(painter, size, legend.camera, legend.overlay)
    lines = legend.lines if legend.marks.measurements or legend.marks.notes else ()
    for line in lines:
        places = _places(line, legend.camera, size)
        if places is None:
            continue
        opacities = np.full(2, DIM_LINE if line.hidden else 1.0)
        draw_line(painter, places, [LINE_COLOR] * 2, opacities, np.ones(2, bool), 2 * _END * painter.em)
        told.append(ToldLine(line.text, places, LINE_COLOR, float(opacities[0])))
    inside = [one for one in told if _is_inside(one.places, size)]
    marks = np.concatenate([marks, *(one.places for one in inside)])
    ground = LabelGround(size, painter.em, legend.covered, marks, taken, legend.camera)
    legend.places.take_up(legend.labels)
    _draw_labels(painter, legend.places, said_once(inside, lambda one: one.text), ground)


def _draw_labels(
    painter: ImagePainter, places: LabelPlaces, told: Sequence[ToldLine], ground: LabelGround
) -> None:
    """Draw texts on plates at their places, each with a leader from its line."""
    em = painter.em
    room = ground.size[0] - 2 * (MARGIN + PAD) * em
    forms = [
        [[fitted_text(painter, line, room) for line in form] for form in forms_of([one.text])] for one in told
    ]
    labels = [
        Callout(one.text.partition(":")[0], tuple(_plate_size(painter, form) for form in own), one.places)
        for one, own in zip(told, forms, strict=True)
    ]
    placed = places.place(labels, ground)
    for one, place in zip(told, placed, strict=True):
        if place.leader is not None:
            ends, none = np.array(place.leader), np.zeros(2, bool)
            opacities = np.full(2, max(one.opacity, LEADER_OPACITY))
            draw_line(painter, ends, [one.color] * 2, opacities, none, 0.0, LEADER_THICK)
    for one, own, place in zip(told, forms, placed, strict=True):
        left, top, _, bottom = place.box
        painter.box(place.box, PLATE)
        painter.box(
            (left, top, left + max(2, round(LABEL_EDGE * em)), bottom),
            (*rgba(f"#{one.color:06x}")[:3], round(255 * one.opacity)),
        )
        for number, line in enumerate(own[place.form]):
            painter.text(left + PAD * em, top + (PAD + number * _LINE_STEP) * em, line)


def _plate_size(painter: MarkPainter, lines: Sequence[str]) -> tuple[float, float]:
    """Width and height of the plate of a label."""
    height = 1 + (len(lines) - 1) * _LINE_STEP + 2 * PAD
    return max(map(painter.width, lines)) + 2 * PAD * painter.em, height * painter.em


def _is_inside(places: NDArray[np.float64], size: tuple[float, float]) -> bool:
    """Whether some of a line's places (N, 2) are in a picture."""
    return bool(((places >= 0) & (places <= size)).all(axis=1).any())


def _places(line: MeasuredLine, camera: Camera, size: tuple[float, float]) -> NDArray[np.float64] | None:
    """The ends in a picture of this size, (2, 2); None where one is behind the eye."""
    width, height = size
    places = camera.places_in_picture(np.array(line.ends)) * (height, -height) + (width / 2, height / 2)
    return places if np.isfinite(places).all() else None
