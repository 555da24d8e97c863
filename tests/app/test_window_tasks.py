"""Long work in the window: it goes on beside it, shows how far it is, and can be cancelled."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from virtual_screen import PANEL, PATIENCE, SIZE, RunningApp, running_app, virtual_screen

from viewer.scan import formats
from viewer.scan.points import PointCloud

# Scans are opened, and what renderers need is found, once there is no file "held" in the working directory.
HELD = """
import os, time
import viewer.app.files.opening as opening
from viewer.helper import Helper
from viewer.task import checkpoint
begin, call = opening.begin, Helper.call
def wait(check):
    while os.path.exists("held"):
        check()
        time.sleep(0.01)
def begin_held(*arguments):
    wait(checkpoint)
    return begin(*arguments)
def call_held(self, task, *arguments, **others):
    wait(task.check)
    return call(self, task, *arguments, **others)
opening.begin, Helper.call = begin_held, call_held
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Scans to go through in this order: a small one, one of text, one without normals, a damaged one."""
    folder = tmp_path_factory.mktemp("scans")
    rng = np.random.default_rng(0)
    np.save(folder / "0_small.npy", rng.random((500, 3)))
    rows = "".join(f"{x:.5f} {y:.5f} {z:.5f}\n" for x, y, z in rng.random((100_000, 3)))
    with (folder / "1_text.xyz").open("w") as stream:
        stream.write(rows)
    points = rng.standard_normal((100_000, 3), dtype=np.float32)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    formats.write(folder / "2_bare.npz", PointCloud.from_arrays(points))
    (folder / "3_damaged.ply").write_bytes(b"ply\nformat binary_little_endian 1.0\nelement vertex 9\n")
    return folder


@pytest.fixture(scope="module")
def app(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningApp]:
    with (
        virtual_screen(tmp_path_factory.mktemp("screen"), SIZE) as screen,
        running_app(screen, tmp_path_factory.mktemp("app"), *sorted(folder.iterdir()), before=HELD) as app,
    ):
        yield app


@pytest.mark.slow
def test_opening_is_cancelled_replaced_and_done(app: RunningApp, folder: Path) -> None:
    small, text, bare, _ = names = [str(path) for path in sorted(folder.iterdir())]
    app.send_notes_away()  # Escape ends these first
    held = app.folder / "held"
    held.touch()
    app.screen.do("key", "Next")
    app.see(lambda state: "Opening 1_text.xyz" in state.works)
    app.screen.do("key", "Escape")
    app.told("Cancelled: Opening 1_text.xyz")
    assert app.settle().scan == small
    app.screen.do("key", "p")
    assert Path(app.told(r"Saved (.+)")[1]).exists(), "the scan before is still there"

    held.unlink()
    app.screen.do("key", "Prior")  # to the first one, from the one that was cancelled
    app.settle()
    held.touch()
    app.screen.do("key", "Next", "key", "Next")  # the second instead of the first
    app.see(lambda state: "Opening 2_bare.npz" in state.works)
    held.unlink()
    app.see(scan=bare)
    assert text not in {state.scan for state in app.states}
    app.screen.do("key", "Next")
    app.told(r"Cannot open: \S+3_damaged.ply")
    app.screen.do("key", "Prior", "key", "Prior")
    app.see(scan=text, frame=0, backend="auto_splats", points=100_000)
    assert names[3] not in {state.scan for state in app.states}


@pytest.mark.slow
def test_preparing_is_cancelled_and_the_renderer_before_comes_back(app: RunningApp, folder: Path) -> None:
    go_to(app, folder / "2_bare.npz")
    app.see(frame=0, backend="auto_splats")
    app.screen.do("mousemove", *(v - 1 for v in SIZE))
    app.send_notes_away()
    app.settle()
    left, top, width, height = app.view()
    part = np.s_[top + 200 : top + height - 100, left : left + width]  # without marks
    before, pictures = app.screen.picture()[part], app.state.pictures
    held = app.folder / "held"
    held.touch()
    app.choose(PANEL, "##backend", "###surfels")
    app.see(lambda state: any("normals" in name for name in state.works))
    app.do(("key", "Escape", "key", "Escape"), ("key", "Escape"))  # meant for anything but the work
    app.act("timeline", ("item_click", "###cancel"))
    assert app.told("Cancelled")[0]
    assert app.notes[-1] == "Cancelled: Estimating normals."
    app.send_notes_away()
    after = app.settle()
    assert (after.frame, after.backend) == (0, "auto_splats")
    assert {state.backend for state in app.pictures(pictures)} <= {"auto_splats"}, "which stays meanwhile"
    assert after.pictures <= pictures + 4, "the same picture is not drawn again and again"
    assert (app.screen.picture()[part] == before).all()
    held.unlink()
    app.choose(PANEL, "##backend", "###surfels")
    app.see(frame=0, backend="surfels")
    app.settle()
    assert (app.screen.picture()[part] != before).any()
    assert "Traceback" not in app.log()


def go_to(app: RunningApp, scan: Path) -> None:
    """Step through the list until the scan is there."""
    for _ in range(4):
        if app.settle().scan == str(scan):
            return
        app.screen.do("key", "Next")
    raise AssertionError(f"{scan} is not in the list")


@pytest.mark.slow
def test_closing_ends_the_process_while_a_scan_is_read(app: RunningApp, folder: Path) -> None:
    go_to(app, folder / "0_small.npy")
    (app.folder / "held").touch()
    app.screen.do("key", "Next")
    app.see(is_opening=True)
    app.screen.do("key", "ctrl+q")
    assert app.process.wait(PATIENCE) == 0
    assert app.state.scan == str(folder / "0_small.npy")
    assert "Traceback" not in app.log()
