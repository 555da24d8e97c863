"""Where every point of a reference frame goes: paths, and how the surface stretches."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ...files import reading, whole_file
from .dense import PointState, TrackedFrame

Float = NDArray[np.float64]

_BESIDE = 24  # points of the reference frame that tell the strain at one of them
_CARRY = 6  # that tell where a position between them goes
_FLAT = 1e-9  # of the squared distances: points that are nearer to one line tell no strain
_CHUNK = 20_000  # points at a time
_LOST_HINT = "Delete the file and run scan4d motion --dense again"


@dataclass(frozen=True, eq=False)
class SurfaceStrain:
    """How the surface around N points is stretched, (N,) each; NaN where it is not known.

    first, second: principal strains, the larger first: 0.1 is 10 % longer. area: change of the area: 0.1 is
    10 % larger.
    """

    first: Float
    second: Float
    area: Float


class StrainGauge:
    """Tells how the surface around points of a reference frame is stretched.

    Around each point, the map of the tangent plane that fits the moved neighbours best (least squares) is the
    deformation gradient; its singular values are the principal stretches.
    """

    def __init__(self, reference: Float, tree: Any, rows: NDArray[np.integer] | None = None) -> None:
        """reference: (N, 3) positions. tree: a cKDTree of them. rows: (n,), of the points at which strain is
        told; None: at all."""
        self._reference = reference
        self._rows = np.arange(len(reference)) if rows is None else rows
        count, nearest = len(self._rows), min(_BESIDE + 1, len(reference))
        self._beside = tree.query(reference[self._rows], nearest)[1].reshape(count, -1).astype(np.int32)
        self._slopes = np.empty((*self._beside.shape, 2))  # what each neighbour adds to the gradient
        for start in range(0, count, _CHUNK):
            part = slice(start, start + _CHUNK)
            ways = reference[self._beside[part]] - reference[self._rows[part], None]
            sizes, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", ways, ways))
            flat = np.einsum("nki,nia->nka", ways, axes[:, :, 1:])
            squares = np.where(sizes[:, 1:] > _FLAT * sizes[:, 2:], sizes[:, 1:], np.nan)
            self._slopes[part] = flat / squares[:, None]

    def strain(self, displacement: NDArray[np.float32], state: NDArray[np.uint8]) -> SurfaceStrain:
        """The strain at its points. displacement: (N, 3). state: (N,), see `PointState`."""
        moved = self._reference + displacement
        moved[state == PointState.LOST] = np.nan
        first, second = np.empty(len(self._rows)), np.empty(len(self._rows))
        for start in range(0, len(first), _CHUNK):
            part = slice(start, start + _CHUNK)
            ways = moved[self._beside[part]] - moved[self._rows[part], None]
            gradient = np.einsum("nka,nki->nia", self._slopes[part], ways)
            squares = np.einsum("nia,nib->nab", gradient, gradient)
            middle = (squares[:, 0, 0] + squares[:, 1, 1]) / 2
            apart = np.hypot((squares[:, 0, 0] - squares[:, 1, 1]) / 2, squares[:, 0, 1])
            first[part] = np.sqrt(middle + apart)
            second[part] = np.sqrt(np.maximum(middle - apart, 0.0))
        return SurfaceStrain(first - 1, second - 1, first * second - 1)


@dataclass(frozen=True, eq=False)
class MeanPath:
    """The mean of some points in F frames.

    positions: (F, 3), as scanned, scan units; NaN where all points are lost. sigma: (F,), standard deviations
    of these, scan units: the means of those of the points, as errors of neighbours are alike. seen: (F,), the
    share of the points that is seen.
    """

    positions: Float
    sigma: Float
    seen: Float


@dataclass(frozen=True, eq=False)
class Displacements:
    """N points of a reference frame in F frames.

    reference: (N, 3) float64, their positions as scanned. displacement: (F, N, 3) float32, from there, scan
    units; NaN where a point is lost in a frame that cannot be read. sigma: (F, N) float32, standard
    deviations of positions, scan units. state: (F, N) uint8, see `PointState`.
    """

    reference: Float
    displacement: NDArray[np.float32]
    sigma: NDArray[np.float32]
    state: NDArray[np.uint8]

    @classmethod
    def read(cls, path: Path | str) -> Displacements:
        """Read displacements.npz. Raises InputError."""
        with reading(path, "does not hold displacements", _LOST_HINT):
            try:
                with np.load(path, allow_pickle=False) as held:
                    found = cls(*(held[name] for name in ("reference", "displacement", "sigma", "state")))
            except (KeyError, zipfile.BadZipFile, TypeError) as error:
                raise ValueError(f"{type(error).__name__}: {error}") from error
            count = len(found.reference)
            frames = len(found.displacement)
            if (
                found.reference.shape != (count, 3)
                or found.displacement.shape != (frames, count, 3)
                or found.sigma.shape != (frames, count)
                or found.state.shape != (frames, count)
            ):
                raise ValueError("the shapes of its arrays do not fit each other")
            return found

    @classmethod
    def of(cls, reference: Float, frames: Iterable[TrackedFrame], rows: NDArray[np.integer]) -> Displacements:
        """The displacements of some points of a reference, (N, 3), by rows (n,), in frames."""
        some = [(one.displacement[rows], one.sigma[rows], one.state[rows]) for one in frames]
        return cls(reference[rows], *(np.stack(each) for each in zip(*some, strict=True)))

    def path(self, position: Float) -> Float:
        """The positions of a place of the reference frame, (3,), in all frames, (F, 3); NaN where it is lost.

        It goes along with the points nearest to it, the nearest above all.
        """
        away, rows = self._tree.query(position, min(_CARRY, len(self.reference)))
        away, rows = np.atleast_1d(away), np.atleast_1d(rows)
        weights = 1 / (away**2 + (0.1 * away.mean()) ** 2 + 1e-300)
        return np.asarray(position) + self._mean(rows, weights)

    def mean_path(self, rows: NDArray[np.integer]) -> MeanPath:
        """The mean path of points of the reference frame, by rows (n,), such as those of a region. In each
        frame all points count that are not lost there."""
        places = self.reference[rows].mean(axis=0) + self._mean(rows, np.ones(len(rows)))
        state = self.state[:, rows]
        counted = state != PointState.LOST
        sigmas = np.where(counted, self.sigma[:, rows], 0.0).sum(axis=1)
        counts = counted.sum(axis=1)
        sigma = np.divide(sigmas, counts, out=np.full(len(counts), np.nan), where=counts > 0)
        return MeanPath(places, sigma, (state == PointState.SEEN).mean(axis=1))

    def strain(self, frame: int) -> SurfaceStrain:
        """How the surface is stretched in a frame, against the reference frame; see `StrainGauge`."""
        return self._gauge.strain(self.displacement[frame], self.state[frame])

    def _mean(self, rows: NDArray[np.integer], weights: Float) -> Float:
        """The weighted mean displacements of points, (F, 3)."""
        held = np.where(self.state[:, rows] == PointState.LOST, 0.0, weights)
        ways = np.where(held[..., None] > 0, self.displacement[:, rows], 0.0)
        total = held.sum(axis=1, keepdims=True)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.einsum("fn,fnk->fk", held, ways) / total

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self.reference)

    @cached_property
    def _gauge(self) -> StrainGauge:
        return StrainGauge(self.reference, self._tree)


def mean_path_of(reference: Float, frames: Iterable[TrackedFrame], rows: NDArray[np.integer]) -> MeanPath:
    """The mean path of some points of a reference, (N, 3), by rows (n,), through frames."""
    return Displacements.of(reference, frames, rows).mean_path(np.arange(len(rows)))


def save_displacements(
    path: Path, reference: Float, frames: int, frame: Callable[[int], TrackedFrame]
) -> None:
    """Write displacements.npz, a frame at a time. frame: gives the points in each of so many frames.

    Raises InputError.
    """
    count = len(reference)
    with whole_file(path) as temporary, zipfile.ZipFile(temporary, "w") as held:
        _add(held, "reference", np.float64, (count, 3), [reference])
        parts: dict[str, tuple[DTypeLike, tuple[int, ...]]] = {
            "displacement": (np.float32, (count, 3)),
            "sigma": (np.float32, (count,)),
            "state": (np.uint8, (count,)),
        }
        for name, (dtype, shape) in parts.items():
            arrays = (getattr(frame(index), name) for index in range(frames))
            _add(held, name, dtype, (frames, *shape), arrays)


def _add(
    held: zipfile.ZipFile, name: str, dtype: DTypeLike, shape: tuple[int, ...], arrays: Iterable[NDArray]
) -> None:
    """Add an array that comes in parts, in the format of numpy."""
    about = {"descr": np.lib.format.dtype_to_descr(np.dtype(dtype)), "fortran_order": False, "shape": shape}
    with held.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as stream:
        np.lib.format.write_array_header_1_0(stream, about)
        for array in arrays:
            stream.write(np.ascontiguousarray(array, dtype).tobytes())
