"""Attributes as bytes: each normal has the nearest cell, and differences are those that the docs state."""

from __future__ import annotations

import numpy as np

from viewer.scan.octree.coding import Counterparts, differences, normal_bytes, restored


def test_normals_have_cells_of_the_unfolded_octahedron() -> None:
    axes = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0], [0, 0, 0], [0.6, 0, -0.8]], np.float32)
    found = normal_bytes(axes).tolist()
    assert found[:5] == [[255, 128], [128, 255], [128, 128], [128, 1], [0, 0]]
    assert found[5] == [255, 201]  # below, x 3 / 7 is folded to y 4 / 7: 73 of 127 from the middle


def test_differences_are_from_counterparts_and_then_from_parents() -> None:
    masks = np.array([0b11, 0b100, 0b11001], np.uint8)
    above = np.array([[10], [20], [30]], np.uint8)
    values = np.array([[11], [9], [20], [36], [37], [38]], np.uint8)
    assert differences(values, above, masks).tolist() == [1, 255, 6, 7, 8]
    before = Counterparts(np.array([-1, 1, 0, -1, 0, -1], np.int32), np.array([[40], [50]], np.uint8))
    stored = differences(values, above, masks, before)
    assert stored.tolist() == [(9 - 50) % 256, (37 - 40) % 256, 1, 6, 8]
    assert np.array_equal(restored(stored, above, masks, before), values)
