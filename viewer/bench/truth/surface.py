"""Reference pictures as Surfaces, so that they are shaded as those of backends are."""

from __future__ import annotations

import numpy as np

from ...gpu.context import Gpu
from ...gpu.pose import GpuPose
from ...look import Look
from ...mesh.reference import Reference
from ...picture.shade import shade
from ...picture.surface import Surface
from ...scan.points import NOTHING, PointCloud
from ...scan.pose import Pose
from ...srgb import bytes_from_linear


def reference_surface(reference: Reference, gpu: Gpu, look: Look | None = None) -> Surface:
    """A shaded Surface of a reference picture, one point a covered pixel.

    A look that colours by depth or height needs its own `low` and `high`: what is not seen is not known.
    """
    gpu.activate()
    hits = PointCloud(
        positions=reference.positions().astype(np.float32),
        origin=reference.origin,
        normals=reference.normal[reference.covered],
        colors=np.pad(
            bytes_from_linear(reference.color[reference.covered]), ((0, 0), (0, 1)), constant_values=255
        ),
        ids=reference.id[reference.covered],
    )
    rows = np.full(reference.depth.shape, NOTHING, np.uint32)
    rows[reference.covered] = np.arange(len(hits))
    surface = Surface(gpu, reference.view.size)
    surface.start(GpuPose(gpu, Pose(0, 0.0, "reference", hits)), reference.view)
    surface.depths.buffer.write(reference.depth.astype(np.float32))
    surface.rows.buffer.write(rows)
    shade(surface, look or Look())
    return surface
