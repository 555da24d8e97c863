"""The window as a person uses it: real keys and mouse on a virtual screen."""

from __future__ import annotations

import itertools
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from imgui_bundle import icons_fontawesome_6 as icons
from numpy.typing import NDArray
from scenes import DRAWS_POINTS
from virtual_screen import PANEL, PATIENCE, ROOT, RunningApp, Screen, running_app, virtual_screen
from written import picture

from viewer import cli
from viewer.analysis.pick import pick
from viewer.app.loop import _WATCH
from viewer.bounds import Bounds
from viewer.camera import Camera
from viewer.document.recording import Recording
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import shared_renderer
from viewer.picture.surface import Surface
from viewer.scan import formats
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud
from viewer.view import View

SIZE = (1280, 720)
MARK = 15  # pixels, height of the text of marks


@pytest.fixture(scope="module")
def screen(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Screen]:
    with virtual_screen(tmp_path_factory.mktemp("screen"), SIZE) as screen:
        yield screen


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five frames of a bumpy sheet with colours, without normals."""
    scan = tmp_path_factory.mktemp("scan")
    x, y = (part.ravel() for part in np.meshgrid(*[np.linspace(-1, 1, 150)] * 2))
    for index in range(5):
        z = 0.3 * np.sin(4 * x + index) * np.cos(3 * y)
        colors = np.stack([0.5 + 0.5 * x, 0.5 + 0.5 * y, 0.5 + z], axis=1)
        points = PointCloud.from_arrays(np.stack([x, y, z], axis=1), colors=colors)
        formats.write(scan / f"{index}.ply", points)
    return scan


@pytest.fixture(scope="module")
def running(screen: Screen, tmp_path_factory: pytest.TempPathFactory, scan: Path) -> Iterator[RunningApp]:
    with running_app(screen, tmp_path_factory.mktemp("app"), scan) as app:
        yield app


@pytest.fixture
def app(running: RunningApp) -> RunningApp:
    running.reset()
    return running


class Screenshot:
    """A picture that the key P has saved."""

    def __init__(self, app: RunningApp) -> None:
        from PIL import Image

        app.screen.do("key", "p")
        self.path = Path(app.told(r"Saved (.+)")[1])
        with Image.open(self.path) as file:
            self.description: dict[str, Any] = json.loads(file.text["scan4d"])  # type: ignore[attr-defined]
            self.pixels = np.asarray(file)

    @property
    def camera(self) -> Camera:
        return Camera.from_json(self.description["camera"])

    def drawn_headless(self) -> NDArray[np.uint8]:
        """The same picture, made from its description without a window."""
        return replayed(self.path, "again.png")[0]

    def surface(self) -> Surface:
        """What each pixel of the same picture sees."""
        (entry,) = Recording.load(self.path).entries
        surface = Surface(shared_renderer().gpu, entry.size)
        with open_scan(entry.scan) as timeline:
            render_frame(shared_renderer(), entry.request(timeline.pose(entry.pose)), surface)
        return surface


def replayed(path: Path, out: str) -> list[NDArray[np.uint8]]:
    """What `scan4d render --replay` makes of a picture or a recording, in a new folder beside it."""
    folder = Path(tempfile.mkdtemp(dir=path.parent))
    assert cli.main(["render", "--replay", str(path), "-o", str(folder / out)]) == 0
    return [picture(file) for file in sorted(folder.iterdir())]


def seen_pixel(surface: Surface) -> tuple[int, int]:
    """The pixel nearest to a place off the centre of the picture whose neighbours show something too."""
    seen = surface.level == 0
    inside = seen[2:-2, 2:-2] & seen[:-4, 2:-2] & seen[4:, 2:-2] & seen[2:-2, :-4] & seen[2:-2, 4:]
    y, x = np.nonzero(inside)
    place = 0.45 * surface.size[0], 0.4 * surface.size[1]
    nearest = np.hypot(x - place[0], y - place[1]).argmin()
    return int(x[nearest]) + 2, int(y[nearest]) + 2


def surface_view(camera: Camera, shot: Screenshot) -> View:
    """Another camera's view of a screenshot's size; from the world's origin."""
    box = Bounds(np.array(camera.target) - 1, np.array(camera.target) + 1)
    return View.of(camera, tuple(shot.description["size"]), np.zeros(3), box)


