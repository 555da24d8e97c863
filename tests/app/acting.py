"""Acts on widgets by their names, through the test engine that imgui-bundle carries.

The engine runs a script on a thread of its own, a step of it inside each `imgui.render`, and the two threads
hand Python's lock to each other; so `render` must let go of it, which imgui-bundle's own does not. Here it is
called through ctypes, which does.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from typing import Any

from imgui_bundle import _imgui_bundle, imgui
from walking import Walk

from viewer.app.tools import tool_names

engine = imgui.test_engine
PANEL = "panel/settings"
SECTIONS = (
    "Scan",
    "How this was read",
    *tool_names(),
    "Appearance",
    "View and bookmarks",
    "Renderer",
    "Statistics",
)  # of it

Action = Sequence[Any]  # name of a method of the engine's TestContext, and its arguments


class Actor:
    """Acts while the window is drawn. The engine stops with ImGui's context."""

    def __init__(self) -> None:
        imgui.render = _let_go_of_the_lock()
        self._engine = engine.create_context()
        settings = engine.get_io(self._engine)
        settings.config_run_speed = engine.TestRunSpeed.fast
        settings.config_mouse_draw_cursor = settings.config_saved_settings = False
        settings.config_restore_focus_after_tests = False  # which would close opened lists
        settings.config_watchdog_warning = settings.config_watchdog_kill_test = math.inf  # of a long walk
        self._test = engine.register_test(self._engine, "window", "actor")
        self._test.test_func = self._act
        engine.start(self._engine, imgui.get_current_context())
        self._window = ""
        self._actions: Sequence[Action] = []
        self._walked: Walk | None = None
        self._is_queued = False

    def begin(self, window: str, *actions: Action) -> None:
        """Do this with a window's widgets from the next frame on."""
        self._window, self._actions, self._is_queued = window, actions, False

    def step(self) -> bool:
        """Go on after a frame was drawn; True when all actions were done, or one has failed."""
        engine.post_swap(self._engine)
        if not self._is_queued:  # before its first frame the engine takes none
            engine.queue_test(self._engine, self._test)
            self._is_queued = True
        return engine.is_test_queue_empty(self._engine)

    @property
    def problem(self) -> str:
        """What went wrong with the last actions, or nothing; of a walk its report."""
        walked, self._walked = self._walked, None
        return self._told if walked is None else walked.report(self._told)

    @property
    def _told(self) -> str:
        """What the engine says went wrong, or nothing."""
        output, text = self._test.output, imgui.TextBuffer()
        if output.status == engine.TestStatus.success:
            return ""
        levels = engine.TestVerboseLevel
        output.log.extract_lines_for_verbose_levels(levels.error, levels.warning, text)
        return f"{output.status}: {text.begin()}"

    def _act(self, context: engine.TestContext) -> None:
        context.set_ref(context.window_info(f"//{self._window}").window)
        for name, *arguments in self._actions:
            if name == "walk":
                self._walked = Walk(context, *arguments)
                self._walked.begin()
            else:
                if self._window == PANEL:
                    arguments = [_reached(context, one) for one in arguments]
                getattr(context, name)(*arguments)


def _found(context: engine.TestContext, argument: Any) -> Any:
    """The argument of an action; a path of a widget begins with the section of the panel that has it. None
    for a path of which no widget is there."""
    if not isinstance(argument, str) or not argument or argument.startswith(("//", "**")):
        return argument
    there = engine.TestItemList()
    context.gather_items(there, "", 99)
    ids = {there.get_by_index(number).id_ for number in range(there.get_size())}
    paths = (argument, *(f"{section}/{argument}" for section in SECTIONS))
    return next((path for path in paths if context.get_id(path) in ids), None)


def _reached(context: engine.TestContext, argument: Any) -> Any:
    """The same, once all sections of the panel are open where they hide it; that takes tens of frames."""
    found = _found(context, argument)
    if found is None:
        context.item_open_all("")
        found = _found(context, argument)
    return argument if found is None else found


def _let_go_of_the_lock() -> Any:
    """`imgui.render` without Python's lock."""
    render = ctypes.CDLL(_imgui_bundle.__file__)._ZN5ImGui6RenderEv
    render.argtypes, render.restype = [], None
    return render
