"""Landmarks and lines in pictures: where they belong, faint where hidden, named where there is room."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.analysis.track import Known
from viewer.camera import Camera
from viewer.geometry import Vector
from viewer.look import Look
from viewer.output.labels import LabelSpot
from viewer.output.legend import Legend, Marks
from viewer.output.marked import marked
from viewer.output.marks import PLATE, text_height
from viewer.output.overlays import (
    MARK_RADIUS,
    MOST_NAMED,
    STATE_MARKS,
    DrawnLandmark,
    DrawnPath,
    Overlay,
    dotted,
    rounded,
    runs_of,
)
from viewer.srgb import linear_from_bytes

SIZE = (2560, 1440)
UNIT = 144  # pixels
LEGEND = Legend(
    Marks(landmarks=True), Camera(projection="orthographic", height=10.0), Look(), "mm", 0, 1, 0.0
)
EM = text_height(SIZE)


def picture(
    *landmarks: DrawnLandmark, paths: tuple[DrawnPath, ...] = (), seen: bool = True, **of_legend: Any
) -> NDArray[np.int64]:
    told = [(one, one.place, 0.0) for one in landmarks]
    overlay = Overlay.of(told, [(path, np.array(path.places)) for path in paths], 0.0)
    overlay = overlay.with_seen(lambda places, _: np.full(len(places), seen))
    blank = np.full((SIZE[1], SIZE[0], 4), (90, 90, 90, 255), np.uint8)
    return marked(blank, replace(LEGEND, overlay=overlay, **of_legend), None)[..., :3].astype(int)


def bytes_of(color: int) -> list[int]:
    return [color >> 16, color >> 8 & 255, color & 255]


def at(x: float, y: float) -> tuple[int, int]:
    """Row and column of a place."""
    return round(SIZE[1] / 2 - UNIT * y), round(SIZE[0] / 2 + UNIT * x)


def changed(image: NDArray[np.int64]) -> NDArray[np.bool_]:
    return np.asarray((image != 90).any(axis=2))


def test_landmarks_are_discs_where_they_are_in_the_colour_of_their_state() -> None:
    image = picture(DrawnLandmark((2.0, 1.0, 0.0), "", True), DrawnLandmark((-3.0, 0.0, 0.0), "", False))
    assert image[at(2, 1)].tolist() == bytes_of(STATE_MARKS[Known.PLACED].color)
    assert image[at(-3, 0)].tolist() == bytes_of(STATE_MARKS[Known.TRACKED].color)
    rows, columns = np.nonzero(changed(image)[:, SIZE[0] // 2 :])
    middle = rows.mean(), columns.mean() + SIZE[0] // 2
    assert middle == pytest.approx(at(2, 1), abs=1.1)
    assert len(rows) == pytest.approx(np.pi * (MARK_RADIUS * EM + 1) ** 2, rel=0.4)


PROTAN = (0.152286, 1.052583, -0.204868), (0.114503, 0.786281, 0.099216), (-0.003882, -0.048116, 1.051998)
DEUTAN = (0.367322, 0.860646, -0.227968), (0.280085, 0.672501, 0.047413), (-0.011820, 0.042940, 0.968881)
TRITAN = (1.255528, -0.076749, -0.178779), (-0.078411, 0.930809, 0.147602), (0.004733, 0.691367, 0.303900)


def seen_as(color: int, sight: tuple[tuple[float, ...], ...]) -> NDArray[np.float64]:
    """CIELAB of a colour as it is seen. sight: from linear RGB to linear RGB (Machado, Oliveira and Fernandes
    2009, severity 1)."""
    linear = linear_from_bytes(np.array(bytes_of(color), np.uint8))
    to_xyz = (
        (0.4124564, 0.3575761, 0.1804375),
        (0.2126729, 0.7151522, 0.0721750),
        (0.0193339, 0.1191920, 0.9503041),
    )
    xyz = np.array(to_xyz) @ np.clip(np.array(sight) @ linear, 0, 1) / (0.95047, 1, 1.08883)
    x, y, z = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize(
    "sight", [np.eye(3), PROTAN, DEUTAN, TRITAN], ids=["all", "protan", "deutan", "tritan"]
)
def test_states_are_told_apart_whoever_looks(sight: tuple[tuple[float, ...], ...]) -> None:
    for one, other in itertools.combinations(set(STATE_MARKS.values()), 2):
        assert one.sides != other.sides, "also by their shapes"
        assert np.linalg.norm(seen_as(one.color, sight) - seen_as(other.color, sight)) >= 20


def test_the_shape_of_a_mark_tells_what_was_tracked() -> None:
    image = picture(DrawnLandmark((2.0, 1.0, 0.0), "", True), DrawnLandmark((-3.0, 0.0, 0.0), "", False))
    for place, diagonal in (((2, 1), True), ((-3, 0), False)):
        row, column = at(*place)
        away = round(0.8 * MARK_RADIUS * EM)  # in a disc to all sides, in a diamond not across
        corner = round(0.66 * MARK_RADIUS * EM)
        bright = [image[row, column + away].max() > 150, image[row + corner, column + corner].max() > 150]
        assert bright == [True, diagonal]


@pytest.mark.slow
def test_a_ring_tells_how_sure_a_tracked_one_is() -> None:
    image = picture(DrawnLandmark((0.0, 0.0, 0.0), "", False, sure=2.0))
    row, column = at(0, 0)
    for radius, is_drawn in ((1.0, False), (2.0, True), (2.5, False)):
        for turn in np.linspace(0, 2 * np.pi, 7):
            place = round(row + UNIT * radius * np.sin(turn)), round(column + UNIT * radius * np.cos(turn))
            assert changed(image)[place] == is_drawn, (radius, turn)
    assert changed(picture(DrawnLandmark((0.0, 0.0, 0.0), "", True, sure=2.0))).sum() < 500, (
        "set, not tracked"
    )


def test_what_is_hidden_is_faint() -> None:
    one = DrawnLandmark((0.0, 0.0, 0.0), "", True)
    line = DrawnPath(((-4.0, 2.0, 0.0), (4.0, 2.0, 0.0)), (0xFF0000,))
    bright, faint = picture(one, paths=(line,)), picture(one, paths=(line,), seen=False)
    for place in (at(0, 0), at(1, 2)):
        assert 0 < np.abs(faint[place] - 90).max() < 0.5 * np.abs(bright[place] - 90).max()


def test_a_line_runs_through_its_places_and_is_no_more_opaque_where_it_crosses_itself() -> None:
    bow: tuple[Vector, ...] = ((-4.0, -2.0, 0.0), (4.0, 2.0, 0.0), (4.0, -2.0, 0.0), (-4.0, 2.0, 0.0))
    image = picture(paths=(DrawnPath(bow, (0xFF0000,)),), seen=False)
    for x, y in ((-2, -1), (4, 0), (2, -1)):
        assert image[at(x, y)][0] > 100 > image[at(x, y)][1], "red over gray"
    crossing, alone = image[at(0, 0)], image[at(-2, -1)]
    assert np.abs(crossing - alone).max() < 12


def test_the_colours_of_a_path_are_those_of_its_places_and_dots_need_room() -> None:
    places = tuple((float(x), 0.0, 0.0) for x in range(-4, 5))
    colors = tuple(0xFF0000 if x < 0 else 0x0000FF for x in range(-4, 5))
    image = picture(paths=(DrawnPath(places, colors, has_dots=True),))
    assert image[at(-2.5, 0)].tolist() == [255, 0, 0]
    assert image[at(2.5, 0)].tolist() == [0, 0, 255]
    thick = changed(image).sum(axis=0)
    assert thick[at(2, 0)[1]] > thick[at(2.5, 0)[1]], "a dot at each place"
    near = np.stack([np.linspace(0, 20, 30), np.zeros(30)], axis=1)
    assert not dotted(near, 5.0).any()
    near[10] = near[12] = np.nan
    assert np.flatnonzero(dotted(near, 5.0)).tolist() == [11], "what no line joins has a dot"


def dark(image: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Where the plates of labels are."""
    return np.asarray((image == round(90 * (1 - PLATE[3] / 255))).all(axis=2))


