"""Landmarks: named places of a subject, and where a user has set them in which frames."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from ..measures import Measure
from ..surface_point import SurfacePoint

State = Literal["not placed", "placed", "skipped"]


@dataclass(frozen=True)
class Landmark:
    """A named place of a subject.

    keys: where a user has set it, one a frame at most, by frame. skipped: whether it is not to be set.
    missing: frames in which a user has said that it is not there, increasing. partner: the name of the one
    that is its mirror image, "" for none. about: how a person finds it; a name in words and a colon may come
    first.
    """

    name: str
    keys: tuple[SurfacePoint, ...] = ()
    skipped: bool = False
    missing: tuple[int, ...] = ()
    partner: str = ""
    about: str = ""

    @property
    def title(self) -> str:
        """The name in words and the short one, such as "Subnasale (sn)"; the short one alone where no other
        is known."""
        words, colon, _ = self.about.partition(":")
        return f"{words} ({self.name})" if colon and words.lower() != self.name.lower() else self.name

    @property
    def state(self) -> State:
        """Whether it is set in any frame, or shall be."""
        if self.keys:
            return "placed"
        return "skipped" if self.skipped else "not placed"

    def key_at(self, frame: int) -> SurfacePoint | None:
        """The point of the surface at which it was placed in a frame; None where it was not."""
        return next((key for key in self.keys if key.frame == frame), None)

    def with_key(self, key: SurfacePoint) -> Landmark:
        """The landmark with a key, in place of the one in that frame; it is visible there then."""
        others = (other for other in self.keys if other.frame != key.frame)
        keys = tuple(sorted((*others, key), key=lambda one: one.frame))
        missing = tuple(frame for frame in self.missing if frame != key.frame)
        return replace(self, keys=keys, missing=missing, skipped=False)

    def without_key(self, frame: int) -> Landmark:
        """The landmark not set in a frame."""
        return replace(self, keys=tuple(key for key in self.keys if key.frame != frame))

    def with_missing(self, frame: int) -> Landmark:
        """The landmark not there in a frame."""
        missing = tuple(sorted({*self.missing, frame}))
        return replace(self.without_key(frame), missing=missing)


@dataclass(frozen=True)
class Template:
    """Landmarks to be placed, in their order, and measures of them.

    name: that files and commands know it by. title: that users read. source: of the definitions.
    """

    name: str
    title: str
    landmarks: tuple[Landmark, ...]
    measures: tuple[Measure, ...] = ()
    source: str = ""
