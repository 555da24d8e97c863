"""What the user is told: short notes over the picture that go by themselves, and a log that stays."""

from __future__ import annotations

import logging
import math
import time
from dataclasses import dataclass
from datetime import datetime

from imgui_bundle import ImVec2, imgui

from ..files import printable

log = logging.getLogger(__name__)
_LASTS = 4.0, 0.06  # seconds, and as much more for each letter
_MOST_SHOWN = 3
_MOST_KEPT = 1000
_WIDTH, _FOOT = 34.0, 4.5  # in heights of the font; the foot is where the scale bar is


@dataclass(frozen=True)
class Notice:
    """One message. at: when it came, local time. until: by the clock, when it goes."""

    text: str
    at: datetime
    until: float


class Notices:
    """All messages, the last one at the end."""

    def __init__(self) -> None:
        self.all: list[Notice] = []
        self.count = 0  # ever told

    def tell(self, text: str) -> None:
        """Show a message for as long as it takes to read, and keep it in the log."""
        text = printable(text)
        log.info("%s", text)
        seconds, per_letter = _LASTS
        until = time.monotonic() + seconds + per_letter * len(text)
        self.all.append(Notice(text, datetime.now(), until))
        del self.all[:-_MOST_KEPT]
        self.count += 1

    def shown(self, now: float) -> list[Notice]:
        """Notices to show over the picture, the oldest first."""
        return [notice for notice in self.all[-_MOST_SHOWN:] if notice.until > now]

    def next_change(self, now: float) -> float:
        """Seconds until one of those shown goes; infinite where none is shown."""
        return min((notice.until - now for notice in self.shown(now)), default=math.inf)

    def on_escape(self) -> bool:
        """Show none of them any longer."""
        self.all = [Notice(notice.text, notice.at, 0.0) for notice in self.all]
        return True


def draw(notices: Notices, size: ImVec2) -> None:
    """Declare notes in the current ImGui window, the 3D view. size: of the view."""
    em = imgui.get_font_size()
    wrap = min(_WIDTH * em, 0.8 * size.x)
    pad = ImVec2(0.8 * em, 0.5 * em)
    bottom = size.y - _FOOT * em
    for notice in reversed(notices.shown(time.monotonic())):
        extent = imgui.calc_text_size(notice.text, wrap_width=wrap)
        corner = ImVec2((size.x - extent.x) / 2, bottom - extent.y)
        draw_text(notice.text, corner, extent, wrap, pad)
        bottom = corner.y - 2 * pad.y - 0.4 * em


def draw_text(text: str, corner: ImVec2, extent: ImVec2, wrap: float, pad: ImVec2) -> None:
    """Declare a text on a plate. corner: in the ImGui window. extent: of the text. wrap: its width."""
    start = imgui.get_window_pos() + corner
    behind = imgui.get_color_u32(imgui.Col_.window_bg, 0.92)
    imgui.get_window_draw_list().add_rect_filled(start - pad, start + extent + pad, behind, pad.y)
    imgui.set_cursor_pos(corner)
    imgui.push_text_wrap_pos(corner.x + wrap)
    imgui.text_unformatted(text)
    imgui.pop_text_wrap_pos()
