"""Fonts and colours of the window.

Sizes are in heights of the font everywhere in the window, so that the display's scale and the user's
choice need nothing else.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import imgui_bundle
from imgui_bundle import ImVec2, ImVec4, imgui

from ..look import Look

_FONTS = Path(imgui_bundle.__file__).parent / "assets" / "fonts"
_FONT_SIZE = 16.0  # pixels at scale 1


@dataclass(frozen=True)
class Palette:
    """The colours of a theme, 0xRRGGBB.

    panel: behind everything. picture: behind the scan where the look leaves it to the theme, '#rrggbb'.
    frame: of fields, button, header: each also under the mouse and pressed. grab: what is dragged. accent:
    ticks, and what is switched on. cached, broken: frames of the timeline.
    """

    base: Callable[[], None]  # for what is not named here
    panel: int
    picture: str
    text: int
    faint: int
    popup: int
    line: int
    frame: tuple[int, int, int]
    button: tuple[int, int, int]
    header: tuple[int, int, int]
    grab: tuple[int, int]
    accent: int
    scroll: int
    cached: int
    broken: int

    @property
    def behind_text(self) -> tuple[int, ...]:
        """All that text stands on."""
        return self.panel, self.popup, *self.frame, *self.button, *self.header, *self.grab


PALETTES = {
    "dark": Palette(
        base=imgui.style_colors_dark, panel=0x24272D, picture=Look().background,
        text=0xE3E6EA, faint=0x969CA6, popup=0x2B2F36,
        line=0x3A3F48, frame=(0x33383F, 0x3D434C, 0x464D58), button=(0x363C45, 0x454D59, 0x2C6A99),
        header=(0x2E333A, 0x3B424C, 0x44505F), grab=(0x2A6796, 0x2C6A99), accent=0x6FB4E6,
        scroll=0x565E6A, cached=0x4A6B86, broken=0xD2544B,
    ),
    "light": Palette(
        base=imgui.style_colors_light, panel=0xF1F3F5, picture="#e2e6ea",
        text=0x1E2329, faint=0x5C646F, popup=0xFFFFFF,
        line=0xC9CED5, frame=(0xDDE1E6, 0xD2D8DF, 0xC5CDD6), button=(0xDADFE5, 0xCBD2DA, 0x8FC1E6),
        header=(0xE2E6EA, 0xD3DAE1, 0xC3D3E2), grab=(0x7DB4DE, 0x8FC1E6), accent=0x1F6FAB,
        scroll=0xA9B1BC, cached=0x8FB3D1, broken=0xC43C33,
    ),
}  # fmt: skip
DEFAULT = "dark"
TEXT_SCALES = (0.75, 0.85, 1.0, 1.15, 1.35, 1.6, 2.0)  # to choose from


def themed(look: Look, palette: Palette) -> Look:
    """The look on the background of the palette, where it has that of any."""
    return replace(look, background=palette.picture) if leaves_background(look) else look


def leaves_background(look: Look) -> bool:
    """Whether a look leaves its background to the theme."""
    return look.background in (palette.picture for palette in PALETTES.values())


def set_sizes(scale: float) -> None:
    """Set the sizes of text and widgets of the current ImGui context.

    scale: of the display, times the user's choice.
    """
    sizes = imgui.Style()  # scaling again what was scaled before would add up roundings
    sizes.window_padding = ImVec2(12, 10)
    sizes.frame_padding = ImVec2(7, 4)
    sizes.item_spacing = ImVec2(8, 6)
    sizes.window_border_size = 1
    sizes.frame_rounding = sizes.grab_rounding = sizes.popup_rounding = sizes.window_rounding = 4
    sizes.scrollbar_size = 11
    sizes.scale_all_sizes(scale)
    sizes.font_size_base = _FONT_SIZE
    sizes.font_scale_dpi = scale
    style = imgui.get_style()
    for name in dir(sizes):
        if isinstance(value := getattr(sizes, name), float | ImVec2):
            setattr(style, name, value)


def set_colors(palette: Palette) -> None:
    """Set the colours of the current ImGui context."""
    palette.base()
    style, entry = imgui.get_style(), imgui.Col_
    for where, color in (
        (entry.window_bg, palette.panel), (entry.scrollbar_bg, palette.panel),
        (entry.menu_bar_bg, palette.panel),
        (entry.text, palette.text), (entry.text_disabled, palette.faint), (entry.popup_bg, palette.popup),
        (entry.border, palette.line), (entry.separator, palette.line), (entry.check_mark, palette.accent),
        (entry.scrollbar_grab, palette.scroll), (entry.scrollbar_grab_hovered, palette.faint),
        (entry.scrollbar_grab_active, palette.faint),
        (entry.title_bg, palette.header[0]), (entry.title_bg_active, palette.header[2]),
        (entry.title_bg_collapsed, palette.header[0]),
        (entry.separator_hovered, palette.accent), (entry.separator_active, palette.accent),
        (entry.resize_grip, palette.line), (entry.resize_grip_hovered, palette.accent),
        (entry.resize_grip_active, palette.accent),
        (entry.tab, palette.frame[0]), (entry.tab_hovered, palette.header[1]),
        (entry.tab_selected, palette.header[2]), (entry.tab_selected_overline, palette.accent),
        (entry.tab_dimmed, palette.frame[0]), (entry.tab_dimmed_selected, palette.header[2]),
        (entry.tab_dimmed_selected_overline, palette.line),
        (entry.table_header_bg, palette.header[0]), (entry.table_border_strong, palette.line),
        (entry.table_border_light, palette.line),
        (entry.text_link, palette.accent), (entry.text_selected_bg, palette.button[2]),
        (entry.input_text_cursor, palette.text), (entry.nav_cursor, palette.accent),
        (entry.checkbox_selected_bg, palette.frame[0]), (entry.tree_lines, palette.line),
        (entry.plot_histogram, palette.grab[0]), (entry.plot_histogram_hovered, palette.grab[1]),
        (entry.drag_drop_target, palette.accent), (entry.unsaved_marker, palette.accent),
        *zip((entry.frame_bg, entry.frame_bg_hovered, entry.frame_bg_active), palette.frame, strict=True),
        *zip((entry.button, entry.button_hovered, entry.button_active), palette.button, strict=True),
        *zip((entry.header, entry.header_hovered, entry.header_active), palette.header, strict=True),
        *zip((entry.slider_grab, entry.slider_grab_active), palette.grab, strict=True),
    ):  # fmt: skip
        style.set_color_(where, ImVec4(*rgb(color), 1.0))
    for where, color, alpha in (
        (entry.child_bg, 0, 0.0), (entry.border_shadow, 0, 0.0), (entry.table_row_bg, 0, 0.0),
        (entry.table_row_bg_alt, palette.text, 0.05), (entry.modal_window_dim_bg, 0, 0.45),
        (entry.drag_drop_target_bg, 0, 0.0),
    ):  # fmt: skip
        style.set_color_(where, ImVec4(*rgb(color), alpha))


def rgb(color: int) -> tuple[float, float, float]:
    """The channels of 0xRRGGBB, 0..1."""
    return (color >> 16) / 255, (color >> 8 & 255) / 255, (color & 255) / 255


def mixed(one: int, other: int, share: float) -> int:
    """A color between two, 0xRRGGBB. share: of the other, 0..1."""
    channels = (round(255 * (a + (b - a) * share)) for a, b in zip(rgb(one), rgb(other), strict=True))
    red, green, blue = channels
    return red << 16 | green << 8 | blue


def packed(color: int, alpha: float = 1.0) -> int:
    """0xRRGGBB as ImGui's draw lists take it."""
    return imgui.color_convert_float4_to_u32(ImVec4(*rgb(color), alpha))


def add_fonts() -> None:
    """The fonts of the current ImGui context."""
    fonts = imgui.get_io().fonts
    fonts.add_font_from_file_ttf(str(_FONTS / "Roboto" / "Roboto-Regular.ttf"), _FONT_SIZE)
    icons = imgui.ImFontConfig()
    icons.merge_mode = True
    fonts.add_font_from_file_ttf(str(_FONTS / "Font_Awesome_6_Free-Solid-900.otf"), 0.85 * _FONT_SIZE, icons)
