"""Notes that are pinned to positions and frames: over the view, and as a list."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ....document.landmarks import Landmarks, Note
from ....errors import InputError
from ....geometry import vector
from ....scan.times import frame_in_words
from ... import widgets
from ...scene.canvas import Canvas, Label, ScreenView
from ...tool_context import Click, ToolContext

_COLOR = 0xF2E36B
_CORNER = ImVec2(1.0, 3.4)  # where notes on the frame begin, in heights of the font


class Notebook:
    """The notes of the open scan. is_pinning: whether the next click pins one."""

    def __init__(self, context: ToolContext) -> None:
        self._context = context
        self.is_pinning = False
        self._takes_keyboard = False  # the field of the last one

    @property
    def _notes(self) -> tuple[Note, ...]:
        return self._context.document.part(Landmarks).notes

    def _change(self, name: str, notes: tuple[Note, ...], merge: object = None) -> None:
        made = replace(self._context.document.part(Landmarks), notes=notes)
        self._context.change(name, made, merge=merge)

    def pin(self, click: Click) -> None:
        """Add a note at what was clicked, in its frame; raises InputError where nothing is."""
        if click.picked is None:
            raise InputError("No surface here: click on the scan.")
        self.is_pinning = False
        position = vector(click.motion.inverse.points(np.array(click.picked.place)))
        self._add(Note("", click.pose.index, position))

    def add_to_frame(self, frame: int) -> None:
        """Add a note on a frame."""
        self._add(Note("", frame))

    def _add(self, note: Note) -> None:
        self._change("Add note", (*self._notes, note))
        self._takes_keyboard = True
        self._context.reveal()

    def draw_over(self, frame: int, canvas: Canvas, view: ScreenView) -> None:
        """Draw the notes of a frame over the picture: at their positions, those on the frame in a corner."""
        pose, labels, below = self._context.pose, [], view.corner + _CORNER * canvas.em
        for note in self._notes:
            if note.frame not in (None, frame) or pose is None:
                continue
            if note.position is None:
                plate = Label([note.text or "..."], np.array([(below.x, below.y)]), _COLOR)
                below = plate.draw_at(below)
                continue
            position = view.on_screen(vector(self._context.motion(pose).points(np.array(note.position))))
            if position is not None and view.box.clipped(position, position) is not None:
                canvas.point(position, _COLOR)
                labels.append(Label([note.text or "..."], np.array([(position.x, position.y)]), _COLOR))
        canvas.labels(labels)

    def draw_list(self) -> None:
        """Declare the notes as rows that are edited."""
        for number, note in enumerate(self._notes):
            imgui.push_id(number)
            self._draw_row(number, note)
            imgui.pop_id()

    def _draw_row(self, number: int, note: Note) -> None:
        side, gap = 1.3 * imgui.get_frame_height(), imgui.get_style().item_spacing.x
        if self._takes_keyboard and number == len(self._notes) - 1:
            imgui.set_keyboard_focus_here()
            self._takes_keyboard = False
        imgui.set_next_item_width(imgui.get_content_region_avail().x - 2 * (side + gap))
        changed, text = imgui.input_text_with_hint("##text", "Note text", note.text)
        where = "All frames" if note.frame is None else frame_in_words(note.frame).capitalize()
        widgets.tooltip(f"{where}, {'pinned to the surface' if note.position else 'on the whole frame'}")
        imgui.same_line()
        goes = widgets.icon_button(icons.ICON_FA_CROSSHAIRS, f"Go there: {where.lower()}")
        imgui.same_line()
        others = self._notes[:number], self._notes[number + 1 :]
        if widgets.icon_button(icons.ICON_FA_TRASH, "Delete"):
            self._change("Delete note", (*others[0], *others[1]))
        elif goes:
            self._go_to(note)
        elif changed:
            edited = (*others[0], replace(note, text=text), *others[1])
            self._change("Edit note", edited, merge=("note", number))

    def _go_to(self, note: Note) -> None:
        camera, pose = self._context.document.camera, self._context.pose
        if note.frame is not None:
            self._context.seek(note.frame)
        if note.position is not None and camera is not None and pose is not None:
            position = vector(self._context.motion(pose).points(np.array(note.position)))
            self._context.change("Look at note", camera=camera.centered(position), pivot=position)
