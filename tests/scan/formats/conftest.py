"""Clouds that hold every attribute."""

from __future__ import annotations

import pytest

from viewer.scan.points import PointCloud
from viewer.testing.readers import FAR_AWAY
from viewer.testing.readers import full_cloud as make_cloud


@pytest.fixture(params=["near zero", "at UTM coordinates"])
def full_cloud(request: pytest.FixtureRequest) -> PointCloud:
    return make_cloud(FAR_AWAY) if request.param == "at UTM coordinates" else make_cloud()
