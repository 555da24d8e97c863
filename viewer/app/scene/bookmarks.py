"""Bookmarks: cameras of a scan by name, to go back to."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import count

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ...document.document import Bookmark
from .. import widgets
from ..commands import Command, Item, Listing
from ..part import WindowPart
from ..session import Session
from ..ui import Ui

_LONGEST = 60  # letters of a name


@dataclass(eq=False)
class Bookmarks(WindowPart):
    """Actions on the bookmarks of the document. renaming: the field for the name of one."""

    name = "bookmarks"
    CONDITIONS = {"bookmarks": lambda bookmarks: bool(bookmarks.all)}
    session: Session
    note_of_scan: Callable[[str], None]

    def __post_init__(self) -> None:
        self.renaming = widgets.NameField()
        self._last: Bookmark | None = None  # gone to or added

    @property
    def all(self) -> tuple[Bookmark, ...]:
        """The bookmarks of the open scan."""
        return self.session.document.bookmarks

    def add(self) -> None:
        """Keep the camera under the next free name."""
        camera = self.session.document.camera
        if camera is not None:
            names = {bookmark.name for bookmark in self.all}
            name = next(name for n in count(1) if (name := f"View {n}") not in names)
            self._last = Bookmark(name, camera)
            self.session.change("Add bookmark", bookmarks=(*self.all, self._last))
            self.note_of_scan(f"Bookmark '{name}' added.")

    def go_to(self, bookmark: Bookmark) -> None:
        """Look from there."""
        self._last = bookmark
        self.session.change("Go to bookmark", camera=bookmark.camera, pivot=None)

    def step(self, direction: int) -> None:
        """Go to the next one for 1, the previous for -1, round the end."""
        if self.all:
            start = self.all.index(self._last) if self._last in self.all else min(-direction, 0)
            self.go_to(self.all[(start + direction) % len(self.all)])

    def rename(self, number: int, name: str) -> None:
        """Give one another name; an empty one changes nothing."""
        name = " ".join(name.split())[:_LONGEST]
        if name:
            named = replace(self.all[number], name=name)
            self._last = named if self._last == self.all[number] else self._last
            renamed = *self.all[:number], named, *self.all[number + 1 :]
            self.session.change("Rename bookmark", bookmarks=renamed)

    def delete(self, number: int) -> None:
        """Forget one."""
        self.note_of_scan(f"Bookmark '{self.all[number].name}' deleted.")
        left = *self.all[:number], *self.all[number + 1 :]
        self.session.change("Delete bookmark", bookmarks=left)

    def items(self) -> Iterator[Item]:
        """Bookmarks for a menu."""
        for bookmark in self.all:
            yield bookmark.name, partial(self.go_to, bookmark), self.is_shown(bookmark)

    def is_shown(self, bookmark: Bookmark) -> bool:
        """Whether the view is that of a bookmark."""
        return self.session.document.camera == bookmark.camera

    # --- the section of the panel -----------------------------------------------------

    def draw(self, ui: Ui) -> None:
        """Declare the list: a click on a name goes there; buttons rename and delete."""
        if not self.all:
            widgets.faint("No bookmarks yet. Press Add to store the current view.")
        deleted = None
        for number, bookmark in enumerate(self.all):
            imgui.push_id(number)
            if bookmark is self.renaming.subject:
                if (name := self.renaming.draw(-1)) is not None:
                    self.rename(number, name)
            else:
                deleted = number if self._draw_row(number, bookmark) else deleted
            imgui.pop_id()
        if deleted is not None:
            self.delete(deleted)
        imgui.begin_disabled(self.session.document.camera is None)
        if imgui.button(f"{icons.ICON_FA_PLUS}  Add"):
            self.add()
        imgui.end_disabled()
        ui.tooltip("Store the current view as a bookmark", "bookmark_add")

    def _draw_row(self, number: int, bookmark: Bookmark) -> bool:
        """One bookmark; True where it is to be deleted."""
        gap, side = imgui.get_style().item_inner_spacing.x, widgets.ICON_WIDTH * imgui.get_frame_height()
        room = imgui.get_content_region_avail().x - 2 * (side + gap)
        name = widgets.fitted(bookmark.name, room)
        imgui.align_text_to_frame_padding()
        if imgui.selectable(widgets.labelled(name, "go"), self.is_shown(bookmark), 0, ImVec2(room, 0))[0]:
            self.go_to(bookmark)
        if name != bookmark.name:
            widgets.tooltip(bookmark.name)
        imgui.same_line(0, gap)
        if widgets.icon_button(icons.ICON_FA_PEN_TO_SQUARE, "Rename"):
            self.renaming.begin(bookmark, bookmark.name)
        imgui.same_line(0, gap)
        return widgets.icon_button(icons.ICON_FA_TRASH, "Delete")

    COMMANDS = (
        Command("bookmark_add", "Add bookmark", add, "Ctrl+B", "view"),
        Command("bookmark_next", "Next", lambda bookmarks: bookmarks.step(1), "N", "bookmarks"),
        Command(
            "bookmark_previous", "Previous", lambda bookmarks: bookmarks.step(-1), "Shift+N", "bookmarks"
        ),
        Listing("Go to", items, "bookmarks"),
    )
