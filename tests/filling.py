"""Points, and what lies between them filled from the nearest: a backend for tests of filled pixels.

Where no point is seen, up to three pixels away, a pixel takes the mean of the nearest that are.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from viewer.backends import FrameView, Suited
from viewer.backends import points as plain
from viewer.gpu.pose import GpuPose
from viewer.params import param
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose

SHADER = str(Path(__file__).with_suffix(".comp").resolve())
CHANNELS = ("color", "normal", "value")


@dataclass(frozen=True)
class Params(plain.Params):
    """Parameters of the points, and of filling."""

    levels: int = param(3, "How far away what fills a pixel may be, pixels", low=0, high=8)
    blends: bool = param(True, "Fill with what is around; off: with a depth alone")


class Filling(plain.PointSquares):
    """Points, and what fills the pixels around them."""

    title = "Filling"
    good_for = "Tests"
    params_class = Params
    accumulates = False
    fills = True

    def suits(self, pose: Pose) -> Suited | None:
        """No scan."""
        return None

    def offers(self, pose: Pose) -> tuple[dict[str, object], ...]:
        """Nothing."""
        return ()

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Scatter the points, then fill."""
        params: Params = frame.params
        refinable = super().draw(pose, frame, surface)
        gpu, blends = surface.gpu, params.blends
        gathered = [n for n in CHANNELS if blends and _is_there(n, pose, surface)]
        for name in gathered:
            surface.resolve(name)
        fill = gpu.compute(
            SHADER, {f"FILL_{name.upper()}": int(name in gathered) for name in CHANNELS}, params=params
        )
        surface.bind_textures()
        surface.bind_storage()
        surface.bind_own("level", *gathered)
        with gpu.timers.measure("fill"):
            gpu.dispatch(fill, surface.size[0] * surface.size[1])
        return refinable


def _is_there(name: str, pose: GpuPose, surface: Surface) -> bool:
    if name == "value":
        return surface.row_values is not None
    return pose.find(f"{name}s") is not None


BACKEND = Filling("filling")
