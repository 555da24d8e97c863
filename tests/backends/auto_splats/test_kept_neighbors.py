"""Neighbours that an earlier picture found are used again, and change no bit of a picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bare_scenes import SCENES, BareScene
from scenes import rarely

from viewer.backends import backend
from viewer.backends.auto_splats.neighborhoods import Neighborhoods
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose

pytestmark = pytest.mark.backend("auto_splats")

CHANNELS = ("depth", "id", "normal", "color", "coverage")


def drawn(
    renderer: Renderer, pose: Pose, camera: Camera, surface: Surface, **params: object
) -> dict[str, int]:
    """Draw a picture; how many neighbourhoods it took from those that are kept, and how many it searched."""
    request = Request(pose, camera, "auto_splats", backend("auto_splats").params(params))
    while render_frame(renderer, request, surface):
        pass
    known = surface.cached(Neighborhoods).read_rounds()
    return {"kept": known["kept"], "searched": sum(known.values()) - known["kept"]}


def cameras(scene: BareScene) -> list[Camera]:
    """Views from beside, from farther away, from near, and back."""
    first = scene.camera
    turned = [first.orbited(*turn) for turn in ((1.0, 0.0), (40.0, 10.0), (180.0, 0.0))]
    return [first, *turned, first.at_distance(3 * first.distance), first.zoomed(2.5), first]


@pytest.mark.parametrize("params", [{}, *rarely({"k": 20}, {"adaptive": False}, {"cull": False})])
@pytest.mark.parametrize("name", ["copied", "sheets", *rarely(*sorted(set(SCENES) - {"copied", "sheets"}))])
def test_pictures_are_the_same_with_neighbors_that_are_kept(
    renderer: Renderer, name: str, params: dict[str, object]
) -> None:
    scene = SCENES[name]()
    pose, surface = Pose(0, 0.0, name, scene.cloud), Surface(renderer.gpu, scene.size)
    for number, camera in enumerate(cameras(scene)):
        drawn(renderer, pose, camera, surface, **params)
        fresh = Surface(renderer.gpu, scene.size)
        assert drawn(renderer, pose, camera, fresh, **params)["kept"] == 0
        for channel in CHANNELS:
            np.testing.assert_array_equal(
                getattr(surface, channel), getattr(fresh, channel), f"{channel} of picture {number}"
            )
        renderer.gpu.discard(fresh)


def test_a_moved_camera_searches_only_what_is_not_known(renderer: Renderer) -> None:
    scene = SCENES["sphere"]()
    pose, surface = Pose(0, 0.0, "moved", scene.cloud), Surface(renderer.gpu, scene.size)
    first = drawn(renderer, pose, scene.camera, surface)
    assert first["kept"] == 0
    moved = drawn(renderer, pose, scene.camera.orbited(1.0, 0.0), surface)
    assert moved["searched"] < 0.3 * first["searched"]
    assert moved["kept"] + moved["searched"] == pytest.approx(first["searched"], rel=0.1)


def test_other_points_and_other_numbers_of_neighbors_keep_nothing(renderer: Renderer) -> None:
    scene = SCENES["sphere"]()
    pose, surface = Pose(0, 0.0, "one", scene.cloud), Surface(renderer.gpu, scene.size)
    other = Pose(1, 0.1, "other", replace(scene.cloud, positions=1.1 * scene.cloud.positions))
    drawn(renderer, pose, scene.camera, surface)
    assert drawn(renderer, other, scene.camera, surface)["kept"] == 0
    away = replace(scene.camera, target=tuple(2 * np.array(scene.camera.eye) - scene.camera.target))
    drawn(renderer, pose, away, surface)
    assert not np.isfinite(surface.depth).any(), "nothing is seen"
    assert drawn(renderer, pose, scene.camera, surface)["kept"] == 0
    assert drawn(renderer, pose, scene.camera, surface, k=12)["kept"] == 0
    assert drawn(renderer, pose, scene.camera.orbited(1.0, 0.0), surface, k=12)["kept"] > 0
