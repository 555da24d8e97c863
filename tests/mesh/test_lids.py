"""Lids over openings: each closes its hole once, flat where the hole is, and straight across a slit."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.mesh.manifold import across_edges
from viewer.mesh.openings import bridged, inner_holes
from viewer.mesh.patch import Patch

WIDTH = 30


def sheet(seed: int = 0) -> Patch:
    """A flat sheet of a unit grid, its inner vertices moved about."""
    places = np.stack(np.meshgrid(np.arange(WIDTH + 1.0), np.arange(WIDTH + 1.0)), axis=-1).reshape(-1, 2)
    inner = ((places > 0) & (places < WIDTH)).all(axis=1)
    places[inner] += np.random.default_rng(seed).uniform(-0.2, 0.2, (inner.sum(), 2))
    row, column = (each.ravel() for each in np.mgrid[:WIDTH, :WIDTH])
    a = row * (WIDTH + 1) + column
    c = a + WIDTH + 1
    faces = np.concatenate([np.stack([a, a + 1, c], axis=1), np.stack([a + 1, c + 1, c], axis=1)])
    return Patch.of(np.pad(places, ((0, 0), (0, 1))), faces)


def without(patch: Patch, hole: str) -> Patch:
    x, y, _ = patch.corners.mean(axis=0).T - WIDTH / 2
    inside = {
        "slit": (np.abs(y) < 1.5) & (np.abs(x) < 10),
        "round": np.hypot(x, y) < 8,
        "crescent": (np.hypot(x, y) < 10) & (np.hypot(x, y - 4) > 9),
        "corner": (np.abs(x) < 6) & (np.abs(y) < 6),
    }[hole]
    return patch.of_faces(np.flatnonzero(~inside))


@pytest.mark.parametrize("hole", ["slit", "round", "crescent", "corner"])
def test_a_lid_fills_its_hole_once(hole: str) -> None:
    whole = sheet()
    holed = without(whole, hole)
    (number,) = inner_holes(holed)
    lidded = bridged(holed, np.array([number]))
    assert (lidded.faces[: len(holed.faces)] == holed.faces).all()
    assert lidded.doubled[:, 2].sum() == pytest.approx(2 * WIDTH**2), "less what is turned over"
    before, after = across_edges(lidded.faces)
    assert len(np.unique(np.concatenate([before, after]))) == 2 * len(before), "two faces an edge"
    assert len(lidded.border[0]) == 4 * WIDTH
    lid = lidded.doubled[len(holed.faces) :, 2] / 2
    assert lid[lid < 0].sum() > -0.15 * lid.sum()


def test_a_slit_is_closed_straight_across() -> None:
    holed = without(sheet(), "slit")
    lidded = bridged(holed, inner_holes(holed))
    lid = lidded.corners[:, len(holed.faces) :, 0]
    assert np.ptp(lid, axis=0).max() < 4, "no face reaches along it"


def test_where_a_patch_was_cut_there_is_no_hole() -> None:
    holed = without(sheet(), "round")
    assert len(inner_holes(holed)) == 1
    assert len(inner_holes(holed, lambda places: places[:, 0] < WIDTH / 2 - 7)) == 0
    assert len(inner_holes(holed, lambda places: places[:, 0] < 1)) == 1
