"""The menu bar and the toolbar, drawn from the table of commands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from . import theme, widgets
from .commands import Command, Entry, Listing, Menu, Toolbar
from .failures import Failures
from .keyboard import VIEW
from .keys import Keys, chord
from .menus import Commands
from .part import WindowPart
from .window import Window
from .window_look import WindowLook

_MORE = f"{icons.ICON_FA_ANGLES_RIGHT}###more of the toolbar"
_ASIDE = (imgui.Key.left_arrow, imgui.Key.right_arrow)  # to the menus beside


@dataclass(eq=False)
class MenuBar(WindowPart):
    """The menu bar of the window, and the toolbar below it. By keys: Alt opens the first menu, Alt and its
    first letter each, Left and Right go to those beside it; ImGui leads the keyboard through what is open."""

    name = "menu_bar"
    commands: Commands
    keys: Keys
    failures: Failures
    window: Window
    window_look: WindowLook

    def __post_init__(self) -> None:
        self._is_by_keys = False  # what is open was opened by keys, and the mouse has rested since
        self._goes_on = False  # Left or Right was pressed while a menu was open

    def draw(self) -> float:
        """Declare it; returns its height."""
        imgui.push_style_var(imgui.StyleVar_.window_border_size, 0.0)
        is_there = imgui.begin_main_menu_bar()
        imgui.pop_style_var()
        if is_there:
            asked, has_list = self._asked_for(), imgui.is_popup_open("", imgui.PopupFlags_.any_popup)
            if has_list:
                self._goes_on = any(imgui.is_key_pressed(key) for key in _ASIDE)
            for menu in self.commands.menus:
                if menu.title == asked:
                    self._open(menu)
                start = imgui.get_cursor_screen_pos()
                self._draw(menu)
                if not has_list and imgui.is_window_focused() and imgui.is_item_focused():
                    self._leave_or_open(menu)
                if imgui.is_key_down(imgui.Key.mod_alt):
                    _underline(start, menu.title[0])
            self._mark_chosen()
            imgui.end_main_menu_bar()
        return imgui.get_frame_height()

    def _open(self, menu: Menu) -> None:
        imgui.open_popup(menu.title)
        self._is_by_keys = True
        self.window.touch()  # ImGui takes frames to lay it out, and to find what the keyboard begins with

    def _leave_or_open(self, menu: Menu) -> None:
        """Open a menu that ImGui has led the keyboard to from an open one; else the view has it again."""
        if imgui.get_current_context().nav_any_request:
            return
        if self._goes_on:
            self._goes_on = False
            self._open(menu)
        else:
            imgui.set_window_focus(VIEW)

    def _mark_chosen(self) -> None:
        """Have ImGui mark the entry that the keyboard is at, until the mouse is moved."""
        moved = imgui.get_io().mouse_delta
        self._is_by_keys = self._is_by_keys and not (moved.x or moved.y)
        if self._is_by_keys and imgui.is_popup_open("", imgui.PopupFlags_.any_popup):
            imgui.set_nav_cursor_visible(True)

    def _asked_for(self) -> str | None:
        """The menu that was asked for by keys: the first by Alt alone, each by Alt and its first letter,
        unless those are a command's."""
        asked = self.commands.menus[0].title if self.window.take_alt() else None
        if imgui.is_popup_open("", imgui.PopupFlags_.any_popup):
            return None
        for menu in self.commands.menus:
            keys = f"Alt+{menu.title[0]}"
            if not self.keys.has(keys) and imgui.is_key_chord_pressed(chord(keys)):
                asked = menu.title
        return asked

    def draw_toolbar(self) -> None:
        """Declare the toolbar in the current ImGui window: icons and words, icons alone in the last groups
        where there is no room for both, and what has no room at all in a list at its end."""
        groups = self._shown_groups()
        left, room = [item for group in groups for item in group], imgui.get_content_region_avail().x
        worded = next((count for count in range(len(groups), 0, -1) if self._width(groups, count) <= room), 0)
        more = widgets.button_width(_MORE) + imgui.get_style().item_spacing.x
        for number, group in enumerate(groups):
            has_words = number < worded
            if group is not groups[0]:
                _draw_line()
            for item in group:
                text = self._text(item, has_words)
                wide = self._button_width(item, has_words) + (more if len(left) > 1 else 0)
                if imgui.get_cursor_pos_x() + wide > room:
                    self._draw_more(left)
                    return
                left.remove(item)
                if isinstance(item, Menu):
                    self._draw_drop(item, text, self._button_width(item, has_words))
                else:
                    self._draw_button(self.commands.of[item], text)
                imgui.same_line()

    def _shown_groups(self) -> Toolbar:
        """The groups of the toolbar, without what is not there now."""

        def is_there(item: str | Menu) -> bool:
            return isinstance(item, Menu) or self.commands.of[item].is_there()

        shown = (tuple(filter(is_there, group)) for group in self.commands.toolbar)
        return tuple(filter(None, shown))

    def _draw_more(self, items: Sequence[str | Menu]) -> None:
        """A button that opens what had no room."""
        if imgui.button(_MORE):
            imgui.open_popup("more")
        widgets.tooltip("More of the toolbar")
        if imgui.begin_popup("more"):
            for item in items:
                if isinstance(item, str):
                    self._draw(self.commands.of[item])
                elif item.title:
                    self._draw(item)
                else:
                    self._draw_groups(item)
            imgui.end_popup()

    def _width(self, groups: Toolbar, worded: int) -> float:
        """The width of a toolbar with words in so many of its groups."""
        gap = imgui.get_style().item_spacing.x
        widths = [
            self._button_width(item, number < worded) + gap
            for number, group in enumerate(groups)
            for item in group
        ]
        return sum(widths) + gap * len(groups)

    def _button_width(self, item: str | Menu, has_words: bool) -> float:
        """The width of a button, the same whatever it is called now: those behind it stay where they are."""
        texts = [self._text(item, has_words)]
        if isinstance(item, Menu):
            titles = item.listing.titles() if item.listing else ()
            texts += [_drop_text(item, title, has_words) for title in titles]
        return max(map(widgets.button_width, texts))

    def _text(self, item: str | Menu, has_words: bool) -> str:
        """The text of a button, and its name after "###"."""
        if isinstance(item, Menu):
            listing = item.listing
            title = listing.title_now() if listing and listing.title_now else item.title
            return _drop_text(item, title, has_words)
        command = self.commands.of[item]
        icon, words = command.icon, command.short
        return f"{f'{icon}  {words}' if has_words and icon else icon or words}###{_name(item)}"

    def _draw_button(self, command: Command, text: str) -> None:
        is_on = command.is_on is not None and command.is_on()
        imgui.begin_disabled(not command.can())
        if is_on:
            imgui.push_style_color(imgui.Col_.text, theme.packed(self.window_look.palette.accent))
        if imgui.button(text):
            with self.failures.reported(command.title):
                command.act()
        if is_on:
            imgui.pop_style_color()
        imgui.end_disabled()
        widgets.tooltip(self.keys.hint(command.name))

    def _draw_drop(self, menu: Menu, text: str, width: float) -> None:
        """A button that a menu drops from; one without a title stands close to the button before it."""
        if not menu.title:
            imgui.same_line(0, 1)
        popup = f"##drop {_name(menu)}"
        if imgui.button(text, ImVec2(width, 0)):
            imgui.open_popup(popup)
        imgui.set_next_window_pos(ImVec2(imgui.get_item_rect_min().x, imgui.get_item_rect_max().y))
        if imgui.begin_popup(popup):
            self._draw_groups(menu)
            imgui.end_popup()

    def _draw(self, entry: str | Entry) -> None:
        if isinstance(entry, Command):
            is_on = entry.is_on is not None and entry.is_on()
            title = entry.title_now() if entry.title_now else entry.title
            if imgui.menu_item(
                widgets.labelled(title, entry.name), self.keys.of[entry.name], is_on, entry.can()
            )[0]:
                with self.failures.reported(entry.title):
                    entry.act()
        elif isinstance(entry, Listing) and not entry.title:
            self._draw_items(entry)
        elif isinstance(entry, Listing) and imgui.begin_menu(entry.title):
            self._draw_items(entry)
            imgui.end_menu()
        elif isinstance(entry, Menu) and self.commands.holds(entry.when) and imgui.begin_menu(entry.title):
            self._draw_groups(entry)
            imgui.end_menu()

    def _draw_groups(self, menu: Menu) -> None:
        for group in menu.groups:
            if group is not menu.groups[0]:
                imgui.separator()
            for entry in group:
                self._draw(entry)

    def _draw_items(self, listing: Listing) -> None:
        items = list(listing.items())
        for number, (title, act, is_on) in enumerate(items):
            if imgui.menu_item(widgets.labelled(title, number), "", is_on)[0]:
                act()
        if not items:
            imgui.text_disabled("none")


