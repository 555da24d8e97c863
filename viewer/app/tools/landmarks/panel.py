"""Landmarks in the panel: which are to be placed, their list, what is said of the selected one, notes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ....analysis.landmarks import Landmark
from ....analysis.track import Known
from ....files import printable
from ....output.overlays import STATE_MARKS
from ... import widgets
from ...ui import Ui
from .words import corners_words, position_words

if TYPE_CHECKING:
    from . import Tool

_ROWS = 6  # of the list that are shown at once
_FREE, _NONE = "No template", "None"


def draw(tool: Tool, ui: Ui) -> None:
    """Declare the section of the panel."""
    _draw_template(tool)
    words = "Stop placing" if tool.is_active else "Place"
    row = ui.row(widgets.labelled(words, "place"), "Skip", "Not visible here")
    if row.button():
        tool.toggle()
    ui.tooltip("Click the position of each landmark in the view, one after the other", "landmarks")
    imgui.begin_disabled(not tool.is_active)
    if row.button():
        tool.skip()
    ui.tooltip("Skip the next landmark, or place a skipped landmark after all", "skip_landmark")
    if row.button():
        tool.set_missing()
    ui.tooltip("Mark the landmark as not visible in this frame", "missing_landmark")
    imgui.end_disabled()
    if tool.is_active and tool.proposal is not None and tool.target is not None:
        if ui.row("Place from mirror partner").button():
            tool.take_mirrored()
        ui.tooltip(
            f"Place {tool.target.name} at the mirror image of {tool.target.partner}",
            "mirrored_landmark",
        )
    if tool.is_active and tool.target is not None and tool.target.about:
        widgets.faint(tool.target.about)
    if tool.made.listed:
        _draw_list(tool)
    else:
        widgets.faint("No landmarks yet. Choose a template, or press Place and click on the surface.")
    if tool.selected:
        _draw_selected(tool, ui)
    _draw_following(tool)
    imgui.separator_text("Notes")
    row = ui.row("Pin a note", "Add frame note")
    if row.button():
        tool.pin_note()
    ui.tooltip("Click the surface to pin a note to it", "note_at_place")
    if row.button():
        tool.notebook.add_to_frame(tool.frame)
    ui.tooltip("Add a note to this whole frame", "note_at_frame")
    tool.notebook.draw_list()
    settings = tool.context.settings
    tool.context.settings = widgets.edit(
        settings, type(settings)(), widgets.EditOptions(rest="More landmark options")
    )


def _draw_template(tool: Tool) -> None:
    known = tool.exchange.templates
    titles = {"": _FREE, **{name: template.title for name, template in known.items()}}
    widgets.label("Template", "Names and order of the landmarks to place")
    chosen = tool.made.template
    if imgui.begin_combo("##template", widgets.unhidden(titles.get(chosen, chosen))):
        for name, title in titles.items():
            label = widgets.labelled(title, f"template {name}")
            if imgui.selectable(label, name == chosen)[0] and name != chosen:
                tool.begin(known.get(name))
        imgui.separator()
        if imgui.selectable("Load template...###template file", False)[0]:
            tool.exchange.ask_for_template()
        if tool.made.listed and imgui.selectable("Save as template...###save template", False)[0]:
            tool.exchange.ask_to_save_template()
        imgui.end_combo()


def _draw_list(tool: Tool) -> None:
    """Declare a row of two lines for each: name and state, position and uncertainty; the corners of a region
    are below a row of it that opens. Only rows in sight are gone through."""
    rows, height = tool.rows(), 2 * imgui.get_text_line_height_with_spacing()
    size = ImVec2(0, min(len(rows), _ROWS) * height + 2 * imgui.get_style().window_padding.y)
    flags = imgui.ChildFlags_.borders | imgui.ChildFlags_.nav_flattened
    if imgui.begin_child("landmarks", size, flags):
        clipper = imgui.ListClipper()
        clipper.begin(len(rows), height)
        while clipper.step():
            for row in rows[clipper.display_start : clipper.display_end]:
                if isinstance(row, str):
                    _draw_region(tool, row, height)
                else:
                    imgui.push_id(row)
                    _draw_row(tool, row, height)
                    imgui.pop_id()
    imgui.end_child()


def _draw_region(tool: Tool, region: str, height: float) -> None:
    """Declare the row of a region, which shows its corners or hides them."""
    em, gap, shown = imgui.get_font_size(), imgui.get_style().item_spacing, tool.shown
    numbers = [n for n, one in enumerate(shown.landmarks) if tool.regions.get(one.name) == region]
    corner, width = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x
    is_open = region in tool.open_regions
    if imgui.selectable(widgets.labelled("", f"region {region}"), False, size=ImVec2(width, height - gap.y))[
        0
    ]:
        tool.open_regions ^= {region}
    widgets.tooltip("Hide the corners of the region" if is_open else "Show the corners of the region")
    draw_list, faint = imgui.get_window_draw_list(), imgui.get_color_u32(imgui.Col_.text_disabled)
    icon = icons.ICON_FA_ANGLE_DOWN if is_open else icons.ICON_FA_ANGLE_RIGHT
    draw_list.add_text(corner, imgui.get_color_u32(imgui.Col_.text), icon)
    left, room = corner.x + 1.2 * em, width - 1.2 * em - gap.x
    name = widgets.fitted(printable(region), room)
    draw_list.add_text(ImVec2(left, corner.y), imgui.get_color_u32(imgui.Col_.text), name)
    words = widgets.fitted(corners_words([shown.state(number) for number in numbers]), room)
    below = corner.y + imgui.get_text_line_height_with_spacing()
    draw_list.add_text(ImVec2(left, below), faint, words)


def _draw_row(tool: Tool, number: int, height: float) -> None:
    shown, em, gap = tool.shown, imgui.get_font_size(), imgui.get_style().item_spacing
    landmark, target = shown.landmarks[number], tool.target if tool.is_active else None
    corner, width = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x
    is_chosen = landmark.name == (target.name if target else tool.selected)
    if imgui.selectable("##row", is_chosen, size=ImVec2(width, height - gap.y))[0]:
        tool.choose(landmark.name)
    if landmark.about:
        widgets.tooltip(landmark.about)
    draw_list, faint = imgui.get_window_draw_list(), imgui.get_color_u32(imgui.Col_.text_disabled)
    mark = STATE_MARKS[Known(int(shown.known[number]))] if landmark.keys else None
    left, state = corner.x + 1.2 * em * (2 if landmark.name in tool.regions else 1), shown.state(number)
    widgets.state_mark(ImVec2(left - 0.7 * em, corner.y + 0.5 * imgui.get_text_line_height()), mark)
    room = corner.x + width - left - gap.x
    state = widgets.fitted(state, 0.6 * room)
    right = corner.x + width - imgui.calc_text_size(state).x
    name = widgets.fitted(printable(landmark.title), right - left - gap.x)
    draw_list.add_text(ImVec2(left, corner.y), imgui.get_color_u32(imgui.Col_.text), name)
    draw_list.add_text(ImVec2(right, corner.y), faint, state)
    words = widgets.fitted(position_words(shown, number, tool.context.scale), room)
    below = corner.y + imgui.get_text_line_height_with_spacing()
    draw_list.add_text(ImVec2(left, below), faint, words)


def _draw_selected(tool: Tool, ui: Ui) -> None:
    """Declare what can be done with the selected one."""
    landmark = tool.made.named(tool.selected)
    if landmark is None:
        return
    imgui.separator_text("Selected")
    imgui.set_next_item_width(-1)
    entered, name = imgui.input_text("##name", landmark.name, imgui.InputTextFlags_.enter_returns_true.value)
    widgets.tooltip("Name of the landmark. Press Enter to change it")
    _draw_partner(tool, landmark)
    row, reason = ui.row("Remove correction in this frame", "Delete"), tool.why_no_correction()
    imgui.begin_disabled(bool(reason))
    if row.button():
        tool.take_key_away()
    imgui.end_disabled()
    about = (
        "Remove the position that you set in this frame. Scan4D then tracks the landmark through this frame"
    )
    ui.tooltip(reason or about, "landmark_key")
    if row.button():
        tool.delete()
    ui.tooltip("Delete the landmark and its measures. Undo restores them", "delete_landmark")
    if entered:
        tool.rename(name)


def _draw_partner(tool: Tool, landmark: Landmark) -> None:
    """Declare the choice of the landmark that is another's mirror image."""
    widgets.label("Mirror partner", "The landmark at the same place on the other side of the body")
    if imgui.begin_combo("##partner", widgets.unhidden(landmark.partner or _NONE)):
        for name in ("", *(one.name for one in tool.made.listed if one.name != landmark.name)):
            label = widgets.labelled(name or _NONE, f"partner {name}")
            if imgui.selectable(label, name == landmark.partner)[0] and name != landmark.partner:
                tool.pair(name)
        imgui.end_combo()


def _draw_following(tool: Tool) -> None:
    """Say how far landmarks are followed through time."""
    if len(tool.context.timeline) < 2 or not tool.context.followed.tracks:
        return
    tracks, pending = tool.context.followed.tracks, tool.follower.pending
    if tool.follower.is_running:
        widgets.faint(f"Tracking {pending} of {len(tracks)} landmarks through all frames ...")
    elif pending and tool.follower.is_stopped:
        if imgui.button("Continue tracking"):
            tool.follower.resume()
    elif pending:
        widgets.faint(f"{pending} of {len(tracks)} landmarks are not tracked through all frames.")
