"""What every backend is held against: plain GL_POINTS, the floor, and the true mesh, the ceiling.

And what pictures of range views are held against: the mesh of neighbours in their grids; and pictures of
splats that are found anew in each picture: those of planes through the neighbours in the whole scan. They
are backends that draw to the same Surface, but no user chooses them.
"""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..backends import Backend, Derives, FrameView
from ..gpu import gl
from ..gpu.bindings import Texture, texture
from ..gpu.context import Gpu
from ..gpu.pose import GpuPose
from ..mesh.triangles import Mesh
from ..picture.surface import Surface
from ..scan.faces import Triangles
from ..scan.pose import Pose
from ..view import View

FLOOR, CEILING, RANGE_MESH = "gl-points", "mesh", "range-mesh"


@dataclass(frozen=True)
class NoParams:
    """Parameters of a baseline: none."""


def gl_points() -> Backend:
    """Each point as one pixel, as the driver's GL_POINTS draws it."""
    return _Points(FLOOR)


def mesh(drawn: Mesh, name: str = CEILING) -> Backend:
    """The triangles of a mesh, rasterised; for a pose whose cloud are the vertices, with normals."""
    return _Triangles(name, drawn.faces)


class _Points(Backend):
    """Plain GL_POINTS."""

    title = "GL_POINTS"
    params_class = NoParams

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Draw the points; always complete."""
        _rasterise(pose, surface, moderngl.POINTS, len(pose.cloud))
        return False


class _Triangles(Backend):
    """A rasterised mesh. Rows and ids are faces; normals and colours are interpolated for each pixel."""

    title = "Mesh"
    params_class = NoParams
    derives = Derives.ON_THREAD

    def __init__(self, name: str, faces: Triangles) -> None:
        super().__init__(name)
        self._faces = faces

    def needs(self, pose: Pose, params: NoParams) -> tuple[str, ...]:
        """The normals that it interpolates."""
        return ("normals",)

    def derive(self, pose: Pose, params: NoParams, view: View | None) -> Triangles:
        """The faces as they are."""
        return self._faces

    def upload(self, gpu: Gpu, faces: NDArray[np.uint32]) -> _FaceBuffer:
        """The corners of the faces, on the GPU."""
        return _FaceBuffer(gpu, faces)

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Draw the triangles, then find what each covered pixel sees of its own; always complete."""
        gpu, faces = pose.gpu, frame.derived.corners
        _rasterise(pose, surface, moderngl.TRIANGLES, frame.derived.count, faces.buffer)

        colored = pose.cloud.colors is not None
        resolve = gpu.compute("bench/mesh.comp", {"HAS_COLORS": int(colored)})
        covered = surface.list_covered()
        with gpu.timers.measure("resolve"):
            surface.rows.bind(Texture.ROWS)
            faces.bind(Texture.CORNERS)
            for name in ("positions", "normals", *(("colors",) if colored else ())):
                pose.array(name).bind(texture(name))
            surface.bind_own("normal", *(("color",) if colored else ()))
            covered.run(resolve)
        return False


class _FaceBuffer:
    """The corners of all faces, three texels each, and how many there are."""

    def __init__(self, gpu: Gpu, faces: Triangles) -> None:
        self.corners = gl.BufferTexture(gpu.buffer(np.ascontiguousarray(faces)), gl.R32UI)
        self.count, self.nbytes = faces.size, faces.nbytes

    def release(self) -> None:
        """Delete the buffer."""
        self.corners.release()


def _rasterise(
    pose: GpuPose, surface: Surface, mode: int, count: int, indices: moderngl.Buffer | None = None
) -> None:
    """Draw into the Surface with a strict depth test; rows are points, or faces where there are indices.

    count: of vertices, or of indices.
    """
    gpu, target = pose.gpu, surface.raster()
    program = gpu.program(("bench/row.vert", "bench/row.frag"), {"FACES": int(indices is not None)})
    content = [(pose.array("positions").buffer, "3f", "in_position")]
    with gpu.timers.measure("raster"):
        target.clear()
        gpu.ctx.enable_only(moderngl.DEPTH_TEST)
        gpu.ctx.depth_func = ">"  # reversed depth: near is 1
        if count:
            with gpu.vertices(program, content, indices) as vertices:
                vertices.render(mode, vertices=count)
    with gpu.timers.measure("copy"):
        surface.take_raster()
