"""The landmarks of a document: the order of placing, and what a change of one means for others."""

from __future__ import annotations

from dataclasses import replace

from viewer.analysis.landmarks import Landmark, Template
from viewer.analysis.measures import Measure
from viewer.analysis.surface_point import SurfacePoint
from viewer.document.landmarks import Landmarks

WIDTH = Measure("width", "distance", ("left", "right"))
PAIR = Template(
    "pair", "A pair", (Landmark("left", partner="right"), Landmark("right", partner="left")), (WIDTH,)
)


def spot(frame: int) -> SurfacePoint:
    return SurfacePoint(frame, frame / 10, (1.0, 2.0, 3.0), None, None, 0)


def test_landmarks_are_placed_in_turn_but_those_that_are_not_there() -> None:
    names = ("a", "b", "c", "d")
    part = Landmarks(tuple(Landmark(name) for name in names))
    part = part.with_landmark(Landmark("b", keys=(spot(0),))).with_landmark(Landmark("c", skipped=True))

    def following(frame: int, after: str = "") -> str | None:
        found = part.next_to_place(frame, after)
        return found and found.name

    assert (following(0), following(0, "a"), following(0, "d")) == ("a", "d", "a")
    part = part.with_landmark(Landmark("d", missing=(0,)))
    assert (following(0, "a"), following(1, "a")) == ("a", "d")
    part = part.with_landmark(Landmark("a", keys=(spot(1),)))
    assert following(0) is None


def test_two_are_paired_and_part_from_those_before() -> None:
    part = Landmarks(tuple(Landmark(name) for name in "abc"))

    def partners(now: Landmarks) -> list[str]:
        return [one.partner for one in now.all]

    assert partners(part.paired("a", "b")) == ["b", "a", ""]
    assert partners(part.paired("a", "b").paired("b", "c")) == ["", "c", "b"]
    assert partners(part.paired("a", "b").paired("b", "")) == ["", "", ""]


def test_a_measure_is_renamed_alone() -> None:
    others = (WIDTH, replace(WIDTH, name="other"))
    renamed = Landmarks(PAIR.landmarks, measures=others).with_measure_renamed("width", "mouth")
    assert renamed == Landmarks(PAIR.landmarks, measures=(replace(WIDTH, name="mouth"), others[1]))


def test_a_template_keeps_what_was_set() -> None:
    part = Landmarks(
        (Landmark("other", keys=(spot(0),)), Landmark("right", keys=(spot(2),)), Landmark("idle"))
    )
    begun = part.begun_with(PAIR)
    assert [one.name for one in begun.all] == ["left", "right", "other"]
    assert begun.all[1] == replace(PAIR.landmarks[1], keys=(spot(2),))
    assert (begun.template, begun.measures) == ("pair", (WIDTH,))
    assert begun.begun_with(PAIR) == begun, "nothing is there twice"


def test_what_a_file_does_not_place_stays_where_it_is() -> None:
    placed, skipped = Landmark("left", (spot(0),), missing=(3,)), Landmark("right", skipped=True)
    part = Landmarks((placed, skipped, Landmark("nose", (spot(2),))))
    read = [
        Landmark("left", about="the corner"),
        Landmark("right"),
        Landmark("nose", (spot(1),)),
        Landmark("a"),
    ]
    assert part.with_read(read).all == (
        replace(placed, about="the corner"),
        skipped,
        Landmark("nose", (spot(1),)),
        Landmark("a"),
    )


def test_a_name_goes_wherever_it_is_spoken_of() -> None:
    part = Landmarks().begun_with(PAIR).renamed("left", "links")
    assert [(one.name, one.partner) for one in part.all] == [("links", "right"), ("right", "links")]
    assert part.measures[0].landmarks == ("links", "right")
    assert part.without_landmark("right").measures == ()


def test_a_free_name_is_none_of_those_that_are_there() -> None:
    assert Landmarks().free_name() == "Landmark 1"
    assert Landmarks((Landmark("Landmark 7"), Landmark("nose"))).free_name() == "Landmark 8"


def test_a_distance_owns_its_landmarks_and_takes_them_along() -> None:
    made = Landmarks((Landmark("nose"),)).with_distance([spot(0)], [spot(1)])
    assert [one.name for one in made.all] == ["nose", "Distance 1 A", "Distance 1 B"]
    assert [one.name for one in made.listed] == ["nose"]
    (measure,) = made.distances
    assert (measure.name, measure.kind) == ("Distance 1", "distance")
    assert measure.landmarks == ("Distance 1 A", "Distance 1 B")
    assert made.without_measures(["Distance 1"]) == Landmarks((Landmark("nose"),))
    assert made.without_landmark("nose").listed == ()


def test_names_of_distances_are_free_ones() -> None:
    made = Landmarks().with_distance([spot(0)], [spot(1)]).with_distance([spot(0)], [spot(1)])
    assert [one.name for one in made.distances] == ["Distance 1", "Distance 2"]
    made = made.without_measures(["Distance 1"]).with_measure_renamed("Distance 2", "lips")
    made = made.with_distance([spot(0)], [spot(1)]).with_distance([spot(0)], [spot(1)], "lips")
    made = made.with_distance([spot(0)], [spot(1)], "eyes")
    assert [one.name for one in made.distances] == ["lips", "Distance 1", "Distance 3", "eyes"]
    assert len({one.name for one in made.all}) == len(made.all), "a landmark's name is there once"