def test_names_of_few_landmarks_stand_beside_the_subject() -> None:
    """Those of many are written beside their marks, where they cover no other name or mark."""
    rows, columns = np.mgrid[:48, :85]
    head = (np.abs(columns - 42) < 20) & (np.abs(rows - 24) < 20)
    grid = [(0.9 * x, 1.2 * y, 0.0) for x in (-2, -1, 1, 2) for y in (-1.5, -0.5, 0.5, 1.5)]

    def names(count: int) -> NDArray[np.int64]:
        some = [DrawnLandmark(place, "pronasale", True) for place in grid[:count]]
        return picture(*some, covered=head)

    on_head = np.kron(head, np.ones((SIZE[1] // 48, 30), bool))
    on_head = np.pad(on_head, ((0, SIZE[1] - on_head.shape[0]), (0, SIZE[0] - on_head.shape[1])))
    few = dark(names(MOST_NAMED))
    assert few.sum() > MOST_NAMED * 3 * EM * EM
    assert few[on_head].sum() < EM * EM, "leaders alone"
    many = [DrawnLandmark((0.2 * n - 2, 0.0, 0.0), "sn", True) for n in range(MOST_NAMED + 1)]
    assert dark(picture(*many)).sum() < EM * EM
    bare = [replace(one, name="") for one in many]
    written = changed(picture(*many)) & ~changed(picture(*bare))
    assert written.any()
    near = [replace(one, name="pronasale") for one in many]  # would cover the next mark
    assert not (changed(picture(*near[:-1], near[-1])) & ~changed(picture(*bare)))[:, : at(1.1, 0)[1]].any()


@pytest.mark.slow
def test_the_corners_of_a_region_are_smaller_and_its_name_stands_once() -> None:
    place = (0.0, 0.0, 0.0)
    area = [changed(picture(DrawnLandmark(place, "", True, is_corner=one))).sum() for one in (True, False)]
    assert area[0] < 0.6 * area[1]
    corner = DrawnLandmark(place, "Region 1", True, is_corner=True)
    line = DrawnPath(((-3.0, 0.0, 0.0), (3.0, 0.0, 0.0)), (0xFF0000,), name="Region 1, area", value="6 mm2")
    alone = picture(replace(corner, name=""), paths=(line,))
    assert (picture(corner, paths=(line,)) == alone).all()
    assert dark(picture(corner, paths=(replace(line, name="width"),))).sum() > dark(alone).sum()


def test_labels_stand_where_they_stand_in_the_view() -> None:
    """At the left of the picture, where they would not be otherwise."""
    one = DrawnLandmark((2.0, 1.0, 0.0), "pronasale", True)
    left = dark(picture(one, labels=(LabelSpot("pronasale", 0, (-0.5, 0.1), True),)))
    assert left[:, : SIZE[0] // 2].any()
    assert not left[:, SIZE[0] // 2 :].any()
    assert dark(picture(one))[:, SIZE[0] // 2 :].any()


def test_values_stand_beside_lines() -> None:
    line = DrawnPath(((-3.0, 0.0, 0.0), (3.0, 0.0, 0.0)), (0xFF0000,))
    plated = changed(picture(paths=(replace(line, name="width", value="6 mm"),)))
    assert plated.sum() > changed(picture(paths=(line,))).sum() + 5 * EM


def test_what_is_behind_the_eye_or_out_of_the_picture_is_left_out() -> None:
    legend = replace(LEGEND, camera=Camera(eye=(0, 0, 5.0)))
    behind = DrawnLandmark((0.0, 0.0, 9.0), "behind", True)
    path = DrawnPath(((0.0, 0.0, 9.0), (0.0, 0.0, 8.0)), (0xFF0000,), True, "behind", "1")
    overlay = Overlay.of([(behind, behind.place, 0.0)], [(path, np.array(path.places))], 0.0)
    blank = np.full((SIZE[1], SIZE[0], 4), 90, np.uint8)
    assert (marked(blank, replace(legend, overlay=overlay), None) == blank).all()
    assert not changed(picture(DrawnLandmark((99.0, 0.0, 0.0), "", True))).any()


def test_places_are_rounded_to_what_tells_them_apart_and_gaps_part_them() -> None:
    far = np.array([[1e7 + 1 / 3, 0.0, 1 / 3]])
    assert rounded(far, 100.0) == ((10000000.3333, 0.0, 0.3333),)
    assert np.abs(np.array(rounded(far * 1e-9, 1e-7)) - far * 1e-9).max() < 1e-12
    places = np.zeros((6, 3))
    places[[0, 3]] = np.nan
    assert runs_of(places) == [slice(1, 3), slice(4, 6)]
