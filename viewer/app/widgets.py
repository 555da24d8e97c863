"""Widgets made from the declarations of parameters (see viewer/params.py)."""

from __future__ import annotations

import math
from bisect import bisect
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ..files import printable
from ..look import rgba
from ..output.overlays import MARK_RADIUS, StateMark, mark_radius
from ..params import Parameter, describe
from ..task import Task
from . import theme

T = TypeVar("T")
_LABEL_SHARE = 0.46  # of the width
_LABEL, _FIELD = 9.0, 22.0  # widths in a wide dialog, in heights of the font
_DIALOG_WIDTH = 34.0  # in heights of the font
_DOT = 0.2  # radius of a mark on an assumption, in heights of the font
_DECADES = 100.0  # ratio of the limits from which a slider is logarithmic
_TOOLTIP = 60  # characters of a line
_NO_PUSH = imgui.TreeNodeFlags_.no_tree_push_on_open | imgui.TreeNodeFlags_.span_avail_width
_FACTS = 6.0  # where facts begin, in heights of the font
_NARROW = 15.0  # width of a window, in heights of the font, below which labels stand over their widgets
FLOATING = (  # flags of a small window that floats over others
    imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_focus_on_appearing
)  # fmt: skip
ICON_WIDTH = 1.3  # of a button with an icon, in heights of frames
_DRAG_SPEED = 0.005  # share of a number without limits that a pixel adds


class EditOptions(NamedTuple):
    """Options of rows that the declaration of their parameters does not have.

    choices: words to choose from and their titles, for parameters that declare none. hidden: names of
    parameters without a row. now: the values that "auto" stands for now; a parameter that leaves "auto"
    begins with them. idle: name -> why a parameter changes nothing now: its row is greyed, and says so. rows:
    what declares the rows of parameters that have their own, by name. rest: the heading of those that are not
    basic.
    """

    choices: Mapping[str, Mapping[str, str]] = MappingProxyType({})
    hidden: Collection[str] = ()
    now: Mapping[str, Any] = MappingProxyType({})
    idle: Mapping[str, str] = MappingProxyType({})
    rows: Mapping[str, Callable[[Any], Any]] = MappingProxyType({})
    rest: str = "More options"


def edit(values: T, defaults: T, options: EditOptions = EditOptions()) -> T:  # noqa: B008, it never changes
    """A row for each parameter that matters beside the others: label, widget, and what resets it where it is
    not its default; those that are not basic under a heading of their own, which is closed at first, and the
    headings of their groups. The same object while nothing is edited."""
    shown = [one for one in describe(type(values)) if one.matters(values) and one.name not in options.hidden]
    basic = [one for one in shown if one.basic]
    values = _edit_rows(basic, values, defaults, options)
    if len(basic) < len(shown) and imgui.tree_node_ex(options.rest, _NO_PUSH):
        group = ""
        for parameter in shown:
            if parameter.basic or not parameter.matters(values):
                continue
            if parameter.group != group:
                group = parameter.group
                imgui.separator_text(group)
            values = _edit_rows([parameter], values, defaults, options)
    return values


def _edit_rows(parameters: Iterable[Parameter], values: T, defaults: T, options: EditOptions) -> T:
    for parameter in parameters:
        why_idle = options.idle.get(parameter.name)
        imgui.begin_disabled(why_idle is not None)
        imgui.begin_group()
        values = _edit_parameter(parameter, values, defaults, options)
        imgui.end_group()
        imgui.end_disabled()
        if why_idle is not None:
            tooltip(why_idle)
    return values


def _edit_parameter(parameter: Parameter, values: T, defaults: T, options: EditOptions) -> T:
    """Declare the row of a parameter; returns the values, edited or not."""
    if parameter.name in options.rows:
        imgui.push_id(parameter.name)
        values = options.rows[parameter.name](values)
        imgui.pop_id()
        return values
    old, default = (getattr(each, parameter.name) for each in (values, defaults))
    words = options.choices.get(parameter.name, parameter.words)
    new = _edit_row(parameter, old, default, words, options.now.get(parameter.name))
    return values if new == old else replace(values, **{parameter.name: new})  # type: ignore[type-var]


