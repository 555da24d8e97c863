"""Long work in the window: it goes on beside it, shows how far it is, and can be cancelled."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from virtual_screen import PATIENCE, RunningApp, running_app, virtual_screen

from viewer.scan import formats
from viewer.scan.points import PointCloud

SIZE = (1280, 720)
_SPHERE = 500_000  # points without normals: estimating takes seconds


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Scans to go through in this order: a small one, one of text, one without normals, a damaged one."""
    folder = tmp_path_factory.mktemp("scans")
    rng = np.random.default_rng(0)
    np.save(folder / "0_small.npy", rng.random((500, 3)))
    rows = "".join(f"{x:.5f} {y:.5f} {z:.5f}\n" for x, y, z in rng.random((100_000, 3)))
    with (folder / "1_text.xyz").open("w") as stream:
        for _ in range(30):
            stream.write(rows)
    points = rng.standard_normal((_SPHERE, 3), dtype=np.float32)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    formats.write(folder / "2_bare.npz", PointCloud.from_arrays(points))
    (folder / "3_damaged.ply").write_bytes(b"ply\nformat binary_little_endian 1.0\nelement vertex 9\n")
    yield folder
    (folder / "1_text.xyz").unlink()


@pytest.fixture(scope="module")
def app(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningApp]:
    with (
        virtual_screen(tmp_path_factory.mktemp("screen"), SIZE) as screen,
        running_app(screen, tmp_path_factory.mktemp("app"), *sorted(folder.iterdir())) as app,
    ):
        yield app


def press_until(app: RunningApp, key: str, words: str) -> None:
    """What goes on is shown, and can be cancelled, a moment after it has begun."""
    end = time.monotonic() + PATIENCE
    before = app.log().count(words)
    while app.log().count(words) == before:
        assert app.process.poll() is None, app.log()
        assert time.monotonic() < end, app.log()
        app.screen.do("key", key, "sleep", 0.1)
    app.expect(words)


def test_opening_is_cancelled_replaced_and_done(app: RunningApp) -> None:
    app.screen.do("key", "Next")
    press_until(app, "Escape", "Cancelled: Opening 1_text.xyz")
    app.settle(1.0)
    assert "opened" not in app.log()
    app.screen.do("key", "p")
    assert Path(app.expect(r"Saved (.+)")[1]).exists(), "the scan before is still there"

    app.screen.do("key", "Prior")
    app.expect(r"opened \S+0_small.npy")
    app.screen.do("key", "Next", "key", "Next")  # the second instead of the first
    app.expect(r"opened \S+2_bare.npz")
    assert "1_text.xyz\n" not in app.log()
    app.screen.do("key", "Next")
    app.expect(r"Cannot open: \S+3_damaged.ply")
    app.screen.do("key", "Prior", "key", "Prior")
    app.expect(r"opened \S+1_text.xyz")
    app.expect("drew frame 0 with points, .* 3000000 points")


def test_preparing_is_cancelled_and_the_renderer_before_comes_back(app: RunningApp) -> None:
    app.screen.do("key", "Next")
    app.expect(r"opened \S+2_bare.npz")
    app.expect("drew frame 0 with points")
    app.settle()
    app.screen.do("mousemove", *(v - 1 for v in SIZE), "key", "Escape")  # away with the notes
    app.settle(1.0)
    left, top, width, height = app.view()
    part = np.s_[top + 200 : top + height - 100, left : left + width]  # without marks
    before = app.screen.picture()[part]
    app.screen.do("key", "b")
    app.expect("drew frame 0 with points")  # meanwhile
    drawn = app.log().count("drew frame")
    press_until(app, "Escape", "Cancelled: Estimating normals")
    app.expect("drew frame 0 with points")
    assert app.log().count("drew frame") <= drawn + 3, "the same picture is not drawn again and again"
    app.screen.do("key", "Escape")  # away with the note
    app.settle()
    assert (app.screen.picture()[part] == before).all()
    app.screen.do("key", "b")
    app.expect("drew frame 0 with surfels")
    app.settle()
    assert (app.screen.picture()[part] != before).any()
    assert "Traceback" not in app.log()


def test_closing_ends_the_process_while_a_scan_is_read(app: RunningApp) -> None:
    opened = app.log().count("opened")
    app.screen.do("key", "Prior", "sleep", 0.2)
    app.screen.do("keydown", "ctrl", "sleep", 0.1, "key", "q", "sleep", 0.1, "keyup", "ctrl")
    assert app.process.wait(PATIENCE) == 0
    assert app.log().count("opened") == opened
    assert "Traceback" not in app.log()
