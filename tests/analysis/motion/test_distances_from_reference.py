"""Distances of a frame from the reference: of a plane that is raised, and of hills that moved as one."""

from __future__ import annotations

import numpy as np
from rigid_hills import RigidHills, opened, truth

from viewer.analysis.motion.distances import distances_from, in_region, unknown_distances
from viewer.analysis.motion.stabilise import moment_surface
from viewer.rigid import STILL
from viewer.scan.points import PointCloud


def test_distances_from_a_plane_are_known_and_there_are_none_beyond_it() -> None:
    x, y = np.meshgrid(np.arange(20.0), np.arange(20.0))
    plane = np.stack([x.ravel(), y.ravel(), np.zeros(400)], axis=1) + 1e6
    cloud = PointCloud.from_arrays(plane)
    above = PointCloud.from_arrays(plane[[45, 190, 210]] + [(0.3, 0.2, 2.5), (0, 0, -1.0), (40.0, 0, 0)])
    found = distances_from(moment_surface(cloud, cloud.origin), cloud.origin, above, STILL)
    np.testing.assert_allclose(found[:2], [2.5, 1.0], atol=1e-3)
    assert np.isnan(found[2])


def test_what_moved_as_one_is_near_and_what_rose_is_not() -> None:
    timeline = opened(RigidHills(3, rise=1.0))
    reference, cloud = timeline.pose(0).cloud, timeline.pose(2).cloud
    surface = moment_surface(reference, reference.origin)
    back = truth(2, 0).inverse
    found = distances_from(surface, reference.origin, cloud, back)
    x = back.points(cloud.world())[:, 0]
    assert np.nanquantile(found[x < 7], 0.9) < 0.1
    assert np.nanmedian(found[x > 13]) > 1.0
    assert np.isnan(unknown_distances(3)).all()
    rows = np.flatnonzero(reference.world()[:, 0] < 0)
    told = in_region(surface, reference.origin, cloud, back, rows)
    assert told[x < -1].min() == 1
    assert told[x > 1].max() == 0
