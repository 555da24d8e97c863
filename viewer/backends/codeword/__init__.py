"""Draws discs in whole numbers, from 64-bit code words and a table of shapes.

`codeword` implements the method of Maršík 2010. The encoder of `codeword` turns each disc into code words. A
code word stores the shape of its disc as an index into a table of sizes and normals. An engine then draws the
code words, line by line of the picture. In the paper of Maršík, the engine uses a window that slides down the
picture. In Scan4D, each GPU work group draws one band of the picture. The package `viewer/codewords/`
contains the code words, the tables of shapes and the lighting.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...codewords.lighting import Materials
from ...codewords.stream import WordStream
from ...gpu.context import Gpu
from ...gpu.pose import GpuPose
from ...look import Look
from ...params import param
from ...picture.surface import Surface
from ...scan import code_words
from ...scan.code_words import own_palette, uniform_radius, word_look, words_of
from ...scan.layers import Layers
from ...scan.points import PointCloud
from ...scan.pose import Pose
from ...splatting.amplify import Points
from .. import Backend, FrameView, Limit, Suited
from .encoder import encode_points
from .engine import Sheet, WordBuffers, draw_bands

_HELD = (
    "code words store positions, shapes, depths and colours as whole steps: rounding can change a value "
    "by one step, and added points change the steps"
)
_OF_TABLE, _OF_PLANES, _OF_PALETTE = {"quality": ("table",)}, {"quality": ("planes",)}, {"lighting": ("own",)}


@dataclass(frozen=True)
class Params(code_words.Params):
    """Parameters of code words."""

    lighting: str = param(
        "common",
        "How discs are lit. common: with the colours and light of all renderers; own: with Phong "
        "lighting in whole numbers, from a table of materials, with one colour per disc",
        choices=("common", "own"),
        sweep=("common", "own"),
        group="Light",
    )


class CodeWords(Backend):
    """The backend `codeword`."""

    title = "Code words"
    good_for = "For research: draws discs from compact tables"
    params_class = Params
    draws_with = ("radii", "axes")
    limits = {
        "the near plane inside the scan": Limit(0.0, _HELD, _OF_PALETTE),
        "zoomed in to 1/1000 of the scan's width": Limit(0.0, _HELD, _OF_PALETTE),
        "zoomed in to a millionth of the scan's width": Limit(0.0, _HELD, _OF_PALETTE),
        "an outlier at a million times the scan's width": Limit(0.0, _HELD, _OF_PALETTE),
        "the eye inside the scan": Limit(1.0, _HELD, _OF_TABLE),
        "zoomed out x10^6": Limit(0.07, _HELD, _OF_TABLE),
        "telephoto x10^6": Limit(0.02, _HELD, _OF_PLANES),
        "zero radii": Limit(0.0, _HELD, _OF_TABLE),
        "negative radii": Limit(0.0, _HELD, _OF_TABLE),
        "NaN radii": Limit(0.0, _HELD, _OF_TABLE),
    }

    def needs(self, pose: Pose, params: Params) -> tuple[str, ...]:
        """Normals, and radii where they shall be the points' own."""
        return ("normals", "radii") if params.radius == "own" else ("normals",)

    def foresee(self, cloud: PointCloud, params: Params) -> None:
        """Find the radius of points without one of their own, and their palette."""
        uniform_radius(cloud, params)
        if cloud.colors is not None:
            own_palette(cloud)

    def suits(self, pose: Pose) -> Suited | None:
        """None: `surfels` draws the same points better."""
        return None

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Encode and draw; complete where all points shall be drawn."""
        params: Params = frame.params
        surface.stats.faces_away = params.cull_back
        if not len(pose.cloud):
            surface.clear()
            return False
        is_lit = params.lighting == "own"
        # Colours of words that nobody sees need not be found.
        look = surface.look if is_lit else replace(surface.look, color_by="plain")
        words = surface.cached(WordBuffers)
        made = _encoded_here if params.quality == "table" else _encoded_on_cpu
        sheet, materials = made(pose, frame, surface, look, words)
        lit = (surface.own("color", is_lit=True).buffer, materials) if is_lit else None
        draw_bands(words, sheet, params.window, surface.depths.buffer, surface.rows.buffer, lit)
        return surface.stats.share < 1


def _encoded_here(
    pose: GpuPose, frame: FrameView, surface: Surface, look: Look, words: WordBuffers
) -> tuple[Sheet, Materials]:
    """Words of the table, and their materials."""
    params: Params = frame.params
    own = params.radius == "own" and pose.cloud.radii is not None
    points = Points.of(pose, surface, frame.share, use_radii=own)
    known = pose.pose.with_cloud(pose.cloud)
    materials, index, light = word_look(known, frame.view, look, surface.layers)
    radius = uniform_radius(pose.cloud, params)
    several = index if len(materials) > 1 else None
    return encode_points(points, frame.view, words, params, light, radius, several), materials


def _encoded_on_cpu(
    pose: GpuPose, frame: FrameView, surface: Surface, look: Look, words: WordBuffers
) -> tuple[Sheet, Materials]:
    """Words of exact outlines, which take float64, and their materials."""
    params: Params = frame.params
    part = surface.cached(_Sampled).take(pose, surface, frame.share)
    with surface.gpu.timers.measure("encode"):
        stream = words_of(part.pose, frame.view, look, part.enlarged(params), part.layers(surface.layers))
    is_lit = params.lighting == "own"
    sheet = words.take_encoded(part.in_pose(stream), len(pose.cloud), frame.view.base, is_lit)
    return sheet, stream.materials


@dataclass(frozen=True, eq=False)
class _Part:
    """Points that are drawn. rows: in the pose that they are of; None: all. pose: these alone."""

    pose: Pose
    rows: NDArray[np.uint32] | None = None
    share: float = 1.0

    def enlarged(self, params: Params) -> Params:
        """Parameters with which they cover what all do; a radius that goes by their spacing does so."""
        by_spacing = params.radius == "uniform" or self.pose.cloud.radii is None
        factor = 1.0 if by_spacing else 1 / math.sqrt(self.share)
        return replace(params, radius_scale=params.radius_scale * factor)

    def layers(self, layers: Layers) -> Layers:
        """Layers with their numbers alone."""
        if self.rows is None:
            return layers
        return replace(layers, scalars={name: values[self.rows] for name, values in layers.scalars.items()})

    def in_pose(self, stream: WordStream) -> WordStream:
        """The stream with rows of the whole pose as ids."""
        return stream if self.rows is None else replace(stream, ids=self.rows[stream.ids])


class _Sampled:
    """The points of a preview, kept until those of another one are asked for."""

    nbytes = 0  # on the GPU

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self._of: tuple[PointCloud, float] | None = None
        self._part: _Part | None = None

    def take(self, pose: GpuPose, surface: Surface, share: float) -> _Part:
        """The share of the points that `Surface.take_sample` chooses; 1: all."""
        texels, count = surface.take_sample(share)
        if texels is None:
            self.release()
            return _Part(pose.pose.with_cloud(pose.cloud))
        if self._part is None or self._of is None or self._of[0] is not pose.cloud or self._of[1] != share:
            rows = surface.gpu.read(texels.buffer, np.uint32, count)
            sampled = Pose(0, 0.0, "sample", pose.cloud.of_rows(rows))
            self._of, self._part = (pose.cloud, share), _Part(sampled, rows, count / len(pose.cloud))
        return self._part

    def release(self) -> None:
        """Forget them."""
        self._of = self._part = None
