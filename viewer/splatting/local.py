"""The local surface: in each pixel, the splats of the front layer vote on its depth.

Noise moves points in front of their surface and behind it, so the nearest splat of a pixel lies in front of
the surface. The local surface is the mean of all splats of its layer in place of the nearest (moving least
squares, Levin 2003), with the weights of the second pass. The noise of the points tells how thick the layer
is (docs/how-it-works/surfels.md).
"""

from __future__ import annotations

import math
from concurrent.futures import Future
from dataclasses import replace
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

from ..gpu.bindings import Storage
from ..gpu.context import Gpu
from ..gpu.pose import GpuPose
from ..params import param
from ..picture.frame_view import FrameView
from ..picture.surface import Surface
from ..scan.noise import Noise, known_noise, noise_of
from ..scan.points import PointCloud
from ..scan.pose import ScanKey
from ..task import Task, in_background
from .splats import Splats

NEAREST, LOCAL = SURFACES = ("nearest", "local")  # values of the parameter `surface`
DETAIL = 0.08  # deviations in spacings up to which curvature may be taken for noise
_THICK = 6.0  # deviations from the nearest splat of a layer to the farthest
_SMOOTHEST = 0.5  # factor on the falloff of weights where noise is a third of a spacing or more
_NOISY = 1 / 3


class PoseNoise:
    """The noise of a pose's points, estimated in the background. Made with `GpuPose.cached`."""

    nbytes = 0

    def __init__(self, pose: GpuPose) -> None:
        self._found: Noise | None = None
        self._future: Future[Noise] | None = None

    def find(self, pose: GpuPose, *, wait: bool) -> Noise | None:
        """The noise; without `wait`, None as long as it is not known."""
        if self._found is None:
            self._found = known_noise(pose.stored)
        if self._found is None and wait:
            with pose.preparing("derive"):
                self._found = noise_of(pose.stored)
        elif self._found is None:
            cloud = pose.stored
            if self._future is None:
                self._future = in_background(Task("Estimating noise"), lambda: noise_of(cloud))
            if self._future.done():
                self._found = self._future.result()
        return self._found

    def release(self) -> None:
        """Nothing is on the GPU."""


class NoiseEstimate(NamedTuple):
    """The noise that a picture goes by. is_own: whether it is that of the pose's points; else it is that of
    the last pose of the scan whose noise is known, or None."""

    noise: Noise | None
    is_own: bool


class _LastNoise:
    """The noise of the last pose drawn of each scan. Made with `Gpu.cached`."""

    def __init__(self, _: Gpu) -> None:
        self.by_scan: WeakKeyDictionary[ScanKey, Noise] = WeakKeyDictionary()


def estimated_noise(pose: GpuPose, frame: FrameView) -> NoiseEstimate:
    """The noise for a picture of a pose. A picture that is to be finished waits for that of the pose itself.
    Others take that of the last pose of the same scan until then, so that the surface does not jump from pose
    to pose while a scan plays."""
    last = pose.gpu.cached(_LastNoise).by_scan
    own = pose.cached(PoseNoise).find(pose, wait=frame.budget_ms is None)
    if own is None:
        return NoiseEstimate(last.get(pose.pose.scan), False)
    last[pose.pose.scan] = own
    return NoiseEstimate(own, True)


def foresee_noise(cloud: PointCloud, params: Any) -> None:
    """Find what `layer_of` reads of points (`Backend.foresee`)."""
    if params.surface == LOCAL:
        noise_of(cloud)


