"""Octrees that arrive from a server in the real window: finer with each level, and never coarser again."""

from __future__ import annotations

from pathlib import Path

import pytest
from byte_server import serving
from scenes import sphere
from virtual_screen import Screen, running_app

from viewer.scan import formats
from viewer.scan.octree.storage import read_header
from viewer.scan.pose import Pose


@pytest.fixture
def octree(tmp_path: Path) -> bytes:
    path = tmp_path / "ball.svo"
    formats.write_poses(path, iter([Pose(0, 0.0, "", sphere(60_000))]), "mm")
    return path.read_bytes()


def level_starts(data: bytes) -> list[int]:
    """Where each level begins, and where the last one ends."""
    header, size = read_header(data)
    starts = [size + header.strays.masks + header.strays.attributes]
    for level in header.levels:
        starts.append(starts[-1] + level.masks + level.attributes)
    return starts


@pytest.mark.slow
def test_the_picture_gets_finer_while_levels_arrive(screen: Screen, tmp_path: Path, octree: bytes) -> None:
    header, _ = read_header(octree)
    starts, nodes = level_starts(octree), [level.nodes for level in header.levels]
    with (
        serving(octree, held_back=range(starts[-2], starts[-1])) as served,
        running_app(screen, tmp_path, served.url) as app,
    ):
        app.see(points=nodes[-2])
        served.released.set()
        app.see(points=nodes[-1])
        app.settle()
        shown = [state.points for state in app.pictures()]
        assert shown == sorted(shown)
        assert not app.state.shown_notes or "octree" not in " ".join(app.state.shown_notes)
        assert "Traceback" not in app.log()


@pytest.mark.slow
def test_what_is_cut_off_stays_coarse_with_one_message(screen: Screen, tmp_path: Path, octree: bytes) -> None:
    header, _ = read_header(octree)
    deepest = len(header.levels) - 1
    cut = octree[: level_starts(octree)[-2] + 10]
    with serving(cut, ranges=False) as served, running_app(screen, tmp_path, served.url) as app:
        app.told(f"ends within level {deepest} of {deepest} of an octree")
        app.see(points=header.levels[-2].nodes)
        assert sum("ends within level" in note for note in app.notes) == 1
        assert "Traceback" not in app.log()
