"""Everything in the panels can be read, in every theme."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("imgui_bundle")

from viewer.app.theme import PALETTES, Palette, rgb


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
