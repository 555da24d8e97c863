"""Points in parts: a pose with more points than a buffer texture takes is drawn like any other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from scenes import sphere

from viewer.camera import Camera
from viewer.drawing.frame import draw_plan, render_frame
from viewer.drawing.plan import Effort, Ready, Waiting, make_plan
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.errors import InputError
from viewer.gpu.context import headless
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.rigid import Rigid
from viewer.scan.layers import Layers
from viewer.scan.pose import Pose

COUNT, MOST, SIZE = 2500, 1000, (96, 72)
CLOUD = replace(sphere(COUNT), scalars={"step": np.arange(COUNT, dtype=np.float32)})
LAYERS = Layers({"layer": np.sin(np.arange(COUNT, dtype=np.float64))})
TURNED = Layers(world_from_pose=Rigid(np.array([[0.0, -1, 0, 2], [1, 0, 0, 3], [0, 0, 1, 4], [0, 0, 0, 1]])))


@pytest.fixture(scope="module")
def both() -> Iterator[tuple[Renderer, Renderer]]:
    """A renderer that takes all points at once, and one that takes them in parts."""
    whole, parts = Renderer(headless()), Renderer(headless())
    parts.gpu.max_points = MOST
    yield whole, parts
    whole.release()
    parts.release()


def drawn(own: Renderer, request: Request) -> Surface:
    """The picture that a renderer draws."""
    surface = Surface(own.gpu, SIZE)
    while render_frame(own, request, surface):
        pass
    return surface


@pytest.mark.parametrize(
    ("look", "layers", "size"),
    [
        (Look(), Layers(), 1),
        (Look(light="head"), Layers(), 3),
        (Look(light="fixed", color_by="normal"), TURNED, 2),
        (Look(color_by="height"), TURNED, 2),
        (Look(color_by="depth", eye_dome=True), Layers(), 0),
        (Look(color_by="step"), Layers(), 2),
        (Look(color_by="layer"), LAYERS, 2),
        (Look(color_by="id"), Layers(), 2),
        (Look(color_by="plain", plain="#123456"), Layers(), 2),
    ],
)
def test_a_picture_is_the_same_to_the_bit(
    both: tuple[Renderer, Renderer], look: Look, layers: Layers, size: int
) -> None:
    bounds = layers.world_from_pose.bounds(CLOUD.bounds())
    params = type(Request(Pose(0, 0.0, "", CLOUD), Camera(), "points").params)(point_size=size)
    request = Request(Pose(0, 0.0, "", CLOUD), Camera.orbit(bounds), "points", params, look, layers)
    expected, found = (drawn(own, request) for own in both)
    assert len(both[1].resident(request.pose).parts) == 3
    assert np.isfinite(found.depth).mean() > 0.1
    for name in ("depth", "row", "id", "color", "normal", "level", "coverage"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), name)
    np.testing.assert_allclose(found.value, expected.value, rtol=1e-6, atol=1e-6)  # from a zero, on the GPU
    np.testing.assert_array_equal(found.image(), expected.image())


def test_previews_draw_some_of_each_part(both: tuple[Renderer, Renderer]) -> None:
    request = Request(Pose(0, 0.0, "", CLOUD), Camera.orbit(CLOUD.bounds()), "points")
    surface = Surface(both[1].gpu, SIZE)
    assert render_frame(both[1], request, surface, share=0.25, moving=True, before=surface)
    assert surface.stats.left_out == COUNT - 3 * 250 + 125
    parts = np.unique(surface.row[surface.row < COUNT] // MOST)
    assert parts.tolist() == [0, 1, 2]
    while render_frame(both[1], request, surface):
        pass
    np.testing.assert_array_equal(surface.row, drawn(both[0], request).row)


def test_arrays_are_uploaded_in_slices_and_counted(both: tuple[Renderer, Renderer]) -> None:
    pose = Pose(0, 0.0, "", CLOUD)
    request = Request(pose, Camera.orbit(CLOUD.bounds()), "points")
    plan = make_plan(both[1], request, SIZE, Effort.BEGIN, upload_ms=1000)
    assert isinstance(plan, Ready)
    assert both[1].bytes_of(pose) == 28 * COUNT
    surface = Surface(both[1].gpu, SIZE)
    draw_plan(plan, surface)
    assert surface.stats.uploaded_bytes == 28 * COUNT
    assert both[1].bytes_of(pose) == 28 * COUNT


@pytest.mark.parametrize(("backend", "params"), [("surfels", None), ("voxels", None)])
def test_other_renderers_say_what_to_do(
    both: tuple[Renderer, Renderer], backend: str, params: object
) -> None:
    request = Request(Pose(0, 0.0, "", CLOUD), Camera.orbit(CLOUD.bounds()), backend, params)
    with pytest.raises(InputError, match="can draw only 1,000 on this driver") as error:
        drawn(both[1], request)
    assert "Choose the renderer Points" in (error.value.hint or "")
    assert not isinstance(make_plan(both[1], request, SIZE, Effort.NONE), Waiting)


def test_hidden_points_are_not_searched(both: tuple[Renderer, Renderer]) -> None:
    pose = Pose(0, 0.0, "", CLOUD)
    params = type(Request(pose, Camera(), "points").params)(hide_hidden=True)
    with pytest.raises(InputError, match="cannot hide points behind others"):
        drawn(both[1], Request(pose, Camera.orbit(CLOUD.bounds()), "points", params))


def test_numbers_of_points_that_were_left_out_give_no_colours(both: tuple[Renderer, Renderer]) -> None:
    cloud = replace(CLOUD, ids=np.arange(COUNT, dtype=np.uint32) * 2)
    request = Request(
        Pose(0, 0.0, "", cloud), Camera.orbit(CLOUD.bounds()), "points", None, Look(color_by="id")
    )
    with pytest.raises(InputError, match="no colours by number"):
        drawn(both[1], request)
