"""Each point as a disc that lies in the surface. Closes the gaps between points.

Slomp 2014, IV-A and V: a template quad, aligned to the normal, with a round Gaussian mask
that is cut off, in a single pass.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..gpu.amplify import FEEDS, amplify
from ..gpu.pose import GpuPose
from ..gpu.surface import Surface
from ..params import param
from ..scan.points import PointCloud
from ..scan.spacing import typical_spacing
from . import FrameView

TITLE = "Surfels"

# A uniform radius of 1.5 times the spacing closes the surface.
_RADIUS_PER_SPACING = 1.5
# The mask is exp(-falloff d^2), 2 % at the quad's edge (d = 1).
_MASK_FALLOFF = 4.0
_LARGEST_RADIUS = np.float32(3e38)  # beyond it the shader takes a radius as unknown


@dataclass(frozen=True)
class Params:
    """Parameters of the surfels backend."""

    instancing: str = param("gs", "How points become quads", choices=FEEDS, affects="shader")
    radius: str = param(
        "auto",
        "auto: the scan's own, else uniform; own: estimated where the scan has none; uniform: one for all",
        choices=("auto", "own", "uniform"),
    )
    radius_scale: float = param(1.0, "Factor on the radius", low=0.01, high=100, sweep=(0.5, 1.0, 2.0))
    mask_cutoff: float = param(
        0.0183, "Value of the Gaussian mask where the splat ends", low=0.0183, high=0.99
    )
    cull_back: bool = param(False, "Leave out surfels that face away")


def needs(cloud: PointCloud, params: Params) -> tuple[str, ...]:
    """Normals, and radii where they shall be the points' own."""
    return ("normals", "radii") if params.radius == "own" else ("normals",)


def draw(pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
    """Splat in one pass; complete where all points shall be drawn."""
    params: Params = frame.params
    own = {"auto": pose.stored.radii is not None, "own": True, "uniform": False}[params.radius]
    # The spacing takes longer to find than many a pose takes to draw.
    suffices = own and pose.remember("radii suffice", lambda: _radii_suffice(pose))
    return amplify(
        pose,
        surface,
        params.instancing,
        "surfels/surfel.glsl",
        "surfels/splat.frag",
        use_radii=own,
        share=frame.share,
        radius_scale=params.radius_scale,
        uniform_radius=0.0 if suffices else _uniform_radius(pose),
        cull_back=params.cull_back,
        mask_limit=min(1.0, -math.log(params.mask_cutoff) / _MASK_FALLOFF),
    )


def _radii_suffice(pose: GpuPose) -> bool:
    """Whether each point has a radius that the shader takes."""
    radii = pose.cloud.radii
    return radii is not None and bool(((radii > 0) & (radii < _LARGEST_RADIUS)).all())


def _uniform_radius(pose: GpuPose) -> float:
    return _RADIUS_PER_SPACING * pose.remember("spacing", lambda: typical_spacing(pose.stored))
