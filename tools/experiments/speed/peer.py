"""One viewer that `peers.py` compares, in a process of its own: it reads commands from standard input.

    python tools/experiments/speed/peer.py scan4d|pyvista|vispy|polyscope|open3d WIDTHxHEIGHT

A command is a line of JSON, and so is its answer: what was measured, or {"error": why not}. `show` takes a
folder with `positions.npy` and `colors.npy`, float32 (N, 3), and `radius`, scan units, or 0 for points of a
pixel; `draw` takes the eye, and a folder where other points of the same number are to be shown. Needs numpy
and the viewer that is named; nothing of Scan4D but for `scan4d`.
"""

from __future__ import annotations

import importlib.metadata
import json
import math
import os
import sys
import time
from pathlib import Path
from typing import Any, Protocol

import numpy as np

FOV = 30.0  # degrees, of the picture's height
MIDDLE, ABOVE = (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)
DISTANCE = 4.5  # of the eye from the middle, scan units
BACKGROUND = (1.0, 0.0, 1.0)  # unlike all colours that are shown, however they are lit
_SEEN = 8  # of 255: how far from the background a covered pixel is, since some tone colours

Array = np.ndarray[Any, Any]


def pixel_at(distance: float, height: int) -> float:
    """The width of a pixel at a distance in a picture of so many rows, scan units."""
    return 2 * distance * math.tan(math.radians(FOV) / 2) / height


class Peer(Protocol):
    """A viewer that draws points into pictures without a window.

    points, splats: how, as its documentation names it.
    """

    points: str
    splats: str

    def __init__(self, size: tuple[int, int]) -> None: ...

    def show(self, positions: Array, colors: Array, radius: float) -> None:
        """Show these alone, as points of a pixel where radius is 0, else as splats of that radius."""

    def replace(self, positions: Array, colors: Array) -> None:
        """Show other points instead of those that are shown, as many."""

    def picture(self, eye: tuple[float, float, float]) -> Array:
        """Draw, and read back: (height, width, 3 or 4) uint8."""


class Scan4D:
    """This project."""

    points = "backend points, flat"
    splats = "backend surfels, head light"

    def __init__(self, size: tuple[int, int]) -> None:
        from viewer.drawing.renderer import Renderer
        from viewer.picture.surface import Surface

        self._renderer = Renderer()
        self._surface = Surface(self._renderer.gpu, size)

    def show(self, positions: Array, colors: Array, radius: float) -> None:
        """See Peer. Splats are discs, and so need normals: those of the sphere that they lie on."""
        from viewer.look import Look
        from viewer.scan.points import PointCloud
        from viewer.scan.pose import Pose

        given: dict[str, Any] = {"colors": colors, "origin": np.zeros(3)}
        if radius:
            given |= {"normals": positions, "radii": np.full(len(positions), radius, np.float32)}
        self._pose = Pose(0, 0.0, "shown", PointCloud.from_arrays(positions, **given))
        self._backend = "surfels" if radius else "points"
        background = "#" + bytes(int(255 * part) for part in BACKGROUND).hex()
        self._look = Look(light="head" if radius else "flat", background=background)

    def replace(self, positions: Array, colors: Array) -> None:
        """See Peer."""
        self.show(positions, colors, 0.0)

    def picture(self, eye: tuple[float, float, float]) -> Array:
        """See Peer."""
        from viewer.camera import Camera
        from viewer.drawing.frame import render_frame
        from viewer.drawing.request import Request

        camera = Camera(eye=eye, target=MIDDLE, fov_y=FOV)
        render_frame(
            self._renderer, Request(self._pose, camera, self._backend, None, self._look), self._surface
        )
        return self._surface.image()


class PyVista:
    """VTK."""

    points = "add_points, point_size=1, lighting=False, no anti-aliasing"
    splats = "add_points, style='points_gaussian', render_points_as_spheres=True"

    def __init__(self, size: tuple[int, int]) -> None:
        import pyvista

        self._plotter = pyvista.Plotter(off_screen=True, window_size=list(size))
        self._plotter.disable_anti_aliasing()
        self._plotter.set_background(BACKGROUND)
        self._plotter.camera.focal_point, self._plotter.camera.up = MIDDLE, ABOVE
        self._plotter.camera.view_angle = FOV

    def show(self, positions: Array, colors: Array, radius: float) -> None:
        """See Peer."""
        import pyvista

        self._points = pyvista.PolyData(positions)
        self._points["colors"] = (colors * 255).astype(np.uint8)
        self._plotter.clear_actors()
        shown: dict[str, Any] = {"scalars": "colors", "rgb": True, "reset_camera": False}
        if not radius:
            self._plotter.add_points(self._points, point_size=1, lighting=False, **shown)
            return
        actor = self._plotter.add_points(
            self._points, style="points_gaussian", render_points_as_spheres=True, emissive=False, **shown
        )
        actor.mapper.scale_factor = radius

    def replace(self, positions: Array, colors: Array) -> None:
        """See Peer."""
        self._points.points = positions
        self._points["colors"] = (colors * 255).astype(np.uint8)

    def picture(self, eye: tuple[float, float, float]) -> Array:
        """See Peer."""
        self._plotter.camera.position = eye
        self._plotter.renderer.reset_camera_clipping_range()
        self._plotter.render()  # the first time alone, screenshot does
        return self._plotter.screenshot(return_img=True)


