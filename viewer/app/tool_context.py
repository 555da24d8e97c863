"""What a tool knows of the window, and can ask it for."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, TypeVar

from ..document.document import Document
from ..document.part import Part
from ..files import working_folder
from ..geometry import Vector
from ..rigid import Rigid
from ..scan.pose import Pose
from ..scan.timeline import Timeline, TimelineClosed
from ..scan.units import Scale
from ..task import Cancelled, Task, in_background
from .clicks import Click, Clicks
from .followed import Followed
from .laid import MotionOf, NumbersOf
from .playing.playback import Playback
from .scene.viewport import Viewport
from .session import Session, named_like

T = TypeVar("T")


@dataclass(frozen=True)
class FrameSpan:
    """Frames that are marked on the timeline. color: 0xRRGGBB. words: that the timeline shows of them."""

    frames: range
    color: int
    words: str


@dataclass(frozen=True)
class Work:
    """A piece of work that runs beside the window for a tool. then: takes its result."""

    task: Task
    future: Future[Any]
    then: Callable[[Any], object]

    def finish(self) -> None:
        """Hand over the result, unless the work was cancelled or its scan is not open any more; raises what
        else that raised."""
        if self.task.cancelled:
            return
        try:
            result = self.future.result()
        except (Cancelled, TimelineClosed):  # the former where closing has ended reading that it waited for
            return
        self.then(result)


class Lay(Protocol):
    """Lays something over the open scan for a tool."""

    def __call__(self, numbers: NumbersOf | None = None, motion: MotionOf | None = None) -> None:
        """Lay numbers over the points of the open scan, and move its poses; what the tool laid before goes.

        numbers: gives those of a pose, name -> (N,) array by row of its cloud, empty where there are none;
        they are colours to choose, and are picked, like the scan's own. It is asked when a pose comes to be
        shown, so it answers with arrays that are there already; those that it gave before are not uploaded
        again. motion: gives the motion of a pose by its index. Without either, nothing is laid. To change
        something, lay it anew. All is taken away when another scan is opened, and none of it is kept.
        """


@dataclass(eq=False)
class ToolContext:
    """The window as one tool sees it.

    name: of the tool's module. viewport: the view of the scan: its picture, and what a pixel of it shows.
    followed: landmarks of the open scan through time, and the measures of them, as far as they are known.
    note: shows the user a message. redraw: has the window drawn again, since something that it shows has
    changed. settings: the tool's `Settings`, which it replaces by others; None where it declares none. works:
    what runs for it. is_revealed: whether the panel has yet to show its section.
    """

    name: str
    session: Session
    playback: Playback
    viewport: Viewport
    clicks: Clicks
    followed: Followed
    lay: Lay
    note: Callable[[str], None]
    redraw: Callable[[], None]
    settings: Any = None
    works: list[Work] = field(default_factory=list)
    is_revealed: bool = False

    # --- the scan ---------------------------------------------------------------------

    @property
    def timeline(self) -> Timeline:
        """The scan that is open."""
        return self.playback.timeline

    @property
    def scan(self) -> str:
        """The name of the open scan, as the user gave it."""
        return self.session.scan

    def free_file(self, ending: str) -> Path:
        """A file for what is made of the scan, named like it, that is not there yet. ending: of its name, as
        "_distances.csv"."""
        return named_like(self.scan, working_folder(), ending)

    @property
    def pose(self) -> Pose | None:
        """The pose that is shown, as measures use it; None before the first."""
        pose = self.playback.pose
        return None if pose is None else pose.measured

    @property
    def index(self) -> int:
        """The frame that the user is at, whose pose may still be read."""
        return self.session.index

    @property
    def unit(self) -> str:
        """The unit of length: as the user calls it, else as the scan tells, else "units"."""
        return self.playback.unit

    @property
    def scale(self) -> Scale:
        """The scale of displayed lengths: the unit that the user wants to see, and how many of it one unit
        is."""
        return self.playback.scale

    def seek(self, index: int) -> None:
        """Go to a frame."""
        self.playback.seek(index, time.monotonic())
        self.redraw()

    def seen_at(self, position: Vector, step: tuple[int, int] = (0, 0)) -> Click | None:
        """Find the click that one at a position would be, moved by so many pixels to the right and up;
        None where the position is not in the view. position: scan units, where the scan is moved to."""
        return self.clicks.near(position, step)

    def motion(self, pose: Pose) -> Rigid:
        """The motion of a pose from the scan's coordinates to where it is shown, by what all tools lay."""
        return self.session.laid.layers(pose).world_from_pose

    def motion_of(self, frame: int) -> Rigid | None:
        """The motion of a frame likewise, which need not have been read; None in a gap of a stabilised
        scan."""
        still = self.followed.still
        is_gap = still is not None and still[frame] is None
        return None if is_gap else self.session.laid.world_from_pose(frame)

    # --- the document -----------------------------------------------------------------

    @property
    def document(self) -> Document:
        """The document of the open scan: what the user has chosen and made for it."""
        return self.session.document

    def change(self, name: str, *parts: Part, merge: Hashable = None, **fields: Any) -> None:
        """Change the document: what a tool keeps, and fields by name. The user can undo it.

        name: of the step, such as "Delete note". merge: with the step before where that had this key and has
        not come to an end. Raises TypeError where a part holds what cannot be kept, and changes nothing.
        """
        for part in parts:
            part.check_storable(self.document.part(type(part)))
        self.session.change(name, *parts, merge=merge, **fields)

    def amend(self, **fields: Any) -> None:
        """Set fields of the document that no user changed, such as a range that is found. It is no step."""
        self.session.amend(**fields)

    # --- the window -------------------------------------------------------------------

    @property
    def has_clicks(self) -> bool:
        """Whether clicks in the view come to this tool."""
        return self.clicks.owner == self.name

    def take_clicks(self) -> None:
        """Have clicks in the view come to this tool, and to no other."""
        self.clicks.owner = self.name
        self.redraw()

    def leave_clicks(self) -> None:
        """Let clicks in the view be as without a tool."""
        if self.has_clicks:
            self.clicks.owner = None
            self.redraw()

    def reveal(self) -> None:
        """Open the tool's section of the panel, and scroll to its end."""
        self.is_revealed = True

    def run(self, name: str, work: Callable[[], T], then: Callable[[T], object]) -> Task:
        """Do work on a thread of its own, which the user sees by this name and may cancel.

        Long loops in it call `task.checkpoint`. then: takes the result, on the window's thread; it is not
        called where the work was cancelled. An InputError that the work raises is reported, anything else
        switches the tool off.
        """
        task = Task(name)
        self.works.append(Work(task, in_background(task, work), then))
        return task

    def take_done(self) -> list[Work]:
        """The work that has ended, once."""
        done = [work for work in self.works if work.future.done()]
        self.works = [work for work in self.works if work not in done]
        return done

    def cancel_work(self) -> None:
        """Stop all that runs for the tool."""
        for work in self.works:
            work.task.cancel()
        self.works.clear()
