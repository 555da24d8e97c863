"""What Escape ends: one thing a press, the uppermost first."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from . import tasks

if TYPE_CHECKING:
    from .app import App

_OWNER = 1  # of the key: any number


def handle(app: App) -> None:
    """End the first of what goes on where Escape was pressed. A field or a drag that is held has it first."""
    if not imgui.is_key_pressed(imgui.Key.escape, repeat=False):
        return
    if imgui.is_popup_open("", imgui.PopupFlags_.any_popup):
        if not imgui.get_io().want_text_input:
            _close_list()
    elif not imgui.is_any_item_active():
        next(end for goes_on, end in _takers(app) if goes_on)()


def _close_list() -> None:
    """Close the uppermost list, menu or colour picker. A dialog looks for Escape itself."""
    popups = imgui.get_current_context().open_popup_stack
    last = popups.size() - 1
    top = popups[last].window
    if top is not None and not top.flags & imgui.WindowFlags_.modal:
        imgui.internal.close_popup_to_level(last, True)
        # So that the dialog below does not see it as well.
        lock = imgui.internal.InputFlagsPrivate_.lock_this_frame
        imgui.internal.set_key_owner(imgui.Key.escape, _OWNER, lock)


def _takers(app: App) -> Iterator[tuple[bool, Callable[[], object]]]:
    """(whether it goes on, what ends it), in their order."""
    yield app.help.focused is not None, app.help.close_focused
    yield app.measuring.active, app.measuring.toggle
    yield app.capture.replaying is not None, app.capture.stop_replaying
    lightly = tasks.end_by_escape(app)
    yield bool(lightly), lambda: app.cancel(lightly[-1])
    yield app.full_view.is_on, app.full_view.leave
    yield True, app.notices.dismiss
