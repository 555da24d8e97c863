"""What a refused click asks for."""

from __future__ import annotations

from collections.abc import Callable

import filling
import numpy as np
import pytest
from scenes import looking_down_z, plane

from viewer.analysis.pick import pick
from viewer.app.clicks import Click
from viewer.errors import InputError
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud


@pytest.mark.parametrize(("filled", "hint"), [(None, "Click beside the hole"), (False, "tick 'Allow clicks")])
def test_only_tools_with_a_choice_offer_it_at_filled_holes(
    draw: Callable[..., Surface], filled: bool | None, hint: str
) -> None:
    whole = plane(60, depth=4.0, spacing=0.05)
    outside = np.linalg.norm(whole.world()[:, :2], axis=1) >= 4 * 0.05
    surface = draw(
        PointCloud.from_arrays(whole.world()[outside]), looking_down_z(), (60, 40), filling.BACKEND
    )
    row, column = np.argwhere(surface.level == 2)[0].tolist()
    click = Click(pick(surface, column, row), surface.scanned.pose)
    with pytest.raises(InputError) as refused:
        click.surface_point(filled=filled)
    assert refused.value.hint is not None
    assert hint in refused.value.hint
    assert click.surface_point(filled=True).level == 2
