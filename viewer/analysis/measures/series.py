"""The values of measures in all frames, with their uncertainty (docs/how-it-works/landmarks.md)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...mesh.geodesic import Line, length_of, steps_along
from ...scan.faces import Triangles
from ...scan.pose import Pose
from ...scan.timeline import Timeline
from ...task import checkpoint
from ..track import Known, Track
from . import Measure, Series
from .kept import KeptValues
from .kinds import MeasureKind, kind_of
from .regions import Refused
from .surface import Found, PoseSurface

_NO_DIRECTION = "the landmarks of the measure lie at the same position or on a line"
_DRAWN = 48  # places of a line along the surface that are kept, in each frame


@dataclass(frozen=True, eq=False)
class _Asked:
    """A measure with what is known of its landmarks. positions: (T, K, 3). covariances: (T, U, 3, 3), of its
    landmarks, each once. which: (K,), of these. known: (T,). is_left: (T,), whether its
    surface has yet to be looked at. reasons, shares: as of `Series`."""

    measure: Measure
    kind: MeasureKind
    positions: NDArray[np.float64]
    covariances: NDArray[np.float64]
    which: NDArray[np.intp]
    known: NDArray[np.uint8]
    values: NDArray[np.float64]
    sigmas: NDArray[np.float64]
    lines: dict[int, tuple[Line, ...]]
    is_left: NDArray[np.bool_]
    reasons: dict[int, str]
    shares: NDArray[np.float64]


def series_of(
    measure: Measure,
    tracks: Mapping[str, Track],
    timeline: Timeline | None = None,
    noise: float = 0.0,
) -> Series:
    """The values of a measure in all frames, see `all_series`."""
    return all_series([measure], tracks, timeline, noise)[measure.name]


def all_series(
    measures: Sequence[Measure],
    tracks: Mapping[str, Track],
    timeline: Timeline | None = None,
    noise: float = 0.0,
    frames: Sequence[int] | None = None,
    tell: Callable[[dict[str, Series]], object] | None = None,
    *,
    keep: bool = False,
) -> dict[str, Series]:
    """The values of measures by name in all frames.

    tracks: by the name of the landmark, all of the same frames, at least one. timeline: the scan; each pose
    is read once for all measures that need its surface, and none where none does. noise: of the scanner,
    standard deviation of a coordinate of what it measures, scan units. frames: those in which the surface is
    looked at, in this order, others stay pending; None: all. tell: called after each with the series as far
    as they are known. keep: values of surfaces are kept in the cache folder, and taken from there where they
    were found before. What a frame does not tell, because a landmark is not known there, is not on the
    surface, or the frame is broken, is a gap. Long work: it can be cancelled. Raises InputError for measures
    that are none.
    """
    asked = [_asked(measure, tracks, noise) for measure in measures]
    for each in asked:
        if not each.kind.needs_surface:
            _fill_points(each)
    on_surface = [each for each in asked if each.kind.needs_surface]
    if on_surface and timeline is not None:
        kept = [KeptValues(each.measure, each.positions) for each in on_surface] if keep else []
        try:
            looked_at = range(len(timeline)) if frames is None else frames
            for _ in _fill_surfaces(on_surface, timeline, looked_at, kept):
                if tell is not None:
                    tell(_series(asked, tracks))
        finally:  # also where it is cancelled
            for values in kept:
                values.save()
    return _series(asked, tracks)


def lines_of(measure: Measure, series: Series, tracks: Mapping[str, Track], frame: int) -> tuple[Line, ...]:
    """The lines that a measure measures in a frame, or that are around what it does, each (P, 3), to be
    drawn; none where its value is not known. series: of the measure. tracks: by the name of the landmark.
    Raises InputError as `kind_of`."""
    kind = kind_of(measure)
    if frame >= len(series.values) or not np.isfinite(series.values[frame]):
        return ()
    if kind.lines is None:
        return series.lines.get(frame, ())
    positions = np.array([tracks[name].positions[frame] for name in measure.landmarks])
    return tuple(kind.lines(positions, measure.options)) if np.isfinite(positions).all() else ()


def surface_of(timeline: Timeline, pose: Pose, kept: dict[str, Triangles] | None = None) -> PoseSurface:
    """The surface of a pose, with the faces that the scan has of it. kept: faces by topology, of other
    poses."""
    name = pose.overview.topology
    if name is None:
        return PoseSurface(pose)
    kept = {} if kept is None else kept
    if name not in kept:
        kept.clear()  # one at a time: they are as large as a pose
        kept[name] = timeline.faces(pose.index).triangles()
    return PoseSurface(pose, kept[name])


def _asked(measure: Measure, tracks: Mapping[str, Track], noise: float) -> _Asked:
    kind = kind_of(measure)
    frames = len(next(iter(tracks.values())).times) if tracks else 0
    names = list(dict.fromkeys(measure.landmarks))
    missing = Track.pending(np.zeros(frames))
    own = [tracks.get(name, missing) for name in names]
    which = np.array([names.index(name) for name in measure.landmarks], np.intp)
    known = np.min([track.known for track in own], axis=0).astype(np.uint8)
    covariances = np.stack([track.covariances for track in own], axis=1) + noise**2 * np.eye(3)
    positions = np.stack([track.positions for track in own], axis=1)[:, which]
    values, sigmas, shares = np.full((3, frames), np.nan)
    reasons = {
        int(frame): f"{name} has no data"
        for name, track in reversed(list(zip(names, own, strict=True)))
        for frame in np.flatnonzero(track.known == Known.GAP)
    }
    return _Asked(
        measure,
        kind,
        positions,
        covariances,
        which,
        known,
        values,
        sigmas,
        {},
        np.full(frames, kind.needs_surface),
        reasons,
        shares,
    )


def _series(asked: Sequence[_Asked], tracks: Mapping[str, Track]) -> dict[str, Series]:
    """The series of measures as far as they are known, by name."""
    times = next(iter(tracks.values())).times if tracks else np.zeros(0)
    found = {}
    for each in asked:
        known, values = each.known.copy(), each.values.copy()
        is_open = (known >= Known.TRACKED) & ~np.isfinite(values)
        known[is_open] = np.where(each.is_left[is_open], Known.PENDING, Known.GAP)
        name, quantity = each.measure.name, each.kind.quantity
        sigmas, shares = each.sigmas.copy(), each.shares.copy()
        found[name] = Series(
            name, quantity, times, values, sigmas, known, dict(each.lines), dict(each.reasons), shares
        )
    return found


def _fill_points(asked: _Asked) -> None:
    rows = np.flatnonzero((asked.known >= Known.TRACKED) & np.isfinite(asked.positions).all(axis=(1, 2)))
    compute: Callable = asked.kind.compute

    def value(positions: NDArray[np.float64]) -> NDArray[np.float64]:
        with np.errstate(invalid="ignore", divide="ignore"):  # of landmarks in one place
            return compute(positions, asked.measure.options)

    positions = asked.positions[rows]
    asked.values[rows] = found = value(positions)
    variance = np.zeros(len(rows))
    is_known = np.asarray(np.isfinite(asked.covariances[rows]).all(axis=(1, 2, 3)))
    covariances = np.where(is_known[:, None, None, None], asked.covariances[rows], 0)
    roots = _roots(covariances)
    for landmark in range(covariances.shape[1]):
        moved = (asked.which == landmark)[None, :, None]
        for axis in range(3):
            step = moved * roots[:, landmark, None, :, axis]
            for side in (step, -step):
                variance += (value(positions + side) - found) ** 2 / 2
    asked.sigmas[rows] = np.where(is_known, np.sqrt(variance), np.nan)
    asked.reasons.update((int(row), _NO_DIRECTION) for row in rows[~np.isfinite(found)])


def _roots(covariances: NDArray[np.float64]) -> NDArray[np.float64]:
    """Matrices (..., 3, 3) of which each column is a standard deviation long, along the axes."""
    widths, axes = np.linalg.eigh(covariances)
    return axes * np.sqrt(np.maximum(widths, 0))[..., None, :]


def _fill_surfaces(
    asked: Sequence[_Asked], timeline: Timeline, frames: Sequence[int], kept: Sequence[KeptValues]
) -> Iterator[int]:
    """Look at the surface of one frame after the other, and tell which was done. kept: values of each, or
    none."""
    needed = [frame for frame in frames if any(each.known[frame] >= Known.TRACKED for each in asked)]
    faces: dict[str, Triangles] = {}
    for done, frame in enumerate(needed):
        checkpoint(done / len(needed))
        for each in asked:
            each.is_left[frame] = False
        try:
            surface = surface_of(timeline, timeline.visit(frame), faces)
        except InputError:  # the timeline reports it
            for each in asked:
                each.reasons.setdefault(frame, "Scan4D cannot read the frame")
            continue
        for each, values in zip_longest(asked, kept):
            checkpoint()
            if each.known[frame] >= Known.TRACKED and np.isfinite(each.positions[frame]).all():
                _fill_surface(each, frame, surface, values)
        yield frame


def _fill_surface(asked: _Asked, frame: int, surface: PoseSurface, kept: KeptValues | None) -> None:
    found = kept.get(frame, surface.digest) if kept else None
    if found is None:
        compute: Callable = asked.kind.compute
        found = compute(surface, asked.positions[frame], asked.measure.options)
        if isinstance(found, Found):
            found = replace(found, lines=tuple(map(_thinned, found.lines)))
        if kept:
            kept.put(frame, surface.digest, found)
    if isinstance(found, Refused):
        asked.reasons[frame] = found.in_words(asked.measure.landmarks)
        return
    gradient = np.zeros((asked.covariances.shape[1], 3))
    np.add.at(gradient, asked.which, found.gradient)
    variance = np.einsum("ui,uij,uj->", gradient, asked.covariances[frame], gradient)
    asked.values[frame] = found.value
    asked.sigmas[frame] = np.sqrt(max(variance, 0) + found.deviation**2)
    asked.shares[frame] = found.share
    asked.lines[frame] = found.lines


def _thinned(line: Line) -> Line:
    """A line through no more places than are drawn."""
    return line if len(line) <= _DRAWN else steps_along(line, length_of(line) / (_DRAWN - 1))
