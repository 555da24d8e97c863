"""What the user has chosen outlives a switch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from viewer.app.session import Session
from viewer.backends import backend
from viewer.camera import Camera
from viewer.look import Look
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

BARE = Pose(3, 0.5, "three", PointCloud.from_arrays([[0.0, 0, 0], [1, 1, 0], [0.3, 0.8, 0.5]]))


def test_parameters_outlive_a_switch_of_backends() -> None:
    session = Session("scan", backend="points")
    session.params["points"] = backend("points").params({"point_size": 7})
    session.camera = Camera()
    session.backend = "surfels"
    session.request(BARE)
    session.backend = "points"
    assert session.request(BARE).params.point_size == 7


def test_the_scan_decides_until_the_user_does() -> None:
    session = Session("scan")
    assert session.chosen(BARE)[0] == "points"
    session.backend = "surfels"
    assert session.chosen(BARE)[0] == "surfels"


def test_going_back_to_the_default_backend_finds_its_own_defaults() -> None:
    session = Session("scan", camera=Camera())
    first = session.request(BARE).params
    session.backend = "surfels"
    session.request(BARE)
    session.backend = "points"
    assert session.request(BARE).params == first


def test_a_scan_is_found_again_where_it_was_left() -> None:
    session = Session("one", index=4, camera=Camera(), pivot=(1, 2, 3))
    session.turn_to("two")
    assert session.pivot is None, "another scan's place means nothing here"
    assert (session.index, session.camera) == (0, None)
    session.index = 2
    session.turn_to("one")
    assert (session.index, session.camera) == (4, Camera())
    session.turn_to("two")
    assert session.index == 2


def test_a_frame_without_the_chosen_scalar_is_drawn_in_other_colours_and_the_choice_stays() -> None:
    with_q = replace(BARE, cloud=replace(BARE.cloud, scalars={"q": np.zeros(3, np.float32)}))
    session = Session("scan", camera=Camera(), look=Look(color_by="q", light="flat"))
    assert session.request(with_q).look == session.look
    assert session.request(BARE).look == Look(color_by="auto", light="flat")
    assert session.request(with_q).look.color_by == "q"
