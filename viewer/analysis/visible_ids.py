"""Visible ids: which points of a scan a picture can show, whatever draws it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..drawing.renderer import shared_renderer
from ..drawing.request import Request
from ..view import View
from ..visibility.search import visible_points

_FAR = 1e4  # radii of the scan from which an eye sees it as by parallel rays


def visible_ids(request: Request, size: tuple[int, int]) -> NDArray[np.uint32]:
    """The points that a camera sees: in its picture, and not hidden by what the others are samples of.

    Ids (M,) uint32, indices in the file, ascending; those that `hide_hidden` of the points backend draws,
    also where several lie in one pixel. size: of the picture, pixels; it says what lies in it, and nothing
    else. Backend, parameters and look of the request do not matter. Raises InputError, NoOpenGLError.
    """
    pose, motion, cloud = request.pose, request.layers.world_from_pose, request.pose.cloud
    if not len(cloud):
        return np.empty(0, np.uint32)
    bounds = pose.drawn_bounds(request.camera)
    view = View.of(request.camera, size, pose.origin, bounds, motion)
    offsets = cloud.positions + (cloud.origin - view.origin)
    far = _FAR * (bounds.radius or 1.0)
    eye = view.eye if view.perspective else bounds.center + far * view.rotation[2]
    seen = visible_points(pose, eye, gpu=shared_renderer().gpu)
    inside = view.contains(offsets)
    ids = np.flatnonzero(inside).astype(np.uint32) if cloud.ids is None else cloud.ids[inside]
    return np.intersect1d(seen, ids).astype(np.uint32)
