"""The landmarks of a document, the measures of them, and notes."""

from __future__ import annotations

from dataclasses import dataclass

from ..analysis.landmarks import Landmark
from ..analysis.measures import Measure
from ..geometry import Vector
from .part import Part


@dataclass(frozen=True)
class Note:
    """A text that is pinned to a place, to a frame, or to a place in a frame.

    frame: None for all. position: scan units, None where it is of the frame.
    """

    text: str
    frame: int | None = None
    position: Vector | None = None


@dataclass(frozen=True)
class Landmarks(Part, name="landmarks"):
    """all: in the order of placing. template: the name of the one that they began with, "" for none."""

    all: tuple[Landmark, ...] = ()
    template: str = ""
    measures: tuple[Measure, ...] = ()
    notes: tuple[Note, ...] = ()
