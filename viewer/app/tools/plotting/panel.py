"""Curves in the panel: the measures, how to add one, and whose paths are drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import ImVec2, ImVec4, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ....look import color_table
from ... import widgets
from ...ui import Ui
from . import adding
from .choices import ANCHORS, Settings
from .paths import SPEED_MAP

if TYPE_CHECKING:
    from . import Tool

_OF_THE_PLOT = ("is_open", "mode", "order", "bands", "seconds", "lines", "least")
_OPEN = imgui.TreeNodeFlags_.default_open.value
_BAR_STEPS = 16  # of the bar of colours


def draw(tool: Tool, ui: Ui) -> None:
    """Declare the section of the panel."""
    words = "Hide plot" if tool.is_below() else "Plot measures"
    if ui.row(widgets.labelled(words, "curves")).button():
        tool.toggle()
    ui.tooltip("Plot the measures of all frames under the timeline", "curves")
    _draw_measures(tool)
    if measures_there := bool(tool.landmarks.measures):
        changed, _ = imgui.checkbox("Show measures in the view", tool.settings.lines)
        if changed:
            tool.show_lines()
        ui.tooltip("Draw each measure in the view, with its value", "measure_lines")
        _draw_noise(tool)
    words = "Stop" if tool.lasso.is_drawn else "Outline a region"
    if ui.row(widgets.labelled(words, "region")).button():
        tool.lasso.toggle()
    ui.tooltip("Draw round a part of the surface to measure its area and perimeter", "lasso")
    _, tool.lasso.through = imgui.checkbox("Include surface behind", tool.lasso.through)
    ui.tooltip("Also measure surfaces in front of and behind the outlined surface", "lasso")
    if tool.placed and imgui.tree_node_ex("Add a measure", 0 if measures_there else _OPEN):
        adding.draw(tool, ui)
        imgui.tree_pop()
    _draw_paths(tool)


def _draw_measures(tool: Tool) -> None:
    """The measures, each with what shows it and what deletes it, and a row to add one."""
    measures, choices = tool.landmarks.measures, tool.choices
    if not measures:
        widgets.faint("No measures yet. Choose a landmark template with measures, or add a measure below.")
    for number, measure in enumerate(measures):
        imgui.push_id(number)
        right = imgui.get_cursor_start_pos().x + imgui.get_content_region_avail().x
        changed, is_shown = imgui.checkbox("##shown", measure.name not in choices.hidden)
        widgets.tooltip("Plot this measure")
        if changed:
            others = tuple(name for name in choices.hidden if name != measure.name)
            tool.choose("Show measure", hidden=others if is_shown else (*others, measure.name))
        imgui.same_line()
        room = right - imgui.get_cursor_pos_x() - 3 * imgui.get_frame_height()
        if tool.renaming.subject == measure.name:
            if (name := tool.renaming.draw(room)) is not None:
                tool.rename(measure.name, name)
        else:
            imgui.text(widgets.fitted(measure.name, room))
            widgets.tooltip(f"{measure.name}: {measure.kind} of {', '.join(measure.landmarks)}")
        imgui.same_line(right - 2.7 * imgui.get_frame_height())
        if widgets.icon_button(icons.ICON_FA_PEN_TO_SQUARE, "Rename"):
            tool.renaming.begin(measure.name, measure.name)
        imgui.same_line(right - 1.3 * imgui.get_frame_height())
        if widgets.icon_button(icons.ICON_FA_TRASH, "Delete"):
            tool.delete(measure.name)
        imgui.pop_id()


def _draw_noise(tool: Tool) -> None:
    """The scanner's noise, which adds to how uncertain measures are."""
    scale, noise = tool.context.scale, tool.choices.noise
    widgets.label(
        "Scanner noise (SD)",
        "Noise of the scanner: the standard deviation of a measured coordinate. The uncertainty of "
        "measures includes this noise",
    )
    low, high, speed = 0.0, 1e9, 0.01
    changed, new = imgui.drag_float(
        "##noise", scale.factor * noise, speed, low, high, widgets.number_format("%.3g", scale.unit)
    )
    if changed:
        tool.choose("Set scanner noise", noise=max(float(f"{new / scale.factor:.6g}"), 0.0))


def _draw_paths(tool: Tool) -> None:
    """The landmarks, each with whether its path is drawn and whether it holds the scan still."""
    placed = tool.placed
    if not placed or not imgui.tree_node("Landmark paths (trajectories)"):
        return
    choices = tool.choices
    if imgui.begin_table("paths", 3, imgui.TableFlags_.sizing_fixed_fit.value):
        imgui.table_setup_column("landmark", imgui.TableColumnFlags_.width_stretch.value)
        for words, about in (
            ("", ""),
            ("path", "Draw the path of this landmark over the picture"),
            (
                "rigid reference",
                "Tick landmarks on a part of the subject that does not deform, such as the forehead. "
                "Scan4D subtracts the common motion of these landmarks from paths and speeds",
            ),
        ):
            imgui.table_next_column()
            imgui.text_disabled(words)
            if about:
                widgets.tooltip(about)
        for number, name in enumerate(placed):
            imgui.push_id(number)
            imgui.table_next_column()
            imgui.align_text_to_frame_padding()
            imgui.text(name)
            for column in ("traced", "anchors"):
                imgui.table_next_column()
                names = getattr(choices, column)
                changed, is_on = imgui.checkbox(f"##{column}", name in names)
                if changed:
                    others = tuple(one for one in names if one != name)
                    tool.choose("Choose paths", **{column: (*others, name) if is_on else others})
            imgui.pop_id()
        imgui.end_table()
    options = widgets.EditOptions(hidden=_OF_THE_PLOT, rest="More path options")
    tool.settings = widgets.edit(tool.settings, Settings(), options)
    if (tool.settings.hold or tool.settings.coordinates == ANCHORS) and tool.paths.problem:
        widgets.faint(tool.paths.problem)
    if tool.settings.by_speed and tool.settings.trajectories and tool.paths.fastest:
        _draw_colors(tool)
    imgui.tree_pop()


def _draw_colors(tool: Tool) -> None:
    """The colours of speeds, from rest to the fastest."""
    em, scale = imgui.get_font_size(), tool.context.scale
    low = imgui.get_cursor_screen_pos()
    step = imgui.get_content_region_avail().x / _BAR_STEPS
    table = color_table(SPEED_MAP)
    for number in range(_BAR_STEPS):
        red, green, blue, _ = (table[round(255 * number / (_BAR_STEPS - 1))] / 255).tolist()
        corner = low + ImVec2(number * step, 0)
        ink = imgui.color_convert_float4_to_u32(ImVec4(red, green, blue, 1))
        imgui.get_window_draw_list().add_rect_filled(corner, corner + ImVec2(step + 1, 0.5 * em), ink)
    imgui.dummy(ImVec2(0, 0.5 * em))
    imgui.text_disabled(f"0 to {scale.factor * tool.paths.fastest:.3g} {scale.unit}/s")
