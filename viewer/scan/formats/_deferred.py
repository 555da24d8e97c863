"""Points from arrays that are made one after the other, so that few are held beside what they become."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..admission import admit
from ..contents import Deferred
from ..points import PointCloud, choose_origin, finite_rows

_FINAL = {"normals": 12, "colors": 4, "radii": 4}  # bytes of a point in a PointCloud
_WORK = 20 << 20  # bytes of the points that are worked on together
_SPLAT = 20  # bytes of a half-axis and its radius
_IDS, _ID = 12, 4  # bytes of a point's number while it is found, and then


def cloud_of(
    positions: list[NDArray],
    attributes: Mapping[str, Deferred],
    scalars: Mapping[str, Deferred],
    origin: NDArray[np.float64] | None = None,
    held: int | None = None,
    at_hand: bool = False,
) -> PointCloud:
    """`PointCloud.from_arrays` of deferred arrays.

    positions: (N, 3), alone in a list that gives it away. held: bytes of the file, which has to admit what
    that takes; None: its rows are not packed. at_hand: whether what the others are made of is in memory.
    Raises InputError.
    """
    if held is not None:
        admit(held, _memory(positions[0], attributes, scalars, origin, at_hand))
    points = Deferred(positions.pop, positions[0].dtype, 3)
    return PointCloud.from_arrays(
        points, **attributes, scalars=scalars, origin=origin, precise=True, unmeasured=None
    )


def _memory(
    points: NDArray,
    attributes: Mapping[str, Deferred],
    scalars: Mapping[str, Deferred],
    origin: NDArray[np.float64] | None,
    at_hand: bool,
) -> int:
    """Bytes that are held at most at a time, step by step as `PointCloud.from_arrays` goes."""
    rows, finite = len(points), finite_rows(points)
    retained = rows if finite is None else int(np.count_nonzero(finite))
    moved = points.dtype != np.float32 or (
        finite is not None or bool(choose_origin(points).any()) if origin is None else bool(origin.any())
    )

    def taken(array: Deferred) -> tuple[int, int]:
        made, freed = rows * array.size, rows * array.size if at_hand else 0
        return (
            (made, made - freed)
            if finite is None
            else (made + retained * array.size, retained * array.size - freed)
        )

    steps = [taken(array) for array in attributes.values()]  # bytes meanwhile, and then
    if finite is not None:
        steps.append((retained * points.itemsize * 3, (retained - rows) * points.itemsize * 3))
    if "axes" in attributes:
        steps.append((retained * _SPLAT, retained * _SPLAT))
    beyond = points.dtype != np.float32  # what float32 offsets do not hold
    steps.append((retained * 12 * (moved + beyond),) * 2)
    for name, size in _FINAL.items():
        if name in attributes and (name == "colors" or attributes[name].dtype != np.float32):
            steps.append((retained * size,) * 2)
    steps += [taken(array) for array in scalars.values()]
    if finite is not None:
        steps.append((retained * _IDS, retained * _ID))
    held = points.nbytes + (0 if finite is None else rows)
    if at_hand:
        held += rows * sum(array.size for array in [*attributes.values(), *scalars.values()])
    peak = held
    for meanwhile, then in steps:
        peak, held = max(peak, held + meanwhile), held + then
    return peak + _WORK
