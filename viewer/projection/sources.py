"""Sources of samples, and the points of a cloud as one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from ..gpu import gl
from ..gpu.bindings import Texture
from ..gpu.context import Program
from ..gpu.pose import GpuPose
from ..gpu.scatter import Visits
from ..picture.surface import Surface

CHANNELS = {"color": Texture.COLORS, "normal": Texture.NORMALS, "value": Texture.VALUES}


class SampleSource(Protocol):
    """A source of samples.

    parts: the shader file that says what a sample is, as programs include it. params: the numbers that it
    reads. is_closed: whether what it scatters has no holes that something behind is seen through. is_made:
    whether what it scatters are no rows yet, but what `resolve.comp` makes rows of. count: of the samples.
    """

    parts: Mapping[str, str]
    params: Any
    count: int
    is_closed: bool
    is_made: bool

    def defines(self, channels: Sequence[str]) -> dict[str, object]:
        """Macros of the shader file, where these channels are asked for."""

    def channels(self, surface: Surface) -> list[str]:
        """The names of what its samples have to show, of `CHANNELS`."""

    def visits(self, surface: Surface, share: float) -> Visits:
        """The visits of the samples to pixels."""

    def bind(self) -> None:
        """Bind what the shader file reads."""


class PointSource:
    """The points of a pose."""

    parts: Mapping[str, str] = {"source": "pyramidal/of_points.glsl"}
    is_closed = is_made = False

    def __init__(self, pose: GpuPose, params: Any) -> None:
        self.params = params
        self.count = len(pose.cloud)
        self._pose = pose
        self._texels: dict[str, gl.BufferTexture] = {}

    def defines(self, channels: Sequence[str]) -> dict[str, object]:
        return {"POLYGONS": 0, "FRAMED": 0, **{name.upper(): int(name in channels) for name in CHANNELS}}

    def channels(self, surface: Surface) -> list[str]:
        found = {
            "color": self._pose.find("colors"),
            "normal": self._pose.find("normals"),
            "value": surface.row_values,
        }
        self._texels = {name: texels for name, texels in found.items() if texels is not None}
        return list(self._texels)

    def visits(self, surface: Surface, share: float) -> Visits:
        rows, count = surface.take_sample(share)

        def bind(_: Program) -> None:
            self.bind()
            if rows is not None:
                rows.bind(Texture.DRAWN_ROWS)

        defines = {"SAMPLED": int(rows is not None), "SUMS": 0}
        return Visits("pyramidal/points.glsl", count, bind, defines, self.params)

    def bind(self) -> None:
        self._pose.array("positions").bind(Texture.POSITIONS)
        for name, texels in self._texels.items():
            texels.bind(CHANNELS[name])
