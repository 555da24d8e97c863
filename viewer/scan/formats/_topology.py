"""The topology that faces define: which points of a file are those of another file."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from ...errors import InputError
from ..faces import Faces, topology
from ..points import PointCloud


def topology_of(points: int, faces: Iterable[Faces]) -> str | None:
    """The name of the topology that faces, in pieces, give the points of a file; None where there are none.

    Damaged faces define none, and cost no point.
    """
    try:
        return topology(points, faces)
    except (InputError, ValueError, IndexError, OverflowError):
        return None


def with_topology(cloud: PointCloud, faces: Iterable[Faces]) -> PointCloud:
    """The cloud with the topology that its faces, in pieces, give it; itself where there are none."""
    name = topology_of(len(cloud) + cloud.dropped, faces)
    return cloud if name is None else replace(cloud, topology=name)
