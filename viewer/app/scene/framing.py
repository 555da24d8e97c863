"""Where the subject is, which views are fitted to and may follow from frame to frame."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...bounds import Bounds
from ...camera import Camera
from ...geometry import vector
from ...scan.pods import first_camera, subject_of
from ...scan.pose import Pose
from ...scan.timeline import Timeline
from ...scan.upright import Upright
from ..commands import Command
from ..part import WindowPart
from ..playing.playback import FRAMES, Playback
from ..session import Session
from .extent import Extent
from .viewport import Viewport


@dataclass(eq=False)
class Framing(WindowPart):
    """Finds the subject, and cameras that show it.

    extent: the bounds of known frames. follows: whether the view goes with the subject from frame to frame.
    """

    name = "framing"
    doing = "Finding the subject"
    session: Session
    playback: Playback
    viewport: Viewport

    def __post_init__(self) -> None:
        self.extent: Extent = Extent()
        self.follows: bool = False
        self._followed: Pose | None = None  # where the camera is with the subject

    def begin_scan(self, timeline: Timeline) -> None:
        """Take in that another scan is shown from now on."""
        self.follows, self._followed = False, None
        self.extent.begin(timeline)

    def close(self) -> None:
        """Visit no more frames."""
        self.extent.close()

    def bounds(self, pose: Pose) -> Bounds:
        """The robust bounds of a pose, where tools move it to."""
        return self.session.laid.layers(pose).world_from_pose.bounds(self.viewport.bounds(pose))

    def whole(self, pose: Pose) -> Bounds:
        """The bounds of all frames together, as far as they are known; of the pose alone where tools move it,
        or the view goes with the subject."""
        is_moved = not self.session.laid.layers(pose).world_from_pose.is_identity
        return self.bounds(pose) if is_moved or self.follows else self.extent.around(self.bounds(pose))

    def framed(self, camera: Camera, pose: Pose) -> Camera:
        """Move a camera, in the same direction, to where it shows the subject."""
        subject = self.subject(pose)
        if subject is None:
            return camera.fit(self.whole(pose), self.viewport.aspect)
        motion = self.session.laid.layers(pose).world_from_pose
        return camera.framing(motion.points(subject), self.viewport.aspect)

    def subject(self, pose: Pose) -> NDArray[np.float64] | None:
        """The points of what one depth camera looks at, as of `subject_of`."""
        return subject_of(pose.views, pose.sample + pose.origin, self.whole(pose), self._upright(pose))

    def first_camera(self, pose: Pose) -> Camera:
        """The camera that a scan is first shown with."""
        is_moved = not self.session.laid.layers(pose).world_from_pose.is_identity
        views = () if is_moved else pose.views
        return first_camera(views, self.whole(pose), self.viewport.aspect, self._upright(pose))

    def _upright(self, pose: Pose) -> Upright:
        """The up axis and the front that the user has chosen, or the scan itself tells."""
        return replace(pose.upright, up=self.session.document.look.up, front=self.session.document.front)

    def follow(self, pose: Pose, camera: Camera | None) -> None:
        """Move the camera, and what it turns about, as far as the subject has gone since the pose before;
        where the view goes with the subject. camera: None where there was none."""
        before, self._followed = self._followed, pose
        if camera is not None and self.follows and before is not None and pose is not before:
            by = self._center(pose) - self._center(before)
            pivot = self.session.document.pivot
            self.session.amend(camera=camera.moved(by), pivot=pivot and vector(np.add(pivot, by)))

    def _center(self, pose: Pose) -> NDArray[np.float64]:
        """The middle of a subject, (3,) in the world: far outliers do not move it."""
        middle = np.median(pose.sample, axis=0) + pose.origin
        return self.session.laid.world_from_pose(pose.index).points(middle)

    def toggle_following(self) -> None:
        """Go with the subject from now on, or stay."""
        self.follows, self._followed = not self.follows, self.playback.pose

    COMMANDS = (
        Command(
            "follow", "Follow the subject", toggle_following, "Shift+F", FRAMES,
            is_on=lambda framing: framing.follows,
        ),
    )  # fmt: skip
