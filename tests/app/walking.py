"""Goes through every widget that the window shows: hovers each, rests on it, drags and clicks it, and goes on
with what that opens. ImGui's test engine finds the widgets, no list names them.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Collection, Iterator

from imgui_bundle import ImVec2, imgui

engine = imgui.test_engine

_DRAG = ImVec2(2, 7)  # pixels: enough to be one, and not off a menu
_ESCAPES = 5  # presses after which what is still open counts as stuck
_DELAYS = ("hover_stationary_delay", "hover_delay_short", "hover_delay_normal")
_ERROR = "[imgui-error]"  # begins the lines of ImGui's log on what its callers do wrong
_MOST_ALIKE = 3  # rows of a list that are acted on: they are one widget, many times

Path = tuple[int, ...]  # ids of widgets, each of which opens what has the next one


class Walk:
    """A walk through the widgets that are there."""

    def __init__(
        self,
        context: engine.TestContext,
        windows: Collection[str] = (),
        presses: bool = True,
        skipped: Collection[str] = (),
        part: tuple[int, int] = (0, 1),
    ) -> None:
        """windows: the names of those that it begins with; none: all. presses: whether each widget is dragged
        and clicked as well. skipped: the names after "###" of those that are only hovered. part: its number
        and how many there are: each takes its share of the widgets that are there at first, and all that
        these bring."""
        self._seen: dict[int, str] = {}
        self._problems: list[str] = []
        self._windows, self._presses, self._skipped, self._part = windows, presses, skipped, part
        self._of_other_parts: set[int] = set()
        self._context = context
        self._ui = imgui.get_current_context()
        self._opened: dict[Path, int] = {}  # the popup that each opens

    def begin(self) -> None:
        """Go through all of it."""
        style = imgui.get_style()
        before = [getattr(style, name) for name in _DELAYS]
        for name in _DELAYS:
            setattr(style, name, 0.0)  # a frame on a widget is as long as any rest
        number, count = self._part
        there = [item for item in self._reachable(self._windows)] if count > 1 else []
        self._of_other_parts = {item for place, item in enumerate(there) if place % count != number}
        self._go_through(())
        for name, delay in zip(_DELAYS, before, strict=True):
            setattr(style, name, delay)

    def report(self, problem: str) -> str:
        """A `Report` of virtual_screen.py, as JSON. problem: of the engine, empty where there is none."""
        problems = self._problems + ([problem] if problem else [])
        return json.dumps([list(self._seen.values()), list(dict.fromkeys(problems))])

    def _go_through(self, path: Path) -> None:
        """Act on the widgets that are reached by clicks on a path of others, and on those that they open."""
        left: list[int] = []
        while self._reach(path):
            left = left or self._new(path)
            if not left:
                return
            item, before = left.pop(0), self._popups
            self._act(item)
            if self._popups and self._popups[-1] not in before:
                longer = (*path, item)
                self._opened[longer] = self._popups[-1]
                self._go_through(longer)

    def _new(self, path: Path) -> list[int]:
        """The widgets that nothing was done with, but for most of those that are alike."""
        found = []
        self._context.yield_(2)  # in which a popup that was opened appears
        for item in self._reachable(() if path else self._windows):
            if item not in self._seen and item not in self._of_other_parts:
                words = self._seen[item] = self._words(item)
                alike = sum(other == words for other in self._seen.values())
                if alike <= _MOST_ALIKE or words.endswith(": "):
                    found.append(item)
        return found

    def _act(self, item: int) -> None:
        """Hover, rest, drag and click."""
        context, before, words = self._context, self._popups, self._seen[item]
        print(f"walk: {words}", file=sys.stderr, flush=True)  # the last one, should the process end
        if not self._point_at(item):
            return
        self._look(words)
        if self._presses and not any(words.endswith(f"###{name}") for name in self._skipped):
            context.mouse_drag_with_delta(_DRAG)
            self._look(f"drag of {words}")
            if self._popups == before and self._point_at(item):
                context.mouse_click(0)
                self._look(f"click on {words}")

    def _point_at(self, item: int) -> bool:
        """Move the mouse to a widget; whether that is there."""
        info = self._info(item)
        if info is None:
            return False
        if info.rect_clipped.get_height() < 1 or info.rect_clipped.get_width() < 1:
            self._context.scroll_to_item_y(item)
            info = self._info(item)
        if info is not None:
            self._context.mouse_move_to_pos(info.rect_clipped.get_center())
        return info is not None

    def _look(self, words: str, frames: int = 2) -> None:
        """Let frames pass, and note what ImGui finds wrong in them."""
        for _ in range(frames):
            self._context.yield_()
            if (count := self._ui.hovered_id_previous_frame_item_count) > 1:
                self._note(f"{words}: {count} widgets have its id")
        log = self._ui.debug_log_buf
        for line in (log.begin() or "").splitlines():
            if _ERROR in line:
                self._note(f"{words}: {line}")
        log.clear()

    def _note(self, problem: str) -> None:
        self._problems.append(problem)
        print(f"walk: PROBLEM: {problem}", file=sys.stderr, flush=True)

    # --- what there is ----------------------------------------------------------------

    @property
    def _popups(self) -> tuple[int, ...]:
        """The ids of the popups that are open, the uppermost last."""
        stack = self._ui.open_popup_stack
        return tuple(stack[number].popup_id for number in range(stack.size()))

    def _reachable(self, windows: Collection[str]) -> Iterator[int]:
        """The widgets that the mouse reaches: of the uppermost popup, of all windows where none is open."""
        stack, there = self._ui.open_popup_stack, self._ui.windows
        if stack.size():
            roots = [stack[stack.size() - 1].window]
        else:
            roots = [there[number] for number in range(there.size())]
            roots = [one for one in roots if one.active and one.root_window.id_ == one.id_]
        for root in roots:
            if root is None or root.hidden or root.flags & imgui.WindowFlags_.tooltip:
                continue
            if not windows or root.name in windows:
                found = engine.TestItemList()
                self._context.gather_items(found, f"//{root.name}", 99)
                yield from [found.get_by_index(number).id_ for number in range(found.get_size())]
                if root.flags & imgui.WindowFlags_.menu_bar:
                    yield from self._in_bar(root)

    def _in_bar(self, window: imgui.internal.Window) -> Iterator[int]:
        """The menus of a bar, which the engine does not gather: what the mouse finds on its way along it."""
        bar = window.menu_bar_rect()
        em, middle = imgui.get_font_size(), bar.get_center().y
        x, last, found = bar.min.x + em, bar.min.x, []
        while x < min(last + 6 * em, bar.max.x):
            self._context.mouse_move_to_pos(ImVec2(x, middle))
            self._context.yield_()
            if (item := self._ui.hovered_id_previous_frame) and self._ui.hovered_window.id_ == window.id_:
                last = x
                found += [item] * (item not in found)
            x += 0.75 * em
        yield from found

    def _info(self, item: int) -> engine.TestItemInfo | None:
        """Where a widget is; None where it is not any more."""
        info = self._context.item_info(item, engine.TestOpFlags_.no_error)
        return info if info.id_ else None

    def _words(self, item: int) -> str:
        """The window and the label of a widget."""
        info, label = self._info(item), engine.find_item_debug_label(self._ui, item)
        return f"{info.window.name if info is not None and info.window is not None else ''}: {label}"

    # --- how to come there ------------------------------------------------------------

    def _reach(self, path: Path) -> bool:
        """Open what a path leads to; whether that is there."""
        wanted = self._opened.get(path)
        at_end = (wanted,) if wanted else ()
        if self._popups[-1:] == at_end:
            return True
        self._context.mouse_move_to_pos(
            imgui.get_io().display_size - ImVec2(1, 1)
        )  # off what opens by itself
        for _ in range(_ESCAPES):
            if self._popups:
                self._context.key_press(imgui.Key.escape)
                self._context.yield_(2)
        if self._popups:
            self._note(f"Escape does not close what {self._seen[path[-1]] if path else ''} opened")
            return False
        for item in path:
            if not self._point_at(item):
                return False
            self._context.mouse_click(0)
            self._context.yield_(3)
        return self._popups[-1:] == at_end
