"""Dense tracking: every point of a frame is followed through all frames, and colours show how it moves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from imgui_bundle import icons_fontawesome_6 as icons
from numpy.typing import NDArray

from ....analysis.motion.quantities import DISPLACEMENT, QUANTITIES, frames_needed
from ....errors import InputError
from ....output.overlays import NOTHING_DRAWN, DrawnMarks, FollowedMarks
from ....scan.pose import Pose
from ...commands import Command
from ...tool_context import ToolContext
from ...ui import Ui
from .._colored import Colored
from .._painting import Painted, Painting, PaintingTool, Sphere
from . import panel
from .choices import DenseTracking
from .point_colors import PointColors
from .point_follower import PointFollower
from .region_path import RegionPath

TITLE = "Dense tracking"


class Tool(PaintingTool):
    """The tool that follows points. follower: has them followed. colors: has numbers of them found.
    colored: sets their colours. painting: the brush that paints a region. region_path: has its mean path
    found."""

    def __init__(self, context: ToolContext) -> None:
        self.context = context
        self.follower = PointFollower(context)
        self.colors = PointColors(context)
        self.colored = Colored(context, {name: one.is_signed for name, one in QUANTITIES.items()})
        self.region_path = RegionPath(context)
        self.painting = Painting(
            context,
            Painted(
                "tracked region", lambda: self.choices.reference, lambda: self.choices.spheres, self._paint,
                "Drag over the part whose mean path you want, such as a corner of the mouth.",
            ),
        )  # fmt: skip
        self._laid: tuple[object, ...] = ()

    @property
    def choices(self) -> DenseTracking:
        """The choices about the open scan."""
        return self.context.document.part(DenseTracking)

    @property
    def frame(self) -> int:
        """The frame that is shown."""
        return self.context.index if self.context.pose is None else self.context.pose.index

    @property
    def color(self) -> str:
        """The number of followed points that the colours show; "" for none."""
        return self.colored.name

    def choose(self, step: str, **changes: Any) -> None:
        """Change choices. step: what Undo calls it."""
        self.context.change(step, self.choices.changed(**changes))

    def _paint(self, step: str, spheres: tuple[Sphere, ...]) -> None:
        self.choose(step, spheres=spheres)

    def follow(self) -> None:
        """Follow the points and colour them by displacement; or colour as usual. Raises InputError for a scan
        of one frame."""
        self.color_by("" if self.color else DISPLACEMENT)
        if self.color:
            self.context.reveal()

    def color_by(self, name: str) -> None:
        """Colour by a number of QUANTITIES, for which points are followed; "": as usual. Raises InputError
        for a scan of one frame."""
        if not name:
            self.colored.reset()
            return
        if len(self.context.timeline) < 2:
            raise InputError("The scan has one frame, so there is no motion to follow.")
        step = "Colour by displacement" if self.choices.is_on else "Follow points"
        self.colored.show(step, name, self.colors.end(name) or 1.0, self.choices.changed(is_on=True))
        self.follower.resume()
        self._lay()  # the numbers, not known yet, are there before the next picture asks for them

    def advance(self, budget: float) -> bool:
        """Have points followed, and the scan coloured by them; whether there is something new."""
        choices = self.choices
        is_new = self.follower.advance(choices.reference, choices.is_on or bool(self.color))
        work = self.follower.work
        points = self.context.followed.points = None if work is None or not work.is_whole else work.points
        self.region_path.advance(points, choices.spheres)
        self.context.followed.curves[self.context.name] = self.region_path.curves(choices.reference)
        self.colors.advance(self.follower.points, self.color)
        self.colored.fit(self.color, self.colors.end(self.color))
        return self._lay() or is_new

    def _lay(self) -> bool:
        """Lay the numbers over the frame that is shown; whether others than before."""
        name, pose = self.color, self.context.playback.pose
        values = None if pose is None or not name else self.colors.of(pose)
        wanted = (self.context.timeline, name, values is not None and id(values))
        if wanted == self._laid:
            return False
        self._laid = wanted
        self.context.lay(self._numbers)  # also without a colour: Undo may bring one back
        return True

    def _numbers(self, pose: Pose) -> Mapping[str, NDArray[Any]]:
        return {self.color: self.colors.of(pose)} if self.color else {}

    def drawn(self, frame: int) -> DrawnMarks:
        """How the numbers of a frame of a saved picture are found again."""
        if not self.color:
            return NOTHING_DRAWN
        reference = self.choices.reference
        needed = {reference, *frames_needed(self.color, frame, len(self.context.timeline))}
        motions = {index: self.context.motion_of(index) for index in needed}
        known = {index: motion for index, motion in motions.items() if motion is not None}
        return DrawnMarks(followed=FollowedMarks(reference, known))

    def panel(self, ui: Ui) -> None:
        """Declare the section of the panel."""
        panel.draw(self, ui)


COMMANDS = {
    "Tools": (
        Command(
            "follow_points", "Follow points", Tool.follow, "Shift+D",
            is_on=lambda tool: bool(tool.color), can=lambda tool: len(tool.context.timeline) > 1,
            short="Follow points", icon=icons.ICON_FA_BRAILLE,
        ),
    )
}  # fmt: skip