def _edit_row(
    parameter: Parameter, value: Any, default: Any, words: Mapping[str, str], now: Any = None
) -> Any:
    """Declare the row of a parameter; returns its value, edited or not. now: that "auto" stands for."""
    imgui.push_id(parameter.name)
    gutter = imgui.get_frame_height()
    label(parameter.title, _in_words(parameter), gutter)
    if parameter.optional:
        new = _edit_optional(parameter, value, gutter, now)
    else:
        new = _edit(parameter, value, words)
    if value != default:
        imgui.same_line(imgui.get_cursor_start_pos().x + imgui.get_content_region_avail().x - gutter)
        text = _value_in_words(default, words)
        if flat_button(icons.ICON_FA_ARROW_ROTATE_LEFT, f"Reset to the default, {text}"):
            new = default
    imgui.pop_id()
    return new


def _in_words(parameter: Parameter) -> str:
    """Words on what a parameter does, its identifier, and which key switches it."""
    return f"{parameter.name}: {parameter.help}" + (f" ({parameter.key})" if parameter.key else "")


def _value_in_words(value: Any, titles: Mapping[str, str]) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if value is None:
        return "auto"
    return titles.get(value, value) if isinstance(value, str) else f"{value:g}"


def tooltip(text: str) -> None:
    """Explain the last widget, in lines that can be read, while the mouse rests on it."""
    if imgui.begin_item_tooltip():
        widest = 0.9 * imgui.get_io().display_size.x
        imgui.push_text_wrap_pos(min(_TOOLTIP * imgui.calc_text_size("n").x, widest))
        imgui.text_unformatted(text)
        imgui.pop_text_wrap_pos()
        imgui.end_tooltip()


def mark_header(text: str) -> None:
    """Draw a dot at the right end of the last widget, the header of a section, and explain it with a text."""
    low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    middle = ImVec2(high.x - imgui.get_frame_height() / 2, (low.y + high.y) / 2)
    fill_mark(imgui.get_window_draw_list(), middle, _DOT * imgui.get_font_size(), 0, dot_color())
    tooltip(text)


def dot() -> None:
    """Declare a dot as wide as a space between widgets, before a text on the same line."""
    start, size = imgui.get_cursor_screen_pos(), imgui.get_font_size()
    middle = ImVec2(start.x + _DOT * size, start.y + imgui.get_text_line_height() / 2)
    fill_mark(imgui.get_window_draw_list(), middle, _DOT * size, 0, dot_color())
    imgui.dummy(ImVec2(2 * _DOT * size, imgui.get_text_line_height()))
    imgui.same_line()


def dot_color() -> int:
    """The colour of a mark on an assumption, packed for ImGui: the accent of the theme."""
    return imgui.get_color_u32(imgui.Col_.check_mark)


def fact(name: str, text: str) -> None:
    """A row that tells something: what it is, faint, and its value, which begins behind a long name."""
    start = imgui.get_cursor_pos_x()
    imgui.text_disabled(name)
    end = start + imgui.get_item_rect_size().x + imgui.get_style().item_spacing.x
    imgui.same_line(max(_FACTS * imgui.get_font_size(), end))
    imgui.push_text_wrap_pos(0)
    imgui.text_unformatted(text)
    imgui.pop_text_wrap_pos()


def faint(text: str) -> None:
    """A text that is read once, in as many lines as it takes."""
    imgui.push_style_color(imgui.Col_.text, imgui.get_style_color_vec4(imgui.Col_.text_disabled))
    imgui.text_wrapped(text)
    imgui.pop_style_color()


def label(text: str, help: str = "", gutter: float = 0.0) -> None:
    """A text at the left of a row; the next widget takes the rest of it, but for a gutter at its end, and
    begins behind a long text. In a narrow window the widget has the next line to itself."""
    width, start = imgui.get_content_region_avail().x, imgui.get_cursor_pos_x()
    imgui.align_text_to_frame_padding()
    imgui.text(text)
    end = start + imgui.get_item_rect_size().x + imgui.get_style().item_inner_spacing.x
    if help:
        tooltip(help)
    if width >= _NARROW * imgui.get_font_size():
        imgui.same_line(max(imgui.get_cursor_start_pos().x + width * _LABEL_SHARE, end))
    imgui.set_next_item_width(-1 - gutter)


