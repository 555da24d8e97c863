"""What the nodes of an octree show: means over the points below each, at every level."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...srgb import LIGHT_STEPS, bytes_from_light, light_from_bytes
from ...threads import together
from ..points import PointCloud
from .cube import Grid
from .discs import discs_of
from .octree import Attributes

_LARGEST = 8  # edges of the cube: discs that are larger cover all of it
_LIGHT = light_from_bytes(np.arange(256, dtype=np.uint8)).astype(np.int64)
_ENCODED = bytes_from_light(np.arange(16 * LIGHT_STEPS + 1) / 16).astype(np.uint32)


def attributes_of(
    cloud: PointCloud,
    points: Sorted,
    grid: Grid,
    edge: float,
    ends: NDArray[np.uint8],
    masks: Sequence[NDArray[np.uint8]],
    counts: NDArray[np.int64],
) -> tuple[Attributes, ...]:
    """Attributes of each level of a tree, from its points in their order.

    grid, edge: of the cube. ends: (N,), the level of each point's leaf. masks: of the levels above the
    deepest. counts: (depth + 1,), the nodes of each level. Colours are means in linear light, normals means
    of unit normals, both summed as whole numbers. None depends on the order of the points.
    """
    starts = np.cumsum(counts) - counts
    order = _Order(points.rows, points.levels, ends, starts, int(counts.sum()))
    found: dict[str, NDArray] = {"rows": np.empty(order.nodes, np.uint32)}
    works: list[Callable[[], object]] = [partial(_rows, order, found["rows"])]
    found["offsets"] = np.empty((order.nodes, 3), np.uint16)
    found["radii"] = np.empty(order.nodes, np.float32)
    if cloud.radii is not None and ((cloud.radii > 0) & (cloud.radii < np.inf)).any():
        found["own_radii"] = np.empty(order.nodes, np.float32)
    works.append(partial(_discs, order, cloud, points, grid, edge, masks, found))
    if cloud.colors is not None:
        found["colors"] = np.empty((order.nodes, 4), np.uint8)
        works.append(partial(_colors, order, cloud.colors, found["colors"]))
    if cloud.normals is not None:
        found["normals"] = np.empty((order.nodes, 3), np.float32)
        found["cones"] = np.empty(order.nodes, np.float32)
        works.append(partial(_normals, order, cloud.normals, found["normals"], found["cones"]))
    together(len(order.rows), reversed(works))  # the longest first
    ranges = zip(starts.tolist(), (starts + counts).tolist(), strict=True)
    return tuple(Attributes(**{name: values[a:b] for name, values in found.items()}) for a, b in ranges)


class Sorted(NamedTuple):
    """The points by ascending Morton code of level 21; equal ones by row.

    codes: (N,) uint64. rows: (N,) uint32. levels: (N,) uint8: the first level at which each point is in
    another node than the one before, 0 for the first, 22 where there is none. counts: (22,) int64: the nodes
    of each level, were all divided. distinct: how many different positions there are.
    """

    codes: NDArray[np.uint64]
    rows: NDArray[np.uint32]
    levels: NDArray[np.uint8]
    counts: NDArray[np.int64]
    distinct: int


class _Order(NamedTuple):
    """The points in the order of their codes, and where the nodes of each level begin; see `node_kernels`."""

    rows: NDArray[np.uint32]
    levels: NDArray[np.uint8]
    ends: NDArray[np.uint8]
    starts: NDArray[np.int64]
    nodes: int

    def by_level(self, values: NDArray) -> list[NDArray]:
        """Values of all nodes, level by level, in the same memory."""
        return np.split(values, self.starts[1:])


def _discs(
    order: _Order,
    cloud: PointCloud,
    points: Sorted,
    grid: Grid,
    edge: float,
    masks: Sequence[NDArray[np.uint8]],
    found: dict[str, NDArray],
) -> None:
    """Fill the offsets, the radii and, where points store radii, their own of all nodes."""
    from . import disc_kernels

    walk = disc_kernels.CodeOrder(points.rows, points.codes, points.levels, order.ends, order.starts)
    disc_kernels.leaf_offsets(np.ascontiguousarray(cloud.positions), walk, grid, found["offsets"])
    offsets, radii = order.by_level(found["offsets"]), order.by_level(found["radii"])
    own: Sequence[NDArray[np.float32] | None] = [None] * len(radii)
    if "own_radii" in found and cloud.radii is not None:
        _own_radii(order, cloud.radii, edge, found["own_radii"])
        own = order.by_level(found["own_radii"])
    discs_of(masks, edge, offsets, radii, own)


def _own_radii(order: _Order, radii: NDArray[np.float32], edge: float, largest: NDArray[np.float32]) -> None:
    """Fill the largest radius of the points below each node, as `Attributes` has it."""
    from . import node_kernels

    those = radii[order.rows]
    known = np.where((those > 0) & (those < np.inf), np.minimum(those, _LARGEST * edge), 0)
    # Numbers that are not negative have the order of their bits.
    inverse = ~known.astype(np.float32).view(np.uint32)
    node_kernels.lowest_rows(order.levels, order.ends, inverse, order.starts, largest.view(np.uint32))
    np.invert(largest.view(np.uint32), out=largest.view(np.uint32))


def _rows(order: _Order, rows: NDArray[np.uint32]) -> None:
    from . import node_kernels

    node_kernels.lowest_rows(order.levels, order.ends, order.rows, order.starts, rows)


def _colors(order: _Order, colors: NDArray[np.uint8], means: NDArray[np.uint8]) -> None:
    from . import node_kernels

    gathered = np.empty(len(order.rows), np.uint32)
    node_kernels.gather_colors(_words(np.ascontiguousarray(colors)), order.rows, gathered)
    walk = order.levels, order.ends, gathered, order.starts
    node_kernels.mean_colors(*walk, _LIGHT, _ENCODED, _words(means))


def _words(colors: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """Colours (N, 4) as one number each, (N,), in the same memory."""
    return colors.view(np.uint32).reshape(-1)


def _normals(
    order: _Order, normals: NDArray[np.float32], means: NDArray[np.float32], cones: NDArray[np.float32]
) -> None:
    from . import node_kernels

    units = np.empty((len(order.rows), 3), np.float32)
    node_kernels.gather_units(np.ascontiguousarray(normals), order.rows, units)
    node_kernels.mean_normals(order.levels, order.ends, units, order.starts, means)
    node_kernels.open_cones(order.levels, order.ends, units, order.starts, means, cones)