class VisPy:
    """VisPy's scene graph, through EGL."""

    points = "Markers, symbol='square', size=1, no edge"
    splats = "Markers, scaling='scene', no edge"

    def __init__(self, size: tuple[int, int]) -> None:
        os.environ.setdefault("EGL_PLATFORM", "surfaceless")
        from vispy import app, scene

        app.use_app("egl")
        self._canvas = scene.SceneCanvas(size=size, bgcolor=BACKGROUND, show=False)
        self._view = self._canvas.central_widget.add_view()
        self._view.camera = scene.TurntableCamera(fov=FOV, center=MIDDLE, up="+y")
        self._markers: Any = None

    def show(self, positions: Array, colors: Array, radius: float) -> None:
        """See Peer."""
        from vispy import scene

        if self._markers is not None:
            self._markers.parent = None
        self._look: dict[str, Any] = {"edge_width": 0, "size": 2 * radius or 1}
        self._look["symbol"] = "disc" if radius else "square"
        self._markers = scene.visuals.Markers(
            scaling="scene" if radius else "fixed", antialias=0, parent=self._view.scene
        )
        self.replace(positions, colors)

    def replace(self, positions: Array, colors: Array) -> None:
        """See Peer."""
        self._markers.set_data(positions, face_color=colors, **self._look)

    def picture(self, eye: tuple[float, float, float]) -> Array:
        """See Peer."""
        distance = math.dist(eye, MIDDLE)
        camera = self._view.camera
        camera.distance, camera.scale_factor = distance, distance
        camera.elevation = math.degrees(math.asin(eye[1] / distance))
        camera.azimuth = 90 + math.degrees(math.atan2(eye[0], eye[2]))  # its 0 looks along -x
        return self._canvas.render()


class Polyscope:
    """Polyscope, through EGL."""

    points = "register_point_cloud, quads of 0.97 pixels, material flat"
    splats = "register_point_cloud, quads, absolute radius, material flat"

    def __init__(self, size: tuple[int, int]) -> None:
        import polyscope

        polyscope.set_verbosity(0)
        polyscope.set_allow_headless_backends(True)
        polyscope.set_use_prefs_file(False)
        polyscope.init()
        polyscope.set_window_size(*size)
        polyscope.set_ground_plane_mode("none")
        polyscope.set_background_color((*BACKGROUND, 1.0))
        polyscope.set_SSAA_factor(1)
        polyscope.set_automatically_compute_scene_extents(False)
        polyscope.set_length_scale(2.0)
        polyscope.set_bounding_box((-1.2,) * 3, (1.2,) * 3)
        self._size = size

    def show(self, positions: Array, colors: Array, radius: float) -> None:
        """See Peer."""
        import polyscope

        self._cloud = polyscope.register_point_cloud("shown", positions)
        self._cloud.set_point_render_mode("quad")
        self._cloud.set_material("flat")
        self._radius = radius
        self._color(colors)

    def _color(self, colors: Array) -> None:
        self._cloud.add_color_quantity("colors", colors, enabled=True)

    def replace(self, positions: Array, colors: Array) -> None:
        """See Peer."""
        self._cloud.update_point_positions(positions)
        self._color(colors)

    def picture(self, eye: tuple[float, float, float]) -> Array:
        """See Peer."""
        import polyscope

        width, height = self._size
        width_of_points = 0.97 * pixel_at(DISTANCE, height)  # which covers as much as a pixel each
        self._cloud.set_radius(self._radius or width_of_points / 2, relative=False)
        polyscope.set_view_camera_parameters(
            polyscope.CameraParameters(
                polyscope.CameraIntrinsics(fov_vertical_deg=FOV, aspect=width / height),
                polyscope.CameraExtrinsics(root=eye, look_dir=tuple(np.subtract(MIDDLE, eye)), up_dir=ABOVE),
            )
        )
        return polyscope.screenshot_to_buffer(transparent_bg=False)