def dialog_label(text: str, help: str = "") -> None:
    """A text at the left of a row of a wide dialog; the next widget beside it is as wide as a few words."""
    em = imgui.get_font_size()
    imgui.align_text_to_frame_padding()
    imgui.text(text)
    if help:
        tooltip(help)
    imgui.same_line(_LABEL * em)
    imgui.set_next_item_width(min(_FIELD * em, imgui.get_content_region_avail().x))


def join_next_to_tabs() -> None:
    """Have Tab and the arrows go to the widgets of the next table that scrolls, as to those around it."""
    imgui.internal.set_next_window_child_flags(imgui.ChildFlags_.nav_flattened.value, True)


def same_line(width: float) -> None:
    """Go on beside the last widget, or below it where the next one, of this width, has no room there."""
    end = imgui.get_cursor_screen_pos().x + imgui.get_content_region_avail().x
    if imgui.get_item_rect_max().x + imgui.get_style().item_spacing.x + width <= end:
        imgui.same_line()


def button_width(label: str) -> float:
    """The least width of a button that shows all of its label."""
    return (
        imgui.calc_text_size(label, hide_text_after_double_hash=True).x
        + 2 * imgui.get_style().frame_padding.x
    )


def check_width(label: str) -> float:
    """The width of a checkbox with its label."""
    text = imgui.calc_text_size(label, hide_text_after_double_hash=True).x
    return imgui.get_frame_height() + imgui.get_style().item_inner_spacing.x + text


def combo(name: str, current: str, words: Sequence[str], titles: Mapping[str, str] | None = None) -> str:
    """A combo box, which shows up to twenty words at once; the word that is chosen now."""
    titles, tall = titles or {}, imgui.ComboFlags_.height_large.value
    if imgui.begin_combo(f"##{name}", unhidden(titles.get(current, current)), tall):
        for word in words:
            if imgui.selectable(labelled(titles.get(word, word), word), word == current)[0]:
                current = word
        imgui.end_combo()
    return current


def _edit_optional(parameter: Parameter, value: Any, gutter: float, now: Any) -> Any:
    """A box for "auto", and the widget beside it where that is not ticked."""
    toggled, auto = imgui.checkbox("auto", value is None)
    if toggled:
        value = None if auto else parameter.type(now if now is not None else parameter.low or 0)
    if value is not None:
        imgui.same_line()
        imgui.set_next_item_width(-1 - gutter)
        value = _edit(parameter, value)
    return value


def _edit(parameter: Parameter, value: Any, words: Mapping[str, str] | None = None) -> Any:
    name = "##value"
    if parameter.type is bool:
        return imgui.checkbox(name, value)[1]
    if words or parameter.choices:
        return combo("value", value, list(parameter.choices or words or ()), words)
    if parameter.type is str:
        return edit_color(name, value) if value.startswith("#") else _edit_text(name, value)
    return _edit_number(name, parameter, value)


def number_format(digits: str, unit: str = "") -> str:
    """The format of a number's field: the digits as C has them, such as "%.3g", and a unit, which may be any
    text. ImGui reads memory by what stands in formats, so no other text gets there."""
    return f"{digits} {unit.replace('%', '%%')}" if unit else digits


def _edit_number(name: str, parameter: Parameter, value: Any) -> Any:
    low = -math.inf if parameter.low is None else parameter.low
    high = math.inf if parameter.high is None else parameter.high
    edit_one = _edit_whole if parameter.type is int else _edit_real
    changed, new = edit_one(name, value, low, high, parameter.unit)
    return parameter.type(min(max(new, low), high)) if changed else value


