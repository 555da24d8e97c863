"""What surfels choose by themselves is never worse than what a user could choose, on the scans of the suite
"surface"."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from viewer.backends import backend
from viewer.bench.metrics import Errors
from viewer.bench.scenes import catalog
from viewer.bench.surface_suite import CONDITIONS, Amount, PictureTruth, ScanCondition, _cameras
from viewer.drawing.frame import render_frame
from viewer.drawing.request import Request
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose

if TYPE_CHECKING:
    from viewer.drawing.renderer import Renderer

AMOUNT = Amount(points=10_000, views=1, size=(240, 160))
REAL = ("horse-gallop", "crane")  # scenes of the data folder
QUICK = ("blue noise", "stretched grid, with normals")
LEAST, LEAST_SLITS = 0.02, 0.05  # percent of the subject: a pixel or two more are not worse
Draw = Callable[[dict[str, Any]], Errors]


def drawn(renderer: Renderer, condition: ScanCondition, data: Path | None) -> Draw:
    subject = catalog.subject(condition.scene or "torus", data)
    moment = subject.moment(0)
    cloud, _ = condition.scan(moment, AMOUNT.points, (0, 0))
    (camera,) = _cameras(moment, subject.up, condition, AMOUNT, 0)
    truth, pose = PictureTruth.of(moment, camera, AMOUNT.size, cloud), Pose(0, 0.0, condition.name, cloud)

    def errors(values: dict[str, Any]) -> Errors:
        surfels, surface = backend("surfels"), Surface(renderer.gpu, AMOUNT.size)
        request = Request(pose, camera, surfels, surfels.params(values), Look(light="head"))
        while render_frame(renderer, request, surface):
            pass
        found = truth.errors(surface)
        surface.release()
        return found

    return errors


def faults(errors: Errors) -> float:
    """Pixels that show another thing than the truth, percent of the subject."""
    return errors["open_percent"] + errors["wrong_layer_percent"] + errors["spill_percent"]


def marks_of(condition: ScanCondition) -> list[pytest.MarkDecorator]:
    """Slow but for a few."""
    return [] if condition.name in QUICK else [pytest.mark.slow]


@pytest.mark.parametrize(
    "condition",
    [pytest.param(each, marks=marks_of(each), id=each.name) for each in CONDITIONS],
)
@pytest.mark.slow
def test_automatic_radii_and_passes_are_never_worse(
    renderer: Renderer, condition: ScanCondition, request: pytest.FixtureRequest
) -> None:
    data = request.getfixturevalue("data_dir") if condition.scene in REAL else None
    errors = drawn(renderer, condition, data)
    auto = errors({})
    for chosen in ({"radius": "own"}, {"passes": "two"}, {"radius": "own", "passes": "two"}):
        other = errors(chosen)
        assert faults(auto) <= faults(other) + LEAST, chosen
        assert auto["slit_percent"] <= other["slit_percent"] + LEAST_SLITS, chosen
