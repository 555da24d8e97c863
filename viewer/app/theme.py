"""Fonts and colours of the window."""

from __future__ import annotations

from pathlib import Path

import imgui_bundle
from imgui_bundle import ImVec2, ImVec4, imgui

_FONTS = Path(imgui_bundle.__file__).parent / "assets" / "fonts"
_FONT_SIZE = 16.0  # pixels at scale 1

PANEL = 0x24272D  # 0xRRGGBB
_COLORS = {
    imgui.Col_.text: 0xE3E6EA,
    imgui.Col_.text_disabled: 0x969CA6,
    imgui.Col_.popup_bg: 0x2B2F36,
    imgui.Col_.border: 0x3A3F48,
    imgui.Col_.frame_bg: 0x33383F,
    imgui.Col_.frame_bg_hovered: 0x3D434C,
    imgui.Col_.frame_bg_active: 0x464D58,
    imgui.Col_.button: 0x363C45,
    imgui.Col_.button_hovered: 0x454D59,
    imgui.Col_.button_active: 0x2F7DB8,
    imgui.Col_.header: 0x2E333A,
    imgui.Col_.header_hovered: 0x3B424C,
    imgui.Col_.header_active: 0x44505F,
    imgui.Col_.slider_grab: 0x4C9BD6,
    imgui.Col_.slider_grab_active: 0x6FB4E6,
    imgui.Col_.check_mark: 0x6FB4E6,
    imgui.Col_.scrollbar_bg: PANEL,
    imgui.Col_.scrollbar_grab: 0x464D58,
    imgui.Col_.separator: 0x3A3F48,
}


def apply(scale: float) -> None:
    """Set fonts, sizes and colours of the current ImGui context. scale: of the display."""
    _add_fonts()
    style = imgui.get_style()
    imgui.style_colors_dark()
    for entry, color in _COLORS.items():
        style.set_color_(entry, ImVec4(*rgb(color), 1.0))
    style.set_color_(imgui.Col_.child_bg, ImVec4(0, 0, 0, 0))
    style.window_padding = ImVec2(12, 10)
    style.frame_padding = ImVec2(7, 4)
    style.item_spacing = ImVec2(8, 6)
    style.window_border_size = 0
    style.frame_rounding = style.grab_rounding = style.popup_rounding = 4
    style.scrollbar_size = 11
    style.scale_all_sizes(scale)
    style.font_size_base = _FONT_SIZE
    style.font_scale_dpi = scale


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
