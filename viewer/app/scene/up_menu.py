"""The button below the orientation cube that turns a scan upright: it names what is up, and drops the other
axes while the mouse is on it."""

from __future__ import annotations

from collections.abc import Callable

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ...geometry import AXES
from .. import widgets
from .cube import OrientationCube, cube_position
from .steering import Steering

_MENU = "turn upright"
_ALSO_BELOW_LISTS = imgui.HoveredFlags_.allow_when_blocked_by_popup.value
_BELOW = 2.02  # the button's top, in distances of the cube's centre from the edges of the view


def declare(cube: OrientationCube, up: str, size: ImVec2, pick: Callable[[], object]) -> bool:
    """Declare the button in the current ImGui window, before the view; whether the mouse is on it.

    up: the scan's. size: of the view. pick: has the next click tell what is up.
    """
    em = imgui.get_font_size()
    where = cube_position(size.x, size.y, em)
    if where is None:
        return False
    text = f"Up: {up if up in AXES else 'custom'} {icons.ICON_FA_CARET_DOWN}"
    width = imgui.calc_text_size(text).x + 2 * imgui.get_style().frame_padding.x
    inset, before = size.x - where[0], imgui.get_cursor_pos()
    imgui.set_cursor_pos(ImVec2(min(where[0] - width / 2, size.x - width - 0.3 * em), _BELOW * inset))
    imgui.push_style_color(imgui.Col_.button, imgui.get_color_u32(imgui.Col_.button, 0.6))
    is_pressed = imgui.button(widgets.labelled(text, "up"))
    imgui.pop_style_color()
    came, cube.on_up = not cube.on_up, imgui.is_item_hovered(_ALSO_BELOW_LISTS)
    if is_pressed or (imgui.is_item_hovered() and came):  # not again while the mouse rests there
        imgui.open_popup(_MENU)
    is_hovered, low, high = imgui.is_item_hovered(), imgui.get_item_rect_min(), imgui.get_item_rect_max()
    imgui.set_cursor_pos(before)
    imgui.set_next_window_pos(ImVec2(high.x, high.y), imgui.Cond_.always, ImVec2(1, 0))
    if imgui.begin_popup(_MENU):
        _draw_choices(cube.steering, pick)
        corner, extent = imgui.get_window_pos(), imgui.get_window_size()
        near = ImVec2(min(low.x, corner.x) - em, low.y - em), corner + extent + ImVec2(em, em)
        # As it appears, its size is not known yet.
        if not (imgui.is_window_appearing() or imgui.is_mouse_hovering_rect(*near, False)):
            imgui.close_current_popup()
        imgui.end_popup()
    return is_hovered


def _draw_choices(steering: Steering, pick: Callable[[], object]) -> None:
    for title, act, is_on in steering.ups():
        if imgui.menu_item(widgets.labelled(f"{title} is up", title), "", is_on)[0]:
            act()
    imgui.separator()
    if imgui.menu_item("Set current view as front###front", "", False)[0]:
        steering.set_front()
    if imgui.menu_item("Set up from a surface...###pick", "", False)[0]:
        pick()
