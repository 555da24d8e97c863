"""What the nodes of an octree show: means over the points below each, at every level."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..points import PointCloud
from .octree import Attributes
from .threads import together


def attributes_of(
    cloud: PointCloud,
    rows: NDArray[np.uint32],
    levels: NDArray[np.uint8],
    ends: NDArray[np.uint8],
    counts: NDArray[np.int64],
) -> tuple[Attributes, ...]:
    """Attributes of each level of a tree, from its points in their order (`build.Sorted`).

    ends: (N,), the level of each point's leaf. counts: (depth + 1,), the nodes of each level. Colours are
    means of the stored values, rounded half up; normals means of unit normals, summed in fixed point. Neither
    depends on the order of the points.
    """
    starts = np.cumsum(counts) - counts
    order = _Order(rows, levels, ends, starts, int(counts.sum()))
    found: dict[str, NDArray] = {"rows": np.empty(order.nodes, np.uint32)}
    works: list[Callable[[], object]] = [partial(_rows, order, found["rows"])]
    if cloud.colors is not None:
        found["colors"] = np.empty((order.nodes, 4), np.uint8)
        works.append(partial(_colors, order, cloud.colors, found["colors"]))
    if cloud.normals is not None:
        found["normals"] = np.empty((order.nodes, 3), np.float32)
        found["cones"] = np.empty(order.nodes, np.float32)
        works.append(partial(_normals, order, cloud.normals, found["normals"], found["cones"]))
    together(len(rows), reversed(works))  # the longest first
    ranges = zip(starts.tolist(), (starts + counts).tolist(), strict=True)
    return tuple(Attributes(**{name: values[a:b] for name, values in found.items()}) for a, b in ranges)


class _Order(NamedTuple):
    """The points in the order of their codes, and where the nodes of each level begin; see `node_kernels`."""

    rows: NDArray[np.uint32]
    levels: NDArray[np.uint8]
    ends: NDArray[np.uint8]
    starts: NDArray[np.int64]
    nodes: int


def _rows(order: _Order, rows: NDArray[np.uint32]) -> None:
    from . import node_kernels

    node_kernels.lowest_rows(order.levels, order.ends, order.rows, order.starts, rows)


def _colors(order: _Order, colors: NDArray[np.uint8], means: NDArray[np.uint8]) -> None:
    from . import node_kernels

    gathered = np.empty(len(order.rows), np.uint32)
    node_kernels.gather_colors(_words(np.ascontiguousarray(colors)), order.rows, gathered)
    node_kernels.mean_colors(order.levels, order.ends, gathered, order.starts, _words(means))


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