class Layer:
    """How a picture shows the layers of splats.

    noise: of the points, None as long as it is not known. left: the share of it that the splats still have.

    thickness: scan units from the nearest splat of a layer to the farthest, 0: the nearest alone is shown.
    smoothing: factor on the falloff of weights. known: whether the noise is known, and that of these points.
    """

    def __init__(self, noise: Noise | None, left: float = 1.0, is_own: bool = True) -> None:
        self.known = noise is not None and is_own
        self.thickness, self.smoothing = 0.0, 1.0
        if noise is not None and noise.deviation > DETAIL * noise.spacing:
            self.thickness = left * _THICK * math.sqrt(noise.deviation**2 - (DETAIL * noise.spacing) ** 2)
            noisy = min(noise.deviation / (_NOISY * noise.spacing), 1.0)
            self.smoothing = 1 - (1 - _SMOOTHEST) * noisy

    @property
    def is_local(self) -> bool:
        """Whether the picture shows the mean of a layer."""
        return self.thickness > 0

    def of(self, splats: Splats) -> Splats:
        """Splats whose second pass finds the local surface."""
        if not self.is_local:
            return splats
        return replace(splats, layer=self.thickness, falloff=self.smoothing * splats.falloff)


NEAREST_ALONE = Layer(Noise(0.0, 0.0))


def surface_param(default: str, group: str, **declared: Any) -> Any:
    """The parameter `surface` of a backend that draws splats."""
    return param(
        default,
        "Depth of a pixel. nearest: the depth of the nearest splat; local: the mean depth of all splats "
        "of the front layer, so that noise does not move the surface forwards. Without noise, both "
        "depths are the same, but auto_splats moves its splats onto curved surfaces",
        choices=SURFACES,
        group=group,
        **declared,
    )


def layer_of(pose: GpuPose, frame: FrameView, surface: Surface, blends: bool, left: float = 1.0) -> Layer:
    """The layers in a picture of a pose, by `surface` of its parameters. Tells the surface's statistics.

    blends: whether the picture has a second pass anyway. Else previews that have to be fast get none. left:
    the share of the noise of points that their splats still have.
    """
    if frame.params.surface == NEAREST:
        return NEAREST_ALONE
    if not blends and frame.moving and (surface.gpu.software or frame.share < 1):
        surface.stats.simplified = True
        return NEAREST_ALONE
    noise, is_own = estimated_noise(pose, frame)
    layer = Layer(noise, left, is_own)
    stats = surface.stats
    if layer.is_local:
        assert noise is not None
        share = noise.deviation / noise.spacing
        stats.chosen["surface"] = f"local, because the noise is {share:.2g} spacings"
        if not is_own:
            stats.chosen["surface"] += " in the last frame whose noise Scan4D has estimated"
    elif noise is not None:
        stats.chosen["surface"] = "nearest, because the points have too little noise to change the picture"
    else:
        stats.chosen["surface"] = "nearest, until Scan4D has estimated the noise of the points"
    return layer


class _LocalDepths:
    """Depths of the local surface, a word a pixel."""

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self._gpu = gpu
        self.buffer = gpu.buffer(reserve=4 * size[0] * size[1])

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return self.buffer.size

    def release(self) -> None:
        """Delete them."""
        self._gpu.discard(self.buffer)


def begin_local(surface: Surface, splats: Splats) -> None:
    """Clear the depths of the local surface where the second pass is to find them."""
    if splats.layer:
        surface.gpu.clear(surface.cached(_LocalDepths).buffer, 0)


def bind_local(surface: Surface, splats: Splats) -> dict[str, object]:
    """Bind the depths of the local surface for the second pass to write; the defines that say so."""
    if splats.layer:
        surface.cached(_LocalDepths).buffer.bind_to_storage_buffer(Storage.LOCAL_DEPTHS)
    return {"LOCAL": int(splats.layer > 0)}


def settle_depths(surface: Surface, splats: Splats) -> None:
    """Make the depths that the second pass found those of the picture."""
    if not splats.layer:
        return
    gpu = surface.gpu
    with gpu.timers.measure("settle"):
        program = gpu.compute("surfels/passes/settle.comp")
        surface.bind_storage()
        bind_local(surface, splats)
        gpu.dispatch(program, surface.size[0] * surface.size[1])
