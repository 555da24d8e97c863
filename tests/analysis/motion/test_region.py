"""Regions in files: what they contain, and messages for files that Scan4D cannot use."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from viewer.analysis.motion.region import RigidRegion
from viewer.errors import InputError
from viewer.scan.points import PointCloud

CLOUD = PointCloud.from_arrays(np.array([[0, 0, 0], [np.nan, 0, 0], [10, 0, 0], [20, 0, 0]], float))


@pytest.mark.parametrize(
    ("data", "rows"),
    [
        ({"spheres": [[0, 0, 0, 1], [21, 0, 0, 2]]}, [0, 2]),
        ({"points": [2, 0]}, [0, 1]),
        ({"landmarks": ["n"], "radius": 3}, [1]),
        ({"landmarks": ["n"]}, [1]),
        ({"landmarks": ["n"], "radius": 0.9}, []),
        ({"points": [3], "spheres": [[0, 0, 0, 1]]}, [0, 2]),
        ({"points": [3], "spheres": [[0, 0, 0, 30], [10, 0, 0, -1], [20, 0, 0, -1]]}, [0]),
    ],
)
def test_a_region_is_all_that_its_parts_hold(data: dict[str, Any], rows: list[int]) -> None:
    region = RigidRegion.from_json(data)
    assert region.rows(CLOUD, {"n": np.array([11.0, 0, 0])}).tolist() == rows
    assert RigidRegion.from_json(region.to_json()).rows(CLOUD, {"n": np.array([11.0, 0, 0])}).tolist() == rows


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("{", "is not valid JSON"),
        ("[]", "has no region"),
        ('{"spheres": []}', "has no region"),
        ('{"sphere": [[0, 0, 0, 1]]}', "'sphere'. Did you mean 'spheres'"),
        ('{"spheres": [[0, 0, 0]]}', "'spheres' is not a list"),
        ('{"spheres": [[0, 0, 0, 0]]}', "'spheres' is not a list"),
        ('{"spheres": [[0, 0, NaN, 1]]}', "'spheres' is not a list"),
        ('{"points": [1.5]}', "'points' is not a list"),
        ('{"points": [true]}', "'points' is not a list"),
        ('{"landmarks": ["n"], "radius": 0}', "'radius' is not a length.*State the radius"),
        ('{"landmarks": [1], "radius": 2}', "'landmarks' is not a list"),
    ],
)
def test_an_unusable_region_is_reported_with_its_file(tmp_path: Path, text: str, what: str) -> None:
    path = tmp_path / "region.json"
    path.write_text(text)
    with pytest.raises(InputError, match=what) as raised:
        RigidRegion.read(path)
    assert "region.json" in str(raised.value)


@pytest.mark.parametrize(
    ("data", "what"),
    [
        ({"points": [1]}, "no point 1. It has 3 points with numbers from 0 to 3"),
        ({"landmarks": ["x"], "radius": 1.0}, "no landmark 'x'. Place it there .* one that is there: n"),
    ],
)
def test_points_and_landmarks_that_the_frame_lacks_are_reported(data: dict[str, Any], what: str) -> None:
    with pytest.raises(InputError, match=what):
        RigidRegion.from_json(data).rows(CLOUD, {"n": np.zeros(3)})
