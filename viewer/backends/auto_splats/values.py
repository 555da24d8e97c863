"""Numbers of neighborhoods, for looks to colour by (Preiner 2012, Figs. 9 and 12)."""

from __future__ import annotations

from ...gpu import gl
from ...gpu.bindings import Storage, Texture
from ...gpu.context import Gpu
from ...look import ValueKind
from ...picture.surface import Surface
from .neighborhoods import Neighborhoods

VALUES = {
    "neighborhood": ValueKind(
        "Radius of the neighbourhood of a splat. It shows how sparse the points are",
        is_length=True,
        is_log=True,
    ),
    "curvature": ValueKind(
        "Share of the neighbourhood's variance perpendicular to its plane: 0 if flat, at most 1/3"
    ),
    "splat_radius": ValueKind(
        "Radius of a splat; of an ellipse, the shorter half-axis", is_length=True, is_log=True
    ),
    "outlier": ValueKind(
        "1 if a point has no close neighbour, else 0. The parameter `outliers` shows such points",
        range=(0.0, 1.0),
    ),
}


class _ByRow:
    """A number for each row of a pose."""

    def __init__(self, gpu: Gpu, _: tuple[int, int]) -> None:
        self._gpu = gpu
        self.texels: gl.BufferTexture | None = None

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return 0 if self.texels is None else self.texels.buffer.size

    def reserve(self, count: int) -> gl.BufferTexture:
        """Room for so many rows."""
        if self.texels is None or self.nbytes != 4 * count:
            self.release()
            self.texels = gl.BufferTexture(self._gpu.buffer(reserve=4 * count), gl.R32F)
        return self.texels

    def release(self) -> None:
        """Delete it."""
        self._gpu.discard(self.texels)
        self.texels = None


def give_value(found: Neighborhoods, surface: Surface, radius_scale: float) -> None:
    """Give the surface the one of `VALUES` that it wants, if any. radius_scale: factor on radii of splats."""
    if (name := surface.wanted) is None:
        return
    gpu, texels = surface.gpu, surface.cached(_ByRow).reserve(max(len(surface.pose.cloud), 1))
    surface.give(texels)
    if found.count:
        with gpu.timers.measure("values"):
            program = gpu.compute("auto_splats/values.comp", {"NUMBER": list(VALUES).index(name)})
            found["drawn"].bind(Texture.DRAWN_ROWS)
            found["found"].bind(Texture.FOUND)
            found["splats"].bind(Texture.SPLATS)
            texels.buffer.bind_to_storage_buffer(Storage.VALUE)
            if name == "splat_radius":
                gpu.set(program, radius_scale=radius_scale)
            gpu.dispatch(program, found.count)
