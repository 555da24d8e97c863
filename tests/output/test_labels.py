"""Labels stand off the subject, off each other and where they were; their leaders lead to their lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.output.labels import (
    Callout,
    LabelGround,
    LabelPlace,
    LabelPlaces,
    covered_cells,
    forms_of,
    free_names,
    said_once,
)

SIZE, EM, WIDE = (960.0, 640.0), 16.0, (150.0, 24.0)
HEAD = (480.0, 330.0), (150.0, 230.0)  # the middle and the half axes of the subject


def cells(middle: tuple[float, float], axes: tuple[float, float]) -> NDArray[np.bool_]:
    """The cells of an ellipse."""
    rows, columns = (np.arange(n) + 0.5 for n in (48, 72))
    x, y = columns * SIZE[0] / 72, rows[:, None] * SIZE[1] / 48
    return np.asarray(((x - middle[0]) / axes[0]) ** 2 + ((y - middle[1]) / axes[1]) ** 2 < 1)


def callouts(count: int, seed: int = 0, moved: float = 0.0) -> list[Callout]:
    """Labels of lines on the subject."""
    rng = np.random.default_rng(seed)
    ends = np.array(HEAD[0]) + rng.uniform(-0.6, 0.6, (count, 2, 2)) * HEAD[1] + moved
    lines = [np.linspace(a, b, 9) for a, b in ends]
    return [Callout(f"measure {n}", (WIDE, (90.0, 40.0)), line) for n, line in enumerate(lines)]


def ground(
    labels: list[Callout], covered: NDArray[np.bool_] | None = None, view: object = "front"
) -> LabelGround:
    marks = np.concatenate([label.line for label in labels])
    return LabelGround(SIZE, EM, cells(*HEAD) if covered is None else covered, marks, (), view)


def share_covered(places: list[LabelPlace], covered: NDArray[np.bool_]) -> float:
    """How much of the labels' area lies on the subject."""
    on, area = 0.0, 0.0
    for place in places:
        left, top, right, bottom = place.box
        x, y = np.linspace(left, right, 40), np.linspace(top, bottom, 40)
        columns, rows = (x * 72 / SIZE[0]).astype(int), (y * 48 / SIZE[1]).astype(int)
        share = covered[np.ix_(np.clip(rows, 0, 47), np.clip(columns, 0, 71))].mean()
        on, area = on + share * (right - left) * (bottom - top), area + (right - left) * (bottom - top)
    return on / area


def overlaps(places: list[LabelPlace]) -> int:
    boxes = np.array([place.box for place in places])
    low = np.maximum(boxes[:, None, :2], boxes[None, :, :2])
    high = np.minimum(boxes[:, None, 2:], boxes[None, :, 2:])
    return int((np.triu((low < high).all(axis=2), 1)).sum())


def crossings(places: list[LabelPlace]) -> int:
    """How many pairs of leaders cross."""
    leaders = [np.array(place.leader) for place in places if place.leader is not None]
    found = 0
    for number, (a, b) in enumerate(leaders):
        for c, d in leaders[:number]:
            step = np.stack([b - a, c - d], axis=1)
            if abs(np.linalg.det(step)) > 1e-9:
                found += bool(((np.linalg.solve(step, c - a) > 0) & (np.linalg.solve(step, c - a) < 1)).all())
    return found


@pytest.mark.parametrize("count", [1, 6, 12])
def test_they_keep_off_the_subject_and_each_other(count: int) -> None:
    for seed in range(4):
        labels = callouts(count, seed)
        places = LabelPlaces().place(labels, ground(labels))
        assert overlaps(places) == 0
        assert crossings(places) <= count // 6
        assert share_covered(places, cells(*HEAD)) < 0.02
        for label, place in zip(labels, places, strict=True):
            left, top, right, bottom = place.box
            assert (right - left, bottom - top) == pytest.approx(label.sizes[place.form])
            assert left >= 0
            assert right <= SIZE[0]
            assert top >= 0
            assert bottom <= SIZE[1]
            assert place.leader is not None
            start, stop = np.array(place.leader)
            assert np.hypot(*(label.line - start).T).min() < np.ptp(label.line) / 8 + 1, (
                "it begins at its line"
            )
            assert left - 1e-6 <= stop[0] <= right + 1e-6
            assert top - 1e-6 <= stop[1] <= bottom + 1e-6


