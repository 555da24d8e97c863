"""Looks: what splats give where they are blended, two words a point (shaders/surfels/passes/look.glsl)."""

from __future__ import annotations

import numpy as np

from ..gpu import gl
from ..gpu.bindings import Storage, Texture
from ..gpu.context import Gpu
from ..gpu.pose import GpuPose
from ..srgb import roots_from_bytes
from .amplify import Points


def looks_of(points: Points) -> gl.BufferTexture:
    """Colour and normal of each row: those that the points bring, else those of the pose."""
    return points.buffers.get("looks") or points.pose.cached(PackedLooks).texels


class PackedLooks:
    """Colour and normal of each point of a pose in two words: square roots of linear light, 3 x 10 bits, and
    the word that common/octahedron.glsl makes of a normal."""

    def __init__(self, pose: GpuPose) -> None:
        gpu, colors, normals = pose.gpu, pose.find("colors"), pose.find("normals")
        self._gpu, count = gpu, pose.count
        self.nbytes = 8 * max(count, 1)
        self.texels = gl.BufferTexture(gpu.buffer(reserve=self.nbytes), gl.RG32UI)
        program = gpu.compute(
            "surfels/passes/pack_looks.comp",
            {"COLORED": int(colors is not None), "SHAPED": int(normals is not None)},
        )
        if colors is not None:
            colors.bind(Texture.COLORS)
        if normals is not None:
            normals.bind(Texture.NORMALS)
        gpu.cached(_roots).bind(Texture.LIGHT)
        with gpu.timers.measure("looks"):
            self.texels.buffer.bind_to_storage_buffer(Storage.LOOKS)
            gpu.dispatch(program, count)

    def release(self) -> None:
        """Delete it."""
        self._gpu.discard(self.texels)


def _roots(gpu: Gpu) -> gl.BufferTexture:
    """The square roots of the light of bytes."""
    return gl.BufferTexture(
        gpu.buffer(roots_from_bytes(np.arange(256, dtype=np.uint8)).astype(np.uint32)), gl.R32UI
    )