def _edit_whole(name: str, value: int, low: float, high: float, unit: str) -> tuple[bool, int]:
    if math.isfinite(high - low):
        return imgui.slider_int(name, value, int(low), int(high), number_format("%d", unit))
    return imgui.drag_int(name, value, 0.1, format=number_format("%d", unit))


def _edit_real(name: str, value: float, low: float, high: float, unit: str) -> tuple[bool, float]:
    if not math.isfinite(high - low):
        speed = max(abs(value), 1.0) * _DRAG_SPEED
        changed, new = imgui.drag_float(name, value, speed, format=number_format("%.5g", unit))
    elif low > 0 and high / low > _DECADES:
        logarithmic = imgui.SliderFlags_.logarithmic.value
        changed, new = imgui.slider_float(name, value, low, high, number_format("%.3g", unit), logarithmic)
    else:
        decimals = min(max(2 - math.floor(math.log10(high - low)), 0), 6)
        changed, new = imgui.slider_float(name, value, low, high, number_format(f"%.{decimals}f", unit))
    return changed, float(f"{new:.6g}")  # ImGui's float32 has no more digits


def edit_color(name: str, value: str) -> str:
    """A field for a colour, '#rrggbb' or '#rrggbbaa', whose alpha stays."""
    red, green, blue, _ = rgba(value)
    flags = imgui.ColorEditFlags_.display_hex.value
    changed, new = imgui.color_edit3(name, [red / 255, green / 255, blue / 255], flags)
    return "#" + "".join(f"{round(255 * c):02x}" for c in new[:3]) + value[7:] if changed else value


def _edit_text(name: str, value: str) -> str:
    entered, new = imgui.input_text(name, value, imgui.InputTextFlags_.enter_returns_true.value)
    return new if entered else value


class NameField:
    """A field that gives something another name. subject: what it is for now, None for nothing."""

    def __init__(self) -> None:
        self.subject: object = None
        self._text = ""
        self._is_asked = False

    def begin(self, subject: object, name: str) -> None:
        """Have a name typed, beginning with this one."""
        self.subject, self._text, self._is_asked = subject, name, True

    def draw(self, width: float) -> str | None:
        """Declare the field; the new name once it is typed. Enter or a click elsewhere takes it, Escape does
        not."""
        imgui.set_next_item_width(width)
        if self._is_asked:
            imgui.set_keyboard_focus_here()
            self._is_asked = False
        _, self._text = imgui.input_text("##name", self._text, imgui.InputTextFlags_.auto_select_all.value)
        if not imgui.is_item_deactivated():
            return None
        self.subject = None
        return None if imgui.is_key_pressed(imgui.Key.escape) else self._text


def edit_path(name: str, path: str, flags: int = 0) -> tuple[bool, str]:
    """A field for a path; what ImGui says of the field, and the path."""
    answer, text = imgui.input_text(name, printable(path), flags)
    return answer, edited(path, text)


def edited(path: str, text: str) -> str:
    """A path whose `printable` form the user has changed to this text: what is not UTF-8 in it stays, unless
    that part was changed."""
    heads = (path[:end] for end in range(len(path), -1, -1))
    kept = next(head for head in heads if text.startswith(printable(head)))
    return kept + text[len(printable(kept)) :]


def state_mark(middle: ImVec2, mark: StateMark | None) -> None:
    """Draw the mark of a landmark's state on the screen; a faint ring without one."""
    draw_list, em = imgui.get_window_draw_list(), imgui.get_font_size()
    if mark is None:
        draw_list.add_circle(middle, MARK_RADIUS * em, imgui.get_color_u32(imgui.Col_.text_disabled))
    else:
        fill_mark(draw_list, middle, mark_radius(mark.sides) * em, mark.sides, theme.packed(mark.color))


def fill_mark(draw_list: imgui.ImDrawList, middle: ImVec2, radius: float, sides: int, ink: int) -> None:
    """Fill a polygon with a corner at the right, or a disc for 0 sides. ink: packed for ImGui."""
    if sides:
        draw_list.add_ngon_filled(middle, radius, ink, sides)
    else:
        draw_list.add_circle_filled(middle, radius, ink)


