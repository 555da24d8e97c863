"""The dialog that exports, and the one that asks before the window closes while an export runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from ...look import QUALITY_WORDS
from ...output.export import numbered
from ...output.legend import Marks
from ...params import describe
from .. import widgets
from ..part import ViewArea, WindowPart
from ..window import Window
from .export_plan import AS_SHOWN, EXR, FRAMES, MP4, PNG, TURNTABLE, VIEW, Choices
from .exporting import Exporting

_TITLE, _LEAVING = "Export", "Close Scan4D?"
_WHAT = {VIEW: "Current view", TURNTABLE: "Turntable", FRAMES: "Image sequence / film"}
_FORMATS = {PNG: "PNG pictures", EXR: "EXR: depth, normals and colours", MP4: "MP4 film"}
AS_SCAN, EVEN = "as the scan", "even"
_TIMES = {AS_SCAN: "As the scan", EVEN: "Even rate"}
_SIZES = ((1280, 720), (1920, 1080), (3840, 2160))
_MARKS = {
    "scale_bar": "Scale bar",
    "color_bar": "Colour bar",
    "stamp": "Frame and time",
    "notes": "Notes",
    "landmarks": "Landmarks",
    "trajectories": "Landmark paths",
    "measure_lines": "Measures",
    "plot": "Include plot",
}
_FIRST_MARKS = 0.52  # of a row of boxes, for the first one
_HELP = {parameter.name: parameter.help for parameter in (*describe(Choices), *describe(Marks))}


@dataclass(eq=False)
class ExportDialog(WindowPart):
    """The dialogs."""

    name = "export_dialog"
    layer = 82
    shows = "The export dialog"
    exporting: Exporting
    window: Window

    def dialog(self, view: ViewArea) -> None:
        """Declare the dialogs that are open."""
        _draw(self.exporting, self.window.close)


def _draw(exporting: Exporting, quit: Callable[[], None]) -> None:
    with widgets.modal(_TITLE, exporting.is_open) as is_drawn:
        if is_drawn:
            choices, problems = exporting.choices, exporting.problems()
            choices = _edit_what(choices, exporting.count, problems)
            choices = _edit_format(choices, exporting.count, exporting.even_rate, problems)
            choices = _edit_size(choices, exporting.size, problems)
            choices = _edit_quality(choices, exporting.quality)
            marks = _edit_marks(exporting.marks, choices)
            choices, asks = _edit_folder(choices, problems)
            exporting.change(choices, marks)
            _draw_end(exporting, can=not exporting.problems())
            if asks:
                exporting.choose_folder()
            exporting.choosing.draw()
    with widgets.modal(_LEAVING, exporting.is_leaving) as is_drawn:
        if is_drawn:
            _draw_leaving(exporting, quit)


# --- the fields -----------------------------------------------------------------------------


def _edit_what(choices: Choices, count: int, problems: dict[str, str]) -> Choices:
    widgets.label("What", "Turntable: one full turn, starting at the current view")
    choices = replace(choices, what=widgets.combo("what", choices.what, list(_WHAT), _WHAT))
    if choices.what == TURNTABLE:
        widgets.label("Pictures", _HELP["pictures"])
        choices = replace(choices, pictures=_whole("pictures", choices.pictures))
    if choices.what == FRAMES:
        widgets.label("From, to, every", f"Frames, 1 to {count}")
        width = _shares(3)
        first = _whole("first", choices.first, width)
        imgui.same_line()
        shown = count if choices.last is None else choices.last
        last = _whole("last", shown, width)
        imgui.same_line()
        step = _whole("step", choices.step, width)
        last_or_auto = choices.last if last == shown else last
        choices = replace(choices, first=first, last=last_or_auto, step=step)
    _draw_problems(problems, "pictures", "first", "last", "step")
    return choices


def _edit_format(choices: Choices, count: int, even_rate: float, problems: dict[str, str]) -> Choices:
    widgets.label("Format", _HELP["format"])
    format = widgets.combo("format", choices.format, list(_FORMATS), _FORMATS)
    is_film_of_view = format == MP4 != choices.format and choices.what == VIEW and count > 1
    choices = replace(choices, format=format, what=FRAMES if is_film_of_view else choices.what)
    if choices.format == MP4 and choices.what == FRAMES:
        widgets.label(
            "Frame times", "As in the scan: the film shows each frame until the time of the next frame"
        )
        now = EVEN if choices.fps is not None else AS_SCAN
        chosen = widgets.combo("times", now, list(_TIMES), _TIMES)
        if chosen != now:
            choices = replace(choices, fps=round(even_rate, 3) if chosen == EVEN else None)
    if choices.format == MP4 and (choices.what != FRAMES or choices.fps is not None):
        widgets.label("Frames per second", _HELP["fps"])
        edited, fps = imgui.input_float("##fps", even_rate, 0, 0, "%.5g")
        choices = replace(choices, fps=round(fps, 3)) if edited else choices
    _draw_problems(problems, "format", "fps")
    return choices


def _edit_size(choices: Choices, of_view: tuple[int, int] | None, problems: dict[str, str]) -> Choices:
    titles = {f"{w}x{h}": f"{w} x {h}" for w, h in _SIZES}
    if of_view is not None:
        titles[f"{of_view[0]}x{of_view[1]}"] = f"{of_view[0]} x {of_view[1]}, the size of the view"
    now = f"{choices.width}x{choices.height}"
    widgets.label(
        "Size",
        "Width and height in pixels. If the proportions differ from the view's, the picture shows more "
        "or less of the scan at the sides",
    )
    chosen = widgets.combo("size", now if now in titles else "Other", list(titles), titles)
    if chosen in titles and chosen != now:
        width, height = (int(side) for side in chosen.split("x"))
        choices = replace(choices, width=width, height=height)
    widgets.label("Width, height", "Pixels")
    share = _shares(2)
    width = _whole("width", choices.width, share)
    imgui.same_line()
    height = _whole("height", choices.height, share)
    _draw_problems(problems, "width", "height")
    return replace(choices, width=width, height=height)


def _edit_quality(choices: Choices, shown: str) -> Choices:
    """Declare the choice of samples. shown: the word for that of the view."""
    titles = {
        AS_SHOWN: f"Anti-aliasing as shown: {QUALITY_WORDS[shown]}",
        **QUALITY_WORDS,
    }
    imgui.begin_disabled(choices.format == EXR)
    widgets.label("Anti-aliasing", _HELP["quality"])
    quality = widgets.combo("quality", choices.quality, list(titles), titles)
    imgui.end_disabled()
    if choices.format == EXR:
        widgets.tooltip("EXR files store the surface at the middle of each pixel, without anti-aliasing")
    return replace(choices, quality=quality)


def _edit_marks(marks: Marks, choices: Choices) -> Marks:
    widgets.label("Overlays", "EXR files have no overlays: they store the surface, not a picture")
    imgui.begin_disabled(choices.format == EXR)
    imgui.begin_group()
    width = imgui.get_content_region_avail().x
    for number, (name, title) in enumerate(_MARKS.items()):
        if number % 2:  # two in a row: the dialog has to fit a small window with large text
            imgui.same_line(_FIRST_MARKS * width)
        marks = replace(marks, **{name: imgui.checkbox(title, getattr(marks, name))[1]})
        widgets.tooltip(_HELP[name])
    imgui.end_group()
    imgui.end_disabled()
    return marks


def _edit_folder(choices: Choices, problems: dict[str, str]) -> tuple[Choices, bool]:
    """Declare where the files go; the choices, and whether the user wants to go through folders."""
    widgets.label("Anonymise (no names, paths)", _HELP["anonymous"])
    anonymous = imgui.checkbox("##anonymous", choices.anonymous)[1]
    widgets.tooltip(_HELP["anonymous"])
    gap = imgui.get_style().item_inner_spacing.x
    widgets.label("Folder", _HELP["folder"], widgets.ICON_WIDTH * imgui.get_frame_height() + gap)
    folder = widgets.edit_path("##folder", choices.folder)[1]
    imgui.same_line(0, gap)
    asks = widgets.icon_button(icons.ICON_FA_FOLDER_OPEN, "Choose a folder")
    _draw_problems(problems, "folder")
    widgets.label("Name", _HELP["name"])
    name = imgui.input_text("##name", choices.name)[1]
    _draw_problems(problems, "name")
    return replace(choices, anonymous=anonymous, folder=folder, name=name), asks


def _whole(name: str, value: int, width: float = -1) -> int:
    imgui.set_next_item_width(width)
    return imgui.input_int(f"##{name}", value, 0)[1]


def _shares(parts: int) -> float:
    """The width of one of several fields in the rest of a row."""
    gap = imgui.get_style().item_spacing.x
    return (imgui.get_content_region_avail().x - gap * (parts - 1)) / parts


def _draw_problems(problems: dict[str, str], *names: str) -> None:
    """Tell what is wrong with the fields of these names."""
    for name in names:
        if name in problems:
            _warn(problems[name])


def _warn(text: str) -> None:
    imgui.text_wrapped(f"{icons.ICON_FA_TRIANGLE_EXCLAMATION}  {text}")


# --- the end of it --------------------------------------------------------------------------


def _draw_end(exporting: Exporting, can: bool) -> None:
    """Tell what will be written, and declare the buttons."""
    choices, numbers = exporting.choices, exporting.choices.numbers(exporting.count)
    out = choices.out()
    imgui.separator()
    if can:
        names = dict.fromkeys(numbered(out, n).name for n in (numbers[0], numbers[-1]))
        imgui.text_wrapped(f"{len(numbers)} picture{'s' * (len(numbers) > 1)}: {' to '.join(names)}")
    if exporting.own:
        _warn(f"{exporting.own[0].name} is a file of the scan: Scan4D does not replace it.")
    elif exporting.replaced:
        _warn(_there_already([path.name for path in exporting.replaced]))
    imgui.begin_disabled(not can)
    if imgui.button("Replace" if exporting.replaced else "Export"):
        exporting.start()
    imgui.end_disabled()
    imgui.same_line()
    leaves = imgui.button("Cancel") or imgui.is_key_pressed(imgui.Key.escape)
    if leaves and not exporting.choosing.is_open:
        exporting.is_open = False
    if not exporting.is_open:
        imgui.close_current_popup()


def _there_already(names: list[str]) -> str:
    if len(names) == 1:
        return f"{names[0]} exists already."
    return f"{len(names)} of these files exist already."


def _draw_leaving(exporting: Exporting, quit: Callable[[], None]) -> None:
    imgui.text_wrapped(
        "An export is running. If you close the window, Scan4D cancels it and removes its files."
    )
    leaves = imgui.button("Cancel the export and close")
    imgui.same_line()
    stays = imgui.button("Continue export") or imgui.is_key_pressed(imgui.Key.escape)
    task = exporting.task
    if leaves and task is not None:
        task.cancel()
        quit()
    if leaves or stays or task is None:  # it may have ended meanwhile
        exporting.is_leaving = False
        imgui.close_current_popup()
