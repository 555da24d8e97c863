"""The panel at the right: scan, renderer, projection, look, statistics."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_4 as icons

from ..backends import backend, backends
from ..camera import PROJECTIONS
from ..files import printable
from ..look import COLOR_BY, Look, drawable
from . import widgets
from .files.scans import title
from .scene import counting
from .ui import Ui

if TYPE_CHECKING:
    from ..camera import Camera
    from ..gpu.surface import Stats
    from ..scan.pose import Pose
    from .app import App
    from .files.scans import Scans
    from .keys import Keys
    from .scene.rendering import Rendering
    from .scene.steering import Steering
    from .session import Session

_STATISTICS_ROWS = 8  # without the passes
_STATISTICS_SHARE = 0.4  # of the panel's height at most


def draw(app: App) -> None:
    """Declare the panel in the current ImGui window."""
    stats = app.viewport.surface.stats if app.viewport.surface else None
    passes = len(stats.passes) + len(stats.chosen) if stats else 0
    rows = imgui.get_text_line_height_with_spacing() * (_STATISTICS_ROWS + passes)
    head = imgui.get_frame_height_with_spacing() + 2 * imgui.get_style().item_spacing.y
    height = min(head + rows, _STATISTICS_SHARE * imgui.get_content_region_avail().y)
    imgui.begin_child("settings", ImVec2(0, -height))
    if len(app.scans.listed) > 1:
        _draw_scans(app.scans, app.session.scan, app.keys)
    pose, ui = app.playback.pose, Ui(app.keys)
    if pose is not None:
        if _section("Renderer"):
            _draw_renderer(app.session, app.rendering, pose)
        if _section("Look"):
            look = app.document.look
            names = app.session.laid.layers(pose).names(pose.overview.scalars)
            colors = _colors(look, names, backend(app.document.chosen(pose)[0]).values)
            app.rendering.edit_look(widgets.edit(look, Look(up=look.up), {"color_by": colors}))
            _draw_projection(app.steering, app.document.camera)
        if _section("Bookmarks", is_open=bool(app.document.bookmarks)):
            app.bookmarks.draw(ui)
        for title, is_revealed, declare in app.tools.sections():
            if is_revealed:
                imgui.set_next_item_open(True)
            if _section(title, is_open=False):
                declare(ui)
                if is_revealed:
                    imgui.set_scroll_here_y(1.0)
    imgui.end_child()
    imgui.separator()
    imgui.begin_child("statistics")
    _draw_statistics(app)
    imgui.end_child()


def _section(title: str, is_open: bool = True) -> bool:
    return imgui.collapsing_header(title, imgui.TreeNodeFlags_.default_open.value if is_open else 0)


def _draw_scans(scans: Scans, scan: str, keys: Keys) -> None:
    """Declare the list of scans, and buttons to the one before and the next. scan: the open one."""
    gap = imgui.get_style().item_inner_spacing.x
    for icon, step, name in (
        (icons.ICON_FA_CHEVRON_LEFT, -1, "previous"), (icons.ICON_FA_CHEVRON_RIGHT, 1, "next"),
    ):  # fmt: skip
        hint = keys.of[f"{name}_scan"]
        if widgets.icon_button(icon, f"{name.capitalize()} scan" + (f" ({hint})" if hint else "")):
            scans.step(step)
        imgui.same_line(0, gap)
    imgui.set_next_item_width(-1)
    room = imgui.get_content_region_avail().x - 2 * imgui.get_frame_height()
    if imgui.begin_combo("##scan", widgets.fitted(title(scan), room)):
        for number, (name, act, is_open) in enumerate(scans.items(scans.listed)):
            if imgui.selectable(f"{name}##{number}", is_open)[0]:
                act()
        imgui.end_combo()
    imgui.set_item_tooltip(printable(scan))


def _draw_renderer(session: Session, rendering: Rendering, pose: Pose) -> None:
    name, _ = session.document.chosen(pose)
    imgui.set_next_item_width(-1)
    chosen = widgets.combo("backend", name, list(backends()), {n: b.title for n, b in backends().items()})
    imgui.set_item_tooltip(backend(name).help)
    if chosen != name:
        rendering.choose(chosen)
    _, params = session.document.chosen(pose)
    rendering.edit_params(widgets.edit(params, session.document.defaults(pose)[1]))


def _colors(look: Look, scalars: Collection[str], found: Collection[str]) -> dict[str, str]:
    """Sources of colours, and the title of each: also the one chosen where it is not there.

    scalars: that the frame has. found: what the backend finds.
    """
    titles = {name: printable(name) for name in (*COLOR_BY, *scalars)}
    titles |= {name: name.replace("_", " ") for name in found if name not in titles}
    if look.color_by in titles:
        return titles
    is_here = drawable(look, scalars) == look  # as the scalar's number
    return titles | {look.color_by: printable(look.color_by) + ("" if is_here else " (not here)")}


def _draw_projection(steering: Steering, camera: Camera | None) -> None:
    widgets.label("Projection", "Perspective: near is larger. Orthographic: sizes compare at any depth")
    now = camera.projection if camera else PROJECTIONS[0]
    chosen = widgets.combo("projection", now, PROJECTIONS)
    if chosen != now:
        steering.project(chosen)


def _draw_statistics(app: App) -> None:
    imgui.align_text_to_frame_padding()
    imgui.text_disabled("Statistics")
    surface, pose = app.viewport.surface, app.playback.pose
    timers = app.renderer.gpu.timers
    width = imgui.get_item_rect_size().x + imgui.get_style().item_spacing.x
    imgui.same_line(max(imgui.get_content_region_avail().x - 8 * imgui.get_font_size(), width))
    timers.enabled = imgui.checkbox("Time each pass", timers.enabled)[1]
    imgui.set_item_tooltip("Measure each pass of a picture; this makes it a little slower")
    if surface is None or pose is None or not app.viewport.is_there:
        return
    bounds = app.steering.bounds(pose)
    x, y, z = bounds.high - bounds.low
    _row(
        "Points",
        f"{pose.count:,}" + (f" ({pose.dropped:,} dropped)" if pose.dropped else ""),
    )
    for name, number in counting.words(app.viewport, app.counting.counts):
        _row(name, number)
    _row("Extent", f"{x:.4g} x {y:.4g} x {z:.4g} {app.playback.unit}")
    _row("Picture", f"{surface.size[0]} x {surface.size[1]}, {backend(surface.stats.backend).title}")
    if app.playback.player.playing:
        held = f"{app.renderer.held_bytes / 1e6:,.0f} MB"
        _row("Ahead", f"{app.ahead.ready} ready, {app.renderer.unfinished} begun, {held}")
    for name, choice in surface.stats.chosen.items():
        _row(name.capitalize(), choice)
    _row("Time", _times(surface.stats) + (f", {app.viewport.rate:.0f} fps" if app.moving else ""))
    for name, milliseconds in surface.stats.passes:
        _row(f"  {name}", f"{milliseconds:.2f} ms")


def _times(stats: Stats) -> str:
    upload = f" (upload {stats.upload_ms:.1f})" if stats.upload_ms >= 0.1 else ""
    return f"{stats.cpu_ms:.1f} ms{upload}"


def _row(name: str, text: str) -> None:
    imgui.text_disabled(name)
    imgui.same_line(6 * imgui.get_font_size())
    imgui.text(text)