def labelled(text: str, name: object) -> str:
    """The label of a widget that shows a text and is known by a name, whatever is in these."""
    return f"{unhidden(text)}###{unhidden(str(name))}"


def unhidden(text: str) -> str:
    """A text, such as a name that a user gave, as part of a label: ImGui takes what follows "##" for an id
    and does not show it, so that a space without width stands between."""
    return text.replace("#", "#\u200b")


def is_click() -> bool:
    """Whether the mouse has hardly been moved since the left button was pressed; not so of a drag that has
    come back to where it began."""
    io = imgui.get_io()
    return bool(io.mouse_drag_max_distance_sqr[0] < io.mouse_drag_threshold**2)


def fitted(text: str, width: float) -> str:
    """Shorten a text to what there is room for, with an ellipsis where it is not all."""
    if imgui.calc_text_size(text).x <= width:
        return text
    kept = bisect(range(len(text)), width, key=lambda length: imgui.calc_text_size(text[:length] + "...").x)
    return text[: max(kept - 1, 0)] + "..."


@contextmanager
def modal(title: str, is_open: bool, size: ImVec2 | None = None) -> Iterator[bool]:
    """A dialog in the middle of the window; whether its widgets are to be declared. size: pixels; None: as
    high as they are."""
    if not is_open:
        yield False
        return
    if not imgui.is_popup_open(title):
        imgui.open_popup(title)
    display = imgui.get_io().display_size
    imgui.set_next_window_pos(display * 0.5, imgui.Cond_.appearing, ImVec2(0.5, 0.5))
    usual = ImVec2(min(_DIALOG_WIDTH * imgui.get_font_size(), display.x), 0)
    imgui.set_next_window_size(size or usual)
    flags = imgui.WindowFlags_.no_resize | imgui.WindowFlags_.no_saved_settings
    is_drawn = imgui.begin_popup_modal(title, None, flags)[0]
    yield is_drawn
    if is_drawn:
        imgui.end_popup()


def is_taken() -> bool:
    """Whether Enter takes what the dialog that is being declared shows: no field, list or widget that Tab has
    led to has the key."""
    here = imgui.FocusedFlags_.root_and_child_windows | imgui.FocusedFlags_.no_popup_hierarchy
    was_held = imgui.get_current_context().active_id_previous_frame != 0
    if was_held or imgui.get_io().nav_visible or not imgui.is_window_focused(here):
        return False
    return any(imgui.is_key_pressed(key, repeat=False) for key in (imgui.Key.enter, imgui.Key.keypad_enter))


def how_far(task: Task) -> str:
    """The share that is done, where it is known, and for how long the work has gone on."""
    done = "" if task.progress is None else f"{100 * task.progress:.0f} %, "
    return f"{done}{task.seconds:.0f} s"


def progress_row(task: Task, width: float) -> bool:
    """Declare a bar of this width that shows how far work has come, and a button that cancels the work;
    whether the user pressed it."""
    # Of a negative share ImGui draws a bar that only moves.
    share = -task.seconds if task.progress is None else task.progress
    imgui.progress_bar(share, ImVec2(width, imgui.get_frame_height()), unhidden(how_far(task)))
    imgui.same_line()
    return imgui.button(f"Cancel##{id(task)}")


def flat_button(icon: str, help: str) -> bool:
    """An icon that is a button without a frame; True when it is pressed."""
    imgui.push_style_color(imgui.Col_.button, 0)
    pressed = imgui.button(icon, ImVec2(imgui.get_frame_height(), 0))
    imgui.pop_style_color()
    tooltip(help)
    return pressed


def icon_button(icon: str, help: str, color: int | None = None) -> bool:
    """A square button with one icon; True when it is pressed. color: 0xRRGGBB of the icon."""
    side = imgui.get_frame_height()
    if color is not None:
        imgui.push_style_color(imgui.Col_.text, theme.packed(color))
    pressed = imgui.button(icon, ImVec2(ICON_WIDTH * side, side))
    if color is not None:
        imgui.pop_style_color()
    tooltip(help)
    return pressed
