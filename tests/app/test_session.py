"""What the user has chosen outlives a switch, and a picture's description draws it again."""

from __future__ import annotations

import json

import numpy as np
from numpy.typing import NDArray

from viewer.app.session import Session, describe
from viewer.backends import backend
from viewer.camera import Camera
from viewer.frame import Request, render_frame, shared_renderer
from viewer.gpu.surface import Surface
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
    session = Session("one", index=4, camera=Camera())
    session.turn_to("two")
    assert (session.index, session.camera) == (0, None)
    session.index = 2
    session.turn_to("one")
    assert (session.index, session.camera) == (4, Camera())
    session.turn_to("two")
    assert session.index == 2


def test_a_description_is_json_that_draws_the_same_picture() -> None:
    session = Session("scan", backend="points", look=Look(color_by="height", eye_dome=True))
    session.params["points"] = backend("points").params({"point_size": 5})
    session.camera = Camera.orbit(BARE.cloud.bounds(), azimuth=30, elevation=20)
    request = session.request(BARE)
    found = json.loads(json.dumps(describe(request, session.scan, (64, 48))))
    assert (found["scan"], found["pose"], found["time"]) == ("scan", 3, 0.5)
    again = Request(
        BARE,
        Camera.from_json(found["camera"]),
        found["backend"],
        backend(found["backend"]).params(found["params"]),
        Look(**found["look"]),
    )
    first, second = picture(request, (64, 48)), picture(again, tuple(found["size"]))
    assert (first == second).all()
    assert len(np.unique(first.reshape(-1, 4), axis=0)) > 3


def picture(request: Request, size: tuple[int, int]) -> NDArray[np.uint8]:
    surface = Surface(shared_renderer().gpu, size)
    render_frame(shared_renderer(), request, surface)
    return surface.image()
