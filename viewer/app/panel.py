"""The panel at the right: scan, renderer, projection, look, statistics."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from imgui_bundle import ImVec2, imgui

from ..backends import backend, backends
from ..camera import PROJECTIONS
from ..look import COLOR_BY
from . import widgets

if TYPE_CHECKING:
    from ..gpu.surface import Stats
    from ..scan.pose import Pose
    from .app import App

_STATISTICS_ROWS = 4  # without the passes


def draw(app: App) -> None:
    """Declare the panel in the current ImGui window."""
    passes = len(app.picture.surface.stats.passes) if app.picture.surface else 0
    rows = imgui.get_text_line_height_with_spacing() * (_STATISTICS_ROWS + passes)
    head = imgui.get_frame_height_with_spacing() + 2 * imgui.get_style().item_spacing.y
    imgui.begin_child("settings", ImVec2(0, -head - rows))
    if len(app.scans) > 1:
        _draw_scans(app)
    pose = app.playback.pose
    if pose is not None:
        if _section("Renderer"):
            _draw_renderer(app, pose)
        if _section("Look"):
            choices = {"color_by": [*COLOR_BY, *pose.cloud.scalars]}
            app.session.look = widgets.edit(app.session.look, choices)
            _draw_projection(app)
    imgui.end_child()
    imgui.separator()
    _draw_statistics(app)


def _section(title: str, is_open: bool = True) -> bool:
    return imgui.collapsing_header(title, imgui.TreeNodeFlags_.default_open.value if is_open else 0)


def _draw_scans(app: App) -> None:
    imgui.begin_disabled(app.opening is not None)
    imgui.set_next_item_width(-1)
    chosen = widgets.choose("scan", app.session.scan, app.scans, {s: Path(s).name for s in app.scans})
    imgui.set_item_tooltip(app.session.scan)
    imgui.end_disabled()
    if chosen != app.session.scan:
        app.open(chosen)


def _draw_renderer(app: App, pose: Pose) -> None:
    session = app.session
    name, _ = session.chosen(pose)
    imgui.set_next_item_width(-1)
    chosen = widgets.choose("backend", name, list(backends()), {n: b.title for n, b in backends().items()})
    imgui.set_item_tooltip(backend(name).help)
    if chosen != name:
        session.backend = chosen
    name, params = session.chosen(pose)
    session.params[name] = widgets.edit(params)


def _draw_projection(app: App) -> None:
    widgets.label("Projection", "Perspective: near is larger. Orthographic: sizes compare at any depth")
    now = app.session.camera.projection if app.session.camera else PROJECTIONS[0]
    chosen = widgets.choose("projection", now, PROJECTIONS)
    if chosen != now:
        app.project(chosen)


def _draw_statistics(app: App) -> None:
    imgui.text_disabled("Statistics")
    surface, pose = app.picture.surface, app.playback.pose
    timers = app.picture.gpu.timers
    imgui.same_line(imgui.get_content_region_avail().x - 8 * imgui.get_font_size())
    timers.enabled = imgui.checkbox("time passes", timers.enabled)[1]
    imgui.set_item_tooltip("Measure each pass of a picture; this makes it a little slower")
    if surface is None or pose is None or app.picture.request is None:
        return
    x, y, z = app.picture.bounds(pose).high - app.picture.bounds(pose).low
    _row(
        "Points",
        f"{len(pose.cloud):,}" + (f" ({pose.cloud.dropped:,} dropped)" if pose.cloud.dropped else ""),
    )
    _row("Extent", f"{x:.4g} x {y:.4g} x {z:.4g} {app.playback.timeline.unit}")
    _row("Picture", f"{surface.size[0]} x {surface.size[1]}, {backend(surface.stats.backend).title}")
    _row("Time", _times(surface.stats) + (f", {app.picture.rate:.0f} fps" if app.moving else ""))
    for name, milliseconds in surface.stats.passes:
        _row(f"  {name}", f"{milliseconds:.2f} ms")


def _times(stats: Stats) -> str:
    upload = f" (upload {stats.upload_ms:.1f})" if stats.upload_ms >= 0.1 else ""
    return f"{stats.cpu_ms:.1f} ms{upload}"


def _row(name: str, text: str) -> None:
    imgui.text_disabled(name)
    imgui.same_line(6 * imgui.get_font_size())
    imgui.text(text)
