"""What a tool knows of the window, and can ask it for."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ..analysis.pick import Picked
from ..document.document import Document
from ..document.part import Part
from ..files import working_folder
from ..geometry import Vector
from ..rigid import STILL, Rigid
from ..scan.pose import Pose
from ..scan.timeline import Timeline, TimelineClosed
from ..scan.units import Scale
from ..task import Cancelled, Task, in_background
from .followed import Followed
from .laid import NumbersOf, PlaceOf
from .scene.viewport import Viewport
from .session import named_like

if TYPE_CHECKING:
    from .toolbox import Toolbox

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Click:
    """A click in the view.

    picked: what is seen there, with its spacing; None where nothing is. Its `place` is where the surface is
    at the pixel, its `point` the point of the scan that is seen there, None where a hole is filled. pose:
    that the picture shows. through_gap: whether the very pixel shows something farther, through a gap.
    motion: of the pose, see `ToolContext.lay`; positions of `picked` are in the moved scan. pixel: of the
    picture, the one that shows the surface that is meant, (column, row).
    """

    picked: Picked | None
    pose: Pose
    through_gap: bool = False
    motion: Rigid = STILL
    pixel: tuple[int, int] = (0, 0)


@dataclass(frozen=True)
class FrameSpan:
    """Frames that are marked on the timeline. color: 0xRRGGBB. words: that are told of them there."""

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


class ToolContext:
    """The window as one tool sees it.

    name: of the tool's module. settings: the tool's `Settings`, which it replaces by others; None where it
    declares none. works: what runs for it. is_revealed: whether the panel has yet to show its section.
    """

    def __init__(self, toolbox: Toolbox, name: str) -> None:
        self._toolbox = toolbox
        self.name = name
        self.settings: Any = None
        self.works: list[Work] = []
        self.is_revealed = False

    # --- the scan ---------------------------------------------------------------------

    @property
    def timeline(self) -> Timeline:
        """The scan that is open."""
        return self._toolbox.playback.timeline

    @property
    def scan(self) -> str:
        """The name of the open scan, as the user gave it."""
        return self._toolbox.session.scan

    def free_file(self, ending: str) -> Path:
        """A file for what is made of the scan, named like it, that is not there yet. ending: of its name, as
        "_distances.csv"."""
        return named_like(self.scan, working_folder(), ending)

    @property
    def pose(self) -> Pose | None:
        """The pose that is shown; None before the first."""
        return self._toolbox.playback.pose

    @property
    def index(self) -> int:
        """The frame that the user is at, whose pose may still be read."""
        return self._toolbox.session.index

    @property
    def unit(self) -> str:
        """The unit of length: as the user calls it, else as the scan tells, else "units"."""
        return self._toolbox.playback.unit

    @property
    def scale(self) -> Scale:
        """How lengths are told: in the unit that the user wants to see, and how many of it one unit is."""
        return self._toolbox.playback.scale

    @property
    def viewport(self) -> Viewport:
        """The view of the scan: its picture, and what a pixel of it shows."""
        return self._toolbox.viewport

    def seek(self, index: int) -> None:
        """Go to a frame."""
        self._toolbox.playback.seek(index, time.monotonic())
        self.redraw()

    def seen_at(self, position: Vector, step: tuple[int, int] = (0, 0)) -> Click | None:
        """Find the click that one at a place would be, moved by so many pixels to the right and up;
        None where the place is not in the view. position: scan units, where the scan is moved to."""
        return self._toolbox.seen_at(position, step)

    def motion(self, pose: Pose) -> Rigid:
        """The motion of a pose from the scan's coordinates to where it is shown, by what all tools lay."""
        return self._toolbox.session.laid.layers(pose).world_from_pose

    def lay(self, numbers: NumbersOf | None = None, place: PlaceOf | None = None) -> None:
        """Lay numbers over the points of the open scan, and move its poses; what the tool laid before goes.

        numbers: gives those of a pose, name -> (N,) array by row of its cloud, empty where there are none;
        they are colours to choose, and are picked, like the scan's own. It is asked when a pose comes to be
        shown, so it answers with arrays that are there already; those that it gave before are not uploaded
        again. place: gives the motion of a pose by its index. Without either, nothing is laid. To change
        something, lay it anew. All is taken away when another scan is opened, and none of it is kept.
        """
        self._toolbox.lay(self.name, numbers, place)

    @property
    def followed(self) -> Followed:
        """Landmarks of the open scan through time, and the measures of them, as far as they are known."""
        return self._toolbox.followed

    # --- the document -----------------------------------------------------------------

    @property
    def document(self) -> Document:
        """The document of the open scan: what the user has chosen and made for it."""
        return self._toolbox.session.document

    def change(self, name: str, *parts: Part, merge: Hashable = None, **fields: Any) -> None:
        """Change the document: what a tool keeps, and fields by name. The user can undo it.

        name: of the step, such as "Delete note". merge: with the step before where that had this key and has
        not come to an end. Raises TypeError where a part holds what cannot be kept, and changes nothing.
        """
        for part in parts:
            part.check_kept(self.document.part(type(part)))
        self._toolbox.session.change(name, *parts, merge=merge, **fields)

    # --- the window -------------------------------------------------------------------

    @property
    def has_clicks(self) -> bool:
        """Whether clicks in the view come to this tool."""
        return self._toolbox.clicking == self.name

    def take_clicks(self) -> None:
        """Have clicks in the view come to this tool, and to no other."""
        self._toolbox.clicking = self.name
        self.redraw()

    def leave_clicks(self) -> None:
        """Let clicks in the view be as without a tool."""
        if self.has_clicks:
            self._toolbox.clicking = None
            self.redraw()

    def note(self, text: str) -> None:
        """Tell the user something."""
        self._toolbox.note(text)

    def redraw(self) -> None:
        """Draw the window again, since something that it shows has changed."""
        self._toolbox.redraw()

    def reveal(self) -> None:
        """Open the tool's section of the panel, and scroll to its end."""
        self.is_revealed = True

    def run(self, name: str, work: Callable[[], T], then: Callable[[T], object]) -> Task:
        """Do work on a thread of its own, which the user sees by this name and may cancel.

        Long loops in it call `task.checkpoint`. then: takes the result, on the window's thread; it is not
        called where the work was cancelled. An InputError that the work raises is told, anything else
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