def difference(one: NDArray[np.uint8], other: NDArray[np.uint8]) -> int:
    return int(np.abs(one[..., :3].astype(int) - other[..., :3]).max())


def shown(app: RunningApp) -> NDArray[np.uint8]:
    """The 3D view on the screen, once no caption lies over it."""
    app.see(caption=None)
    left, top, width, height = app.view()
    return app.screen.picture()[top : top + height, left : left + width]


def bare(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Without the corners that the orientation cube and the scale bar lie over."""
    pixels = pixels[..., :3].copy()
    pixels[:150, -112:] = pixels[-64:, :200] = 0
    return pixels


def on_screen(app: RunningApp, x: int, y: int) -> tuple[int, int]:
    """Where a pixel of the 3D view is."""
    left, top, *_ = app.view()
    return left + x, top + y


def assert_true_picture(app: RunningApp) -> Screenshot:
    """What is on the screen is what was saved, and what comes out without a screen."""
    app.screen.do("mousemove", *(v - 1 for v in SIZE))  # the pointer is part of the screen's picture
    app.settle()
    shot = Screenshot(app)
    app.send_notes_away()
    app.settle()
    assert difference(bare(shown(app)), bare(shot.pixels)) <= 1
    assert difference(shot.drawn_headless(), shot.pixels) <= 1
    assert np.ptp(shot.pixels[..., :3]) > 100, "there is something in the picture"
    return shot


def drag(app: RunningApp, button: int, start: tuple[int, int], end: tuple[int, int]) -> None:
    """In two moves."""
    app.drag(start, ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2), end, button=button)


def on_track(share: float) -> tuple[int, int]:
    """A place on the timeline's track."""
    return int(SIZE[0] * (0.37 + 0.47 * share)), SIZE[1] - 55


def camera_of(app: RunningApp) -> Camera:
    """The view's, when nothing goes on any longer."""
    return Camera.from_json(app.settle().camera)


def test_opens_plays_scrubs_switches_and_saves_what_is_shown(app: RunningApp) -> None:
    assert_true_picture(app)
    app.screen.do("key", "e", "key", "space")  # else a slow window may leave out the same ones for ever
    for frame in (1, 2, 3, 4, 0):
        app.see(frame=frame, backend="auto_splats")
    app.screen.do("key", "space")
    app.settle()
    app.screen.do("key", "ctrl+Home")
    app.settle()
    drag(app, 1, on_track(0.1), on_track(0.95))
    app.see(frame=4, backend="auto_splats")
    app.screen.do("key", "Left")
    app.see(frame=3, backend="auto_splats")
    before = assert_true_picture(app)
    assert before.description["pose"] == 3
    app.choose(PANEL, "##backend", "###points")
    app.see(frame=3, backend="points")
    assert difference(before.pixels, assert_true_picture(app).pixels) > 20


@pytest.mark.slow
def test_b_goes_round_all_renderers(app: RunningApp) -> None:
    before = assert_true_picture(app)
    names = DRAWS_POINTS
    after = names.index("auto_splats") + 1
    for name in (*names[after:], *names[:after]):
        app.screen.do("key", "b")
        app.see(backend=name)
    assert difference(assert_true_picture(app).pixels, before.pixels) == 0


@pytest.mark.slow
def test_the_mouse_orbits_pans_zooms_and_f_fits(app: RunningApp) -> None:
    app.screen.do("key", "f")
    app.settle()
    start = Screenshot(app)
    height = start.description["size"][1]
    drag(app, 1, (400, 300), (400 + height // 2, 300))  # half a height is a quarter turn
    turned = assert_true_picture(app).camera
    assert turned.target == start.camera.target
    assert turned.distance == pytest.approx(start.camera.distance)
    arms = [np.subtract(c.eye, c.target) / c.distance for c in (start.camera, turned)]
    assert arms[0] @ arms[1] == pytest.approx(0, abs=0.01)

    app.screen.do("mousemove", 400, 300, "click", 4, "click", 4, "click", 4)
    near = camera_of(app)
    assert near.distance == pytest.approx(turned.distance / 1.15**3)

    drag(app, 2, (400, 300), (500, 260))
    panned = camera_of(app)
    shift = near.rotation()[:2] @ np.subtract(near.target, panned.target) / near.view_height * height
    assert shift == pytest.approx([100, 40], abs=1)

    drag(app, 3, (400, 300), (400, 200))
    assert camera_of(app).distance < panned.distance

    app.screen.do("key", "f")
    fitted = camera_of(app)
    assert fitted.target == pytest.approx(start.camera.target)
    assert fitted.rotation() == pytest.approx(turned.rotation(), abs=1e-9)


@pytest.mark.slow
def test_the_line_under_the_timeline_says_what_is_seen(app: RunningApp) -> None:
    app.screen.do("key", "f", "mousemove", *(v - 1 for v in SIZE))
    app.settle()
    shot = Screenshot(app)
    surface = shot.surface()
    x, y = seen_pixel(surface)
    picked = pick(surface, x, y)
    assert picked is not None
    app.screen.do("mousemove", *on_screen(app, x, y))
    assert len(app.see(lambda state: state.pointed).pointed) == 2, "place and frame; more is a choice"
    app.act("##MainMenuBar", ("menu_click", "View/###point_details"))
    app.screen.do("mousemove", *on_screen(app, 3, 3))  # a mouse that stays where it was makes no event
    app.settle()
    app.screen.do("mousemove", *on_screen(app, x, y))
    told = app.see(lambda state: len(state.pointed) > 2).pointed
    assert [float(v) for v in told[0].partition(" ±")[0].split(", ")] == pytest.approx(
        picked.position, abs=1e-2
    )
    assert told[1:3] == [f"frame {shot.description['pose'] + 1}/5", f"point {picked.id}"]
    assert "colour #" + bytes(picked.color[:3]).hex() in told
    app.act("##MainMenuBar", ("menu_click", "View/###point_details"))
    app.screen.do("mousemove", *on_screen(app, 3, 3))
    app.see(pointed=[])


@pytest.mark.slow
def test_a_double_click_sets_the_point_that_the_view_turns_about(app: RunningApp) -> None:
    app.screen.do("key", "f", "mousemove", *(v - 1 for v in SIZE))
    app.settle()
    start = Screenshot(app)
    surface = start.surface()
    x, y = seen_pixel(surface)
    picked = pick(surface, x, y)
    place = on_screen(app, x, y)
    app.do(("mousemove", *place), ("click", "--repeat", 2, "--delay", 0, 1))
    app.settle()
    clicked = Screenshot(app)
    assert clicked.camera.eye == start.camera.eye
    above = np.s_[: -4 * MARK]  # the scale bar, which is true where the view turns about
    assert difference(clicked.pixels[above], start.pixels[above]) <= 1, "nothing jumps"
    drag(app, 1, (400, 300), (500, 340))
    turned = assert_true_picture(app).camera
    assert np.linalg.norm(turned.rotation() - start.camera.rotation()) > 0.3
    assert np.linalg.norm(np.subtract(turned.target, start.camera.target)) > 0
    where = surface_view(turned, start).project(picked.position[None])[0][0]
    assert where == pytest.approx([x + 0.5, y + 0.5], abs=0.02)

    # A double click on nothing changes nothing; fitting turns about the middle again.
    nothing = on_screen(app, 3, 3)
    app.do(("mousemove", *nothing), ("click", "--repeat", 2, "--delay", 0, 1))
    app.settle()
    assert camera_of(app) == turned
    app.screen.do("key", "f")
    drag(app, 1, (400, 300), (500, 300))
    assert camera_of(app).target == pytest.approx(start.camera.target)


@pytest.mark.slow
def test_views_and_projection_by_keys(app: RunningApp) -> None:
    """The subject's left side is on its left view, as the up axis and the front have it."""
    backs = []
    for number in range(1, 7):
        app.screen.do("key", f"ctrl+{number}")
        backs.append(camera_of(app).rotation()[2])
    front, left, top = [0, -1, 0], [1, 0, 0], [0, 0, 1]  # of a sheet that lies, as it is guessed
    expected = np.array([front, np.negative(front), left, np.negative(left), top, np.negative(top)])
    np.testing.assert_allclose(backs, expected, atol=1e-4)
    app.screen.do("key", "o")
    app.settle()
    flat = assert_true_picture(app)
    assert flat.camera.projection == "orthographic"
    app.screen.do("key", "ctrl+1")
    app.screen.do("key", "o")
    assert camera_of(app).projection == "perspective"


@pytest.mark.slow
def test_idle_it_draws_nothing_and_takes_no_processor_time(app: RunningApp) -> None:
    app.send_notes_away()  # they would go by themselves
    app.screen.do("mousemove", 470, 310)  # over the scan: a paused mouse asks for nothing new
    app.settle()
    app.see(counted=True)
    begun = app.state.at
    first = app.see(lambda state: state.at > begun + 1)  # longer than a tooltip takes to appear
    seconds, number = app.cpu_seconds(), len(app.states)
    last = app.see(lambda state: state.at > first.at + 3)
    assert last.windows == first.windows
    elapsed = last.at - first.at
    assert len(app.states) - number <= elapsed / _WATCH + 2, "it looks at what workers have done, and sleeps"
    assert app.cpu_seconds() - seconds < 0.5 * elapsed, "no thread goes on"


@pytest.mark.slow
def test_a_parameter_and_the_look_are_changed_in_the_panel(app: RunningApp) -> None:
    """The points' size: a slider from 0 to 32."""
    size = "point_size"
    app.choose(PANEL, "##backend", "###points")
    app.act(PANEL, ("item_input_value", f"renderer/{size}/##value", 0))
    app.settle()
    before = Screenshot(app)
    app.act(PANEL, ("item_input_value", f"renderer/{size}/##value", 32))
    app.settle()
    after = assert_true_picture(app)
    assert before.description["params"]["point_size"] == 0
    assert after.description["params"]["point_size"] == 32
    app.act(PANEL, ("item_drag_with_delta", f"renderer/{size}/##value", (-300, 0)))
    app.settle()
    assert difference(Screenshot(app).pixels, before.pixels) == 0
    app.act(
        PANEL,
        ("item_input_value", f"renderer/{size}/##value", 32),
        ("item_click", f"renderer/{size}/{icons.ICON_FA_ARROW_ROTATE_LEFT}"),
    )
    app.settle()
    assert assert_true_picture(app).description["params"]["point_size"] == 1, "the default"


@pytest.mark.slow
def test_acting_on_a_widget_or_a_window_that_is_not_there_fails(app: RunningApp) -> None:
    for window, widget in ((PANEL, "renderer/k/##nothing"), ("nothing", "renderer/k/##value")):
        with pytest.raises(AssertionError, match=r"Unable to locate|doesn't seem to exist"):
            app.act(window, ("item_click", widget))
    app.act(PANEL, ("item_click", "renderer/k/##value"))


@pytest.mark.slow
def test_a_recording_holds_what_was_shown_and_is_drawn_again(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    with running_app(screen, tmp_path, scan) as app:
        red = is_red(shown(app)[:60, :200]).sum()
        screen.do("key", "r")
        app.see(is_recording=True)
        app.settle()
        assert is_red(shown(app)[:60, :200]).sum() > red + 50, "a mark says that it records"
        shots = [Screenshot(app)]
        for key, backend in (("Right", "auto_splats"), ("b", "codeword"), ("shift+b", "auto_splats")):
            screen.do("key", key)
            app.see(frame=1, backend=backend)
            app.settle()
            shots.append(Screenshot(app))
        drag(app, 1, (300, 300), (400, 300))
        shots.append(Screenshot(app))
        screen.do("key", "r")
        path = Path(app.told(r"Saved (.+\.json)")[1])
        app.settle()
        assert is_red(shown(app)[:60, :200]).sum() == red
        screen.do("key", "Right")
        app.see(frame=2)
    recording = Recording.load(path)
    entries = recording.entries
    again = replayed(path, "%03d.png")
    assert len(again) == len(entries)
    assert all(one != other for one, other in itertools.pairwise(entries)), "no more than what changed"
    assert [e.pose for e in entries] == [0] + [1] * (len(entries) - 1)
    stamps = [entry.at for entry in entries]
    assert stamps == sorted(stamps)
    assert stamps[-1] < recording.seconds
    described = [Recording.load(shot.path).entries[0] for shot in shots]
    assert [entries[number] for number in (0, 1, 2, 3, -1)] == described
    assert len(entries) > 5, "the camera moved in steps"
    for number, shot in zip((0, 1, 2, 3, -1), shots, strict=True):
        assert difference(again[number], shot.pixels) <= 1


def is_red(pixels: NDArray[np.uint8]) -> NDArray[np.bool_]:
    red, green, blue = np.moveaxis(pixels.astype(int), 2, 0)
    return (red > 180) & (green < 110) & (blue < 110)


@pytest.mark.slow
def test_closing_saves_what_is_being_recorded(screen: Screen, tmp_path: Path, scan: Path) -> None:
    with running_app(screen, tmp_path, scan / "0.ply") as app:
        screen.do("key", "r")
        app.see(is_recording=True)
        screen.do("key", "ctrl+q")
        assert app.process.wait(PATIENCE) == 0
    (path,) = tmp_path.glob("*.json")
    assert [entry.pose for entry in Recording.load(path).entries] == [0]


@pytest.mark.slow
def test_escape_does_not_quit_and_ctrl_q_does(screen: Screen, tmp_path: Path, scan: Path) -> None:
    with running_app(screen, tmp_path, scan / "0.ply") as app:
        screen.do("key", "Escape")
        screen.do("key", "p")
        app.told("Saved")
        # As fingers do it: one key after the other.
        screen.do("key", "ctrl+q")
        assert app.process.wait(PATIENCE) == 0
        assert "Traceback" not in app.log()


def test_a_broken_frame_is_reported_and_playing_goes_on(screen: Screen, tmp_path: Path) -> None:
    scan = tmp_path / "scan"
    scan.mkdir()
    for number in range(5):
        angles = np.linspace(0, 6, 2000)
        np.save(scan / f"{number}.npy", np.stack([np.cos(angles), np.sin(angles * number), angles], axis=1))
    (scan / "2.npy").write_bytes((scan / "2.npy").read_bytes()[:1000])
    with running_app(screen, tmp_path, scan) as app:
        screen.do("key", "e", "key", "space")
        app.told("Scan4D leaves out frame 3")
        for frame in (3, 4, 0, 1, 3):
            app.see(frame=frame)
        assert 2 not in app.frames()
        assert "Traceback" not in app.log()


def run_without_display(scan: object) -> str:
    code = (
        "import sys; from viewer.app import run; from viewer.errors import Scan4DError\n"
        "try: run(sys.argv[1:])\n"
        "except Scan4DError as error: print(type(error).__name__, error)"
    )
    command = [sys.executable, "-c", code, str(scan)]
    return subprocess.run(
        command, env={"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=True
    ).stdout


def test_a_wrong_name_is_told_where_no_window_opens(tmp_path: Path) -> None:
    assert run_without_display(tmp_path / "none").startswith("InputError")


def test_without_a_display_it_says_so(tmp_path: Path) -> None:
    np.save(tmp_path / "points.npy", np.eye(3))
    message = run_without_display(tmp_path / "points.npy")
    assert message.startswith("NoOpenGLError no window can be opened")
    assert "DISPLAY" in message


def test_an_opengl_that_is_too_old_is_named(screen: Screen) -> None:
    older = {**screen.env, "MESA_GL_VERSION_OVERRIDE": "3.3"}
    command = [sys.executable, "-m", "viewer.cli", "view", "demo"]
    done = subprocess.run(command, env=older, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 3
    assert re.fullmatch(r"scan4d: no window can be opened \([^\n]*OpenGL 3\.3 on [^\n]*\n", done.stderr)
