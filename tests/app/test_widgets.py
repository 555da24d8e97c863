"""What widgets show of names that a user gave."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

pytest.importorskip("imgui_bundle")

from imgui_bundle import imgui

from viewer.app import theme
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
