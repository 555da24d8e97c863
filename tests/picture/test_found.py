"""Numbers that a backend finds itself, as looks colour by them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import finding
import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import NOTHING, sphere

from viewer.analysis.pick import pick
from viewer.backends import FrameView, backends
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request, fallback
from viewer.errors import InputError
from viewer.gpu.pose import GpuPose
from viewer.look import COLOR_BY, Look, ValueKind, color_table
from viewer.output.export import write_picture
from viewer.picture.surface import Surface
from viewer.scan.layers import Layers
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.ranges import robust_range

Draw = Callable[..., Surface]
SIZE = (300, 201)  # wider than what ranges are found from
CLOUD = sphere(4000)
CAMERA = Camera.orbit(CLOUD.bounds(), 30, 20, aspect=SIZE[0] / SIZE[1])
FLAT = Look(light="flat", eye_dome=False, plain="#ff0000")
SQUARES: dict[str, object] = {"point_size": 4}


def drawn(draw: Draw, name: str, cloud: PointCloud = CLOUD, **look: object) -> Surface:
    return draw(cloud, CAMERA, SIZE, finding.BACKEND, replace(FLAT, color_by=name, **look), SQUARES)


def colored(values: NDArray, low: float, high: float) -> NDArray[np.uint8]:
    """The colours of numbers, (N, 3), by the map from low to high."""
    share = np.clip((values - low) / (high - low), 0, 1)
    return color_table("batlow")[np.rint(share * 255).astype(int), :3]


@pytest.mark.parametrize("name", list(finding.VALUES))
def test_a_number_that_is_found_is_read_and_shown(draw: Draw, name: str) -> None:
    surface = drawn(draw, name, low=0.01, high=1.0)
    seen = surface.row != NOTHING
    expected = finding.numbers(CLOUD)[name][surface.row[seen]]
    np.testing.assert_array_equal(surface.value[seen], expected)
    assert np.isnan(surface.value[~seen]).all()
    assert surface.color_range == (0.01, 1.0)
    assert surface.value_kind is finding.VALUES[name]
    known = np.isfinite(expected)
    shown = surface.image()[seen][:, :3].astype(int)
    assert (shown[~known] == [255, 0, 0]).all(), "what is unknown is plain"
    by_log = finding.VALUES[name].is_log
    with np.errstate(divide="ignore"):
        ends = np.log([0.01, 1.0]) if by_log else (0.01, 1.0)
        right = colored(np.log(expected[known]) if by_log else expected[known], *ends).astype(int)
    steps = np.abs(np.diff(color_table("batlow")[:, :3].astype(int), axis=0)).max()
    assert np.abs(shown[known] - right).max() <= steps, "a neighbouring entry at most"


def test_the_range_is_of_what_is_seen(draw: Draw) -> None:
    """Not of rows that no pixel has, nor of what is unknown."""
    surface = drawn(draw, "slope")
    values = surface.value
    assert surface.color_range is not None
    assert surface.color_range == pytest.approx(robust_range(values[::2, ::2]))
    assert surface.color_range == pytest.approx(robust_range(values), abs=0.02)
    assert drawn(draw, "slope", low=-3.0).color_range == (-3.0, surface.color_range[1])
    assert drawn(draw, "odd").color_range == (0.0, 1.0), "as its kind says"
    away = draw(CLOUD, CAMERA.moved([50.0, 0, 0]), SIZE, finding.BACKEND, replace(FLAT, color_by="slope"))
    assert away.color_range == (0.0, 1.0), "where nothing is seen"


def test_an_empty_pose_is_drawn(draw: Draw) -> None:
    surface = drawn(draw, "gap", cloud=PointCloud.from_arrays(np.zeros((0, 3))))
    assert np.isnan(surface.value).all()


def test_colours_go_linearly_where_a_range_has_no_logarithm(draw: Draw) -> None:
    surface = drawn(draw, "gap", low=0.0, high=0.5)
    seen = surface.row != NOTHING
    shown = surface.image()[seen][:, :3].astype(int)
    assert np.abs(shown - colored(surface.value[seen], 0.0, 0.5)).max() <= 4
    assert not ValueKind("", is_log=True).goes_by_log(-1.0, 1.0)


def test_a_scalar_of_the_scan_and_a_layer_go_before(draw: Draw, renderer: Renderer) -> None:
    own = np.linspace(5, 6, len(CLOUD))
    surface = drawn(draw, "slope", cloud=replace(CLOUD, scalars={"slope": own}))
    seen = surface.row != NOTHING
    np.testing.assert_array_equal(surface.value[seen], own[surface.row[seen]].astype(np.float32))
    assert surface.value_kind is None
    request = Request(
        Pose(0, 0.0, "x", CLOUD), CAMERA, finding.BACKEND, None, replace(FLAT, color_by="slope"),
        Layers({"slope": own + 1}),
    )  # fmt: skip
    laid = Surface(renderer.gpu, SIZE)
    render_frame(renderer, request, laid)
    assert np.nanmin(laid.value) >= 6


def test_only_a_backend_that_finds_it_draws_it(draw: Draw, monkeypatch: pytest.MonkeyPatch) -> None:
    look = replace(FLAT, color_by="slope")
    with pytest.raises(InputError, match="unknown colour source 'slope'"):
        draw(CLOUD, CAMERA, SIZE, "points", look)
    with pytest.raises(InputError, match=r"unknown colour source 'slop'.*Did you mean 'slope'"):
        drawn(draw, "slop")
    with pytest.raises(InputError, match="unknown colour source '#1'"):
        drawn(draw, "#1")
    monkeypatch.setitem(backends(), "finding", finding.BACKEND)
    with pytest.raises(
        InputError, match=r"the backend points does not compute 'slope', but finding can.*--backend finding"
    ):
        draw(CLOUD, CAMERA, SIZE, "points", look)
    request = Request(Pose(0, 0.0, "x", CLOUD), CAMERA, finding.BACKEND, look=look)
    assert fallback(request).look.color_by == "auto", "which finds nothing"


def test_another_number_than_was_found_is_refused(draw: Draw) -> None:
    surface = drawn(draw, "slope")
    shown = surface.image(replace(FLAT, color_by="slope", color_map="vik"))
    assert (shown != surface.image(replace(FLAT, color_by="depth"))).any()
    with pytest.raises(InputError, match="did not compute 'gap' for this picture"):
        surface.image(replace(FLAT, color_by="gap"))


def test_it_is_picked_and_exported(draw: Draw, tmp_path: Path) -> None:
    surface = drawn(draw, "gap", cloud=replace(CLOUD, scalars={"row": np.arange(4000.0)}))
    y, x = np.argwhere(surface.row != NOTHING)[100].tolist()
    picked = pick(surface, x, y)
    assert picked is not None
    assert picked.row is not None
    number = finding.numbers(CLOUD)["gap"][picked.row]
    assert picked.scalars == {"row": float(picked.row), "gap": number}
    write_picture(surface, tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as arrays:
        assert arrays["value"][y, x] == number


@pytest.mark.parametrize("look", [Look(light="head"), Look(light="flat", color_by="normal")])
def test_normals_that_are_found_are_not_estimated(renderer: Renderer, look: Look) -> None:
    bare = Pose(0, 0.0, "x", PointCloud.from_arrays(CLOUD.world()))
    surface, own = Surface(renderer.gpu, SIZE), Renderer(renderer.gpu)
    render_frame(own, Request(bare, CAMERA, finding.BACKEND, look=look), surface)
    assert own.resident(bare).cloud.normals is None
    seen = surface.row != NOTHING
    np.testing.assert_allclose(surface.normal[seen], CLOUD.normals[surface.row[seen]], atol=1e-5)
    with_normals = Surface(renderer.gpu, SIZE)
    render_frame(own, Request(Pose(0, 0.0, "x", CLOUD), CAMERA, "points", look=look), with_normals)
    colors = surface.image(replace(look, color_by="normal")).astype(int)
    assert np.abs(colors - with_normals.image(replace(look, color_by="normal"))).max() <= 1
    own.release()


def test_what_is_asked_for_tells_the_backend(renderer: Renderer) -> None:
    """That it has to find numbers anew, or others."""
    changes: list[frozenset[str]] = []

    class Noting(finding.Finding):
        def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
            changes.append(frame.changed)
            return super().draw(pose, frame, surface)

    surface, pose = Surface(renderer.gpu, SIZE), Pose(0, 0.0, "x", CLOUD)
    backend = Noting("finding")
    for name in ("slope", "slope", "gap", "auto"):
        look = replace(FLAT, color_by=name)
        render_frame(renderer, Request(pose, CAMERA, backend, look=look), surface)
        assert surface.wanted == (None if name == "auto" else name)
    assert [sorted(names) for names in changes[1:]] == [[], ["values"], ["values"]]


@pytest.mark.parametrize("backend", backends().values(), ids=str)
def test_declarations_name_no_other_source(backend: object) -> None:
    for name, kind in backend.values.items():  # type: ignore[attr-defined]
        assert name.isidentifier()
        assert name not in COLOR_BY
        assert kind.help
