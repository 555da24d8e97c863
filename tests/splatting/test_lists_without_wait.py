"""Lists that are filled without a wait: the pictures are those of lists that the CPU waits for."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scenes import sphere
from splat_scenes import CAMERAS, SIZE, assert_equal

from viewer.backends import backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.splatting import lists
from viewer.splatting.lists import TileLists

pytestmark = pytest.mark.backend("surfels")
BALL = sphere(3000)
AROUND = [Camera.orbit(BALL.bounds(), angle, 20, aspect=4 / 3) for angle in (30, 40, 50)]
FRONT, BEHIND = (Camera((0, 0, z), (0, 0, 0)) for z in (3.0, -3.0))
Look = Callable[..., Surface]


@pytest.fixture
def look(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> Look:
    """look(cloud, camera, surface=..., passes=...): a picture as on a graphics card."""
    monkeypatch.setattr(renderer.gpu, "software", False)
    poses: dict[int, Pose] = {}

    def look(
        cloud: PointCloud,
        camera: Camera,
        surface: Surface | None = None,
        passes: str = "two",
        **params: object,
    ) -> Surface:
        surface = surface or Surface(renderer.gpu, SIZE)
        chosen = {"instancing": "tiles", "passes": passes, "enlarge": 1.0, **params}
        pose = poses.setdefault(id(cloud), Pose(0, 0.0, "test", cloud))
        while render_frame(
            renderer, Request(pose, camera, "surfels", backend("surfels").params(chosen)), surface
        ):
            pass
        return surface

    return look


@pytest.fixture
def waits(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Whether the CPU waited, for each filling."""
    found: list[bool] = []
    fill = TileLists.fill

    def filled(self: TileLists, *args: object, **kwargs: object) -> bool:
        found.append(self.waits)
        return fill(self, *args, **kwargs)  # type: ignore[arg-type]

    monkeypatch.setattr(TileLists, "fill", filled)
    return found


def compared(
    look: Look, waits: list[bool], cloud: PointCloud, camera: Camera, on: Surface, **params: object
) -> list[bool]:
    """The waits of a picture, which is the same as on a new surface, to the bit."""
    waits.clear()
    look(cloud, camera, on, **params)
    found = list(waits)
    other = look(cloud, camera, **params)
    assert_equal(on, other)
    np.testing.assert_array_equal(on.image(), other.image())
    assert on.stats.skipped == other.stats.skipped
    return found


@pytest.mark.parametrize("passes", ["one", "two"])
def test_the_cpu_does_not_wait_once_a_picture_was_as_usual(
    look: Look, waits: list[bool], passes: str
) -> None:
    surface = look(BALL, AROUND[0], passes=passes)
    assert waits == [True, True], "nothing is known of the first picture"
    for camera in AROUND:
        assert compared(look, waits, BALL, camera, surface, passes=passes) == [False, False]


def test_software_drivers_always_wait(
    renderer: Renderer, look: Look, waits: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(renderer.gpu, "software", True)
    surface = look(BALL, AROUND[0])
    look(BALL, AROUND[1], surface)
    assert waits == [True] * 4


@pytest.mark.parametrize("passes", ["one", "two"])
def test_a_picture_whose_lists_have_no_room_is_drawn_anew(look: Look, waits: list[bool], passes: str) -> None:
    """Splats become larger from picture to picture, until their lists are longer than the room for them."""
    surface = look(BALL, AROUND[0], passes=passes)
    anew = [False, False, True, True]
    found = [
        compared(look, waits, BALL, AROUND[0], surface, passes=passes, radius_scale=scale)
        for scale in (1.0, 2.0, 4.0, 4.0)
    ]
    assert found[0] == [False, False]
    assert anew in found[1:3]
    assert found[3] == [False, False], "there is room now"


@pytest.mark.parametrize("passes", ["one", "two"])
def test_large_splats_are_drawn_anew(look: Look, waits: list[bool], passes: str) -> None:
    surface = look(BALL, AROUND[0], passes=passes)
    found = compared(look, waits, BALL, CAMERAS["near plane"], surface, passes=passes)
    assert found[:2] == [False, False]
    assert len(found) > 2
    assert all(found[2:])
    assert all(compared(look, waits, BALL, CAMERAS["near plane"], surface, passes=passes)), "as the last had"
    compared(look, waits, BALL, AROUND[0], surface, passes=passes)
    assert compared(look, waits, BALL, AROUND[1], surface, passes=passes) == [False, False]


@pytest.mark.parametrize("passes", ["one", "two"])
def test_splats_that_face_away_at_once_are_drawn_anew(look: Look, waits: list[bool], passes: str) -> None:
    """A plane that is seen from its front, then from behind."""
    positions = np.random.default_rng(2).uniform(-1, 1, (2000, 3)) * (1, 1, 0.05)
    plane = PointCloud.from_arrays(
        positions, normals=np.tile((0, 0, 1.0), (2000, 1)), radii=np.full(2000, 0.08), origin=np.zeros(3)
    )
    surface = look(plane, FRONT, passes=passes)
    assert compared(look, waits, plane, FRONT, surface, passes=passes) == [False]
    assert compared(look, waits, plane, BEHIND, surface, passes=passes) == [False, True, True]
    assert compared(look, waits, plane, BEHIND, surface, passes=passes) == [False, False]
    assert compared(look, waits, plane, FRONT, surface, passes=passes) == [False, False]


def test_lists_that_are_too_long_are_passed_over_and_then_not_drawn(
    look: Look, waits: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    surface = look(BALL, AROUND[0])
    monkeypatch.setattr(lists, "_LONGEST", 10)
    assert compared(look, waits, BALL, AROUND[0], surface) == [False, False, True]
    assert "too long" in surface.stats.skipped["tiles"]
    assert compared(look, waits, BALL, AROUND[0], surface) == [True]


def test_fitted_splats_are_listed_without_a_wait(
    renderer: Renderer, waits: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same bits, once splats that hide others are smaller, too."""
    monkeypatch.setattr(renderer.gpu, "software", False)
    cloud = PointCloud.from_arrays(BALL.positions, origin=np.zeros(3))
    pose, params = Pose(0, 0.0, "test", cloud), backend("auto_splats").params({"instancing": "tiles"})
    surface = Surface(renderer.gpu, SIZE)
    for number, camera in enumerate(AROUND):
        waits.clear()
        other = Surface(renderer.gpu, SIZE)
        for each in (surface, other):
            found = list(waits)
            while render_frame(renderer, Request(pose, camera, "auto_splats", params), each):
                pass
        assert found
        assert all(found) if number == 0 else not any(found)
        assert_equal(surface, other)
        np.testing.assert_array_equal(surface.image(), other.image())