def test_in_a_close_up_they_keep_off_lines_and_landmarks() -> None:
    everywhere = np.ones((48, 72), bool)
    labels = callouts(6)
    places = LabelPlaces().place(labels, ground(labels, everywhere))
    assert overlaps(places) == 0
    for place in places:
        left, top, right, bottom = place.box
        for label in labels:
            inside = (label.line >= (left, top)) & (label.line <= (right, bottom))
            assert not inside.all(axis=1).any()


def test_they_do_not_jump_while_a_scan_plays_and_follow_the_camera_when_it_rests() -> None:
    """Lines tremble, and the subject breathes; then the camera turns, and the subject is elsewhere."""
    places = LabelPlaces()
    first = places.place(callouts(8), ground(callouts(8)))
    for frame in range(1, 30):
        moved = 12 * np.sin(frame / 3)
        labels = callouts(8, moved=moved)
        covered = cells((480 + moved, 330), (150 + moved / 2, 230))
        now = places.place(labels, ground(labels, covered))
        assert np.array([one.box for one in now]) == pytest.approx(np.array([one.box for one in first]))
        assert now[0].leader != first[0].leader, "leaders follow"
    fresh = LabelPlaces().place(labels, ground(labels, covered))
    assert [place.box for place in fresh] != [place.box for place in first], (
        "placed anew they would be elsewhere"
    )

    labels, covered = callouts(8, moved=150), cells((630, 480), (150, 230))
    for view in ("side", "side"):
        now = places.place(labels, ground(labels, covered, view))
    alone = LabelPlaces().place(labels, ground(labels, covered, "side"))
    assert [place.box for place in now] == [place.box for place in alone]


@pytest.mark.parametrize("seed", [0, 3])
@pytest.mark.parametrize("size", [0.5, 1, 3])
@pytest.mark.parametrize("text", [0.6, 0.8, 1.0, 1.15])
def test_other_pictures_of_a_view_have_them_where_the_window_has_them(
    text: float, size: float, seed: int
) -> None:
    """Of any size, with other text, and other cells of the subject, as those of a preview are; and though the
    window came to its places by what it showed before. text, size: of the picture, in those of the window."""
    places, labels = LabelPlaces(), callouts(8, seed)
    places.place(labels[:3], ground(labels[:3], cells((420, 330), (210, 230))))
    shown = places.place(labels, ground(labels, cells((460, 330), (170, 230))))
    larger = [
        Callout(one.key, tuple((text * size * w, text * size * h) for w, h in one.sizes), size * one.line)
        for one in labels
    ]
    of_picture = ground(labels, cells((490, 330), (160, 220)))
    of_picture = replace(
        of_picture, size=(size * SIZE[0], size * SIZE[1]), em=text * size * EM, marks=size * of_picture.marks
    )
    picture = LabelPlaces()
    picture.take_up(places.spots)
    for _ in range(2):  # as a film has it, too
        saved = picture.place(larger, of_picture)
        assert overlaps(saved) == 0
        for label, there, here in zip(labels, shown, saved, strict=True):
            middle = label.line[:, 0].mean()
            is_right = [
                sum(box[::2]) / 2 > at for box, at in ((there.box, middle), (here.box, size * middle))
            ]
            assert is_right[0] == is_right[1], "on the same side"
            assert here.form == there.form
            rows = np.array(there.box)[1::2].mean(), np.array(here.box)[1::2].mean() / size
            assert rows[1] == pytest.approx(rows[0], abs=1e-6 if text <= 1 else 2 * EM)


def test_other_things_over_the_picture_are_left_free_and_labels_become_narrow_for_it() -> None:
    labels = callouts(4)
    plain = ground(labels)
    taken = (
        (0.0, 0.0, 215.0, 640.0),
        (745.0, 0.0, 960.0, 640.0),
        (0.0, 0.0, 960.0, 200.0),
        (0.0, 470.0, 960.0, 640.0),
    )
    places = LabelPlaces().place(labels, replace(plain, taken=taken))
    assert all(place.box[0] >= 215 and place.box[2] <= 745 for place in places)
    assert {place.form for place in places} >= {1}
    assert forms_of(["mouth: 5 mm"]) == [["mouth: 5 mm"], ["mouth", "5 mm"]]
    assert forms_of(["a note"]) == [["a note"]]


