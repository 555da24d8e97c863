"""Points as the stability suite draws them, and the pictures of these."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..backends import Backend
from ..camera import Camera
from ..drawing.frame import render_frame
from ..drawing.renderer import Renderer
from ..drawing.request import Request
from ..look import Look
from ..picture.surface import Surface
from ..scan.points import PointCloud
from ..scan.pose import Pose
from .scenes.samples import Arrays

_NO_TURN = np.eye(3)


@dataclass(frozen=True, eq=False)
class PointView:
    """Points and how they are looked at.

    arrays: the arguments of `PointCloud.from_arrays`. margin: columns and rows of pixels on
    each side that are drawn but not compared.
    """

    arrays: Arrays
    camera: Camera
    size: tuple[int, int] = (160, 120)
    look: Look = field(default_factory=lambda: Look(light="head"))
    margin: tuple[int, int] = (0, 0)

    def __len__(self) -> int:
        return len(self.arrays["positions"])

    def cloud(self) -> PointCloud:
        """The points as a scan has them."""
        return PointCloud.from_arrays(**self.arrays)  # type: ignore[arg-type]

    def given(self, **arrays: NDArray | None) -> PointView:
        """Replace some arrays; None: leave one out."""
        changed = {**self.arrays, **arrays}
        return replace(self, arrays={name: a for name, a in changed.items() if a is not None})

    def filled(self, name: str, value: ArrayLike) -> PointView:
        """Give an array one value in all rows."""
        return self.given(**{name: np.broadcast_to(value, self.arrays[name].shape)})

    def picked(self, rows: NDArray) -> PointView:
        """Keep these rows of every array."""
        return self.given(**{name: a[rows] for name, a in self.arrays.items()})

    def joined(self, arrays: Arrays) -> PointView:
        """Add points behind its own."""
        return self.given(**{name: np.concatenate([a, arrays[name]]) for name, a in self.arrays.items()})

    def moved(self, shift: ArrayLike = 0.0, scale: float = 1.0, turn: ArrayLike = _NO_TURN) -> PointView:
        """Points and camera turned about zero, scaled, then shifted, in float64."""
        rotation = np.asarray(turn)

        def transformed(points: ArrayLike) -> NDArray[np.float64]:
            return scale * (np.asarray(points) @ rotation.T) + shift

        camera = replace(
            self.camera,
            eye=tuple(transformed(self.camera.eye)),
            target=tuple(transformed(self.camera.target)),
            up=tuple(rotation @ self.camera.up),
        )
        moved = self.given(
            positions=transformed(self.arrays["positions"]),
            normals=self.arrays["normals"] @ rotation.T,
            radii=self.arrays["radii"] * scale,
        )
        return replace(moved, camera=camera)

    def depths(self) -> NDArray[np.float64]:
        """Depths of the points, (N,), scan units along the view axis."""
        return (np.array(self.camera.eye) - self.arrays["positions"]) @ self.camera.rotation()[2]

    def pixels_per_unit(self) -> float:
        """Pixels of a scan unit at the depth of the camera's target."""
        return self.size[1] / self.camera.view_height


@dataclass(frozen=True, eq=False)
class RgbdImage:
    """A picture and its depths, as they are compared.

    depth: (H, W) float64, from the plane of the camera's target, in widths of a pixel there;
    +inf where nothing is. color: (H, W, 3) int, 255 sRGB levels.
    """

    depth: NDArray[np.float64]
    color: NDArray[np.int_]


def picture(renderer: Renderer, backend: Backend, shot: PointView, params: Any = None) -> RgbdImage:
    """Draw a shot. params: of the backend; None: its defaults. Raises InputError as `render_frame` does."""
    pose = Pose(0, 0.0, "numerics", shot.cloud())
    request = Request(pose, shot.camera, backend.name, params, shot.look)
    surface = Surface(renderer.gpu, shot.size)
    while render_frame(renderer, request, surface):
        pass
    (width, height), (columns, rows) = shot.size, shot.margin
    inside = slice(rows, height - rows), slice(columns, width - columns)
    depth = (surface.depth.astype(np.float64) - shot.camera.distance) * shot.pixels_per_unit()
    return RgbdImage(depth[inside], surface.image()[inside][..., :3].astype(int))
