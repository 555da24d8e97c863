"""What Escape ends: one thing a press, the uppermost first.

From the top: a list, menu or submenu; a dialog or a page of the help, with the field in it; a field or drag
elsewhere; the keyboard in another part of the window; the tool that has the clicks; a replay; a message over
the view; a scan that is being opened; the view alone. Work in the status bar is never ended by Escape.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from imgui_bundle import imgui

_OWNER = 1  # of the key: any number


def handle(enders: Iterable[Callable[[], bool]]) -> None:
    """End the first of what goes on where Escape was pressed. A field or a drag that is held has it first.

    enders: each ends one thing, and tells whether there was any.
    """
    was_held = imgui.get_current_context().active_id_previous_frame != 0
    if not (was_held or imgui.is_any_item_active()):
        imgui.internal.set_key_owner(imgui.Key.escape, _OWNER)  # else ImGui ends something by itself
    if not imgui.is_key_pressed(imgui.Key.escape, repeat=False):
        return
    if imgui.is_popup_open("", imgui.PopupFlags_.any_popup):
        if not imgui.get_io().want_text_input:
            _close_list()
    elif not (was_held or imgui.is_any_item_active()):
        any(end() for end in enders)


def _close_list() -> None:
    """Close the uppermost list, menu or colour picker. A dialog looks for Escape itself."""
    popups = imgui.get_current_context().open_popup_stack
    last = popups.size() - 1
    top = popups[last].window
    if top is not None and not top.flags & imgui.WindowFlags_.modal:
        imgui.internal.close_popup_to_level(last, True)
        # Else a mouse that rests on the submenu's title would open it again at once.
        imgui.get_current_context().nav_highlight_item_under_nav = True
        # So that the dialog below does not see it as well.
        lock = imgui.internal.InputFlagsPrivate_.lock_this_frame
        imgui.internal.set_key_owner(imgui.Key.escape, _OWNER, lock)
