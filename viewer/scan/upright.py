"""Which way is up in a scan: guessed from its frames if the user has not set it.

A cascade, the surest first: the pictures of range views, map coordinates, the position of a depth camera,
ground, and what a body stands on. Nobody measures with x up, so that only y and z are guessed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..bounds import Bounds
from ..camera import Camera
from ..geometry import UP, front_vector, nearest_axis, up_vector, vector
from .points import PointCloud, strided
from .range_view import RangeView, up_axis

FROM_ABOVE = 35.0  # degrees: the elevation that ground is first seen from
_LOW = 0.35  # height of ground, in lengths of its shorter side
_ENOUGH = 100  # points, of which shapes are guessed
_FAR = 100.0  # extents that map coordinates are away from zero
_OF_HEIGHT = 0.05  # how much less far away the heights beside them are
_THINNEST = 1e-3  # a sheet without any relief may be a wall as well as a floor
_FILLED, _TENTHS = (
    0.7,
    10,
)  # of ground, the share of its cells that have points, and their number along a side
_EACH = 8  # points in a cell of the grid that tells whether one side alone was seen, in the mean
_BAND = 0.04  # of the height: what touches the ground
_BROAD = 0.4  # what it stands on, in shares of the spread of the whole
_STEADY = 1.2  # how far the whole may be off the middle of what it stands on, in standard deviations of that
_DEEP, _FEW = 0.2, 0.35  # of all depths, in one line of sight; and of all points, that have another so far
_SLENDER, _UPENDED = 4.0, 1.2  # heights of what stands upright, in lengths of its longer side
_FLAT, _TALL = 0.6, 0.9  # depths of a body in its widths; heights of people in these
_KNEE, _NECK = 0.2, 0.9  # where legs end and heads begin, in heights
_TOES, _HEAD = 0.1, 0.3  # how far these are ahead at least, in depths of people and lengths of animals
_BEFORE = 0.2  # how far before all points a depth camera is, in lengths of their longest side
_ASIDE = 0.6  # tangent of how far from the middle of its picture most may be
_FACING = 0.5  # cosine between its view axis and what faces it, in the mean


@dataclass(frozen=True)
class Upright:
    """An up axis, and what tells it.

    up: a name of `AXES`. front: degrees that the front is turned about it, see `front_vector`: the azimuth to
    look from. why: in words. confidence: 0..1, how likely it is right; below 0.5
    nothing tells it.
    """

    up: str
    why: str
    confidence: float
    front: float = 0.0


UNKNOWN = Upright(UP, "nothing in the scan says otherwise", 0.4)


def guess_up(cloud: PointCloud, views: Sequence[RangeView] = ()) -> Upright:
    """Guess what is up, from some thousands of the points and the range views that they are of, if any."""
    points = strided(cloud.positions).astype(np.float64) + cloud.origin
    normals = None if cloud.normals is None else strided(cloud.normals).astype(np.float64)
    if (known := _of_pictures(views, points)) is not None:
        return known
    for rule in (_of_a_map, _of_a_camera, _of_ground, _of_a_body):
        if len(points) and (found := rule(points, normals)) is not None:
            return found
    return UNKNOWN


def first_elevation(bounds: Bounds, up: str) -> float:
    """The elevation in degrees that a scan is first seen from: level, or from above where it is ground, as
    streets, rooms and terrain are. up: as `up_vector` takes it."""
    edges = bounds.high - bounds.low
    along = int(np.abs(up_vector(up)).argmax())
    is_low = edges[along] < _LOW * np.delete(edges, along).min()
    return FROM_ABOVE if is_low or (up == "+z" and _is_map(bounds)) else 0.0


def upright_camera(camera: Camera, bounds: Bounds, aspect: float, up: str) -> Camera:
    """All of the bounds seen upright from the front, ground from above, in a camera's projection. aspect:
    width / height of the picture. up: as for `first_elevation`."""
    return Camera.orbit(
        bounds, 0.0, first_elevation(bounds, up), aspect=aspect, up=up,
        fov_y=camera.fov_y, projection=camera.projection,
    )  # fmt: skip


def _is_map(bounds: Bounds) -> bool:
    """Whether east and north are far from zero, in metres or feet, and heights beside them are not."""
    east, north, height = np.abs(bounds.center)
    far = min(east, north)
    return bool(far > _FAR * (bounds.high - bounds.low).max() and height < _OF_HEIGHT * far)


def _of_pictures(views: Sequence[RangeView], points: NDArray[np.float64]) -> Upright | None:
    """Pictures have their own up; those of heights on ground have it towards the eye."""
    known = up_axis(views)
    if known is None:
        return None
    if len(points) and all(view.kind == "height" for view in views):
        low, high = points.min(axis=0), points.max(axis=0)
        back = np.mean([view.world_to_camera[2, :3] for view in views], axis=0)
        above = nearest_axis(vector(back))
        if first_elevation(Bounds(low, high), above):
            return Upright(above, "the scan is a map of heights", 0.95)
    return Upright(known, "this axis points up in the range images", 0.95)


def _of_a_map(points: NDArray[np.float64], normals: object) -> Upright | None:
    return Upright("+z", "the scan has map coordinates", 0.95) if _is_map(_body(points)) else None


def _of_a_camera(points: NDArray[np.float64], normals: NDArray[np.float64] | None) -> Upright | None:
    """A depth camera at zero looks along +z, and its +y is down: all is seen from there."""
    body = _body(points)
    if len(points) < _ENOUGH or body.low[2] <= _BEFORE * (body.high - body.low).max():
        return None
    rays = points[:, :2] / points[:, 2:]
    is_in_picture = (np.abs(np.median(rays, axis=0)) < _ASIDE).all()
    is_seen_from_there = is_in_picture and _is_one_sided(rays, points[:, 2])
    if normals is not None:
        is_seen_from_there |= bool(np.nanmean(normals[:, 2]) < -_FACING)
    return Upright("-y", "a depth camera took the scan", 0.8) if is_seen_from_there else None


def _of_ground(points: NDArray[np.float64], normals: object) -> Upright | None:
    """Ground is wide and low, and is all over its outline, as somebody with both arms out is not."""
    if len(points) < _ENOUGH:
        return None
    for share in (0.02, 0.005):  # lidar sees far things, and some below the ground
        body = _body(points, share)
        thickness, width = np.sort(body.high - body.low)[:2]
        for up in ("+z", "+y"):
            is_low = _THINNEST * width < thickness and first_elevation(body, up) > 0
            if is_low and _filled(points, body, "xyz".index(up[1])) > _FILLED:
                return Upright(up, "the scan is wide and low", 0.8)
    return None


def _of_a_body(points: NDArray[np.float64], normals: object) -> Upright | None:
    """Bodies and things stand on what is lowest, or are slender as masts are."""
    if len(points) < _ENOUGH:
        return None
    body = _body(points)
    wide, high, deep = body.high - body.low
    if min(wide, high, deep) <= _THINNEST * max(wide, high, deep):
        return None
    near = body.grown(0.5 * max(wide, high, deep))
    points = points[((points > near.low) & (points < near.high)).all(axis=1)]
    if _stands(points, 1):
        return _facing(points, Upright(UP, "the scan stands stably with this axis up", 0.7))
    if not _is_one_sided(points[:, :2], points[:, 2]):  # a relief, of a face perhaps, stands otherwise
        if _stands(points, 2):
            return _facing(points, Upright("+z", "the scan stands stably with this axis up", 0.7))
        if high > _UPENDED * max(wide, deep) and _stands(points * (1, -1, 1), 1):
            return Upright("-y", "the scan stands stably with this axis up", 0.6)
    return (
        Upright("+z", "the scan is longest along this axis", 0.6)
        if deep > _SLENDER * max(wide, high)
        else None
    )


def _facing(points: NDArray[np.float64], known: Upright) -> Upright:
    """Add the front that a body tells: an animal's head is far ahead, unless it is seen from its side, which
    tells more; people are less deep than wide, and their toes point ahead."""
    above, ahead = np.array(up_vector(known.up)), np.array(front_vector(known.up))
    height, across = points @ above, points @ np.column_stack([ahead, np.cross(above, ahead)])
    low, high = np.quantile(height, [0.003, 0.997])
    level = (height - low) / (high - low)
    edges = np.ptp(np.quantile(across, [0.02, 0.98], axis=0), axis=0)
    parts = across[level < _BAND], across[(level > 2 * _BAND) & (level < _KNEE)], across[level > _NECK]
    if min(map(len, parts)) == 0 or edges.min() > _FLAT * edges.max():
        return known
    toes, legs, head = (part.mean(axis=0) for part in parts)
    long, deep = int(edges.argmax()), int(edges.argmin())
    of_head = float((head - across.mean(axis=0))[long] / edges[long])
    if abs(of_head) > _HEAD:
        return known if long == 1 else replace(known, front=0.0 if of_head > 0 else 180.0)
    of_toes = float((toes - legs)[deep] / edges[deep])
    if abs(of_toes) < _TOES or high - low < _TALL * edges[long]:
        return known
    return replace(known, front=math.copysign(90.0, of_toes) if deep == 1 else 0.0 if of_toes > 0 else 180.0)


def _body(points: NDArray[np.float64], share: float = 0.02) -> Bounds:
    """The box around all points but a share at each end of each axis."""
    low, high = np.quantile(points, [share, 1 - share], axis=0)
    return Bounds(low, high)


def _filled(points: NDArray[np.float64], body: Bounds, axis: int) -> float:
    """The share of a box that has points, seen along an axis, in cells of a tenth of its sides."""
    low, edges = np.delete(body.low, axis), np.delete(body.high - body.low, axis)
    cells = np.floor((np.delete(points, axis, axis=1) - low) / edges * _TENTHS).astype(int)
    inside = ((cells >= 0) & (cells < _TENTHS)).all(axis=1)
    return len(np.unique(cells[inside] @ (_TENTHS, 1))) / _TENTHS**2


def _stands(points: NDArray[np.float64], axis: int) -> bool:
    """Whether points (N, 3) stand on their lowest ones along an axis: broadly, and steadily."""
    height, across = points[:, axis], np.delete(points, axis, axis=1)
    ground, top = np.quantile(height, [0.003, 0.997])
    touching = across[height <= ground + _BAND * (top - ground)]
    if len(touching) < 3:
        return False
    whole = np.cov(across.T)
    if np.linalg.det(whole) <= (_THINNEST * np.trace(whole)) ** 2:  # a sheet
        return False
    below = np.cov(touching.T) + 1e-9 * np.trace(whole) * np.eye(2)
    breadth = np.sqrt(np.linalg.det(below) / np.linalg.det(whole))
    off = across.mean(axis=0) - touching.mean(axis=0)
    return bool(breadth > _BROAD and off @ np.linalg.solve(below, off) < _STEADY**2)


def _is_one_sided(picture: NDArray[np.float64], depth: NDArray[np.float64]) -> bool:
    """Whether points were seen from one side alone: few share a line of sight with one far before or behind.
    picture: (N, 2) positions in what is seen from there, of any unit. depth: (N,)."""
    low, high = picture.min(axis=0), picture.max(axis=0)
    side = max(int(np.sqrt(len(depth) / _EACH)), 1)
    cells = ((picture - low) / np.where(high > low, high - low, 1) * side).astype(int).clip(0, side - 1)
    cell = cells @ (side, 1)
    nearest, farthest = np.full(side**2, np.inf), np.full(side**2, -np.inf)
    np.minimum.at(nearest, cell, depth)
    np.maximum.at(farthest, cell, depth)
    is_shared = farthest[cell] - nearest[cell] > _DEEP * float(np.ptp(depth))
    return bool(is_shared.mean() < _FEW)
