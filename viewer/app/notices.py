"""Messages for the user: short notes over the picture that go by themselves, problems and offers that stay
until they are sent away, and a log of all."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from datetime import datetime

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ..files import printable
from ..task import Task, in_background
from . import theme, widgets
from .keyboard import Keyboard
from .part import ViewArea, WindowPart
from .window import Window
from .window_look import WindowLook

log = logging.getLogger(__name__)
_LASTS = 4.0, 0.06  # seconds, and as much more for each letter
_MOST_SHOWN = 3
_MOST_STORED = 1000
_WIDTH, _NARROW, _FOOT = 34.0, 21.0, 4.5  # in heights of the font; the foot is where the scale bar is
_STILL = (
    imgui.WindowFlags_.no_title_bar | imgui.WindowFlags_.no_resize | imgui.WindowFlags_.no_move
    | imgui.WindowFlags_.no_saved_settings | imgui.WindowFlags_.no_focus_on_appearing
    | imgui.WindowFlags_.always_auto_resize
)  # fmt: skip


class Problem(str):
    """A text that tells what went wrong: it stays until the user sends it away."""


class Offer(str):
    """A text with buttons: it stays until the user presses one, or sends it away.

    choices: what each does by its title. about: what it is about; another offer on that replaces it.
    """

    choices: Mapping[str, Callable[[], object]]
    about: str

    def __new__(cls, text: str, choices: Mapping[str, Callable[[], object]], about: str) -> Offer:
        """An offer with this text."""
        offer = super().__new__(cls, text)
        offer.choices, offer.about = choices, about
        return offer


class Refusal(Offer, Problem):
    """A problem with buttons that help to solve it."""


@dataclass(frozen=True)
class Notice:
    """One message. at: when it came, local time. until: by the clock, when it goes. is_problem: whether it
    tells what went wrong. offer: with the buttons that it has, None without any. of: "scan" where it is about
    the open scan, "opening" where it is about what could not be opened."""

    text: str
    at: datetime
    until: float
    is_problem: bool = False
    offer: Offer | None = None
    of: str = ""

    @property
    def stays(self) -> bool:
        """Whether it stays until the user sends it away."""
        return self.is_problem or self.offer is not None


class Notices(WindowPart):
    """All messages, the last one at the end."""

    name = "notices"
    doing = "Looking"
    layer = 20
    OFFERS = {
        "note": "tell", "note_of_scan": "tell_of_scan", "note_of_work": "tell_of_work",
        "note_of_opening": "tell_of_opening", "tell_later": "tell_later", "end_offers": "end_offers",
    }  # fmt: skip

    def __init__(self) -> None:
        self.all: list[Notice] = []
        self.count = 0  # ever shown
        self._foot = 0.0  # height of the problems over the picture
        self._looking: list[Future[str]] = []

    def tell(self, text: str, of: str = "") -> None:
        """Show a message for as long as it takes to read, a `Problem` or an `Offer` until it is sent away,
        and keep it in the log. of: what it is about, see `Notice` and `end`."""
        is_problem, offer = isinstance(text, Problem), text if isinstance(text, Offer) else None
        text = printable(text)
        log.info("%s", text)
        seconds, per_letter = _LASTS
        until = math.inf if is_problem or offer else time.monotonic() + seconds + per_letter * len(text)
        new = Notice(text, datetime.now(), until, is_problem, offer, of)
        self.all = [self._gone(each) if _replaces(new, each) else each for each in self.all]
        self.all.append(new)
        del self.all[:-_MOST_STORED]
        self.count += 1

    def tell_of_scan(self, text: str) -> None:
        """Show a message about the open scan, until another one opens."""
        self.tell(text, "scan")

    def tell_of_work(self, text: str) -> None:
        """Show what came of something that was done with the open scan, until another one opens; a problem or
        an offer stays."""
        self.tell(text, "" if isinstance(text, (Problem, Offer)) else "scan")

    def tell_of_opening(self, text: str) -> None:
        """Show a message about what could not be opened, until something else is to be opened."""
        self.tell(text, "opening")

    def tell_later(self, look: Callable[[], str]) -> None:
        """Find something out beside the window, and show the words that it brings; empty: nothing."""
        self._looking.append(in_background(Task("Looking"), look))

    @property
    def waits(self) -> bool:
        """Whether an answer is awaited."""
        return bool(self._looking)

    def advance(self, now: float) -> None:
        """Show the answers that are there."""
        done = [work for work in self._looking if work.done()]
        self._looking = [work for work in self._looking if work not in done]
        for words in filter(None, (work.result() for work in done)):
            self.tell_of_work(words)

    def leave_scan(self) -> None:
        """Messages about the scan go with it."""
        self.end("scan")

    def end(self, of: str) -> None:
        """Show no longer what was about something that is over: the scan that was open, or an opening."""
        self.all = [self._gone(notice) if notice.of == of else notice for notice in self.all]

    def end_offers(self, about: str) -> None:
        """Show no longer what was offered about something."""

        def is_over(notice: Notice) -> bool:
            return notice.offer is not None and notice.offer.about == about

        self.all = [self._gone(notice) if is_over(notice) else notice for notice in self.all]

    @property
    def latest(self) -> str:
        """The last message, unless what it is about is over; empty where there is none."""
        return self.all[-1].text if self.all and not (self.all[-1].of and self.all[-1].until == 0.0) else ""

    def shown(self, now: float) -> list[Notice]:
        """Notices to show over the picture, the oldest first: the last few, and the last few that stay."""
        there = [notice for notice in self.all[-_MOST_SHOWN:] if notice.until > now and not notice.stays]
        staying = [notice for notice in self.all if notice.stays and notice.until > now]
        return staying[-_MOST_SHOWN:] + there

    def next_change(self, now: float) -> float:
        """Seconds until one of those shown goes; infinite where none does by itself."""
        return min((notice.until - now for notice in self.shown(now)), default=math.inf)

    def send_away(self, gone: Notice) -> None:
        """Show one of them no longer."""
        self.all = [self._gone(notice) if notice is gone else notice for notice in self.all]

    def on_escape(self) -> bool:
        """Send away the latest of those shown; whether one was."""
        shown = self.shown(time.monotonic())
        if shown:
            self.send_away(max(shown, key=lambda notice: notice.at))
        return bool(shown)

    def _gone(self, notice: Notice) -> Notice:
        return replace(notice, until=0.0)

    def draw(self, size: ImVec2) -> None:
        """Declare notes in the current ImGui window, the 3D view. size: of the view."""
        em = imgui.get_font_size()
        wrap = min(_WIDTH * em, 0.8 * size.x)
        pad = ImVec2(0.8 * em, 0.5 * em)
        bottom = size.y - _FOOT * em - self._foot
        for notice in reversed(self.shown(time.monotonic())):
            if notice.stays:
                continue
            extent = imgui.calc_text_size(notice.text, wrap_width=wrap)
            corner = ImVec2((size.x - extent.x) / 2, bottom - extent.y)
            draw_text(notice.text, corner, extent, wrap, pad)
            bottom = corner.y - 2 * pad.y - 0.4 * em

    def draw_staying(self, view: ViewArea, color: int, keyboard: Keyboard) -> None:
        """Declare a window with problems and offers, over the 3D view. color: 0xRRGGBB, of the mark beside
        each problem. keyboard: which goes there as well."""
        left, top, width, height = view
        staying = [notice for notice in self.shown(time.monotonic()) if notice.stays]
        self._foot = 0.0
        if not staying:
            return
        em = imgui.get_font_size()
        foot = ImVec2(left + width / 2, top + height - 0.5 * _FOOT * em)
        imgui.set_next_window_pos(foot, imgui.Cond_.always, ImVec2(0.5, 1.0))
        imgui.set_next_window_size_constraints(ImVec2(0, 0), ImVec2(width, height))
        imgui.begin("problems", None, _STILL.value | keyboard.flags("problems"))
        keyboard.take("problems")
        is_narrow = width < _NARROW * em
        buttons = 0.0 if is_narrow else 2 * imgui.get_frame_height() + 3 * em
        wrap = min(_WIDTH * em, width - buttons - 5 * em)
        for number, notice in enumerate(staying):
            imgui.push_id(number)
            self._draw_staying(notice, wrap, color, is_narrow)
            imgui.pop_id()
        self._foot = imgui.get_window_size().y
        imgui.end()

    def _draw_staying(self, notice: Notice, wrap: float, color: int, is_narrow: bool) -> None:
        """Declare a notice. is_narrow: whether its buttons stand below the text."""
        if notice.is_problem:
            imgui.push_style_color(imgui.Col_.text, theme.packed(color))
            imgui.text(icons.ICON_FA_TRIANGLE_EXCLAMATION)
            imgui.pop_style_color()
        else:
            imgui.text(icons.ICON_FA_CIRCLE_INFO)
        imgui.same_line()
        start = imgui.get_cursor_pos_x()
        imgui.push_text_wrap_pos(start + wrap)
        imgui.text_unformatted(notice.text)
        imgui.pop_text_wrap_pos()
        if is_narrow:
            imgui.set_cursor_pos_x(start)
        else:
            imgui.same_line(start + wrap + imgui.get_style().item_spacing.x)
        if notice.is_problem:
            if imgui.button("Copy"):
                imgui.set_clipboard_text(notice.text)
            imgui.same_line()
        if widgets.icon_button(icons.ICON_FA_XMARK, "Dismiss (Esc)"):
            self.send_away(notice)
        if notice.offer is not None:
            imgui.set_cursor_pos_x(start)
            for title, act in notice.offer.choices.items():
                if imgui.button(widgets.labelled(title, title)):
                    self.send_away(notice)
                    act()
                imgui.same_line()
            imgui.new_line()


@dataclass(eq=False)
class StayingNotices(WindowPart):
    """The window with the messages that stay."""

    name = "staying_notices"
    layer = 20
    shows = "The lasting messages"
    notices: Notices
    window_look: WindowLook
    keyboard: Keyboard
    window: Window
    _seen: tuple[int, int] = field(default=(0, 0), init=False)  # how many there are, and how many are shown

    def advance(self, now: float) -> None:
        """Have the window drawn where other messages are shown."""
        seen = self.notices.count, len(self.notices.shown(now))
        if seen != self._seen:
            self.window.touch()  # ImGui shows a window that fits its content from the second frame on
            self._seen = seen

    def dialog(self, view: ViewArea) -> None:
        """Declare it over the 3D view."""
        self.notices.draw_staying(view, self.window_look.palette.broken, self.keyboard)


def _replaces(new: Notice, former: Notice) -> bool:
    """Whether a message is not to be shown any longer beside another."""
    if new.offer is not None and former.offer is not None:
        return new.offer.about == former.offer.about
    return new.is_problem and former.text == new.text


def draw_text(text: str, corner: ImVec2, extent: ImVec2, wrap: float, pad: ImVec2) -> None:
    """Declare a text on a plate. corner: in the ImGui window. extent: of the text. wrap: its width."""
    start = imgui.get_window_pos() + corner
    behind = imgui.get_color_u32(imgui.Col_.window_bg, 0.92)
    imgui.get_window_draw_list().add_rect_filled(start - pad, start + extent + pad, behind, pad.y)
    imgui.set_cursor_pos(corner)
    imgui.push_text_wrap_pos(corner.x + wrap)
    imgui.text_unformatted(text)
    imgui.pop_text_wrap_pos()
