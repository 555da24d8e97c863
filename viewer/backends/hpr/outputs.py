"""Outputs: what is drawn of the points that are visible."""

from __future__ import annotations

from ...gpu.pose import GpuPose
from ...look import wants_normals
from ...picture.surface import Surface
from ...splatting.amplify import Points
from ...splatting.local import LOCAL, layer_of
from ...splatting.packed import draw_splats, take_normals
from ...splatting.squares import draw_squares
from ...visibility.calibration import EyeCalibration
from ...visibility.candidates import Candidates
from ...visibility.covering import Covering
from ...visibility.exact_search import ExactlySeen
from ...visibility.spacing import is_steadied, steady_points
from .. import FrameView
from .faces import draw_faces
from .reconstruction import fill_between
from .splats import SectorSplats

_LEFT = 0.4  # share of the noise that is left in steadied points
_FINE = 2  # times the sectors along an edge, where each point counts: most have a sector of their own then
OUTPUTS = ("points", "faces", "splats", "reconstruction")


def show_visible(
    pose: GpuPose,
    frame: FrameView,
    surface: Surface,
    seen: Candidates | Covering | ExactlySeen,
    calibration: EyeCalibration,
) -> bool:
    """Show the visible points as the parameters say; True if a later call would show more of them.

    seen: knows which they are.
    """
    params, splats = frame.params, surface.cached(SectorSplats)
    if params.output != "points" or wants_normals(surface.look):
        fine = 1 if params.output == "splats" else _FINE
        nearest = splats.of_visible(pose, seen, calibration, surface, fine)
    else:
        surface.stats.skipped["splats"] = "points without light need no normals"
    if params.output == "faces":
        draw_faces(pose, surface, nearest, seen.visible, splats, params.longest)
    elif params.output == "splats":
        buffers = {name: splats[name] for name in ("splats", "looks")}
        is_moved = is_steadied(pose) and params.surface == LOCAL
        if is_moved:
            buffers["positions"] = steady_points(pose)
        points = Points(pose, use_radii=True, count=len(pose.cloud), buffers=buffers, elliptical=False)
        layer = layer_of(pose, frame, surface, blends=True, left=_LEFT if is_moved else 1.0)
        draw_splats(points, surface, radius_scale=params.radius_scale, two=True, layer=layer)
        return surface.stats.share < 1 or not layer.known
    else:
        pixels = params.point_size if params.output == "points" else 1
        draw_squares(pose, surface, pixels, frame.share, seen.visible)
        if params.output == "reconstruction":
            fill_between(pose, surface, splats, params.radius_scale)
        elif wants_normals(surface.look):
            take_normals(splats["splats"], surface)
    return surface.stats.share < 1
