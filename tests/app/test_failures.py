"""Whatever goes wrong in a frame is told once, and the next frame is as whole as any."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

pytest.importorskip("imgui_bundle")

from imgui_bundle import ImVec2, imgui

from viewer.app import failures as module
from viewer.app.failures import Failures
from viewer.app.widgets import edited
from viewer.errors import InputError
from viewer.task import Cancelled


@pytest.fixture
def notes() -> list[str]:
    return []


@pytest.fixture
def failures(notes: list[str]) -> Failures:
    return Failures(notes.append)


@pytest.fixture
def context() -> Iterator[None]:
    context = imgui.create_context()
    io = imgui.get_io()
    io.set_ini_filename("")
    io.display_size = ImVec2(800, 600)
    io.backend_flags |= imgui.BackendFlags_.renderer_has_textures
    yield
    imgui.destroy_context(context)


def fail(error: BaseException) -> None:
    raise error


def widgets(go_wrong: Callable[[], object]) -> None:
    """Something of each kind that has to be ended, and then a failure."""
    imgui.push_style_var(imgui.StyleVar_.window_padding, ImVec2(0, 0))
    imgui.begin("panel")
    imgui.push_id("inside")
    imgui.begin_child("child")
    imgui.begin_disabled(True)
    imgui.begin_group()
    imgui.push_style_color(imgui.Col_.text, 0)
    assert imgui.begin_table("table", 2)
    imgui.table_next_column()
    go_wrong()


@pytest.mark.usefixtures("context")
@pytest.mark.parametrize(
    "go_wrong",
    [
        lambda: fail(ValueError("x")),
        lambda: imgui.text("\udce9"),  # which no encoding has
        lambda: [imgui.pop_id() for _ in range(5)],  # ImGui's own complaint
        lambda: fail(Cancelled("x")),
    ],
)
def test_widgets_that_were_begun_are_ended(
    failures: Failures, notes: list[str], go_wrong: Callable[[], object], capfd: pytest.CaptureFixture[str]
) -> None:
    for _ in range(3):
        imgui.new_frame()
        with failures.reported("The panel"):
            widgets(go_wrong)
        imgui.begin("another")
        imgui.text("still there")
        imgui.end()
        imgui.render()  # it would fail were something left open
    assert (failures.count, len(notes)) == (3, 1)
    assert notes[0].startswith("The panel failed")
    assert "\n" not in notes[0]
    assert "Missing" not in "".join(capfd.readouterr()), "not a line for each widget and frame"


def test_the_same_is_told_again_after_a_while(
    failures: Failures, notes: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = 100.0
    monkeypatch.setattr(module.time, "monotonic", lambda: now)
    for seconds in (0, 1, 9, 9, 9):  # it goes on
        now += seconds
        failures.report("Drawing", ValueError("x"))
    assert len(notes) == 1
    failures.report("Measuring", ValueError("x"))
    assert len(notes) == 2
    now += 60
    failures.report("Drawing", ValueError("x"))
    assert len(notes) == 3


def test_words_are_for_users(failures: Failures, notes: list[str]) -> None:
    with failures.reported("Opening"):
        raise InputError("has no points", "a.ply", "Use another")
    with failures.reported("Drawing"):
        raise ValueError("of many\n  lines " * 100)
    assert notes[0] == "a.ply: has no points. Use another"
    assert notes[1].startswith("Drawing failed (ValueError: of many lines of many lines")
    assert len(notes[1]) < 300


def test_what_ends_the_program_is_not_held_up(failures: Failures) -> None:
    with pytest.raises(KeyboardInterrupt), failures.reported("Drawing"):
        raise KeyboardInterrupt


CAFE = "/scans/caf\udce9/knot.ply"


@pytest.mark.parametrize(
    ("text", "path"),
    [
        ("/scans/caf�/knot.ply", CAFE),
        ("/scans/caf�/knot.plyx", CAFE + "x"),
        ("/scans/caf�/", "/scans/caf\udce9/"),
        ("/scans/caf�/other", "/scans/caf\udce9/other"),
        ("/scans/cafe/knot.ply", "/scans/cafe/knot.ply"),
        ("/scans", "/scans"),
        ("", ""),
    ],
)
def test_a_path_that_is_no_utf_8_keeps_what_cannot_be_shown(text: str, path: str) -> None:
    assert edited(CAFE, text) == path
