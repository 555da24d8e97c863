"""Landmarks of files placed on a scan: each with the points around it, which it then follows."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from ...errors import shortened
from ...geometry import vector
from ...scan.pose import Pose
from ...scan.spacing import nearest_row, spacing_at
from ...task import checkpoint
from ..pick import FOLLOWED, Neighbor
from ..surface_point import SurfacePoint
from ..track import Known
from . import Landmark
from .landmark_set import LandmarkSet
from .mirroring import partners_of

_ON_SURFACE = 3.0  # spacings: farther from the nearest point, a place follows none
_FEW = 0.2  # of the landmarks, which may lie beside the surface, as in holes


def landmarks_of(
    found: LandmarkSet, pose_of: Callable[[int], Pose], count: int, frame: int, known: Iterable[Landmark] = ()
) -> tuple[Landmark, ...]:
    """The landmarks of a file as keys of a scan; those that have no position are to be placed.

    What the file has as tracked is tracked anew, where anything of the landmark was placed. Lengths have to
    be in the scan's unit. pose_of: gives one by its index. count: of the scan's frames; others are left out.
    frame: the one that a file of one moment without a frame is of. known: landmarks whose partners and
    descriptions stay where the file has none. Raises InputError for a frame that cannot be read.
    """
    frames = found.frames if found.is_framed or len(found) > 1 else np.array([frame])
    placed = found.known == Known.PLACED
    keyed = placed | (found.is_defined & ~placed.any(axis=0))
    keys: list[list[SurfacePoint]] = [[] for _ in found.names]
    for row, index in enumerate(frames.tolist()):
        if not (0 <= index < count and keyed[row].any()):
            continue
        checkpoint(row / len(frames))
        pose = pose_of(index)
        for number in np.flatnonzero(keyed[row]):
            keys[number].append(
                surface_point_at(found.positions[row, number], pose, float(found.sigmas[row, number]))
            )
    before = {landmark.name: landmark for landmark in known}
    partners = partners_of(found.names)
    landmarks = []
    for name, points, about in zip(found.names, keys, found.about, strict=True):
        old = before.get(name, Landmark(name, partner=partners.get(name, "")))
        landmarks.append(Landmark(name, tuple(points), partner=old.partner, about=about or old.about))
    return tuple(landmarks)


def why_beside(landmarks: Sequence[Landmark]) -> str | None:
    """How many landmarks are set beside the surface of their frames, in words; None for few.

    Landmarks of another subject, or of another scan of the same one, lie within the bounds of this one, and
    not on it.
    """
    set_here = [landmark for landmark in landmarks if landmark.keys]
    beside = [one.name for one in set_here if all(key.id is None for key in one.keys)]
    if len(beside) <= _FEW * len(set_here):
        return None
    some = ", ".join(map(shortened, beside[:3]))
    return (
        f"{len(beside)} of {len(set_here)} landmarks do not lie on the surface ({some}). Check that the "
        "landmarks belong to this scan."
    )


def surface_point_at(position: NDArray[np.float64], pose: Pose, sigma: float = math.nan) -> SurfacePoint:
    """A place, (3,), on the surface of a pose, with the points that it follows; none where none is near.

    sigma: standard deviation of its coordinates; where it is not known, the place is as uncertain as the
    points around are apart, or as the nearest is far.
    """
    cloud = pose.around(position)
    row, gap = nearest_row(cloud, position)
    spacing = spacing_at(cloud, row)
    if not math.isfinite(sigma):
        sigma = max(spacing or 0.0, gap)
    neighbors: tuple[Neighbor, ...] = ()
    id = None
    if spacing is not None and gap <= _ON_SURFACE * spacing:
        offsets = cloud.world() - position
        away = np.einsum("ij,ij->i", offsets, offsets)
        few = min(FOLLOWED, len(away))
        nearest = np.argpartition(away, few - 1)[:few]
        nearest = nearest[np.lexsort((nearest, away[nearest]))]
        ids = nearest if cloud.ids is None else cloud.ids[nearest]
        neighbors = tuple(
            Neighbor(int(one), vector(offset)) for one, offset in zip(ids, offsets[nearest], strict=True)
        )
        id = neighbors[0].id
    variance = sigma**2
    return SurfacePoint(
        frame=pose.index,
        time=float(pose.time),
        position=vector(position),
        id=id,
        spacing=spacing,
        level=0,
        covariance=(variance, 0.0, 0.0, variance, 0.0, variance),
        neighbors=neighbors,
    )
