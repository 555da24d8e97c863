"""Another look of what is seen already: shading alone, and the picture that drawing it anew gives."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes import sphere

from viewer.backends import backend, backends
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.frame import reshade as reshade_plan
from viewer.drawing.plan import Ready, make_plan
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.errors import InputError
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.layers import Layers
from viewer.scan.pose import Pose

SIZE = (96, 64)
LOOKS = (
    Look(),
    Look(light="head", ambient=0.3),
    Look(light="fixed", azimuth=40, elevation=20),
    Look(light="fixed", azimuth=-40, elevation=20, background="#ffffff"),
    Look(light="flat", color_by="depth"),
    Look(light="flat", color_by="height", color_map="magma"),
    Look(light="flat", color_by="height", up="+x"),
    Look(light="flat", color_by="height", up="+x", low=-0.5, high=0.5),
    Look(light="flat", color_by="height_of"),
    Look(color_by="normal"),
    Look(color_by="id", plain="#ff0000"),
    Look(color_by="level", holes=True),
    Look(eye_dome=True, light="flat"),
)


@pytest.fixture(scope="module")
def pose() -> Pose:
    cloud = sphere(1500)
    assert cloud.normals is not None
    return Pose(0, 0.0, "", replace(cloud, scalars={"height_of": cloud.normals[:, 1]}))


def reshade(renderer: Renderer, request: Request, surface: Surface) -> bool:
    ready = make_plan(renderer, request, surface.size)
    assert isinstance(ready, Ready)
    return reshade_plan(ready, surface)


def whole(renderer: Renderer, request: Request, surface: Surface) -> None:
    while render_frame(renderer, request, surface):
        pass


@pytest.mark.parametrize("name", [n for n, one in backends().items() if n != "laplacian"])
def test_pictures_are_those_of_drawing_anew(renderer: Renderer, pose: Pose, name: str) -> None:
    camera = Camera.orbit(pose.bounds, 30, 20, aspect=1.5)
    surface, fresh = Surface(renderer.gpu, SIZE), Surface(renderer.gpu, SIZE)
    shaded = 0
    for look in LOOKS:
        request = Request(pose, camera, name, backend(name).params(), look)
        if reshade(renderer, request, surface):
            shaded += 1
            assert "draw" in surface.stats.skipped
        else:
            whole(renderer, request, surface)
            assert "draw" not in surface.stats.skipped
        whole(renderer, request, fresh)
        np.testing.assert_array_equal(surface.image(), fresh.image(), err_msg=str(look))
        for channel in ("id", "depth", "color", "normal", "value", "level", "coverage"):
            ours, wanted = getattr(surface, channel), getattr(fresh, channel)
            np.testing.assert_array_equal(ours, wanted, err_msg=f"{channel} {look}")
    assert shaded >= (0 if name == "codeword" else 3)


def test_what_shows_something_else_is_not_shaded(renderer: Renderer, pose: Pose) -> None:
    camera = Camera.orbit(pose.bounds, 30, 20, aspect=1.5)
    request = Request(pose, camera, "points", backend("points").params(), Look())
    surface = Surface(renderer.gpu, SIZE)
    assert not reshade(renderer, request, surface), "nothing was drawn"
    render_frame(renderer, request, surface)
    assert not reshade(renderer, request, surface), "the same is drawn again, as by who times it"
    others: tuple[dict[str, Any], ...] = (
        {"camera": replace(camera, fov_y=20.0)},
        {"params": backend("points").params({"point_size": 3})},
        {"backend": "surfels", "params": None},
        {"pose": Pose(1, 1.0, "", sphere(1400))},
        {"layers": Layers({"more": np.zeros(1500)})},
    )
    relit = replace(request, look=Look(color_by="id"))
    for other in others:
        assert not reshade(renderer, replace(relit, **other), surface), other
    assert reshade(renderer, relit, surface)
    with pytest.raises(InputError):
        render_frame(renderer, replace(request, look=Look(color_by="missing")), surface)
    assert reshade(renderer, request, surface), "a plan that failed leaves the picture as it is"
    render_frame(renderer, request, surface, share=0.9)
    assert not reshade(renderer, request, surface), "it shows a part of the points"
