"""The panel's section on how the picture was made: what was drawn, and how long it took."""

from __future__ import annotations

from dataclasses import dataclass

from imgui_bundle import imgui

from ...backends import backend
from ...drawing.renderer import Renderer
from ...picture.stats import Stats
from .. import widgets
from ..part import Section, WindowPart
from ..playing.ahead import Ahead
from ..playing.playback import Playback
from ..scene.activity import Activity
from ..scene.counting import Counting, words
from ..scene.viewport import Viewport
from ..ui import Ui


@dataclass(eq=False)
class StatisticsSection(WindowPart):
    """The section."""

    name = "statistics_section"
    SECTION = Section("Statistics", 60, is_open=False)
    playback: Playback
    viewport: Viewport
    renderer: Renderer
    ahead: Ahead
    counting: Counting
    activity: Activity

    def panel(self, ui: Ui) -> None:
        """Declare it."""
        timers, viewport, surface = self.renderer.gpu.timers, self.viewport, self.viewport.surface
        timers.enabled = imgui.checkbox("Time each pass", timers.enabled)[1]
        widgets.tooltip("Measure the time of each drawing pass; this slows drawing a little")
        if surface is None or not viewport.is_there:
            return
        stats, (width, height) = surface.stats, surface.size
        for name, number in words(viewport, self.counting.counts):
            widgets.fact(name, number)
        widgets.fact("Picture", f"{width} x {height}, {backend(stats.backend).title}")
        widgets.fact("Samples per pixel", str(stats.samples))
        if self.playback.player.playing:
            held = f"{self.renderer.held_bytes / 1e6:,.0f} MB"
            widgets.fact(
                "Frames ahead",
                f"{self.ahead.ready} ready, {self.renderer.work.unfinished} in progress, {held}",
            )
        for name, choice in stats.chosen.items():
            widgets.fact(name.capitalize(), choice)
        rate = f", {viewport.rate:.0f} fps" if self.activity.is_moving else ""
        widgets.fact("Time", _times(stats) + rate)
        for name, milliseconds in stats.passes:
            widgets.fact(f"  {name}", f"{milliseconds:.2f} ms")


def _times(stats: Stats) -> str:
    upload = f" (upload {stats.upload_ms:.1f})" if stats.upload_ms >= 0.1 else ""
    return f"{stats.cpu_ms:.1f} ms{upload}"
