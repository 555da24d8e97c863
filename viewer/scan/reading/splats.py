"""Gaussian splats (3DGS, 2DGS): named columns of a training program become colours, normals and ellipses.

The columns are `f_dc_0..2`, colour as the first spherical harmonic; `opacity` before the logistic function,
without which splats are opaque; `scale_0..2`, logarithms of half-axes (2D splats have two); `rot_0..3`, a
quaternion w x y z.
See Kerbl et al. 2023, "3D Gaussian Splatting for Real-Time Radiance Field Rendering", section 4.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..sides import facing
from .corrections import NOTHING_CORRECTED, Corrections
from .record import Decision

KEY = "splats"
COLORS = ("f_dc_0", "f_dc_1", "f_dc_2")
OPACITY = "opacity"
ROTATION = ("rot_0", "rot_1", "rot_2", "rot_3")
SCALES = ("scale_0", "scale_1", "scale_2")  # the last one is not there in 2D splats
_FIRST_HARMONIC = 0.28209479177387814  # 1 / (2 sqrt(pi))
_HIGHER = re.compile(r"f_rest_\d+")
_LONGEST_LOG = 80.0  # exp of more exceeds float32
_AT_ONCE = 1 << 17  # rows


class SplatColumns(NamedTuple):
    """The columns of splats by their names in the file.

    opacity: one name; () where splats are opaque. higher: of harmonics that Scan4D does not use.
    """

    colors: tuple[str, ...]
    opacity: tuple[str, ...]
    scales: tuple[str, ...]
    rotation: tuple[str, ...]
    higher: tuple[str, ...]

    @property
    def all(self) -> tuple[str, ...]:
        """Every column that is part of the splats."""
        return (*self.colors, *self.opacity, *self.scales, *self.rotation, *self.higher)


class Ellipses(NamedTuple):
    """Ellipses as PointCloud takes them. axes: (N, 4) float32. normals: (N, 3) float32, unit length."""

    axes: NDArray[np.float32]
    normals: NDArray[np.float32]


def splat_columns(names: Iterable[str]) -> SplatColumns | None:
    """The columns of splats among those of a file; None where it holds none. Names count in any case."""
    known = {name.lower(): name for name in names}
    if not {*COLORS, *SCALES[:2], *ROTATION} <= known.keys():
        return None
    opacity, scales = (tuple(known[name] for name in names if name in known) for names in ([OPACITY], SCALES))
    higher = tuple(name for lower, name in known.items() if _HIGHER.fullmatch(lower))
    return SplatColumns(
        tuple(known[name] for name in COLORS), opacity, scales,
        tuple(known[name] for name in ROTATION), higher,
    )  # fmt: skip


def splat_colors(harmonics: NDArray, opacity: NDArray | None = None) -> NDArray[np.uint8]:
    """Colours and alpha, (N, 4), of first harmonics (N, 3) and opacities (N,) as files hold them.

    Without opacities, alpha is full.
    """
    rgba = np.empty((len(harmonics), 4), np.uint8)
    for start in range(0, len(rgba), _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        alpha: NDArray = np.ones(len(rgba[part]), np.float32)
        if opacity is not None:
            with np.errstate(over="ignore"):
                alpha = 1 / (1 + np.exp(-opacity[part].astype(np.float32)))
        color = 0.5 + _FIRST_HARMONIC * harmonics[part].astype(np.float32)
        shares = np.nan_to_num(np.column_stack([color, alpha]))
        rgba[part] = np.rint(255 * np.clip(shares, 0, 1))
    return rgba


def splat_ellipses(scales: NDArray, rotation: NDArray, points: NDArray) -> Ellipses:
    """The ellipses of splats: the two longest half-axes, and the direction of the shortest as normal.

    scales: (N, 2 or 3) logarithms. rotation: (N, 4) quaternions w x y z of any length. points: (N, 3), whose
    centre the normals point away from. A row without a rotation or with a NaN gets zeros, which stand for a
    round splat without a normal.
    """
    axes, normals = np.zeros((len(points), 4), np.float32), np.zeros((len(points), 3), np.float32)
    centre = _centre(points)
    for start in range(0, len(axes), _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        quaternions = rotation[part].astype(np.float64)
        norms = np.linalg.norm(quaternions, axis=1)
        logs = scales[part].astype(np.float64)
        good = np.flatnonzero((norms > 0) & np.isfinite(norms) & np.isfinite(logs).all(axis=1))
        lengths = np.exp(np.clip(logs[good], -_LONGEST_LOG, _LONGEST_LOG))
        if lengths.shape[1] == 2:
            lengths = np.column_stack([lengths, np.zeros(len(good))])
        columns = _rotation_matrices(quaternions[good] / norms[good, None])
        order = np.argsort(-lengths, axis=1, kind="stable")  # longest first; a 2D splat's third stays last
        sorted_columns = np.take_along_axis(columns, order[:, None, :], axis=2)
        sorted_lengths = np.take_along_axis(lengths, order, axis=1)
        axes[start + good, :3] = sorted_columns[:, :, 0] * sorted_lengths[:, :1]
        axes[start + good, 3] = sorted_lengths[:, 1]
        outward = points[part][good].astype(np.float64) - centre
        normals[start + good] = facing(sorted_columns[:, :, 2].astype(np.float32), outward)
    return Ellipses(axes, normals)


def decide(found: SplatColumns | None, corrections: Corrections = NOTHING_CORRECTED) -> Decision:
    """Whether a file's points are Gaussian splats; null where it has no such columns."""
    if KEY in corrections:
        return Decision(KEY, found is not None and corrections[KEY] == "yes", "user", "--read")
    return Decision(KEY, None, "file") if found is None else Decision(KEY, True, "file", "names of columns")


def unused(found: SplatColumns | None) -> tuple[str, ...]:
    """One text about the harmonics that a file of splats holds and Scan4D does not use; () without any."""
    if found is None or not found.higher:
        return ()
    degree = round((len(found.higher) / 3 + 1) ** 0.5) - 1
    degrees = "degree 1" if degree == 1 else f"degree 1 to {degree}"
    return (f"{len(found.higher)} harmonics of {degrees}",)


def _rotation_matrices(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """The matrices, (N, 3, 3), of unit quaternions w x y z, (N, 4); their columns are the turned axes."""
    w, x, y, z = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)


def _centre(points: NDArray) -> NDArray[np.float64]:
    """The mean of the finite points, (3,)."""
    finite = points[np.isfinite(points).all(axis=1)]
    return finite.mean(axis=0, dtype=np.float64) if len(finite) else np.zeros(3)
