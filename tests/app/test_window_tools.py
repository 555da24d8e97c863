"""Tools out of folders of their own: the one of the documentation, and some that fail, in the real window."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from extended import pip_install, use_tools, write_package
from PIL import Image
from virtual_screen import PANEL, PATIENCE, SIZE, RunningApp, Screen, running_app

from viewer import cli
from viewer.document.recording import Recording
from viewer.errors import InputError
from viewer.rigid import Rigid
from viewer.scan import formats
from viewer.scan.points import PointCloud

YELLOW = (0xF2, 0xC1, 0x4E)


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    """A wall of points before the camera, so that a click anywhere near the middle hits."""
    x, y = np.meshgrid(np.linspace(-1, 1, 400), np.linspace(-1, 1, 400))
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    formats.write(tmp_path / "wall.npz", PointCloud.from_arrays(points))
    return tmp_path / "wall.npz"


def middle(app: RunningApp) -> tuple[int, int]:
    left, top, width, height = app.view()
    return left + width // 2, top + height // 2


def click(app: RunningApp, x: int, y: int) -> None:
    """Click, and take the mouse out of the way."""
    app.do(("mousemove", x, y), ("click", 1), ("mousemove", 2, SIZE[1] - 2))
    app.settle()


def count(app: RunningApp, color: tuple[int, int, int]) -> int:
    """Pixels of the view in a colour."""
    left, top, width, height = app.view()
    picture = app.screen.picture()[top : top + height, left : left + width]
    return int((picture == color).all(axis=2).sum())


def write_settings(home: Path, tools: dict[str, dict[str, object]]) -> Path:
    """What was remembered of tools at the last start."""
    path = home / "config" / "scan4d" / "settings.json"
    path.parent.mkdir(parents=True)
    path.write_text(json.dumps({"format": 1, "tools": tools}))
    return path


def close(app: RunningApp) -> None:
    app.process.terminate()
    assert app.process.wait(PATIENCE) == 0


@pytest.mark.slow
def test_the_tool_of_the_documentation(screen: Screen, tmp_path: Path, scan: Path) -> None:
    target = tmp_path / "installed"
    pip_install(write_package("tool", tmp_path), target)
    use = f"import sys; sys.path.insert(0, {str(target)!r})\n"
    with running_app(screen, tmp_path, scan, before=use) as app:
        x, y = middle(app)
        assert count(app, YELLOW) == 0
        screen.do("key", "alt+p")
        app.settle()
        click(app, x, y)
        one = count(app, YELLOW)
        assert one > 20, "a position is pinned"
        click(app, x + 100, y + 60)
        assert count(app, YELLOW) == pytest.approx(2 * one, rel=0.2)
        screen.do("key", "ctrl+z")
        app.settle()
        assert count(app, YELLOW) == one, "undo takes the second away"

        click(app, app.view()[0] + 40, y)
        app.told("nothing to pin")

        screen.do("key", "m")
        app.see(clicking="measuring")
        click(app, x - 60, y)
        app.see(is_under_way=True)
        assert count(app, YELLOW) == one, "the clicks are measuring's now"
        screen.do("key", "Escape")
        app.see(clicking=None)
        app.do(("key", "alt+p"), ("key", "Escape"))
        app.settle()
        click(app, x + 100, y + 60)
        assert count(app, YELLOW) == one, "Escape has put the pins away"
        close(app)
    assert "Traceback" not in app.log()


FAILING = {
    "at_import": "TITLE = 'At import'\nraise ValueError('import')\n",
    "at_parsing": "TITLE = (\n",
    "at_making": "TITLE = 'At making'\ndef Tool(context): raise ValueError('making')\n",
    "in_panel": """
        def panel(self, ui):
            imgui.begin_child("begun")
            imgui.push_id("begun")
            raise ValueError("panel")
        """,
    "in_overlay": "def overlay(self, canvas, view): raise ValueError('overlay')\n",
    "in_dialog": """
        def dialog(self):
            imgui.begin("begun")
            raise ValueError("dialog")
        """,
    "in_prompt": "def prompt(self): raise ValueError('prompt')\n",
    "in_escape": "def on_escape(self): raise ValueError('escape')\n",
    "in_advance": "def advance(self, budget): raise ValueError('advance')\n",
    "in_click": "def on_click(self, click): raise ValueError('click')\n",
    "in_command": "def act(self): raise ValueError('command')\n",
    "in_work": """
        def act(self): self.context.run("Working", self.work, print)
        def work(self): raise ValueError("work")
        """,
    "in_result": """
        def act(self): self.context.run("Working", lambda: 1, self.take)
        def take(self, result): raise ValueError("result")
        """,
}  # fmt: skip
HEAD = """
from imgui_bundle import imgui
from viewer.app.commands import Command
from viewer.errors import InputError
TITLE = {name!r}
class Tool:
    def __init__(self, context):
        self.context = context
        context.reveal()
    def act(self): self.context.take_clicks()
