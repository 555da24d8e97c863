"""How often control moves between modules of the package while something runs, by `sys.setprofile`."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import viewer

ROOT = Path(viewer.__file__).parent


class Moves:
    """Calls from a module to another, and calls of each function, outside of what a backend draws.

    parts: the modules that count begin with one of these paths; what lies between them in a stack of calls
    does not.
    """

    def __init__(self, *parts: str) -> None:
        self.between: Counter[str] = Counter()  # "app/scene/viewport.py -> drawing/plan.py:make_plan"
        self.calls: Counter[str] = Counter()  # "drawing/plan.py:make_plan"
        self._parts, self._drawing = parts, 0

    @contextmanager
    def counted(self) -> Iterator[None]:
        """Count what runs inside."""
        sys.setprofile(self._note)
        try:
            yield
        finally:
            sys.setprofile(None)

    def _module(self, frame: FrameType | None) -> str | None:
        path = Path(frame.f_code.co_filename) if frame is not None else ROOT.parent
        name = path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else ""
        return name if name.startswith(self._parts) else None

    def _note(self, frame: FrameType, event: str, _: object) -> None:
        module, function = self._module(frame), frame.f_code.co_name
        if module is None or event not in ("call", "return"):
            return
        draws = module.startswith("backends/") and function == "draw"
        self._drawing -= draws and event == "return"
        if event == "call" and not self._drawing:
            caller = frame.f_back
            while caller is not None and self._module(caller) is None:
                caller = caller.f_back
            self.calls[f"{module}:{function}"] += 1
            if caller is not None and self._module(caller) != module:
                self.between[f"{self._module(caller)} -> {module}:{function}"] += 1
        self._drawing += draws and event == "call"
