"""The panel at the right: sections, one below the other, what a user asks first at the top."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from imgui_bundle import ImVec2, imgui

from ...document.schema import Kind, ReadBy, is_object
from .. import widgets
from ..ui import Ui
from . import appearance, renderer, statistics, views
from .scan import ScanSection

if TYPE_CHECKING:
    from ..app import App

NARROWEST, WIDEST = 14.0, 60.0  # in heights of the font
PanelWidth = Annotated[float, Kind("a width of the panel", lambda width: NARROWEST <= width <= WIDEST)]


def _read_sections(data: Any) -> dict[str, bool]:
    """Whether sections are open, by name; what is something else is left out."""
    values = data.items() if is_object(data) else ()
    return {name: value for name, value in values if isinstance(value, bool)}


@dataclass(frozen=True)
class PanelChoices:
    """The choices about the panel that outlive the window. width: in heights of the font. sections: whether
    each is open, by name, where that was changed."""

    width: PanelWidth = 21.0
    sections: Annotated[Mapping[str, bool], ReadBy(_read_sections)] = field(default_factory=dict)


class Panel:
    """The panel: how wide it is, and which of its sections are open."""

    def __init__(self, chosen: PanelChoices) -> None:
        self.width = chosen.width
        self._opened = dict(chosen.sections)

    @property
    def chosen(self) -> PanelChoices:
        """The choices that are to come back at the next start."""
        return PanelChoices(self.width, dict(self._opened))

    def draw_grip(self, height: float) -> None:
        """Declare what resizes the panel, in a window of its own at the panel's left edge: a drag does, a
        double click brings the usual width back."""
        imgui.invisible_button("##grip", ImVec2(max(imgui.get_content_region_avail().x, 1), max(height, 1)))
        if imgui.is_item_hovered() or imgui.is_item_active():
            imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ew)
        if imgui.is_item_hovered() and imgui.is_mouse_double_clicked(imgui.MouseButton_.left):
            self.width = PanelChoices().width
        elif imgui.is_item_active():
            dragged = imgui.get_io().mouse_delta.x / imgui.get_font_size()
            self.width = min(max(self.width - dragged, NARROWEST), WIDEST)

    def draw(self, app: App) -> None:
        """Declare the panel in the current ImGui window."""
        imgui.begin_child("settings", window_flags=app.keyboard.flags("panel"))
        app.keyboard.take("panel")
        pose, ui = app.playback.pose, Ui(app.keys)
        about = ScanSection(app.scans, app.session, app.playback, app.pacing, app.steering, app.keys)
        self._section("Scan", about.draw)
        if pose is not None:
            for title, is_revealed, declare in app.tools.sections():
                self._section(title, partial(declare, ui), is_revealed=is_revealed)
            viewport, scale = app.viewport, app.playback.scale
            self._section(
                "Appearance",
                lambda: appearance.draw(app.session, app.rendering, viewport, scale, pose, ui),
            )
            self._section("Views", lambda: views.draw(app.steering, app.document.camera, app.bookmarks, ui))
            self._section(
                "Renderer",
                lambda: renderer.draw(app.session, app.rendering, app.choosing, scale, pose),
            )
            self._section("Statistics", lambda: self._draw_statistics(app), is_open=False)
        imgui.end_child()

    def _draw_statistics(self, app: App) -> None:
        rows = []
        if app.playback.player.playing:
            held = f"{app.renderer.held_bytes / 1e6:,.0f} MB"
            rows = [("Ahead", f"{app.ahead.ready} ready, {app.renderer.unfinished} begun, {held}")]
        statistics.draw(app.viewport, app.renderer.gpu.timers, app.counting.counts, rows, app.moving)

    def _section(
        self, title: str, declare: Callable[[], object], *, is_open: bool = True, is_revealed: bool = False
    ) -> None:
        """Declare a section. is_open: at first. is_revealed: whether to open it and scroll to its end."""
        name = title.rpartition("###")[2]
        was_open = is_revealed or self._opened.get(name, is_open)
        imgui.set_next_item_open(was_open)
        shows = imgui.collapsing_header(title)
        if shows != is_open or name in self._opened:
            self._opened[name] = shows
        if shows:
            imgui.push_id(widgets.unhidden(name))  # what other sections declare may have the same labels
            declare()
            imgui.pop_id()
            if is_revealed:
                imgui.set_scroll_here_y(1.0)
