"""Draws each point as a square of pixels, and shows the nearest square at each pixel.

`points` is the fastest renderer, and draws each point exactly at its position. A surface can have gaps
between its points, through which farther points are visible. `hide_hidden` leaves out points behind a
surface.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import InputError
from ..gpu.pose import GpuPose
from ..params import param
from ..picture.surface import Surface
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..splatting.squares import LARGEST_SQUARE, draw_squares, foresee_squares
from ..visibility.search import mark_visible
from ..visibility.spacing import foresee_spacing
from . import Backend, FrameView, Suited, share_param, with_levels


@dataclass(frozen=True)
class Params:
    """Parameters of the points backend."""

    point_size: int = param(
        1,
        "Edge length of a point's square; 0: the spacing of the points",
        low=0,
        high=LARGEST_SQUARE,
        unit="px",
        sweep=(0, 1, 2, 4),
        basic=True,
    )
    hide_hidden: bool = param(
        False,
        "Leave out hidden points, which lie behind a surface of other points. Scan4D estimates this "
        "surface from the points alone",
        key="Shift+V",
        title="Hide what lies behind",
        sweep=(False, True),
        basic=True,
    )
    share: float = share_param()


class PointSquares(Backend):
    """The backend `points`."""

    title = "Points"
    good_for = "Fastest, with exact positions"
    params_class = Params
    accumulates = True
    takes_parts = True

    def needs(self, pose: Pose, params: Params) -> tuple[str, ...]:
        """Nothing but positions."""
        return ()

    def suits(self, pose: Pose) -> Suited:
        """Any scan, with squares that touch: nothing has to be there, or estimated."""
        return Suited(0, {"point_size": 0})

    def offers(self, pose: Pose) -> tuple[dict[str, object], ...]:
        """Squares that touch, and pixels; of range views, the points would have to be merged."""
        return () if pose.views else with_levels(pose, {"point_size": 0}, {})

    def foresee(self, cloud: PointCloud, params: Params) -> None:
        """Find the spacing of points where squares or the search for visible points go by it."""
        if not len(cloud):
            return
        if params.point_size == 0:
            foresee_squares(cloud)
        if params.hide_hidden:
            foresee_spacing(cloud)

    def awaits_facts(self, params: Params) -> bool:
        """Whether it searches for visible points."""
        return params.hide_hidden

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Scatter the points; complete where all shall be drawn."""
        params: Params = frame.params
        if params.hide_hidden and pose.is_split:
            raise InputError(
                f"cannot hide points behind others among more than {pose.gpu.max_points:,} points",
                "hide_hidden",
                "Switch hide_hidden off, or thin out the scan",
            )
        shown = mark_visible(pose, frame, surface) if params.hide_hidden and len(pose.cloud) else None
        stays = "pose" not in frame.changed
        return draw_squares(pose, surface, params.point_size, frame.share, shown, stays, frame.before)