"""
UNBALANCED = {
    "push_id() and pop_id()": "imgui.push_id('begun')",
    "begin() and end(), or begin_child() and end_child()": "imgui.begin_child('begun')",
    "push_style_color() and pop_style_color()": "imgui.push_style_color(imgui.Col_.text, 0xFFFFFFFF)",
    "begin_disabled() and end_disabled()": "imgui.begin_disabled()",
}
KEEPING = """
from dataclasses import dataclass
from typing import Any
from viewer.document.part import Part
from viewer.geometry import Vector
@dataclass(frozen=True)
class Place:
    position: Vector
@dataclass(frozen=True)
class Kept(Part, name={name!r}):
    all: {kind}
"""
TAIL = """
COMMANDS = {{"Tools": (Command("act_{name}", "Act", lambda tool: tool.act(), {key!r}),)}}
"""


def write_failing(folder: Path) -> dict[str, str]:
    """Write a tool for each of FAILING, with a key that has it act: tool's name -> key."""
    folder.mkdir()
    keys = {}
    for number, (name, code) in enumerate(FAILING.items()):
        if name.startswith("in_"):
            lines = code.splitlines()
            indent = min(len(line) - len(line.lstrip()) for line in lines if line.strip())
            body = "\n".join("    " + line[indent:] for line in lines)
            keys[name] = f"Alt+{'ABCDEFGHIJKLM'[number]}"
            code = HEAD.format(name=name) + body + TAIL.format(name=name, key=keys[name])
        (folder / f"{name}.py").write_text(code)
    return keys


