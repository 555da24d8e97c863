"""What goes wrong in the window itself becomes a message, and the window goes on."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from operator import attrgetter

from imgui_bundle import imgui

from ..errors import failure_in_words
from ..task import Cancelled
from .notices import Problem

log = logging.getLogger(__name__)
_PAUSE = 10.0  # seconds without it, after which the same is reported again
_PAIRS = {  # the stacks of ImGui, outermost first -> the calls that come in pairs
    "window": "begin() and end(), or begin_child() and end_child()",
    "begin_popup": "begin_popup() and end_popup()",
    "group": "begin_group() and end_group()",
    "tree": "tree_push() and tree_pop(), or tree_node() and tree_pop()",
    "id": "push_id() and pop_id()",
    "color": "push_style_color() and pop_style_color()",
    "style_var": "push_style_var() and pop_style_var()",
    "font": "push_font() and pop_font()",
    "disabled": "begin_disabled() and end_disabled()",
    "item_flags": "push_item_flag() and pop_item_flag()",
    "focus_scope": "push_focus_scope() and pop_focus_scope()",
}
_sizes = attrgetter(*(f"size_of_{stack}_stack" for stack in _PAIRS))


class Failures:
    """count: of all there were."""

    def __init__(self, note: Callable[[str], None]) -> None:
        """note: tells the user something."""
        self.count = 0
        self._note = note
        self._last: dict[str, float] = {}  # by the clock, when each happened

    @contextmanager
    def reported(self, what: str) -> Iterator[None]:
        """Report whatever goes wrong inside, and end the widgets that were begun there. what: goes on."""
        try:
            with widgets_ended():
                yield
        except (Exception, Cancelled) as error:
            self.report(what, error)

    def report(self, what: str, error: BaseException, words: str = "") -> None:
        """Report what went wrong: once, however many frames in a row it does.

        what: was being done. words: to tell it in; else those of `failure_in_words`.
        """
        now, self.count = time.monotonic(), self.count + 1
        before, self._last[what] = self._last.get(what, -math.inf), now
        if now - before > _PAUSE:
            log.error("%s failed", what, exc_info=error)
            self._note(Problem(words or failure_in_words(what, error)))


@contextmanager
def widgets_ended() -> Iterator[None]:
    """Whatever goes wrong inside goes on from here, and the widgets that were begun there are ended.

    Raises RuntimeError where nothing else goes wrong but ImGui's stacks are not as they were: left so, they
    would have no widget after these be itself.
    """
    state = _state_of_widgets()
    try:
        yield
        if state is not None:
            _check_balance(_sizes(state))
    except BaseException:
        if state is not None:
            _end_widgets(state)
        raise


def _check_balance(before: tuple[int, ...]) -> None:
    after = _sizes(_state_of_widgets())
    for calls, size, now in zip(_PAIRS.values(), before, after, strict=True):
        if size != now:
            raise RuntimeError(f"{calls} were not called equally often")


def _state_of_widgets() -> imgui.internal.ErrorRecoveryState | None:
    """The state of the widgets that have begun; None outside of a frame."""
    context = imgui.get_current_context()
    if context is None or not context.within_frame_scope:
        return None
    state = imgui.internal.ErrorRecoveryState()
    imgui.internal.error_recovery_store_state(state)
    return state


def _end_widgets(state: imgui.internal.ErrorRecoveryState) -> None:
    """End what has begun since then, without an error and a line in ImGui's log for each."""
    io, context = imgui.get_io(), imgui.get_current_context()
    before = io.config_error_recovery_enable_assert, io.config_error_recovery_enable_tooltip
    flags, context.debug_log_flags = context.debug_log_flags, 0
    io.config_error_recovery_enable_assert = io.config_error_recovery_enable_tooltip = False
    imgui.internal.error_recovery_try_to_recover_state(state)
    io.config_error_recovery_enable_assert, io.config_error_recovery_enable_tooltip = before
    context.debug_log_flags = flags
