"""Statistics of deviations over time, whole and of a region, kept in the cache folder as they are found."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...files import parsed_json, read_text, reading, save_json
from ...folders import cache_folder, forget_oldest
from ...rigid import Rigid
from ...scan.points import PointCloud
from ..measures import Series
from ..motion.region import put_in_spheres
from ..track import Known
from .chosen import Deviations
from .statistics import DeviationStatistics

_MOST_KEPT = 16 * 2**20  # bytes, of all scans
_MOST_BYTES = 1 << 24
_WHOLE, _REGION = "Deviation", "Deviation of region"
_NAMES = {"mean": "mean", "rms": "RMS", "p95": "95 %", "max": "maximum"}

Float = NDArray[np.float64]


class FramePlace(NamedTuple):
    """The place of a frame: its motions to the reference, and to the frame whose region was painted."""

    to_reference: Rigid
    to_painted: Rigid

    @property
    def key(self) -> str:
        """A word that tells places apart."""
        both = b"".join(motion.matrix.tobytes() for motion in self)
        return hashlib.blake2b(both, digest_size=12).hexdigest()


class FrameDeviation(NamedTuple):
    """Statistics of a frame. region: of its points in the region; None where none is painted."""

    whole: DeviationStatistics
    region: DeviationStatistics | None

    @classmethod
    def of(
        cls, values: NDArray[np.floating], cloud: PointCloud, spheres: Float, place: FramePlace
    ) -> FrameDeviation:
        """The statistics of values (N,). spheres: (S, 4), of the region, see `RigidRegion`."""
        whole = DeviationStatistics.of(values)
        if not len(spheres):
            return cls(whole, None)
        is_in = np.zeros(len(cloud), bool)
        put_in_spheres(spheres, place.to_painted.points(cloud.world()), is_in)
        return cls(whole, DeviationStatistics.of(values[is_in]))


def frame_deviation(
    deviations: Deviations, cloud: PointCloud, spheres: Float, place: FramePlace
) -> FrameDeviation:
    """The statistics of a frame."""
    return FrameDeviation.of(deviations.of(cloud, place.to_reference), cloud, spheres, place)


class KeptDeviations:
    """A file of statistics. key: what they are of, plain JSON; statistics of anything else are not read."""

    def __init__(self, key: Mapping[str, Any]) -> None:
        self._key = json.dumps(key, sort_keys=True)
        digest = hashlib.blake2b(self._key.encode(), digest_size=16).hexdigest()
        self._folder = cache_folder() / "deviation"
        self._path = self._folder / f"{digest}.json"

    def read(self) -> dict[tuple[int, str], FrameDeviation]:
        """The statistics by frame and the key of its `FramePlace`; none where there is no usable file."""
        with suppress(InputError), reading(self._path, "does not hold deviations", "Delete the file"):
            try:
                said = parsed_json(read_text(self._path, _MOST_BYTES))
                frames = said["frames"] if said["key"] == self._key else []
                return {
                    (int(frame), of): FrameDeviation(_statistics(whole), region and _statistics(region))
                    for frame, of, whole, region in frames
                }
            except (AttributeError, KeyError, TypeError) as error:
                raise ValueError(f"{type(error).__name__}: {error}") from error
        return {}

    def save(self, found: Mapping[tuple[int, str], FrameDeviation]) -> None:
        """Write the statistics, where that is possible; else they are found again next time."""
        frames = [
            (frame, of, _plain(one.whole), one.region and _plain(one.region))
            for (frame, of), one in found.items()
        ]
        with suppress(InputError):
            save_json(self._path, {"key": self._key, "frames": frames})
        forget_oldest(self._folder, _MOST_KEPT)


def deviation_curves(found: Mapping[int, FrameDeviation], times: Float) -> dict[str, Series]:
    """Mean, RMS, 95 % and maximum over time, scan units, by name: of all points, then of the region. times:
    (T,) seconds. Their standard deviations are not known."""
    parts = {_WHOLE: {frame: one.whole for frame, one in found.items()}}
    region = {frame: one.region for frame, one in found.items() if one.region is not None}
    if region:
        parts[_REGION] = region
    curves = {}
    for title, statistics in parts.items():
        states = np.full(len(times), Known.PENDING, np.uint8)
        values = np.full((len(_NAMES), len(times)), np.nan)
        for frame, one in statistics.items():
            values[:, frame] = [getattr(one, name) for name in _NAMES]
            states[frame] = Known.TRACKED if np.isfinite(one.rms) else Known.GAP
        gaps = np.flatnonzero(states == Known.GAP).tolist()
        reasons = dict.fromkeys(gaps, "no point has a deviation")
        unknown = np.full(len(times), np.nan)
        for words, row in zip(_NAMES.values(), values, strict=True):
            name = f"{title}, {words}"
            curves[name] = Series(name, "length", times, row, unknown, states, reasons=reasons)
    return curves


def _plain(one: DeviationStatistics) -> list[float | None]:
    return [value if np.isfinite(value) else None for value in one]


def _statistics(values: list[float | None]) -> DeviationStatistics:
    return DeviationStatistics(*(np.nan if value is None else float(value) for value in values))
