"""Landmarks, lines and their labels over a picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..look import rgba
from .image_painter import ImagePainter
from .labels import Box, Callout, LabelGround, LabelPlaces, forms_of, said_once
from .legend import Legend
from .marks import MARGIN, PAD, PLATE, MarkPainter, fitted_text
from .overlays import LABEL_EDGE, LEADER_OPACITY, LEADER_THICK, LabelledLine, draw_line, draw_overlay

# In heights of the text:
_LINE_STEP = 1.2  # from one line of a label to the next


def draw_lines(
    painter: ImagePainter, size: tuple[float, float], legend: Legend, taken: Sequence[Box]
) -> None:
    """Draw landmarks and lines and their labels. taken: where other marks are."""
    if legend.overlay is None:
        return
    labelled, marks = draw_overlay(painter, size, legend.camera, legend.overlay)
    inside = [one for one in labelled if _is_inside(one.places, size)]
    ground = LabelGround(size, painter.em, legend.covered, marks, taken, legend.camera)
    legend.places.take_up(legend.labels)
    _draw_labels(painter, legend.places, said_once(inside, lambda one: one.text), ground)


def _draw_labels(
    painter: ImagePainter, places: LabelPlaces, labelled: Sequence[LabelledLine], ground: LabelGround
) -> None:
    """Draw texts on plates at their places, each with a leader from its line."""
    em = painter.em
    room = ground.size[0] - 2 * (MARGIN + PAD) * em
    forms = [
        [[fitted_text(painter, line, room) for line in form] for form in forms_of([one.text])]
        for one in labelled
    ]
    labels = [
        Callout(one.text.partition(":")[0], tuple(_plate_size(painter, form) for form in own), one.places)
        for one, own in zip(labelled, forms, strict=True)
    ]
    placed = places.place(labels, ground)
    for one, place in zip(labelled, placed, strict=True):
        if place.leader is not None:
            ends, none = np.array(place.leader), np.zeros(2, bool)
            opacities = np.full(2, max(one.opacity, LEADER_OPACITY))
            draw_line(painter, ends, [one.color] * 2, opacities, none, 0.0, LEADER_THICK)
    for one, own, place in zip(labelled, forms, placed, strict=True):
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
