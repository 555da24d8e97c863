"""What widgets show of names that a user gave."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

pytest.importorskip("imgui_bundle")

from imgui_bundle import imgui

from viewer.app import theme, widgets
from viewer.app.widgets import unhidden


@pytest.fixture
def font() -> Iterator[None]:
    context = imgui.create_context()
    imgui.get_io().set_ini_filename("")
    imgui.get_io().backend_flags |= imgui.BackendFlags_.renderer_has_textures.value
    imgui.get_io().display_size = imgui.ImVec2(100, 100)
    theme.add_fonts()
    imgui.new_frame()
    yield
    imgui.end_frame()
    imgui.destroy_context(context)


@pytest.mark.usefixtures("font")
@pytest.mark.parametrize("name", ["lip", "lip #2", "lip##left", "###", "##", "a###b##"])
def test_labels_show_all_of_a_name(name: str) -> None:
    shown = imgui.calc_text_size(f"{unhidden(name)}##id", hide_text_after_double_hash=True)
    assert shown.x == imgui.calc_text_size(name).x
    assert "##" not in unhidden(name)


@pytest.mark.usefixtures("font")
@pytest.mark.parametrize("text", ["Up", "Edge shading (eye-dome)"])
@pytest.mark.parametrize("indents", [0, 2])
def test_no_widget_lies_over_the_label_of_its_row(text: str, indents: int) -> None:
    imgui.set_next_window_size(imgui.ImVec2(20 * imgui.get_font_size(), 100))
    imgui.begin("window")
    for _ in range(indents):
        imgui.indent()
    left = imgui.get_cursor_screen_pos().x
    widgets.label(text)
    imgui.button("widget")
    assert imgui.get_item_rect_min().x >= left + imgui.calc_text_size(text).x
    imgui.end()


@pytest.mark.usefixtures("font")
@pytest.mark.parametrize("name", ["Time", "Samples per pixel"])
def test_no_value_lies_over_the_name_of_its_fact(name: str) -> None:
    imgui.set_next_window_size(imgui.ImVec2(20 * imgui.get_font_size(), 100))
    imgui.begin("window")
    left = imgui.get_cursor_screen_pos().x
    widgets.fact(name, "5")
    assert imgui.get_item_rect_min().x > left + imgui.calc_text_size(name).x
    imgui.end()
