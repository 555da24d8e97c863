"""A stream of noisy scanners (Preiner 2012, Fig. 12): four pods around a head, with new noise in each frame.

The demo's head stands in for the paper's figure. A frame is the positions that all pods measure, and nothing
else, so it is drawn by the default renderer of bare points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from experiments.pictures import SHADING, drawn, renderer
from experiments.preiner_2012.fits import BAND
from viewer.bench.truth.head_mesh import head_mesh
from viewer.bench.truth.surface import reference_surface
from viewer.camera import Camera
from viewer.drawing.request import Request
from viewer.mesh.reference import Reference, trace, visible_pixels
from viewer.scan.averaging import Averaging, averaged
from viewer.scan.pose import Pose
from viewer.scan.range_view import RangeView, merge
from viewer.simulate.scanner import Faults, around, measured, rig

PODS, FRAMES = 4, 3
SIZE = (640, 480)
_POD_SIZE = (320, 240)
_RATE = 30.0  # frames a second
_STEP, _FAR = 10.0, 1e4  # mm: depths so far apart are of two surfaces; where there is none

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Steadiness:
    """What is wrong with the pictures of a stream.

    holes: the share of the pixels that show what some pod sees, away from silhouettes, that are empty, %.
    flicker: the median change from frame to frame that is not in the truth, levels of 255.
    """

    backend: str
    holes: float
    flicker: float


class Stream:
    """Frames of pods around the demo's head.

    moves: whether the head does. before: how many frames are measured before those that are drawn, for
    averages. footprint: the width of a pod's pixel on the head, mm.
    """

    def __init__(self, moves: bool, before: int) -> None:
        self._before = before
        times = [number / _RATE if moves else 0.0 for number in range(before + FRAMES)]
        self._times, self._meshes = times, {time: head_mesh(time) for time in times}
        bounds = self._meshes[times[0]].bounds
        self._pods = rig(bounds, around(PODS), aspect=_POD_SIZE[0] / _POD_SIZE[1])
        self._camera = Camera.orbit(bounds, 30, 10, aspect=SIZE[0] / SIZE[1])
        self.footprint = self._pods[0].view_height / _POD_SIZE[1]

    @cached_property
    def _seen_by_pods(self) -> dict[float, list[Reference]]:
        """What each pod truly sees at each time."""
        return {
            time: [trace(mesh, pod, _POD_SIZE) for pod in self._pods] for time, mesh in self._meshes.items()
        }

    @cached_property
    def _truths(self) -> list[Reference]:
        """The true pictures of the frames that are drawn."""
        made = {
            time: trace(self._meshes[time], self._camera, SIZE) for time in set(self._times[self._before :])
        }
        return [made[time] for time in self._times[self._before :]]

    def frames(self, noise: float) -> list[Pose]:
        """The range views of all frames, each with noise of its own. noise: deviation, footprints."""
        faults = [Faults(noise=noise * self.footprint)] * PODS
        return [
            Pose.of(
                number,
                number / _RATE,
                "",
                measured(self._seen_by_pods[time], self._pods, faults, frame=number),
            )
            for number, time in enumerate(self._times)
        ]

    def judge(self, frames: Sequence[Pose], average: int) -> Steadiness:
        """Draw the last frames, each as the mean of so many, and compare them with the truth."""
        gpu, images, shown, backend = renderer().gpu, [], [], ""
        for number in range(self._before, len(frames)):
            request = Request(_bare(_averaged(frames, number, average)), self._camera, look=SHADING)
            renderer().work.prepare(request)
            surface = drawn(request, SIZE)
            images.append(surface.image()[..., :3].astype(float))
            shown.append(np.isfinite(surface.depth))
            backend = request.backend.name
            surface.release()
        inside = [
            visible_pixels(self._meshes[time], truth, self._pods) & ~_near_silhouettes(truth)
            for time, truth in zip(self._times[self._before :], self._truths, strict=True)
        ]
        true = [
            reference_surface(truth, gpu, SHADING).image()[..., :3].astype(float) for truth in self._truths
        ]
        empty = sum(np.count_nonzero(one & ~there) for one, there in zip(inside, shown, strict=True))
        changes = []
        for before, after in zip(range(FRAMES - 1), range(1, FRAMES), strict=True):
            both = inside[before] & inside[after] & shown[before] & shown[after]
            change = (images[after] - images[before]) - (true[after] - true[before])
            changes.append(np.abs(change[both]).mean(axis=1))
        holes = 100 * empty / sum(map(np.count_nonzero, inside))
        return Steadiness(backend, holes, float(np.median(np.concatenate(changes))))


def _averaged(frames: Sequence[Pose], number: int, average: int) -> Pose:
    """A frame as the timeline gives it."""
    averaging = Averaging(average)
    if not averaging.is_on:
        return frames[number]
    return averaged(frames[number], frames[number - average + 1 : number][::-1], averaging)


def _bare(pose: Pose) -> Pose:
    """The pose as one cloud of the positions that its views measure, and nothing else."""
    views: list[RangeView] = [replace(view, color=None, confidence=None) for view in pose.views]
    return Pose(pose.index, pose.time, pose.label, merge(views))


def _near_silhouettes(truth: Reference) -> Mask:
    """Which pixels (H, W) lie near a step of depth."""
    from scipy import ndimage

    depth, near = np.where(truth.covered, truth.depth, _FAR), 2 * BAND + 1
    return ndimage.maximum_filter(depth, near) - ndimage.minimum_filter(depth, near) > _STEP
