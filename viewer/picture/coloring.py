"""Coloring: the numbers that a look colours a picture by, as texels of its rows and as ranges."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..errors import InputError
from ..geometry import up_vector
from ..gpu import gl
from ..gpu.pose import GpuPose
from ..look import COLOR_BY, Look, ValueKind, value_source
from ..scan.layers import Layers
from ..scan.ranges import scalar_range
from ..view import View
from .laid_over import LaidOver, laid_over
from .rows import PointRows


class Coloring:
    """A look as it applies to the rows of a picture.

    look: that the picture is drawn for, and was shaded in last. layers: over the pose. finds: the numbers
    that the backend computes for rows, by name, unless the scan or a layer has one of that name. kind: of the
    rows. view: that the picture shows.
    """

    look: Look
    layers: Layers
    finds: Mapping[str, ValueKind]
    _given: tuple[str, gl.BufferTexture] | None  # which of these the backend gave

    @property
    def kind(self) -> PointRows:
        """The kind of the rows: points, octants or samples."""
        raise NotImplementedError

    @property
    def view(self) -> View:
        """The view that the picture shows."""
        raise NotImplementedError

    @property
    def wanted(self) -> str | None:
        """The name of the number that the look colours by where the backend finds it: `give` takes it. None
        where none of these is asked for."""
        source = self.value_source
        return source if source in self.finds else None

    def give(self, texels: gl.BufferTexture) -> None:
        """Take the number that is `wanted`, for a backend that finds it: a float for each row of the pose,
        NaN: unknown. Those of rows that no pixel has are unread. It stays the backend's, and as it is until
        the next picture."""
        assert self.wanted is not None
        self._given = self.wanted, texels

    @property
    def value_kind(self) -> ValueKind | None:
        """The kind of the number that the look colours by, where the backend finds it."""
        return self.finds.get(self.value_source or "")

    @property
    def value_source(self) -> str | None:
        """Source of the number that the look colours by ("depth", "height", a scalar's name, one of `finds`),
        else None."""
        # A picture asks a dozen times, mostly in looks that need no names.
        is_usual = self.look.color_by in COLOR_BY
        names = () if is_usual else self.layers.names(self.kind.pose.overview.scalars)
        return value_source(self.look, names, self.finds)

    @property
    def values_key(self) -> tuple[object, ...]:
        """Key of what `row_values` and `resolve` give of a pose."""
        source = self.value_source
        axis = self.height_axis if source == "height" else None
        return source, axis, self._laid_over(source or ""), self.look.plain

    @property
    def value_zero(self) -> float:
        """Zero that values on the GPU are relative to. It is taken off in float64, so that heights and times
        far from zero keep their steps."""
        source = self.value_source
        if source == "height":
            return float(self.layers.world_from_pose.points(self.kind.pose.origin) @ up_vector(self.look.up))
        if source == "depth":
            return self.view.base
        if source is None or source in self.finds:
            return 0.0
        return self.scalar_range(source, self.kind.pose)[0]

    def scalar_range(self, name: str, pose: GpuPose) -> tuple[float, float]:
        """The 2 % and 98 % quantiles of a layer's or else a pose's finite numbers."""
        layer = self._laid_over(name)
        return scalar_range(pose.overview, name) if layer is None else layer.range

    def _laid_over(self, name: str) -> LaidOver | None:
        layer = self.layers.scalars.get(name)
        return None if layer is None else laid_over(self.kind.scanned, layer)

    def scalar_texels(self, name: str) -> gl.BufferTexture:
        """The numbers of each row, of a layer or the scan, relative to `value_zero`."""
        return self._scalar_by_row(name, self.kind)

    def _scalar_by_row(self, name: str, rows: PointRows) -> gl.BufferTexture:
        layer, zero = self.layers.scalars.get(name), self.scalar_range(name, self.kind.pose)[0]
        return rows.scalar_texels(name, zero) if layer is None else rows.layer_texels(layer, zero)

    @property
    def height_axis(self) -> tuple[float, float, float]:
        """The look's up along the pose's axes."""
        (x, y, z), motion = up_vector(self.look.up), self.layers.world_from_pose
        if not motion.is_identity:
            x, y, z = motion.inverse.directions(np.array([x, y, z], np.float64)).tolist()
        return float(x), float(y), float(z)

    @property
    def row_values(self) -> gl.BufferTexture | None:
        """The number of each row that the look colours by, a float relative to `value_zero`, for a backend
        that blends it into its own `value`. None where it colours by none, or by depth, which pixels have."""
        return self._values_by_row(self.kind)

    def _values_by_row(self, rows: PointRows) -> gl.BufferTexture | None:
        """The number of each of some rows that the look colours by; see `row_values`."""
        source = self.value_source
        if source in (None, "depth"):
            return None
        if source == "height":
            return rows.heights(self.height_axis)
        return self._found_texels(source) if source in self.finds else self._scalar_by_row(source, rows)

    def _found_texels(self, name: str) -> gl.BufferTexture:
        if self._given is None or self._given[0] != name:
            raise InputError(
                f"the renderer did not compute '{name}' for this picture",
                hint="Draw the picture again with this look",
            )
        return self._given[1]