def test_a_label_wider_than_the_picture_takes_the_form_that_fits() -> None:
    line = np.linspace((236.0, 300.0), (266.0, 320.0), 9)
    size, em = (512.0, 374.0), 26.0  # a small window with large text
    label = Callout("distance", ((560.0, 44.0), (400.0, 80.0)), line)
    small = LabelGround(size, em, None, line, ((26.0, 258.0, 143.0, 348.0),))
    (place,) = LabelPlaces().place([label], small)
    assert place.form == 1
    assert place.box[0] >= 0
    assert place.box[2] <= size[0]
    too_wide = Callout("distance", ((900.0, 44.0), (600.0, 80.0)), line)
    (place,) = LabelPlaces().place([too_wide], small)
    assert place.form == 1, "where none fits, the one that is cut least"


def test_many_labels_and_landmarks_all_have_a_place() -> None:
    labels = callouts(30)
    rng = np.random.default_rng(1)
    marks = np.concatenate([ground(labels).marks, rng.uniform(0, 1, (500, 2)) * SIZE])
    places = LabelPlaces().place(labels, replace(ground(labels), marks=marks))
    assert overlaps(places) == 0
    again = LabelPlaces().place(labels, replace(ground(labels), marks=marks))
    assert places == again


def test_names_cover_no_name_before_them() -> None:
    corners = np.array([(10.0, 10.0), (14.0, 12.0), (80.0, 10.0), (-20.0, 200.0)])
    texts, none = ["first", "second", "", "beside"], np.empty((0, 2))
    assert free_names(texts, corners, 16.0, lambda text: 8.0 * len(text), none) == [0, 3]
    marks = corners + np.array((-5, 8))  # each beside its own name
    assert free_names(texts, corners, 16.0, lambda text: 8.0 * len(text), marks) == [0, 3]
    other = np.array([(20.0, 18.0)])
    assert free_names(texts, corners, 16.0, lambda text: 8.0 * len(text), other) == [3]


def test_the_name_of_a_region_is_said_once() -> None:
    texts = ["Region 1", "Region 1, area: 939 mm2", "Region 2", "Region 3, left", "Region 3"]
    assert said_once(texts, str) == [texts[1], "Region 2", "Region 3, left", "Region 3"]


def test_the_subject_is_where_the_surface_shows_something() -> None:
    class Seen:
        size = 960, 640
        depth = np.full((640, 960), np.inf, np.float32)

    Seen.depth[160:480, 240:720] = 1.0
    Seen.depth[60, 60] = 1.0  # a stray point
    covered = covered_cells(Seen())  # type: ignore[arg-type]
    assert covered.shape == (48, 72)
    assert covered[12:36, 18:54].mean() > 0.9
    covered[11:37, 17:55] = False
    assert covered.mean() < 0.01


def test_points_that_lie_a_few_pixels_apart_are_the_subject_throughout() -> None:
    class Seen:
        size = 960, 640
        depth = np.full((640, 960), np.inf, np.float32)

    Seen.depth[160:480:5, 240:720:5] = 1.0
    covered = covered_cells(Seen())  # type: ignore[arg-type]
    assert covered[13:35, 19:53].all()
    covered[11:37, 17:55] = False
    assert not covered.any()


def test_in_a_view_that_is_too_small_for_the_cube_labels_take_all_room() -> None:
    size, em = (512.0, 224.0), 30.0
    scale_bar = 0.0, 100.0, 160.0, 224.0
    line = np.array([[256.0, 120.0]])
    labels = [Callout(f"measure {n}", ((230.0, 60.0),), line) for n in range(2)]
    small = LabelGround(size, em, np.zeros((48, 110), bool), line, [scale_bar])
    places = LabelPlaces().place(labels, small)
    assert overlaps(places) == 0
    for place in places:
        assert place.box[0] >= scale_bar[2] or place.box[3] <= scale_bar[1], "beside the scale bar"
