"""Everything in the panels can be read, in every theme."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("imgui_bundle")

from imgui_bundle import ImVec2, icons_fontawesome_6, imgui

from viewer import app
from viewer.app import theme
from viewer.app.scene import cube
from viewer.app.theme import PALETTES, Palette, rgb

# What the window never shows: docking, plots, windows chosen by Ctrl+Tab.
UNUSED = re.compile("docking_.*|plot_lines.*|nav_windowing_.*|count")


@pytest.fixture
def context() -> Iterator[Any]:
    context = imgui.create_context()
    yield context
    imgui.destroy_context(context)


def luminance(color: int) -> float:
    """Relative luminance, WCAG 2.1."""
    channels = np.array(rgb(color))
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def contrast(one: int, other: int) -> float:
    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


def test_contrast_is_that_of_wcag() -> None:
    assert contrast(0x000000, 0xFFFFFF) == pytest.approx(21)
    assert contrast(0x767676, 0xFFFFFF) == pytest.approx(4.54, abs=0.01)


@pytest.mark.parametrize("palette", PALETTES.values(), ids=PALETTES)
def test_text_has_a_contrast_of_4_5(palette: Palette) -> None:
    """WCAG 2.1, 1.4.3; faint text stands on panels only."""
    assert min(contrast(palette.text, color) for color in palette.behind_text) >= 4.5
    assert contrast(palette.faint, palette.panel) >= 4.5
    assert contrast(palette.faint, palette.popup) >= 4.5


@pytest.mark.parametrize("palette", PALETTES.values(), ids=PALETTES)
def test_what_is_switched_on_and_the_playhead_have_a_contrast_of_3(palette: Palette) -> None:
    """WCAG 2.1, 1.4.11."""
    behind = *palette.frame, *palette.button[:2]
    assert min(contrast(palette.accent, color) for color in behind) >= 3
    assert min(contrast(palette.text, color) for color in (palette.frame[0], palette.cached)) >= 3
    assert contrast(palette.broken, palette.frame[0]) >= 2.5
    assert contrast(palette.cached, palette.frame[0]) >= 1.5


def test_the_light_theme_is_light() -> None:
    assert luminance(PALETTES["light"].panel) > 0.8 > 0.1 > luminance(PALETTES["dark"].panel)


@pytest.mark.parametrize("palette", PALETTES.values(), ids=PALETTES)
def test_no_color_is_left_to_imgui(palette: Palette, context: Any) -> None:
    theme.set_colors(palette)
    named = {0, *palette.behind_text, *(v for v in vars(palette).values() if isinstance(v, int))}
    entries = [entry for entry in imgui.Col_ if not UNUSED.fullmatch(entry.name)]
    assert len(entries) > 40
    for entry in entries:
        color = imgui.get_style().color_(entry)
        rounded = sum(
            round(255 * c) << shift for c, shift in zip((color.x, color.y, color.z), (16, 8, 0), strict=True)
        )
        assert rounded in named, entry.name


@pytest.mark.parametrize("palette", PALETTES.values(), ids=PALETTES)
def test_text_on_the_faces_of_the_cube_has_a_contrast_of_4_5(palette: Palette) -> None:
    for shade in np.linspace(0, cube.SHADE, 5):
        assert contrast(palette.text, theme.mixed(palette.button[0], 0, shade)) >= 4.5


def test_mixed_colors_lie_between() -> None:
    assert theme.mixed(0x102030, 0xFFFFFF, 0) == 0x102030
    assert theme.mixed(0x102030, 0xFFFFFF, 1) == 0xFFFFFF
    assert theme.mixed(0x000000, 0x0000FF, 0.5) == 0x000080


def test_sizes_follow_the_scale_and_come_back(context: Any) -> None:
    """Whatever was set between: roundings do not add up."""

    def sizes() -> list[Any]:
        style = imgui.get_style()
        values = [getattr(style, name) for name in dir(style)]
        return [(v.x, v.y) if isinstance(v, ImVec2) else v for v in values if isinstance(v, float | ImVec2)]

    theme.set_sizes(1.0)
    usual = sizes()
    for scale in theme.TEXT_SCALES:
        theme.set_sizes(scale)
        assert imgui.get_style().font_scale_dpi == pytest.approx(scale)
        assert imgui.get_style().window_padding.x == int(12 * scale)
    theme.set_sizes(1.0)
    assert sizes() == usual


def test_every_icon_of_the_window_is_in_its_font(context: Any) -> None:
    theme.add_fonts()
    font = imgui.get_io().fonts.fonts[0]
    sources = [path.read_text(encoding="utf-8") for path in Path(app.__file__).parent.rglob("*.py")]
    names = {name for source in sources for name in re.findall(r"ICON_FA_\w+", source)}
    assert len(names) > 8
    missing = {name for name in names if not font.is_glyph_in_font(ord(getattr(icons_fontawesome_6, name)))}
    assert missing == set()