class Open3D:
    """Open3D's OffscreenRenderer (Filament), through EGL."""

    points = "OffscreenRenderer, defaultUnlit, point_size=1, no anti-aliasing"
    splats = "OffscreenRenderer, defaultUnlit, squares of one size in pixels"

    def __init__(self, size: tuple[int, int]) -> None:
        os.environ.setdefault("EGL_PLATFORM", "surfaceless")  # as its documentation says of Mesa
        from open3d.visualization import rendering

        self._rendering = rendering
        self._renderer = rendering.OffscreenRenderer(*size)
        self._renderer.scene.set_background(np.array([*BACKGROUND, 1.0], np.float32))
        self._renderer.scene.view.set_post_processing(False)
        self._renderer.scene.view.set_antialiasing(False)
        self._renderer.scene.view.set_sample_count(1)
        self._size = size

    def show(self, positions: Array, colors: Array, radius: float) -> None:
        """See Peer."""
        self._renderer.scene.clear_geometry()
        self._material = self._rendering.MaterialRecord()
        self._material.shader = "defaultUnlit"
        self._material.point_size = max(1.0, round(2 * radius / pixel_at(DISTANCE, self._size[1])))
        self._renderer.scene.add_geometry("shown", self._cloud(positions, colors), self._material)

    @staticmethod
    def _cloud(positions: Array, colors: Array) -> Any:
        import open3d

        cloud = open3d.t.geometry.PointCloud(open3d.core.Tensor(positions))
        cloud.point.colors = open3d.core.Tensor(colors)
        return cloud

    def replace(self, positions: Array, colors: Array) -> None:
        """See Peer."""
        from open3d.visualization.rendering import Scene

        self._renderer.scene.scene.update_geometry(
            "shown", self._cloud(positions, colors), Scene.UPDATE_POINTS_FLAG | Scene.UPDATE_COLORS_FLAG
        )

    def picture(self, eye: tuple[float, float, float]) -> Array:
        """See Peer."""
        self._renderer.setup_camera(FOV, MIDDLE, eye, ABOVE)
        return np.asarray(self._renderer.render_to_image())


PEERS: dict[str, tuple[type[Peer], str]] = {  # with the package that tells its version
    "scan4d": (Scan4D, "scan4d"),
    "pyvista": (PyVista, "vtk"),
    "vispy": (VisPy, "vispy"),
    "polyscope": (Polyscope, "polyscope"),
    "open3d": (Open3D, "open3d-cpu"),
}


class Served:
    """What the commands do."""

    def __init__(self, name: str, size: tuple[int, int]) -> None:
        kind, package = PEERS[name]
        try:
            self._version = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            self._version = ""
        self._peer = kind(size)

    def about(self) -> dict[str, Any]:
        """What it is and how it draws."""
        return {"version": self._version, "points": self._peer.points, "splats": self._peer.splats}

    def show(self, folder: str, radius: float) -> dict[str, Any]:
        """Show the points of a folder."""
        self._peer.show(*_arrays(folder), radius)
        return {}

    def draw(self, eye: tuple[float, float, float], folder: str | None, save: str | None) -> dict[str, Any]:
        """Wall and processor milliseconds of a picture, in memory and with other points before where there is
        a folder; and the share of its pixels that show something."""
        new = _arrays(folder) if folder else None
        wall, busy = time.perf_counter(), time.process_time()
        if new:
            self._peer.replace(*new)
        picture = self._peer.picture((eye[0], eye[1], eye[2]))
        wall, busy = time.perf_counter() - wall, time.process_time() - busy
        covered = (np.abs(picture[..., :3] - np.multiply(BACKGROUND, 255)) > _SEEN).any(axis=2)
        if save:
            from PIL import Image

            Image.fromarray(np.ascontiguousarray(picture[..., :3])).save(save)
        return {"ms": wall * 1e3, "busy_ms": busy * 1e3, "coverage": float(covered.mean())}


def _arrays(folder: str) -> tuple[Array, Array]:
    return np.load(Path(folder, "positions.npy")), np.load(Path(folder, "colors.npy"))


def main() -> None:
    """Answer one command after the other until there are no more."""
    # Libraries print to standard output: answers go to a copy, and all else to standard error.
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)
    name, size = sys.argv[1:]
    width, height = (int(n) for n in size.split("x"))
    served: Served | None = None
    for line in sys.stdin:
        command, given = json.loads(line)
        try:
            served = served or Served(name, (width, height))
            answer = getattr(served, command)(**given)
        except Exception as error:
            answer = {"error": f"{type(error).__name__}: {' '.join(str(error).split())}"}
        print(json.dumps(answer), file=answers)


if __name__ == "__main__":
    main()
