"""Fonts and colours of the window."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import imgui_bundle
from imgui_bundle import ImVec2, ImVec4, imgui

_FONTS = Path(imgui_bundle.__file__).parent / "assets" / "fonts"
_FONT_SIZE = 16.0  # pixels at scale 1


@dataclass(frozen=True)
class Palette:
    """The colours of a theme, 0xRRGGBB.

    panel: behind everything. frame: of fields, button, header: each also under the mouse and
    pressed. grab: what is dragged. accent: ticks, and what is switched on. cached, broken:
    frames of the timeline.
    """

    base: Callable[[], None]  # for what is not named here
    panel: int
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
        base=imgui.style_colors_dark, panel=0x24272D, text=0xE3E6EA, faint=0x969CA6, popup=0x2B2F36,
        line=0x3A3F48, frame=(0x33383F, 0x3D434C, 0x464D58), button=(0x363C45, 0x454D59, 0x2C6A99),
        header=(0x2E333A, 0x3B424C, 0x44505F), grab=(0x2A6796, 0x2C6A99), accent=0x6FB4E6,
        scroll=0x565E6A, cached=0x4A6B86, broken=0xD2544B,
    ),
    "light": Palette(
        base=imgui.style_colors_light, panel=0xF1F3F5, text=0x1E2329, faint=0x5C646F, popup=0xFFFFFF,
        line=0xC9CED5, frame=(0xDDE1E6, 0xD2D8DF, 0xC5CDD6), button=(0xDADFE5, 0xCBD2DA, 0x8FC1E6),
        header=(0xE2E6EA, 0xD3DAE1, 0xC3D3E2), grab=(0x7DB4DE, 0x8FC1E6), accent=0x1F6FAB,
        scroll=0xA9B1BC, cached=0x8FB3D1, broken=0xC43C33,
    ),
}  # fmt: skip
DEFAULT = "dark"


def apply(scale: float) -> None:
    """Set fonts, sizes and the default colours of the current ImGui context. scale: of the display."""
    _add_fonts()
    style = imgui.get_style()
    style.window_padding = ImVec2(12, 10)
    style.frame_padding = ImVec2(7, 4)
    style.item_spacing = ImVec2(8, 6)
    style.window_border_size = 0
    style.frame_rounding = style.grab_rounding = style.popup_rounding = 4
    style.scrollbar_size = 11
    style.scale_all_sizes(scale)
    style.font_size_base = _FONT_SIZE
    style.font_scale_dpi = scale
    set_colors(PALETTES[DEFAULT])


def set_colors(palette: Palette) -> None:
    """Set the colours of the current ImGui context."""
    palette.base()
    style, entry = imgui.get_style(), imgui.Col_
    for where, color in (
        (entry.window_bg, palette.panel), (entry.scrollbar_bg, palette.panel),
        (entry.text, palette.text), (entry.text_disabled, palette.faint), (entry.popup_bg, palette.popup),
        (entry.border, palette.line), (entry.separator, palette.line), (entry.check_mark, palette.accent),
        (entry.scrollbar_grab, palette.scroll),
        *zip((entry.frame_bg, entry.frame_bg_hovered, entry.frame_bg_active), palette.frame, strict=True),
        *zip((entry.button, entry.button_hovered, entry.button_active), palette.button, strict=True),
        *zip((entry.header, entry.header_hovered, entry.header_active), palette.header, strict=True),
        *zip((entry.slider_grab, entry.slider_grab_active), palette.grab, strict=True),
    ):  # fmt: skip
        style.set_color_(where, ImVec4(*rgb(color), 1.0))
    style.set_color_(entry.child_bg, ImVec4(0, 0, 0, 0))


def rgb(color: int) -> tuple[float, float, float]:
    """The channels of 0xRRGGBB, 0..1."""
    return (color >> 16) / 255, (color >> 8 & 255) / 255, (color & 255) / 255


def packed(color: int, alpha: float = 1.0) -> int:
    """0xRRGGBB as ImGui's draw lists take it."""
    return imgui.color_convert_float4_to_u32(ImVec4(*rgb(color), alpha))


def _add_fonts() -> None:
    fonts = imgui.get_io().fonts
    fonts.add_font_from_file_ttf(str(_FONTS / "Roboto" / "Roboto-Regular.ttf"), _FONT_SIZE)
    icons = imgui.ImFontConfig()
    icons.merge_mode = True
    fonts.add_font_from_file_ttf(str(_FONTS / "fontawesome-webfont.ttf"), 0.85 * _FONT_SIZE, icons)