def _underline(start: ImVec2, letter: str) -> None:
    """Mark the letter that opens a menu with Alt. start: where the menu's entry in the bar begins."""
    padding = imgui.get_style().item_spacing.x / 2  # as ImGui puts the words of a menu
    left = start + ImVec2(padding, imgui.get_style().frame_padding.y + imgui.get_font_size())
    right = left + ImVec2(imgui.calc_text_size(letter).x, 0)
    imgui.get_window_draw_list().add_line(left, right, imgui.get_color_u32(imgui.Col_.text))


def _drop_text(menu: Menu, title: str, has_words: bool) -> str:
    """The text of a button that a menu drops from, and its name after "###". title: of the menu now."""
    words = f"{title} {icons.ICON_FA_CARET_DOWN}".lstrip()
    has_words = has_words or menu.listing is not None
    return f"{f'{menu.icon}  {words}' if has_words and menu.icon else menu.icon or words}###{_name(menu)}"


def _name(item: str | Menu) -> str:
    """The name of a button, which no other one of the toolbar has: no two commands have one name."""
    return item if isinstance(item, str) else f"menu of {next(item.commands()).name}"


def _draw_line() -> None:
    """Between groups of buttons."""
    gap = imgui.get_style().item_spacing.x
    imgui.same_line(0, 2 * gap)
    top = imgui.get_cursor_screen_pos() - ImVec2(gap, 0)
    bottom = top + ImVec2(0, imgui.get_frame_height())
    imgui.get_window_draw_list().add_line(top, bottom, imgui.get_color_u32(imgui.Col_.separator))
