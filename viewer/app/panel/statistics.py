"""The panel's section on how the picture was made: what was drawn, and how long it took."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from ...backends import backend
from .. import widgets
from ..scene import counting

if TYPE_CHECKING:
    from ...gpu.timers import Timers
    from ...picture.stats import Stats
    from ..scene.viewport import Viewport


def draw(
    viewport: Viewport,
    timers: Timers,
    counts: Mapping[str, int] | None,
    rows: Iterable[tuple[str, str]],
    is_moving: bool,
) -> None:
    """Declare the section. counts: of points, see `counting`. rows: others to tell. is_moving: whether
    pictures come one after the other."""
    timers.enabled = imgui.checkbox("Time each pass", timers.enabled)[1]
    widgets.tooltip("Measure the time of each drawing pass; this slows drawing a little")
    surface = viewport.surface
    if surface is None or not viewport.is_there:
        return
    for name, number in counting.words(viewport, counts):
        widgets.fact(name, number)
    widgets.fact("Picture", f"{surface.size[0]} x {surface.size[1]}, {backend(surface.stats.backend).title}")
    widgets.fact("Samples per pixel", str(surface.stats.samples))
    for name, text in rows:
        widgets.fact(name, text)
    for name, choice in surface.stats.chosen.items():
        widgets.fact(name.capitalize(), choice)
    rate = f", {viewport.rate:.0f} fps" if is_moving else ""
    widgets.fact("Time", _times(surface.stats) + rate)
    for name, milliseconds in surface.stats.passes:
        widgets.fact(f"  {name}", f"{milliseconds:.2f} ms")


def _times(stats: Stats) -> str:
    upload = f" (upload {stats.upload_ms:.1f})" if stats.upload_ms >= 0.1 else ""
    return f"{stats.cpu_ms:.1f} ms{upload}"
