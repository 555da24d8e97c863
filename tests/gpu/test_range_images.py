"""The range views of a pose as images on the GPU."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from range_scenes import sphere_view

from viewer.errors import InputError
from viewer.gpu import pose as gpu_poses
from viewer.gpu.pose import GpuPose
from viewer.renderer import Renderer
from viewer.scan.colors import srgb8_from_linear
from viewer.scan.pose import Pose

SIZE = (47, 39)  # rows of odd length
VIEWS = (sphere_view((0, 0, 4), size=SIZE), sphere_view((2, 0, 4), size=(20, 30), name="right"))
POSE = Pose.of(0, 0.0, "x", VIEWS)


def test_images_hold_what_was_read(renderer: Renderer) -> None:
    pose = GpuPose(renderer.gpu, POSE.cloud, VIEWS)
    for number, view in enumerate(VIEWS):
        shape = view.depth.shape

        def texels(name: str, dtype: type, number: int = number) -> np.ndarray:
            image = pose.image(number, name)
            assert pose.image(number, name) is image
            assert image.size == VIEWS[number].depth.shape[::-1]
            return np.frombuffer(image.read(alignment=1), dtype)

        assert texels("depth", np.uint32).tobytes() == view.depth.tobytes(), "NaN and all"
        np.testing.assert_array_equal(texels("mask", np.uint8).reshape(shape), view.mask * 255)
        np.testing.assert_array_equal(texels("confidence", np.float32).reshape(shape), view.confidence)
        color = texels("color", np.uint8).reshape(*shape, 4)
        np.testing.assert_array_equal(color[..., :3], srgb8_from_linear(view.color))
        assert (color[..., 3] == 255).all()
    assert pose.uploaded_bytes == (47 * 39 + 20 * 30) * (4 + 1 + 4 + 4)


def test_images_come_in_slices(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gpu_poses, "_SLICE", 5 * 47 * 4 + 3)
    pose = GpuPose(renderer.gpu, POSE.cloud, VIEWS[:1])
    names, calls = pose.names_of(("views",)), 1
    while not pose.upload(names, budget_ms=0):
        calls += 1
    each = (8, 2, 8, 8)  # five rows at a time, of the mask twenty
    assert calls == sum(each) - 3, "a call that ends an image begins the next"
    assert pose.image(0, "depth").read() == VIEWS[0].depth.tobytes()
    assert pose.uploaded_bytes == 47 * 39 * (4 + 1 + 4 + 4)


def test_only_what_is_asked_for_is_uploaded_and_goes_with_the_pose(renderer: Renderer) -> None:
    own = Renderer(renderer.gpu, budget_bytes=1)
    image = own.resident(POSE).image(1, "depth")
    assert own.nbytes == 20 * 30 * 4
    own.resident(replace(POSE, index=1))
    assert own.nbytes == 0
    own.gpu.collect()
    assert type(image.mglo).__name__ == "InvalidObject", "released"
    own.release()


def test_colours_of_pictures_are_uploaded_as_they_are(renderer: Renderer) -> None:
    colors = np.random.default_rng(6).integers(0, 256, (*VIEWS[0].depth.shape, 3), np.uint8)
    pose = GpuPose(renderer.gpu, POSE.cloud, (replace(VIEWS[0], color=colors),))
    texels = np.frombuffer(pose.image(0, "color").read(alignment=1), np.uint8)
    np.testing.assert_array_equal(texels.reshape(*colors.shape[:2], 4)[..., :3], colors)


def test_what_a_view_has_not_is_told(renderer: Renderer) -> None:
    bare = replace(VIEWS[0], color=None, confidence=None)
    pose = GpuPose(renderer.gpu, POSE.cloud, (bare,))
    assert pose.names_of(("views",)) == ["view:0:depth", "view:0:mask"]
    with pytest.raises(InputError, match="the range view 'left' has no confidence"):
        pose.image(0, "confidence")
