"""Samples of range views as points are: a backend for tests of rows that are samples.

It draws by positions that are found for each sample, with the very bits that merged points have, and writes
nothing of its own.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from viewer.backends import Backend, Derives, FrameView
from viewer.backends import points as plain
from viewer.gpu import gl
from viewer.gpu.bindings import Texture
from viewer.gpu.context import Gpu, Program
from viewer.gpu.pose import GpuPose
from viewer.gpu.scatter import Visits, scatter
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose
from viewer.scan.range_points import RangePoints
from viewer.view import View


class Positions:
    """The positions on the GPU."""

    def __init__(self, gpu: Gpu, positions: NDArray[np.float32]) -> None:
        self.texels = gl.BufferTexture(gpu.ctx.buffer(positions), gl.RGB32F)
        self.nbytes = positions.nbytes
        self.release: Callable[[], None] = self.texels.release


class Sampling(Backend):
    """Draws each sample as a square, like points."""

    title = "Sampling"
    good_for = "Tests"
    params_class = plain.Params
    rows = "samples"
    derives = Derives.ON_THREAD

    def needs(self, pose: Pose, params: plain.Params) -> tuple[str, ...]:
        """Range views."""
        return ("views",)

    def derive(self, pose: Pose, params: plain.Params, view: View | None) -> NDArray[np.float32]:
        """The position of each sample, (S, 3), NaN where there is none."""
        assert isinstance(pose.points, RangePoints)
        valid = np.flatnonzero(np.concatenate([view.valid().ravel() for view in pose.views]))
        positions = np.full((pose.points.firsts[-1], 3), np.nan, np.float32)
        positions[valid] = pose.points.of_samples("positions", valid)
        return positions

    def upload(self, gpu: Gpu, arrays: NDArray[np.float32]) -> Positions:
        """The positions on the GPU."""
        return Positions(gpu, arrays)

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Scatter the samples; complete where all shall be drawn."""
        surface.show_samples()
        rows, count = surface.take_sample(frame.share)

        def bind(_: Program) -> None:
            frame.derived.texels.bind(Texture.POSITIONS)
            if rows is not None:
                rows.bind(Texture.DRAWN_ROWS)

        defines = {"SINGLE": int(frame.params.point_size == 1), "SAMPLED": int(rows is not None)}
        visits = Visits("points/cells.glsl", count, bind, defines, frame.params)
        scatter(pose.gpu, visits, surface.depths, surface.rows)
        return rows is not None


BACKEND = Sampling("sampling")
