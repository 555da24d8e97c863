"""The judge of one view, and flicker along a walk: pictures whose errors are known."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
import pytest
from range_scenes import sphere_view
from scenes import plane, rarely, sphere_mesh

from viewer.bench.judge import Judge, Walk
from viewer.bench.truth.shapes import AnalyticScene, Plane, Sphere
from viewer.bench.truth.surface import reference_surface
from viewer.camera import Camera
from viewer.look import Look, rgba
from viewer.mesh.range_mesh import triangulated
from viewer.mesh.reference import trace
from viewer.mesh.scene import Scene
from viewer.mesh.triangles import Mesh, read_mesh, vertex_normals
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

if TYPE_CHECKING:
    from viewer.drawing.renderer import Renderer
    from viewer.picture.surface import Surface

SIZE = (96, 72)
LOOK = Look(light="head")
AHEAD = Camera(eye=(0, 0, 4))


def judge(
    renderer: Renderer,
    truth: Scene,
    camera: Camera = AHEAD,
    cloud: PointCloud | None = None,
    tolerance: float | None = None,
) -> Judge:
    cloud = plane(21, depth=0, spacing=0.1) if cloud is None else cloud
    return Judge.of(renderer.gpu, truth, camera, SIZE, LOOK, cloud, tolerance)


def picture(renderer: Renderer, scene: Scene, camera: Camera = AHEAD) -> Surface:
    """What a flawless backend would draw of another scene."""
    return reference_surface(trace(scene, camera, SIZE), renderer.gpu, LOOK)


def counts(errors: dict[str, float]) -> tuple[float, float, float]:
    return errors["false_positives"], errors["false_negatives"], errors["correct"]


# --- one view ------------------------------------------------------------------------------


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_the_truth_has_no_errors(renderer: Renderer, projection: str) -> None:
    camera, mesh = Camera(eye=(2, 1.5, 3), projection=projection), sphere_mesh()
    errors = judge(renderer, mesh, camera, mesh.points).errors(picture(renderer, mesh, camera))
    assert errors["psnr"] == errors["psnr_frame"] == math.inf
    assert errors["ssim"] == errors["ssim_frame"] == 1
    assert not errors["flip"] > 0
    assert (
        errors["visibility_error_percent"] < 7
    )  # behind the outline, where a pixel covers most of the surface
    for name, error in errors.items():
        if name.startswith(("hole", "spill", "boundary", "depth", "wrong_layer")):
            assert error == 0, name
        if name.startswith("normal"):  # they are made unit length in float32 when they are read
            assert error == pytest.approx(0, abs=1e-5), name


@pytest.mark.parametrize("d", [0.5, -1.25])
def test_a_plane_moved_back_by_d_has_a_bias_of_d(renderer: Renderer, d: float) -> None:
    truth = judge(renderer, AnalyticScene((Plane(),)))
    errors = truth.errors(picture(renderer, AnalyticScene((Plane(center=(0, 0, -d)),))))
    assert errors["depth_bias"] == pytest.approx(d, abs=1e-6)
    assert errors["depth_rmse"] == errors["depth_p95"] == pytest.approx(abs(d), abs=1e-6)
    assert errors["depth_bias_px"] == pytest.approx(d * truth.reference.view.scale / 4, rel=1e-6)
    assert errors["wrong_layer_percent"] == 100  # farther than four spacings of 0.1
    assert errors["normal_p95"] == 0


@pytest.mark.parametrize("slant", [0, 60, 75, 85])
@pytest.mark.parametrize("spacing", [0.1, 0.01])
def test_a_slanted_surface_does_not_hide_its_own_points(
    renderer: Renderer, slant: int, spacing: float
) -> None:
    truth, turn = AnalyticScene((Plane(),)), np.radians(slant)
    cloud = plane(round(1.9 / spacing), depth=0, spacing=spacing)
    camera = Camera(eye=(4 * np.sin(turn), 0, 4 * np.cos(turn)))
    errors = judge(renderer, truth, camera, cloud).errors(picture(renderer, truth, camera))
    assert counts(errors)[:2] == (0, 0)
    assert counts(errors)[2] > 100


def test_far_points_of_one_sheet_are_no_wrong_layer(renderer: Renderer) -> None:
    """Where points are finer than pixels, these set how far depths of a sheet lie apart."""
    truth, camera = AnalyticScene((Sphere(),)), Camera(eye=(0, 0, 8))
    fine, coarse = plane(21, depth=0, spacing=1e-4), plane(21, depth=0, spacing=0.1)
    drawn = picture(renderer, AnalyticScene((Sphere(center=(0.03, 0, 0)),)), camera)  # half a pixel aside
    for cloud in (fine, coarse):
        errors = judge(renderer, truth, camera, cloud).errors(drawn)
        assert errors["depth_rmse_px"] > 0.1
        assert errors["wrong_layer_percent"] == 0


def test_holes_where_nothing_was_scanned_are_told_from_the_others(renderer: Renderer) -> None:
    pod = sphere_view((4, 0, 0), size=(120, 100))  # sees the half to the right
    pod = replace(pod, mask=np.isfinite(pod.depth))
    truth = AnalyticScene((Sphere(),))
    seen = Judge.of(renderer.gpu, truth, AHEAD, SIZE, LOOK, Pose.of(0, 0.0, "", (pod,)), None)
    assert seen.scanned is not None
    columns = np.flatnonzero(seen.scanned.any(axis=0))
    assert SIZE[0] / 2 <= columns[0] < SIZE[0] / 2 + 20  # it sees not quite to its horizon
    drawn = picture(renderer, truth)
    assert seen.errors(drawn)["psnr_scanned"] == math.inf
    empty = seen.errors(picture(renderer, AnalyticScene((Sphere(center=(0, 0, 99)),))))
    assert empty["hole_scanned_percent"] == 100
    half = seen.errors(picture(renderer, triangulated([pod])))
    assert half["hole_percent"] > 40
    assert half["hole_scanned_percent"] < 1
    assert half["psnr_scanned"] > half["psnr"] + 6
    assert "hole_scanned_percent" not in judge(renderer, truth).errors(drawn)


def test_an_empty_picture_is_all_hole_and_hides_nothing(renderer: Renderer) -> None:
    mesh = sphere_mesh()
    truth = judge(renderer, mesh, cloud=mesh.points)
    errors = truth.errors(picture(renderer, AnalyticScene((Sphere(center=(0, 0, 99)),))))
    assert errors["hole_percent"] == 100
    assert math.isnan(errors["depth_bias"])
    assert counts(errors) == (np.count_nonzero(~truth.probes.seen), 0, np.count_nonzero(truth.probes.seen))


def test_points_of_two_planes(renderer: Renderer) -> None:
    front, back = Plane(), Plane(center=(0, 0, -2))  # the hinder one is all in the shadow of the other
    square = plane(10, depth=0, spacing=0.2).world()
    cloud = PointCloud.from_arrays(np.concatenate([square, square - np.array([0, 0, 2])]))
    truth = judge(renderer, AnalyticScene((front, back)), cloud=cloud)

    def found(*planes: Plane) -> tuple[float, float, float]:
        return counts(truth.errors(picture(renderer, AnalyticScene(planes))))

    assert found(front, back) == (0, 0, 200)
    assert found(back) == (100, 0, 100)  # the hinder ones are seen through what is missing
    assert found(Plane(center=(0, 0, 1))) == (0, 100, 100)


def test_points_may_lie_as_far_behind_as_the_tolerance_says(renderer: Renderer) -> None:
    deep = PointCloud.from_arrays(plane(11, depth=0.5, spacing=0.01).world())
    truth = AnalyticScene((Plane(),))
    drawn = picture(renderer, truth)
    strict, lenient = (judge(renderer, truth, cloud=deep, tolerance=t) for t in (None, 0.6))
    assert counts(strict.errors(drawn)) == (0, 0, 121)
    assert not strict.probes.seen.any()
    assert counts(lenient.errors(drawn)) == (0, 0, 121)
    assert lenient.probes.seen.all()


def test_cloud_and_truth_have_origins_of_their_own(renderer: Renderer) -> None:
    mesh, camera = sphere_mesh(16), Camera(eye=(2, 1.5, 3))
    moved = PointCloud.from_arrays(mesh.points.world(), origin=mesh.origin + np.array([5.0, -3.0, 8.0]))
    here, there = (judge(renderer, mesh, camera, cloud).probes for cloud in (mesh.points, moved))
    assert (here.pixels == there.pixels).mean() > 0.95  # float32 moves some over an edge
    assert np.abs(here.limit - there.limit).max() < 1e-5
    assert (here.seen == there.seen).mean() > 0.9


def test_only_points_in_the_picture_are_looked_at(renderer: Renderer) -> None:
    cloud = PointCloud.from_arrays([[0, 0, 0], [50, 0, 0], [0, 0, 5]])
    assert len(judge(renderer, AnalyticScene((Plane(),)), cloud=cloud).probes.seen) == 1


def test_of_many_points_some_stand_for_all(renderer: Renderer) -> None:
    ordered = plane(300, depth=0, spacing=0.006)  # of columns, as scanners give them
    first, again = (judge(renderer, AnalyticScene((Plane(),)), cloud=ordered).probes for _ in range(2))
    assert len(first.seen) == 50_000
    assert (first.pixels == again.pixels).all()
    columns = np.bincount(first.pixels % SIZE[0], minlength=SIZE[0])
    inside = columns[columns > 0][1:-1]
    assert inside.min() > 0.7 * inside.max()


def test_pictures_are_compared_in_the_judge_s_look(renderer: Renderer) -> None:
    truth = AnalyticScene((Sphere(),))
    other = reference_surface(
        trace(truth, AHEAD, SIZE), renderer.gpu, Look(light="flat", background="#ff0000")
    )
    assert judge(renderer, truth).errors(other)["psnr_frame"] == math.inf


@pytest.mark.slow
@pytest.mark.parametrize("size", [1.0, *rarely(0.0)])
def test_the_back_of_the_bunny_shows_between_small_points(
    data_dir: Path, renderer: Renderer, draw: Callable[..., Surface], size: float
) -> None:
    stored = read_mesh(data_dir / "models" / "stanford_bunny_35947.ply")
    cloud = PointCloud.from_arrays(
        stored.points.world(), normals=vertex_normals(stored), origin=stored.origin
    )
    camera = Camera.orbit(stored.bounds, 20, 10)
    bunny = Judge.of(renderer.gpu, stored, camera, (480, 320), LOOK, cloud, None)
    errors = bunny.errors(draw(cloud, camera, (480, 320), "points", LOOK, {"point_size": size}))
    own = bunny.errors(reference_surface(bunny.reference, renderer.gpu, LOOK))
    assert own["visibility_error_percent"] < 4
    if size:
        assert errors["false_positives"] > 10 * errors["false_negatives"]
    else:  # squares that close the holes cover their neighbours
        assert errors["false_negatives"] > errors["false_positives"]


# --- flicker -------------------------------------------------------------------------------


def orbit(renderer: Renderer, frames: int = 3) -> list[Judge]:
    mesh = sphere_mesh()
    cameras = [Camera(eye=(2, 1.5, 3)).orbited(4 * k, 0) for k in range(frames)]
    return [judge(renderer, mesh, camera, mesh.points) for camera in cameras]


def redrawn(renderer: Renderer, judges: list[Judge]) -> Iterator[Surface]:
    """The truth of each judge; a frame is gone when the next is asked for."""
    for frame in judges:
        surface = reference_surface(frame.reference, renderer.gpu, LOOK)
        yield surface
        surface.release()


@pytest.mark.parametrize("kind", ["orbit", "pose"])
def test_the_truth_does_not_flicker(renderer: Renderer, kind: Literal["orbit", "pose"]) -> None:
    judges = orbit(renderer)
    flicker = Walk(judges, [None, None]).flicker(redrawn(renderer, judges), kind)
    assert flicker == {f"flicker_{kind}_color": 0, f"flicker_{kind}_normal": pytest.approx(0, abs=1e-6)}


def test_a_frame_that_is_missing_flickers_by_what_it_lacks(renderer: Renderer) -> None:
    mesh = sphere_mesh()
    still = judge(renderer, mesh, cloud=mesh.points)
    empty = picture(renderer, AnalyticScene((Sphere(center=(0, 0, 99)),)))
    full = reference_surface(still.reference, renderer.gpu, LOOK)
    flicker = Walk([still] * 4, [None] * 3).flicker([full, empty, empty, full], "orbit")
    lost = np.abs(still.image[still.reference.covered, :3] / 255 - np.array(rgba(LOOK.background)[:3]) / 255)
    assert flicker["flicker_orbit_color"] == pytest.approx(2 / 3 * lost.mean(), rel=1e-9)
    assert math.isnan(flicker["flicker_orbit_normal"])  # known in both frames of no pair


def test_flicker_follows_what_moves(renderer: Renderer) -> None:
    mesh, camera = sphere_mesh(), Camera(eye=(2, 1.5, 3))
    shift = np.array([0.3, 0, 0])
    moved = Mesh(
        PointCloud.from_arrays(
            mesh.points.world() + shift, colors=mesh.points.colors, normals=mesh.points.normals
        ),
        mesh.faces,
    )
    judges = [judge(renderer, scene, camera, scene.points) for scene in (mesh, moved)]
    first = judges[0].reference
    carried = mesh.carry(first.id[first.covered], first.positions(), moved)
    still = [reference_surface(first, renderer.gpu, LOOK)] * 2  # a picture that stays while the body moves
    followed = Walk(judges, [carried]).flicker(still, "pose")
    assert followed["flicker_pose_color"] > 0.02
    assert followed["flicker_pose_normal"] > 5
    assert Walk(judges, [carried]).flicker(redrawn(renderer, judges), "pose")["flicker_pose_color"] == 0


@pytest.mark.parametrize("frames", [2, 4])
def test_a_walk_wants_a_frame_for_each_judge(renderer: Renderer, frames: int) -> None:
    judges = orbit(renderer)
    surface = reference_surface(judges[0].reference, renderer.gpu, LOOK)
    with pytest.raises(ValueError, match="zip"):
        Walk(judges, [None, None]).flicker([surface] * frames, "orbit")