@pytest.mark.slow
def test_a_tool_that_fails_is_told_once_and_switched_off_and_all_else_goes_on(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    keys = write_failing(tmp_path / "tools")
    before = {"at_import": {"kept": 1}, "gone": {"kept": 2}}
    settings = write_settings(tmp_path, before)
    with running_app(screen, tmp_path, scan, before=use_tools(tmp_path / "tools")) as app:
        x, y = middle(app)
        for name in ("in_command", "in_work", "in_result"):
            screen.do("key", keys[name].lower())
            app.told(f"switched off {name} ")
        app.do(("key", keys["in_escape"].lower()), ("key", "Escape"))
        app.told("switched off in_escape ")
        screen.do("key", keys["in_prompt"].lower())
        app.told("switched off in_prompt ")
        screen.do("key", keys["in_click"].lower())
        click(app, x, y)
        app.told("switched off in_click ")
        click(app, x, y)

        app.do(("key", keys["in_command"].lower()), ("key", "m"))
        app.see(clicking="measuring")
        click(app, x, y)
        app.see(is_under_way=True)
        screen.do("key", "Escape")
        app.see(clicking=None)
        close(app)
    found = (
        re.fullmatch(r"Scan4D switched off (.+?)(?: of acme-tools 1\.0)? until the next start: (.*)", note)
        for note in app.notes
    )
    told = [match.groups() for match in found if match]
    assert len(told) == len(FAILING), "each once"
    reasons = dict(told)
    assert reasons["at_parsing"].startswith("SyntaxError")
    assert reasons["at_import"] == "ValueError: import"
    assert reasons["At making"] == "ValueError: making"
    for name in keys:
        assert reasons[name] == f"ValueError: {name.removeprefix('in_')}"
    assert json.loads(settings.read_text())["tools"] == before


@pytest.mark.slow
def test_what_two_tools_want_alike_goes_to_the_first_and_mistakes_are_told(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    folder = tmp_path / "tools"
    folder.mkdir()
    body = "    def act(self): raise InputError('a mistake')\n"
    for name, key in (("first", "Alt+A"), ("second", "M"), ("third", "Hyper+A")):
        (folder / f"{name}.py").write_text(HEAD.format(name=name) + body + TAIL.format(name=name, key=key))
    (folder / "fourth.py").write_text(
        HEAD.format(name="fourth") + TAIL.replace("act_{name}", "measure").format(key="Alt+B")
    )
    uncomma = TAIL.replace("),)}}", "))}}")
    (folder / "fifth.py").write_text(HEAD.format(name="fifth") + uncomma.format(name="fifth", key=""))
    mistaken = "    def panel(self, ui): raise InputError('a button pressed wrongly')\n"
    (folder / "sixth.py").write_text(HEAD.format(name="sixth") + mistaken)
    other = tmp_path / "others"
    other.mkdir()
    (other / "first.py").write_text("raise ValueError('not the first')\n")
    use = use_tools(folder) + use_tools(other, "other-tools 2.0")
    with running_app(screen, tmp_path, scan, before=use) as app:
        for _ in range(2):
            screen.do("key", "alt+a")
            app.told("a mistake")
        screen.do("key", "m")
        app.see(clicking="measuring")
        close(app)
    told = "\n".join(app.notes)
    assert "The tool 'second': M is set for both 'measure' and 'act_second'. 'act_second' has no keys" in told
    off = "of acme-tools 1.0 until the next start"
    assert f"switched off third {off}: unknown modifier key 'Hyper'" in told
    assert f"switched off fourth {off}: a command 'measure' exists already" in told
    assert f"switched off fifth {off}: TypeError: COMMANDS['Tools'] must be a tuple of commands" in told
    assert told.count("a button pressed wrongly") == 1, "once while it lasts"
    assert "The tool 'first' of other-tools 2.0 is not used: acme-tools 1.0 already has this name" in told
    assert "not the first" not in told
    assert "switched off sixth" not in told
    assert "switched off first" not in told


@pytest.mark.slow
def test_a_tool_that_leaves_imgui_unbalanced_is_named_and_the_window_goes_on(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    folder = tmp_path / "tools"
    folder.mkdir()
    names = {f"unbalanced{number}": calls for number, calls in enumerate(UNBALANCED)}
    for name, calls in names.items():
        hooks = "".join(f"    def {hook}(self, *_): {UNBALANCED[calls]}\n" for hook in ("panel", "overlay"))
        (folder / f"{name}.py").write_text(HEAD.format(name=name) + hooks)
    with running_app(screen, tmp_path, scan, before=use_tools(folder)) as app:
        screen.do("key", "m")
        app.see(clicking="measuring")
        close(app)
    told = [note for note in app.notes if "failed" in note or "switched off" in note]
    assert sorted(told) == [
        f"Scan4D switched off {name} until the next start: RuntimeError: {calls} were not called equally "
        "often"
        for name, calls in names.items()
    ]


@pytest.mark.slow
def test_what_cannot_be_kept_is_refused_and_the_document_stays_whole(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    folder = tmp_path / "tools"
    folder.mkdir()
    pin = (
        "    def on_click(self, click):\n"
        "        self.context.change('Pin', Kept((Place(click.picked.{}),)))\n"
    )
    kinds = {"array": "tuple[Place, ...] = ()", "place": "tuple[Place, ...] = ()", "listed": "list = ()"}
    for name, kind in kinds.items():
        code = HEAD.format(name=name) + pin.format("position" if name == "array" else "place")
        keys = TAIL.format(name=name, key=f"Alt+{name[0]}")
        (folder / f"{name}.py").write_text(KEEPING.format(name=name, kind=kind) + code + keys)
    with running_app(screen, tmp_path, scan, before=use_tools(folder)) as app:
        app.told(r"switched off listed of acme-tools .*: TypeError: Kept\.all cannot be stored as list")
        screen.do("key", "alt+p")
        click(app, *middle(app))
        screen.do("key", "alt+a")
        x, y = middle(app)
        click(app, x + 60, y)  # elsewhere: at the same pixel it could be the second click of a double click
        app.told(r"switched off array .*: TypeError: array\.all\[0\]\.position must be a tuple, not array")
        close(app)
    assert not [note for note in app.notes if "cannot be saved" in note]
    (kept,) = (tmp_path / "config" / "scan4d" / "scans").glob("*.json")
    (position,) = json.loads(kept.read_text())["document"]["parts"]["place"]["all"]
    assert len(position["position"]) == 3


LAYING = """
from dataclasses import replace
import numpy as np
from viewer.app.commands import Command
from viewer.rigid import Rigid
TITLE = "Laying"
PLACE = np.eye(4)
PLACE[:3, :3] = [[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]]
PLACE[:3, 3] = 100, 0, 3
class Tool:
    def __init__(self, context):
        self.context, self.made = context, {}
    def numbers(self, pose):
        if pose.index not in self.made:
            self.made[pose.index] = {"rising": pose.cloud.positions[:, 1] * 5.0}
        return self.made[pose.index]
    def lay(self): self.context.lay(self.numbers)
    def color_plainly(self):
        look = replace(self.context.document.look, color_by="plain", light="flat")
        self.context.change("Colour", look=look)
    def move(self): self.context.lay(self.numbers, lambda index: Rigid(PLACE))
    def wrong(self): self.context.lay(lambda pose: {"rising": np.zeros(3)})
    def tell(self):
        viewport = self.context.viewport
        look, size = viewport.request.look, viewport.renderer.bytes_of(self.context.pose)
        right = self.context.motion(self.context.pose).matrix[0, 3]
        self.context.note(f"{look.color_by}, {size} bytes, at {right:g}")
COMMANDS = {"Tools": (
    Command("lay", "Lay", Tool.lay, "Alt+A"),
    Command("move", "Move", Tool.move, "Alt+B"),
    Command("plainly", "Plainly", Tool.color_plainly, "Alt+C"),
    Command("wrong", "Lay wrongly", Tool.wrong, "Alt+D"),
    Command("tell", "Tell", Tool.tell, "Alt+E"),
)}
"""


def shown(app: RunningApp) -> tuple[str, int, float]:
    """What the tool above tells: source of colours, bytes of the pose on the GPU, x of its place."""
    app.press("alt+e")
    told = app.told(r"^(\w+), (\d+) bytes, at (\S+)$")
    return told[1], int(told[2]), float(told[3])


def saved_picture(app: RunningApp) -> Path:
    app.press("p")
    return Path(app.told(r"Saved (.+\.png)")[1])


def pixels(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.array(image)[..., :3]


@pytest.mark.slow
def test_what_a_tool_lays_over_the_scan_is_shown_picked_and_replayed(
    screen: Screen, tmp_path: Path, scan: Path
) -> None:
    (tmp_path / "tools").mkdir()
    (tmp_path / "tools" / "laying.py").write_text(LAYING)
    with running_app(screen, tmp_path, scan, before=use_tools(tmp_path / "tools")) as app:
        x, y = middle(app)
        app.press("alt+c")
        color, before, _ = shown(app)
        assert color == "plain"
        plain = saved_picture(app)

        app.press("alt+a")
        app.choose(PANEL, "color_by/##value", "###rising")
        app.settle()
        color, laid, _ = shown(app)
        assert (color, laid - before) == ("rising", 4 * 400 * 400), "a number a point, and nothing else"
        screen.do("mousemove", x, y - 60)
        app.settle()
        height, number = pointed(app)
        assert number == pytest.approx(5 * height[1], abs=0.05)
        app.press("r")
        app.told("Cannot record: the picture shows the colours 'rising'")
        app.press("ctrl+e")
        app.told("Cannot export: the picture shows the colours 'rising'")
        app.press("p")
        app.told("cannot replay this picture: the picture shows the colours 'rising'")
        colored = Path(app.told(r"Saved (.+\.png)")[1])
        assert len(np.unique(pixels(colored).reshape(-1, 3), axis=0)) > 50
        with pytest.raises(InputError):
            Recording.load(colored)

        app.press("alt+b")
        app.press("f")
        assert shown(app) == ("rising", laid, 100), "nothing is uploaded again"
        app.press("alt+c")
        screen.do("mousemove", x, y)
        app.settle()
        place = place_under_mouse(app)
        assert place == pytest.approx((100, 0, 3), abs=0.05), "it is fitted and picked where it is moved to"
        moved = saved_picture(app)
        assert (pixels(moved) != pixels(plain)).any(axis=2).mean() > 0.02
        (entry,) = Recording.load(moved).entries
        assert entry.place is not None
        assert entry.place[0] == (0.8, -0.6, 0, 100)

        app.press("r")
        app.see(is_recording=True)
        app.press("r")
        app.told(r"Saved .+\.json")

        app.press("m")
        click(app, x, y)
        click(app, x + 60, y)
        (measured,) = app.settle().distances
        moved_by = Rigid(np.array(entry.place))
        ends = moved_by.points(np.array(measured["positions"]))
        np.testing.assert_allclose(ends[0], (100, 0, 3), atol=0.05)
        stored = app.state.document["parts"]["landmarks"]["all"]
        np.testing.assert_allclose([end["keys"][0]["position"] for end in stored], measured["positions"])
        app.press("Escape")
        app.press("ctrl+z")  # pictures have measured lines, too

        app.press("alt+d")
        app.told("switched off Laying until the next start: .*'rising' is .*expected 160,000 numbers")
        assert (pixels(saved_picture(app)) != pixels(moved)).any(), "where the scan has it"
        app.press("shift+r")
        app.see(is_replaying=False)
        app.settle()
        np.testing.assert_array_equal(pixels(saved_picture(app)), pixels(moved))
        close(app)
    assert cli.main(["render", "--replay", str(moved), "-o", str(tmp_path / "again.png")]) == 0
    np.testing.assert_array_equal(pixels(tmp_path / "again.png"), pixels(moved))


def pointed(app: RunningApp) -> tuple[list[float], float]:
    """The place under the mouse, and the number of the layer there."""
    words = app.state.pointed
    (number,) = (float(word.split()[1]) for word in words if word.startswith("rising "))
    return place_under_mouse(app), number


def place_under_mouse(app: RunningApp) -> list[float]:
    return [float(part) for part in app.state.pointed[0].partition(" ±")[0].split(",")]
