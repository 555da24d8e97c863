"""Landmarks as files hold them: names, and a table of positions over frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...bounds import Bounds
from ...errors import InputError, shortened
from ...scan.units import conversion, usable_unit
from ..track import Known, Track

LONGEST_LANDMARK_NAME = 200  # characters
_MARGIN = 0.25  # of a scan's radius: as far off its box may a landmark lie
_TURNED = np.array([-1.0, -1.0, 1.0])  # from RAS to LPS, and back
_FACTORS = (1000.0, 0.001, 10.0, 0.1, 25.4, 1 / 25.4)  # between units that people mix up
_MOST_CELLS = 1 << 22  # landmarks times frames
_ALL = 0.8  # of the landmarks, for which a reason is given
_WIDE = (
    0.2  # of a scan's radius, that landmarks span at least: shrunk enough, any lie in a box about the origin
)


class LandmarkNotes(NamedTuple):
    """Texts of a file of landmarks, see `LandmarkSet`. unit: any text."""

    unit: str | None = None
    about: Sequence[str] = ()
    axes: str | None = None
    remarks: Sequence[str] = ()


NO_NOTES = LandmarkNotes()


@dataclass(frozen=True, eq=False)
class LandmarkSet:
    """Landmarks of one or more frames, T of them, in scan coordinates.

    names: L of them, each once. positions: (T, L, 3) float64, NaN where not defined. known: (T, L) uint8 of
    `Known`; a position that is PENDING is a preview, which nobody has confirmed. sigmas: (T, L) standard
    deviations, NaN where not known. times: (T,) seconds, NaN where not stated. frames: (T,) indices from 0,
    increasing. is_framed: whether the file tells them; else it holds one moment, or moments in an order.
    unit: of lengths, None where not stated. about: L descriptions, "" for none. axes: "LPS" or "RAS" as the
    file states, None where it does not. remarks: what a user should know of the reading, a sentence each.
    """

    names: tuple[str, ...]
    positions: NDArray[np.float64]
    known: NDArray[np.uint8]
    sigmas: NDArray[np.float64]
    times: NDArray[np.float64]
    frames: NDArray[np.int64]
    is_framed: bool = False
    unit: str | None = None
    about: tuple[str, ...] = ()
    axes: str | None = None
    remarks: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        names: Sequence[str],
        positions: NDArray[np.float64],
        *,
        known: NDArray[np.uint8] | None = None,
        sigmas: NDArray[np.float64] | None = None,
        times: NDArray[np.float64] | None = None,
        frames: Sequence[int] | NDArray[np.int64] | None = None,
        notes: LandmarkNotes = NO_NOTES,
    ) -> LandmarkSet:
        """The set of the landmarks in a file. Names that are empty, long or repeated are made usable.
        Positions that are not finite are not defined; `known` None makes the others PLACED. If the unit is
        not a known one, `remarks` says so. Raises InputError if there is no landmark."""
        unit, about, axes, remarks = notes
        if not len(names):
            raise InputError("holds no landmarks")
        positions = np.array(positions, np.float64).reshape(-1, len(names), 3)
        count = len(positions)
        usable, of_names = _usable_names(names)
        if unit and usable_unit(unit) is None:
            named = f"'{shortened(unit)}', which is not a known unit such as mm"
            of_names = [*of_names, f"The lengths are in {named}. Scan4D does not convert them"]
        there = np.isfinite(positions).all(axis=2)
        if known is None:
            known = np.where(there, Known.PLACED, Known.PENDING)
        known = np.where(~there & (known > Known.GAP), Known.GAP, known)
        positions[~there | (known == Known.GAP)] = np.nan
        grid = np.full((count, len(names)), np.nan)
        return cls(
            usable,
            positions,
            known.astype(np.uint8),
            grid if sigmas is None else np.array(sigmas, np.float64),
            np.full(count, np.nan) if times is None else np.array(times, np.float64),
            np.arange(count) if frames is None else np.array(frames, np.int64),
            frames is not None,
            usable_unit(unit),
            tuple(about) or ("",) * len(names),
            axes,
            (*remarks, *of_names),
        )

    @classmethod
    def of_tracks(
        cls, tracks: Mapping[str, Track], unit: str, about: Mapping[str, str] | None = None
    ) -> LandmarkSet:
        """The set of the landmarks of a scan, at least one, which are all at the same times."""
        held = list(tracks.values())
        times = held[0].times
        return cls.of(
            tuple(tracks),
            np.stack([track.positions for track in held], axis=1),
            known=np.stack([track.known for track in held], axis=1),
            sigmas=np.stack([track.sigmas for track in held], axis=1),
            times=times,
            frames=np.arange(len(times)),
            notes=LandmarkNotes(unit, [(about or {}).get(name, "") for name in tracks]),
        )

    def __len__(self) -> int:
        """How many frames it has."""
        return len(self.frames)

    @property
    def is_defined(self) -> NDArray[np.bool_]:
        """(T, L): where a landmark was placed or tracked."""
        return self.known >= Known.TRACKED

    def at(self, row: int) -> LandmarkSet:
        """The set of one of its frames."""
        rows = slice(row, row + 1)
        return replace(
            self,
            positions=self.positions[rows],
            known=self.known[rows],
            sigmas=self.sigmas[rows],
            times=self.times[rows],
            frames=self.frames[rows],
        )

    def tracks(self, times: NDArray[np.float64]) -> dict[str, Track]:
        """The landmarks through the frames of a scan, which are at these times, (F,) seconds, by name. Frames
        that the set has not are pending, and those that the scan has not are left out."""
        found = {}
        rows = np.flatnonzero(self.frames < len(times))
        frames = self.frames[rows]
        for number, name in enumerate(self.names):
            track = found[name] = Track.pending(times)
            is_there = self.is_defined[rows, number]
            track.positions[frames[is_there]] = self.positions[rows[is_there], number]
            track.known[frames] = self.known[rows, number]
            track.covariances[frames] = self.sigmas[rows, number, None, None] ** 2 * np.eye(3)
        return found

    def turned(self) -> LandmarkSet:
        """The set with x and y the other way: of LPS in RAS, and of RAS in LPS."""
        return replace(self, positions=self.positions * _TURNED)

    def in_unit(self, unit: str | None) -> LandmarkSet:
        """The set in another unit. Where one of the two is not stated, or is no known length, lengths stay as
        they are, and `remarks` says so."""
        if unit is None or self.unit is None or unit == self.unit:
            return self if unit is None else replace(self, unit=unit)
        factor = conversion(self.unit, unit)
        if factor is None:
            units = f"Lengths are in '{self.unit}', but the scan is in '{unit}'"
            remark = f"{units}. Scan4D does not convert them"
            return replace(self, unit=unit, remarks=(*self.remarks, remark))
        with np.errstate(over="ignore"):
            return replace(self, unit=unit, positions=self.positions * factor, sigmas=self.sigmas * factor)

    def even_rows(self) -> LandmarkSet:
        """The set with each frame from its first to its last, gaps in those that it has not."""
        first, count = int(self.frames[0]), int(self.frames[-1] - self.frames[0]) + 1
        if count == len(self):
            return self
        rows = self.frames - first
        frames = np.arange(first, first + count)
        positions = np.full((count, len(self.names), 3), np.nan)
        known = np.full((count, len(self.names)), Known.GAP, np.uint8)
        sigmas = np.full((count, len(self.names)), np.nan)
        positions[rows], known[rows], sigmas[rows] = self.positions, self.known, self.sigmas
        times = np.interp(frames, self.frames, self.times)
        return replace(self, positions=positions, known=known, sigmas=sigmas, times=times, frames=frames)


def check_cells(frames: int, names: int) -> None:
    """Raise InputError, before anything is allocated, for more landmarks in more frames than any scan has."""
    if frames * names > _MOST_CELLS:
        raise InputError(f"has {names:,} landmarks in {frames:,} frames, more than Scan4D can read")


def _usable_names(names: Sequence[str]) -> tuple[tuple[str, ...], list[str]]:
    """Names of which each is there once and can be shown, and what was changed, in words."""
    usable: dict[str, None] = {}
    copies: dict[str, int] = {}
    twice, unnamed, changed = [], 0, 0
    for number, given in enumerate(names, 1):
        name = "".join(letter if letter.isprintable() else " " for letter in given).strip()
        changed += name != given.strip() or len(name) > LONGEST_LANDMARK_NAME
        name = name[:LONGEST_LANDMARK_NAME]
        unnamed += not name
        base = name = name or str(number)
        while name in usable:
            copies[base] = copies.get(base, 1) + 1
            name = f"{base} ({copies[base]})"
        if name != base and base == given.strip():
            twice.append(base)
        usable[name] = None
    remarks = []
    if twice:
        remarks.append(
            f"{_counted(len(twice), 'name')} appeared twice. Scan4D added numbers to the repeated names, "
            f"such as '{shortened(twice[0])}'"
        )
    if unnamed:
        remarks.append(f"{_counted(unnamed, 'landmark')} had no name, so Scan4D numbered them")
    if changed:
        remarks.append(
            f"Scan4D changed {_counted(changed, 'name')} with too many characters, or characters that the "
            "window cannot show"
        )
    return tuple(usable), remarks


def _counted(number: int, word: str) -> str:
    return f"{number} {word}{'s' * (number != 1)}"


def why_apart(landmarks: LandmarkSet, bounds: Bounds) -> str | None:
    """Why landmarks cannot be of a scan within these bounds, in words with the likely cause; None where all
    of them lie on it or near.

    bounds: around all frames. A landmark is off where it lies a quarter of the scan's radius outside of them.
    """
    points = landmarks.positions[landmarks.is_defined]
    off = _off(points, bounds)
    if not (off > _MARGIN * bounds.radius).any():
        return None
    unit = landmarks.unit or "units"
    few = int((off > _MARGIN * bounds.radius).sum())
    head = (
        f"{few} of {len(points)} positions do not lie on the scan, but up to {off.max():.4g} {unit}"
        if few < len(points)
        else f"no landmark lies on the scan: the nearest one is {off.min():.4g} {unit} away"
    )
    cause = _cause(points, bounds)
    return f"{head}: {cause or 'the landmarks belong to another scan'}"


def _cause(points: NDArray[np.float64], bounds: Bounds) -> str | None:
    """The mistake that would explain why most places are off; None where none does."""

    def fits(moved: NDArray[np.float64]) -> bool:
        return bool((_off(moved, bounds) <= _MARGIN * bounds.radius).mean() >= _ALL)

    if fits(points):
        return None
    if fits(points * _TURNED):
        return (
            "the landmarks fit if the signs of x and y are reversed. The landmarks or the scan have the "
            "axes RAS (right, anterior, superior), and the other has LPS"
        )
    span = float(np.linalg.norm(np.ptp(points, axis=0)))
    for factor in _FACTORS:
        if factor * span >= _WIDE * bounds.radius and fits(points * factor):
            return (
                f"the landmarks fit if their coordinates are multiplied by {factor:.4g}. The landmarks "
                "and the scan have different units"
            )
    return None


def _off(points: NDArray[np.float64], bounds: Bounds) -> NDArray[np.float64]:
    """Distances of points, (N, 3), from a box; 0 within."""
    outside = np.maximum(np.maximum(bounds.low - points, points - bounds.high), 0)
    return np.linalg.norm(outside, axis=1)
