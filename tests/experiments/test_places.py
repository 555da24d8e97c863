"""Places of the demo's face: exact points of the skin, in the open, with exact paths."""

from __future__ import annotations

import numpy as np
import pytest
from demo_surface import rest_of
from experiments.landmarks.places import PLACES, path_of, skin_normals, truth_places

from viewer.errors import InputError
from viewer.scan.demo import head
from viewer.scan.demo.variants import demo_motion


def test_places_are_on_the_skin_and_in_the_open() -> None:
    places = truth_places()
    assert places.shape == (len(PLACES), 3) == (21, 3)
    assert np.abs(head.skin(*places.T)).max() < 1e-9
    outside = places + 0.5 * skin_normals(places)
    assert (head.skin(*outside.T) > 0.3).all()
    assert head.eyes(*places.T).min() > 1


def test_pairs_mirror_each_other() -> None:
    """Hair is not the same on both sides; the skin before the ears has some."""
    lefts = [name for name in PLACES if name.endswith(" left")]
    places = dict(zip(PLACES, truth_places(), strict=True))
    for left in lefts:
        mirrored = places[left.replace(" left", " right")] * (-1, 1, 1)
        np.testing.assert_allclose(places[left], mirrored, atol=0.1)
        assert places[left][0] > 5
    assert len(lefts) == 6


def test_paths_are_of_the_same_points_of_the_skin() -> None:
    sway, times = demo_motion("demo:sway:2"), np.array([0.0, 0.52, 1.4])
    places = truth_places()
    path = path_of(places, times, sway)
    assert path.shape == (3, 21, 3)
    for time, now in zip(times, path, strict=True):
        np.testing.assert_allclose(rest_of(now.T, float(time), sway).T, places, atol=1e-9)
    assert np.linalg.norm(path[1] - path[0], axis=1).min() > 5


def test_an_unknown_place_is_refused() -> None:
    with pytest.raises(InputError, match="Did you mean 'pogonion'"):
        truth_places(["pogonium"])
