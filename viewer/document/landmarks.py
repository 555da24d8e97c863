"""The landmarks of a document, the measures of them, and notes.

A distance that is measured by two clicks is a measure that owns its two landmarks, "Distance 1 A" and
"Distance 1 B". They are tracked like others, but lists of landmarks do not show them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from ..analysis.landmarks import Landmark, Template
from ..analysis.measures import Measure
from ..analysis.surface_point import SurfacePoint
from ..geometry import Vector
from .part import Part

_DISTANCE = re.compile("Distance ([0-9]{1,6})")


@dataclass(frozen=True)
class Note:
    """A text that is pinned to a position, to a frame, or to a position in a frame.

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

    @property
    def distances(self) -> tuple[Measure, ...]:
        """The measures that own their landmarks, in the order they were made."""
        return tuple(measure for measure in self.measures if measure.owns_landmarks)

    @property
    def listed(self) -> tuple[Landmark, ...]:
        """The landmarks that no measure owns."""
        owned = {name for measure in self.distances for name in measure.landmarks}
        return tuple(one for one in self.all if one.name not in owned) if owned else self.all

    def owned_by(self, measure: Measure) -> list[Landmark]:
        """The landmarks of a measure, in its order."""
        return [one for name in measure.landmarks if (one := self.named(name))]

    def is_averaged(self, measure: Measure) -> bool:
        """Whether the user placed a landmark of a measure on averaged points."""
        return any(key.averaged for landmark in self.owned_by(measure) for key in landmark.keys)

    def with_distance(
        self, first: Iterable[SurfacePoint], second: Iterable[SurfacePoint], name: str = ""
    ) -> Landmarks:
        """Add a distance between two landmarks of its own, where these are placed. name: that it has unless
        it is taken; "" for the next number."""
        taken = {*(one.name for one in self.all), *(one.name for one in self.measures)}
        numbers = (_DISTANCE.fullmatch(measure.name) for measure in self.measures)
        count = max((int(number[1]) for number in numbers if number), default=0)
        names = (name, *(f"Distance {number}" for number in range(count + 1, count + len(taken) + 2)))
        name = next(one for one in names if one and not {one, *_ends_of(one)} & taken)
        ends = [Landmark(end, tuple(keys)) for end, keys in zip(_ends_of(name), (first, second), strict=True)]
        measure = Measure(name, "distance", _ends_of(name), owns_landmarks=True)
        return replace(self, all=(*self.all, *ends), measures=(*self.measures, measure))

    def without_measures(self, names: Iterable[str]) -> Landmarks:
        """The landmarks without the measures of these names, and without the landmarks that they own."""
        gone = [measure for measure in self.measures if measure.name in set(names)]
        owned = {name for measure in gone if measure.owns_landmarks for name in measure.landmarks}
        return replace(
            self,
            all=tuple(one for one in self.all if one.name not in owned),
            measures=tuple(measure for measure in self.measures if measure not in gone),
        )

    def named(self, name: str) -> Landmark | None:
        """The landmark of a name; None where there is none."""
        return next((landmark for landmark in self.all if landmark.name == name), None)

    def with_landmark(self, landmark: Landmark) -> Landmarks:
        """The landmarks with this one instead of the one of its name, or at the end."""
        if self.named(landmark.name) is None:
            return replace(self, all=(*self.all, landmark))
        return replace(self, all=tuple(landmark if one.name == landmark.name else one for one in self.all))

    def with_read(self, read: Iterable[Landmark]) -> Landmarks:
        """The landmarks with those of a file. What the file does not place stays as it is set here."""
        made = self
        for landmark in read:
            here = self.named(landmark.name)
            if here is not None and not landmark.keys:
                landmark = replace(here, about=landmark.about)
            made = made.with_landmark(landmark)
        return made

    def without_landmark(self, name: str) -> Landmarks:
        """The landmarks without the one of a name, and without the measures of it."""
        return replace(
            self,
            all=tuple(one for one in self.all if one.name != name),
            measures=tuple(measure for measure in self.measures if name not in measure.landmarks),
        )

    def renamed(self, old: str, new: str) -> Landmarks:
        """The landmarks with another name for one, also where others and measures speak of it."""

        def now(name: str) -> str:
            return new if name == old else name

        return replace(
            self,
            all=tuple(replace(one, name=now(one.name), partner=now(one.partner)) for one in self.all),
            measures=tuple(replace(one, landmarks=tuple(map(now, one.landmarks))) for one in self.measures),
        )

    def with_measure_renamed(self, old: str, new: str) -> Landmarks:
        """The landmarks with another name for a measure."""
        measures = (replace(one, name=new) if one.name == old else one for one in self.measures)
        return replace(self, measures=tuple(measures))

    def paired(self, name: str, partner: str) -> Landmarks:
        """The landmarks with two that are each other's mirror image, and no one else's. partner: "" for
        none."""

        def now(one: Landmark) -> str:
            if one.name in (name, partner):
                return partner if one.name == name else name
            return "" if one.partner in (name, partner) else one.partner

        return replace(self, all=tuple(replace(one, partner=now(one)) for one in self.all))

    def begun_with(self, template: Template) -> Landmarks:
        """The landmarks in the order of a template, as far as they are set; others that are set come after
        them. Its measures come to those that are there."""
        known = {landmark.name: landmark for landmark in self.all}
        listed = {landmark.name for landmark in template.landmarks}
        placed = tuple(
            replace(landmark, keys=known[landmark.name].keys, missing=known[landmark.name].missing)
            if landmark.name in known
            else landmark
            for landmark in template.landmarks
        )
        others = tuple(one for one in self.all if one.name not in listed and one.keys)
        measured = {measure.name for measure in self.measures}
        measures = tuple(measure for measure in template.measures if measure.name not in measured)
        return replace(
            self, all=(*placed, *others), template=template.name, measures=(*self.measures, *measures)
        )

    def next_to_place(self, frame: int, after: str = "") -> Landmark | None:
        """The first landmark after one that is still to be placed and not missing in a frame, round the end;
        None where there is none."""
        names = [landmark.name for landmark in self.all]
        start = names.index(after) + 1 if after in names else 0
        in_turn = (*self.all[start:], *self.all[:start])
        waiting = (one for one in in_turn if one.state == "not placed" and frame not in one.missing)
        return next(waiting, None)

    def free_name(self) -> str:
        """A name for one more: "Landmark 4", a number above those that are there."""
        numbers = (re.fullmatch("Landmark ([0-9]{1,6})", landmark.name) for landmark in self.all)
        return f"Landmark {max((int(number[1]) for number in numbers if number), default=0) + 1}"


def _ends_of(name: str) -> tuple[str, str]:
    """The names of the two landmarks of a distance."""
    return f"{name} A", f"{name} B"
