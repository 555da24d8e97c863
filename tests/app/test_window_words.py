"""Code words in the window: each quality and lighting, chosen in the panel, beside surfels."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from test_window import shown
from virtual_screen import PANEL, RunningApp, Screen, running_app

from viewer.bench.scenes.samples import on_torus
from viewer.look import Look, rgba
from viewer.scan import formats
from viewer.scan.points import PointCloud


@pytest.fixture(scope="module")
def app(screen: Screen, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningApp]:
    scan = tmp_path_factory.mktemp("scan") / "torus.npz"
    formats.write(scan, PointCloud.from_arrays(**on_torus(6000)))
    with running_app(screen, tmp_path_factory.mktemp("app"), scan) as app:
        yield app
    assert "Traceback" not in app.log(), app.log()


def middle(app: RunningApp) -> np.ndarray:
    """Where only the scan is shown."""
    app.settle()
    height, width = shown(app).shape[:2]
    return shown(app)[height // 4 : height * 5 // 8, width // 8 : width * 13 // 16].astype(int)


@pytest.mark.slow
def test_qualities_and_lightings_are_chosen_and_look_like_surfels(app: RunningApp) -> None:
    app.choose(PANEL, "quality/##value", "###fast")
    app.choose(PANEL, "##backend", "###surfels")
    discs = middle(app)
    app.choose(PANEL, "##backend", "###codeword")
    pictures = []
    for quality in ("table", "planes", "exact"):
        for lighting in ("common", "own"):
            app.choose(PANEL, "renderer/quality/##value", f"###{quality}")
            app.choose(PANEL, "renderer/lighting/##value", f"###{lighting}")
            pictures.append(middle(app))
            document = app.state.document
            chosen = {"quality": "table", "lighting": "common"} | document["params"].get("codeword", {})
            assert (chosen["quality"], chosen["lighting"]) == (quality, lighting)
            assert document["look"]["quality"] == "fast", "a parameter of the same name"
            either = (pictures[-1] != rgba(Look().background)[:3]).any(axis=2)
            either |= (discs != rgba(Look().background)[:3]).any(axis=2)
            assert either.mean() > 0.3
            assert np.abs(pictures[-1] - discs)[either].mean() < 16, "surfels are blended"
    assert all((one != other).any() for i, one in enumerate(pictures) for other in pictures[:i])
