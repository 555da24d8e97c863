"""Recordings: what was shown, as plain data that draws the same pictures again.

A recording is a JSON file, an entry a line:

    {
    "format": 1, "version": "0.1.0", "seconds": 2.4, "entries": [
    {"at": 0.0, "scan": "knot", "hash": ..., "pose": 0, "time": 0.0, "size": [1280, 720], "camera": {...},
     "backend": "points", "params": {...}, "look": {...}, "marks": {...}, "unit": "mm",
     "shown_unit": null, "place": null, "anonymous": false},
    {"at": 0.52, "pose": 1, "time": 0.04}
    ]}

The first entry is complete, every other one tells what has changed. Each PNG and EXR that Scan4D writes
holds its own complete entry, with `format` and `version` beside it, and is a recording of one entry.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import secrets
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..analysis.deviation import chosen
from ..analysis.deviation.chosen import Deviations, ReferenceChoice
from ..analysis.motion import distances
from ..analysis.motion.followed_points import FollowedPoints
from ..analysis.motion.quantities import QUANTITIES
from ..analysis.motion.stabilise import moment_surface
from ..analysis.surface_point import slack_before
from ..analysis.tracking.surface import MomentSurface
from ..backends import backend as find_backend
from ..camera import Camera
from ..choice.choose import Automatic, Choice
from ..drawing.request import Request
from ..errors import InputError, shortened
from ..files import open_plain, whole_file
from ..geometry import vector
from ..look import Look, drawable, value_source
from ..output.export import read_description
from ..output.labels import LabelSpot
from ..output.legend import Legend, Marks
from ..output.overlays import (
    LINE_COLOR,
    LINE_SLACK,
    DeviationMarks,
    DrawnLandmark,
    DrawnMarks,
    DrawnPath,
    DrawnPlot,
    FollowedMarks,
    Overlay,
    Stabilised,
)
from ..rigid import STILL, Rigid, is_rigid
from ..scan.layers import NO_LAYERS, Layers
from ..scan.open import is_arriving, is_no_path, searches_folders
from ..scan.pose import Pose
from ..scan.reading.corrections import Corrections
from ..scan.reading.record import Reading
from ..scan.timeline import Timeline
from ..scan.units import Scale
from .anonymous import anonymous_unit, middle_of
from .landmarks import Note
from .schema import (
    DAMAGED,
    AverageFrames,
    BackendName,
    CorrectedTexts,
    Count,
    Hash,
    Kind,
    PoseNumber,
    ScanName,
    Stamp,
    Time,
    Unit,
    Values,
    check_format,
    is_object,
    plain,
    read_json,
    structured,
)

FORMAT = 1
_HASHED_BYTES = 256 * 2**20  # of a file; hashing takes 0.05 to 0.3 s for 100 MB
_ENDS_OF, _END_BYTES = 64, 2**16  # files, spread evenly, of which both ends are read, and bytes of an end
_EXACT = 1e-6  # how far the rotation of a matrix may be from orthonormal

_Row = tuple[float, float, float, float]


def _is_place(rows: tuple[_Row, ...]) -> bool:
    return is_rigid(np.array(rows), _EXACT)


DrawnScale = Annotated[float, Kind("a scale above 0, at most 1", lambda scale: 0 < scale <= 1)]
Matrix = Annotated[tuple[_Row, _Row, _Row, _Row], Kind("a rotation and a translation, 4 x 4", _is_place)]


@dataclass(frozen=True)
class FrameMatrix:
    """A frame and the motion by which it is shown. matrix: from the scan's coordinates to the world's."""

    frame: PoseNumber
    matrix: Matrix


@dataclass(frozen=True)
class FollowedNumbers:
    """Numbers of followed points, by what they are found from again, see `FollowedMarks`."""

    reference: PoseNumber
    motions: tuple[FrameMatrix, ...]

    @classmethod
    def of(cls, marks: FollowedMarks) -> FollowedNumbers:
        """The marks that a tool gives."""
        motions = ((frame, _rows_of(motion)) for frame, motion in sorted(marks.motions.items()))
        return cls(marks.reference, tuple(FrameMatrix(*one) for one in motions))

    def moved(self, origin: NDArray[np.float64]) -> FollowedNumbers:
        """The numbers with motions in coordinates relative to an origin, (3,)."""
        motions = {one.frame: Rigid(np.array(one.matrix)).in_frame(origin) for one in self.motions}
        return FollowedNumbers.of(FollowedMarks(self.reference, motions))


@dataclass(frozen=True)
class DeviationNumbers:
    """Deviations, by what they are found from again, see `DeviationMarks` and `ReferenceChoice`."""

    first: PoseNumber
    last: PoseNumber
    file: ScanName | None
    motion: Matrix | None

    @classmethod
    def of(cls, marks: DeviationMarks) -> DeviationNumbers:
        """The marks that a tool gives."""
        reference, motion = marks.reference, marks.motion
        rows = None if motion is None else _rows_of(motion)
        return cls(reference.first, reference.last, reference.file or None, rows)

    def values(self, pose: Pose, timeline: Timeline) -> NDArray[np.float32]:
        """The deviations of a pose, (N,) by row of its cloud; NaN in a gap. Raises InputError."""
        if self.motion is None:
            return np.full(len(pose.cloud), np.nan, np.float32)
        found = _deviations_of_film(timeline, ReferenceChoice(self.first, self.last, self.file or ""))
        return found.of(pose.cloud, Rigid(np.array(self.motion)))

    def moved(self, origin: NDArray[np.float64]) -> DeviationNumbers:
        """The deviations with the motion in coordinates relative to an origin, (3,)."""
        if self.motion is None:
            return self
        return replace(self, motion=_rows_of(Rigid(np.array(self.motion)).in_frame(origin)))


@dataclass(frozen=True)
class Entry:
    """One picture that was shown: all that is needed to draw it again.

    scan: as the user named it, None where it is anonymous. hash: of its files (see `fingerprint`), None
    where there is none. pose: its index. time: the pose's, seconds. size: (width, height) in pixels.
    params: the backend's own `Params`. marks: what is drawn over it. unit: of length, None for the scan's
    own. shown_unit: that marks tell lengths in, None for `unit`. place: the matrix that the scan is moved by,
    None where it is not. anonymous: whether camera, time, look and place are those of the scan as
    `anonymous_request` has it. notes: of the
    scan, where the marks show them. stabilised: how the place was found, None where it is as recorded.
    followed: how numbers of followed points were found, None where the picture is not coloured by any.
    deviation: likewise of deviations.
    labels: where those over the view stand. scale: of width and height, at
    which it was drawn. automatic: what the renderer was chosen for and expected to take, None where a user or
    the scan says which it is. reading: corrections of how Scan4D reads the scan, as documents have them.
    record: how Scan4D read it (see `Reading.to_json`), for information only: it grows while frames are read.
    average: frames that points are means of at most; 0: each frame is drawn as scanned. at: seconds since the
    recording began. Entries that differ in `record` and `at` alone are equal.
    """

    scan: ScanName | None
    hash: Hash | None
    pose: PoseNumber
    time: Time
    size: Annotated[tuple[Count, Count], Kind("width and height", lambda _: True)]
    camera: Camera
    backend: BackendName
    params: Annotated[Any, Kind("an object with named parameters", is_object)]
    look: Look
    marks: Marks = field(default_factory=Marks)
    unit: Unit | None = None
    shown_unit: Unit | None = None
    place: Matrix | None = None
    anonymous: bool = False
    notes: tuple[Note, ...] = ()
    landmarks: tuple[DrawnLandmark, ...] = ()
    trajectories: tuple[DrawnPath, ...] = ()
    held: Matrix | None = None
    measure_lines: tuple[DrawnPath, ...] = ()
    plot: DrawnPlot | None = None
    stabilised: Stabilised | None = None
    followed: FollowedNumbers | None = None
    deviation: DeviationNumbers | None = None
    labels: tuple[LabelSpot, ...] = ()
    scale: DrawnScale = 1.0
    automatic: Automatic | None = None
    reading: CorrectedTexts = field(default_factory=dict)
    record: Values = field(default_factory=dict, compare=False)
    average: AverageFrames = 0
    at: Stamp = field(default=0.0, compare=False)

    @classmethod
    def of(
        cls,
        request: Request,
        scan: str | None,
        hash: str | None,
        size: tuple[int, int],
        unit: str,
        marks: Marks | None = None,
        choice: Choice | None = None,
    ) -> Entry:
        """The entry of a picture that was asked for with a backend's name and its parameters.

        choice: that backend and parameters come from. Raises InputError where its colours come from a layer:
        these numbers are in no file.
        """
        layers, marks = request.layers, marks or Marks()
        names = layers.names(request.pose.overview.scalars)
        source = value_source(drawable(request.look, names), names)
        if source in layers.scalars:
            what = (
                f"the picture shows the colours '{source}', which Scan4D computes and the files of the scan "
                "do not contain"
            )
            raise InputError(what, hint="Choose other colours and try again")
        return cls(
            scan, hash, request.pose.index, float(request.pose.time), size,
            request.camera, str(request.backend), request.params, request.look, marks, unit,
            place=matrix_of(layers.world_from_pose),
            scale=1.0 if choice is None else choice.configuration.scale,
            automatic=None if choice is None else choice.report,
            average=0 if request.pose.average is None else request.pose.average.frames,
        )  # fmt: skip

    def with_reading(self, timeline: Timeline) -> Entry:
        """The entry with how Scan4D reads its scan: the user's corrections, and the record."""
        texts = dict(timeline.decided.corrections.texts)
        return replace(self, reading=texts, record=timeline.reading.to_json())

    def after_drawing(self, pose: Pose) -> Entry:
        """The entry with what the record of the scan has since the pose was drawn: sides of normals."""
        if pose.scan.decided is None or self.anonymous:
            return self
        return replace(self, record=pose.scan.decided.reading.to_json())

    def with_notes(self, notes: tuple[Note, ...]) -> Entry:
        """The entry with the notes of its scan, if the marks show them."""
        return replace(self, notes=notes if self.marks.notes else ())

    def with_drawn(self, drawn: DrawnMarks) -> Entry:
        """The entry with what tools draw over its frame, as far as the marks show it."""
        marks = self.marks
        return replace(
            self,
            landmarks=drawn.landmarks if marks.landmarks else (),
            trajectories=drawn.trajectories if marks.trajectories else (),
            held=matrix_of(drawn.held) if marks.trajectories else None,
            measure_lines=drawn.measure_lines if marks.measure_lines else (),
            plot=drawn.plot if marks.plot else None,
            stabilised=drawn.stabilised,
            followed=None if drawn.followed is None else FollowedNumbers.of(drawn.followed),
            deviation=None if drawn.deviation is None else DeviationNumbers.of(drawn.deviation),
        )

    def request(self, pose: Pose, scalars: Mapping[str, NDArray[np.generic]] | None = None) -> Request:
        """The picture to draw. pose: number `self.pose` of the scan. scalars: as `computed` gives them."""
        is_plain = self.place is None and not scalars
        layers = NO_LAYERS if is_plain else Layers(scalars or {}, self.motion)
        return Request(pose, self.camera, self.backend, self.params, self.look, layers)

    def computed(self, timeline: Timeline) -> dict[str, NDArray[np.generic]]:
        """The numbers that the picture is coloured by and no file of the scan has, by name. timeline: of the
        scan. Raises InputError where the reference frame cannot be read."""
        name = self.look.color_by
        if self.followed is not None and name in QUANTITIES:
            return {name: self._of_followed(self.followed, timeline)}
        if self.deviation is not None and name == chosen.NAME:
            pose = timeline.drawn(self.pose)
            deviation = self.deviation.moved(-middle_of(pose)) if self.anonymous else self.deviation
            return {name: deviation.values(pose, timeline)}
        if self.stabilised is None or name != distances.NAME:
            return {}
        pose = timeline.drawn(self.pose)
        if self.stabilised.is_gap:
            return {distances.NAME: distances.unknown_distances(len(pose.cloud))}
        surface, origin = _reference_surface(timeline, self.stabilised.reference)
        motion = self.motion.in_frame(-middle_of(pose)) if self.anonymous else self.motion
        return {distances.NAME: distances.distances_from(surface, origin, pose.cloud, motion)}

    def _of_followed(self, followed: FollowedNumbers, timeline: Timeline) -> NDArray[np.float32]:
        """The number of followed points that the picture is coloured by, (N,) by row of its cloud. Points are
        followed now, unless the cache folder has them."""
        pose = timeline.drawn(self.pose)
        followed = followed.moved(-middle_of(pose)) if self.anonymous else followed
        motions = {one.frame: Rigid(np.array(one.matrix)) for one in followed.motions}
        points = _followed_of_film(timeline, followed.reference)
        return points.of_pose(self.look.color_by, self.pose, points.rows_nearest(pose), motions.get)

    @property
    def motion(self) -> Rigid:
        """The motion of `place`."""
        return STILL if self.place is None else Rigid(np.array(self.place))

    def legend(self, timeline: Timeline, pose: Pose) -> Legend:
        """Texts and lines of the marks. timeline: the scan's. pose: that is drawn."""
        scale = Scale.of(timeline.unit if self.unit is None else self.unit, self.shown_unit)
        notes = [one for one in self.notes if self.marks.notes and one.frame in (None, self.pose)]
        return Legend(
            self.marks, self.camera, self.look, scale.unit, self.pose, len(timeline), self.time,
            notes=tuple(one.text for one in notes if one.position is None), factor=scale.factor,
            overlay=self._overlay(pose, notes), plot=self.plot if self.marks.plot else None,
            labels=self.labels,
        )  # fmt: skip

    def _overlay(self, pose: Pose, notes: Iterable[Note]) -> Overlay | None:
        """Landmarks, lines and pinned notes, where the scan is moved to; None where the marks show none."""
        marks, radius, motion = self.marks, pose.drawn_bounds().radius, self.motion
        slack = float(slack_before(0.0, 0.0, radius))
        landmarks = [
            (
                one,
                vector(motion.points(np.array(one.place))),
                float(slack_before(one.spacing, one.sure, radius)),
            )
            for one in (self.landmarks if marks.landmarks else ())
        ]
        of_paths = motion if self.held is None else motion.after(Rigid(np.array(self.held)))
        trajectories = [(path, of_paths) for path in (self.trajectories if marks.trajectories else ())]
        pins = (
            DrawnPath((one.position,), (LINE_COLOR,), name=one.text, has_ends=True, slack=slack)
            for one in notes
            if one.position is not None
        )
        lines = [(path, motion) for path in (*(self.measure_lines if marks.measure_lines else ()), *pins)]
        paths = [(path, moved.points(np.array(path.places))) for path, moved in (*trajectories, *lines)]
        return Overlay.of(landmarks, paths, LINE_SLACK * radius) if landmarks or paths else None

    def drawn_from(self, origin: NDArray[np.float64]) -> Entry:
        """The entry whose landmarks and lines count from an origin, (3,)."""

        def moved(paths: tuple[DrawnPath, ...]) -> tuple[DrawnPath, ...]:
            return tuple(
                replace(one, places=tuple(map(vector, np.array(one.places) - origin))) for one in paths
            )

        landmarks = tuple(replace(one, place=vector(np.array(one.place) - origin)) for one in self.landmarks)
        held = None if self.held is None else matrix_of(Rigid(np.array(self.held)).in_frame(origin))
        return replace(
            self, landmarks=landmarks, trajectories=moved(self.trajectories), held=held,
            measure_lines=moved(self.measure_lines), followed=self.followed and self.followed.moved(origin),
            deviation=self.deviation and self.deviation.moved(origin),
        )  # fmt: skip

    def to_json(self, before: Entry | None = None) -> dict[str, Any]:
        """A JSON object, without `at`. before: leave out what is as it was there."""
        changed = (f.name for f in fields(self) if f.name != "at")
        if before is not None:
            changed = (name for name in changed if getattr(self, name) != getattr(before, name))
        return {name: plain(getattr(self, name)) for name in changed}

    @classmethod
    def from_json(cls, data: Mapping[str, Any], where: object = None) -> Entry:
        """The entry of a complete JSON object.

        where: it stands, for messages. Raises InputError for whatever is wrong in it.
        """
        entry = structured(cls, data, where)
        params = structured(find_backend(entry.backend).params_class, entry.params, f"{where}, params")
        return replace(entry, params=params)

    def without_names(self) -> Entry:
        """The entry as an anonymous picture tells it, of a scan that is as `anonymous_request` has it; notes
        and names of landmarks and measures may tell anything, and are left out."""
        unit, shown = (
            None if name is None else anonymous_unit(name) for name in (self.unit, self.shown_unit)
        )
        return replace(
            self, scan=None, unit=unit, shown_unit=shown, anonymous=True, notes=(), automatic=None,
            deviation=None if self.deviation and self.deviation.file else self.deviation,
            landmarks=tuple(replace(one, name="") for one in self.landmarks),
            measure_lines=tuple(replace(one, name="") for one in self.measure_lines),
            plot=self.plot and self.plot.without_names(), labels=(),
            reading=Corrections.parse(self.reading).without_names(),
            record=Reading.from_json(self.record).without_names().to_json() if self.record else {},
        )  # fmt: skip

    def description(self) -> str:
        """The JSON text that a picture carries."""
        return json.dumps(_head() | self.to_json())


def followed_points(timeline: Timeline, reference: int) -> FollowedPoints:
    """The points of a frame, as far as they were followed. Raises InputError as `FollowedPoints` does."""
    of = {"version": __version__, "scan": fingerprint(timeline.files) or timeline.name}
    return FollowedPoints(timeline, reference, of)


_followed_of_film = lru_cache(maxsize=1)(followed_points)  # all frames of a film share them


@lru_cache(maxsize=1)
def _deviations_of_film(timeline: Timeline, reference: ReferenceChoice) -> Deviations:
    """The deviations from a reference."""
    return reference.read(timeline)


@lru_cache(maxsize=1)
def _reference_surface(timeline: Timeline, frame: int) -> tuple[MomentSurface, NDArray[np.float64]]:
    """The surface of a frame, and the origin that it is relative to."""
    cloud = timeline.pose(frame).cloud
    return moment_surface(cloud, cloud.origin), cloud.origin


def matrix_of(place: Rigid) -> Matrix | None:
    """The `place` of an entry."""
    return None if place.is_identity else _rows_of(place)


def _rows_of(motion: Rigid) -> Matrix:
    return tuple(map(tuple, motion.matrix.tolist()))  # type: ignore[return-value]


@dataclass(frozen=True)
class Recording:
    """Pictures that were shown, in the order of time. entries: at least one. seconds: how long it took."""

    entries: tuple[Entry, ...]
    seconds: float = 0.0

    def save(self, path: Path) -> None:
        """Write its JSON. Raises InputError where it cannot be written."""
        before = (None, *self.entries[:-1])
        lines = (json.dumps(_change(entry, last)) for entry, last in zip(self.entries, before, strict=True))
        head = json.dumps(_head() | {"seconds": self.seconds}).strip("{}")
        text = f'{{\n{head}, "entries": [\n' + ",\n".join(lines) + "\n]}\n"
        with whole_file(path) as temporary:
            temporary.write_text(text, encoding="utf-8")

    @classmethod
    def load(cls, path: Path) -> Recording:
        """Read a recording, or the entry that a .png or .exr of Scan4D carries.

        Raises InputError, which names the file and the entry, for whatever is wrong in it.
        """
        return cls.from_json(read_json(path), path)

    @classmethod
    def from_json(cls, data: Any, path: Path) -> Recording:
        """The recording of a JSON object of this file. Raises InputError for whatever is wrong in it."""
        if not isinstance(data, dict) or "format" not in data:
            raise InputError(
                "is not a recording",
                path,
                "Use a recording (.json) or a picture that you saved with Scan4D",
            )
        check_format(data, FORMAT, path)
        entries = data.get("entries")
        if entries is None:
            complete = {name: value for name, value in data.items() if name not in _head()}
            return cls((Entry.from_json(complete, path),))
        if not isinstance(entries, list) or not entries:
            raise InputError("has no entries", path, DAMAGED)
        read = _read_changes(entries, path)
        seconds = structured(Stamp, data.get("seconds", 0.0), f"{path}, 'seconds'")
        return cls(read, max(seconds, read[-1].at))


class Recorder:
    """Takes down what is shown. now: by the clock, seconds."""

    def __init__(self, now: float) -> None:
        self._began = now
        self._entries: list[Entry] = []

    def __len__(self) -> int:
        return len(self._entries)

    def note(self, entry: Entry, now: float) -> dict[str, Any] | None:
        """Take down what is shown from now on, unless it is what was shown before.

        Returns what has changed, as the recording's file will have it; None where nothing has.
        """
        before = self._entries[-1] if self._entries else None
        if before is not None and entry == replace(before, hash=before.hash or entry.hash):
            # Nothing, or what is found while the picture stays: the hash, and how the scan was read.
            self._entries[-1] = replace(before, record=entry.record)
            return None
        self._entries.append(replace(entry, at=self._since(now)))
        return _change(self._entries[-1], before)

    def finish(self, now: float) -> Recording:
        """All that was noted, which must be something; where a scan's hash was found late, with that."""
        found = {entry.scan: entry.hash for entry in self._entries if entry.hash is not None}
        entries = (replace(entry, hash=entry.hash or found.get(entry.scan)) for entry in self._entries)
        return Recording(tuple(entries), self._since(now))

    def _since(self, now: float) -> float:
        return round(now - self._began, 3)


def fingerprint(files: Sequence[Path], salt: str | None = None) -> str | None:
    """A hash that tells whether a scan is still the same: its kind, and 16 hex digits of a SHA-256.

    "sha256:" is of the bytes of a single file, as sha256sum gives it. "content:" is of several files, or of
    one above 256 MiB: of their sizes, of all of the first file, and of the others' first and last bytes.
    Names do not count, so a scan that was renamed or copied has the same hash. With a salt, which stands
    before it, "salted:" is of the same bytes: two pictures of one scan have nothing in common. None where
    there are no files, or they cannot be read.
    """
    try:
        if not files:
            return None
        if salt is None and len(files) == 1 and os.path.getsize(files[0]) <= _HASHED_BYTES:
            with open_plain(files[0]) as stream:
                return f"sha256:{hashlib.file_digest(stream, 'sha256').hexdigest()[:16]}"
        digest = _digest_of_content(files, salt or "")
    except OSError:
        return None
    return f"content:{digest}" if salt is None else f"salted:{salt}:{digest}"


def _digest_of_content(files: Sequence[Path], salt: str) -> str:
    """Digest of sizes and bytes: see `fingerprint`. The ends of at most _ENDS_OF files are read."""
    digest = hashlib.sha256(salt.encode())
    looked_at = set(range(0, len(files), -(-len(files) // _ENDS_OF)))
    for number, file in enumerate(files):
        if number not in looked_at:
            digest.update(f"{os.path.getsize(file)} ".encode())
            continue
        most = _HASHED_BYTES // 2 if number == 0 else _END_BYTES
        with open_plain(file) as stream:
            size = os.fstat(stream.fileno()).st_size
            digest.update(f"{size} ".encode() + stream.read(most))
            stream.seek(max(size - most, stream.tell()))
            digest.update(stream.read(most))
    return digest.hexdigest()[:16]


def new_salt() -> str:
    """A salt for the hashes of anonymous pictures, 16 hex digits by chance."""
    return secrets.token_hex(8)


def fingerprint_as(known: str | None, files: Sequence[Path]) -> str | None:
    """The hash of files as a known one was made."""
    salted = re.fullmatch("salted:([0-9a-f]{16}):[0-9a-f]{16}", known or "")
    return fingerprint(files, salted[1] if salted else None)


def is_recording(path: Path) -> bool:
    """Whether a file is one to replay, by its suffix; an .exr may also be a scan, so it is looked into."""
    if path.suffix.lower() != ".exr":
        return path.suffix.lower() in (".json", ".png")
    try:
        return bool(read_description(path))
    except InputError:
        return False


def scan_paths(scan: str, recording: Path) -> list[str]:
    """Paths of a scan that a recording names: beside the recording, then as it is named."""
    return [scan] if is_no_path(scan) else list(dict.fromkeys([str(recording.parent / scan), scan]))


def checked_scan_paths(scan: str, recording: Path) -> list[str]:
    """Paths of a scan that a recording or a session names, checked before anything there is opened.

    The scan may lie anywhere on this machine, since the user sees which one is opened. Raises InputError
    where opening it would search through folders, or ask another machine, for whoever wrote the recording.
    """
    if where := remote_location(scan):
        hint = "If this is the right scan, open the scan first, or name it: scan4d render SCAN --replay ..."
        raise InputError(f"names the scan '{shortened(scan)}', {where}", recording, hint)
    return scan_paths(scan, recording)


def remote_location(scan: str) -> str:
    """Words on where a scan may be that only the user may name; "" where a recording may."""
    if scan.startswith(("//", "\\\\")) or is_arriving(scan):
        return "which is on another machine"
    return "a pattern that would search through folders" if searches_folders(scan) else ""


def scan_path(scan: str, recording: Path) -> str:
    """The first of these paths where something is, else the last one. Raises InputError likewise."""
    paths = checked_scan_paths(scan, recording)
    return next((path for path in paths if os.path.exists(path)), paths[-1])


# --- reading --------------------------------------------------------------------------------


def _read_changes(changes: Iterable[Any], path: Path) -> tuple[Entry, ...]:
    """The entries, each with what the one before tells and it does not."""
    entries: list[Entry] = []
    complete: dict[str, Any] = {}
    for number, change in enumerate(changes):
        where = f"{path}, entry {number}"
        if not isinstance(change, dict):
            raise InputError("is not a JSON object", where, DAMAGED)
        complete |= change
        entries.append(Entry.from_json(complete, where))
        if number and entries[-1].at < entries[-2].at:
            raise InputError(
                "the time of this entry is earlier than the time of the entry before it",
                where,
                "Sort the entries by their field 'at'",
            )
    return tuple(entries)


# --- writing --------------------------------------------------------------------------------


def _head() -> dict[str, Any]:
    return {"format": FORMAT, "version": __version__}


def _change(entry: Entry, before: Entry | None) -> dict[str, Any]:
    """An entry as a recording has it, after the one before."""
    return {"at": entry.at} | entry.to_json(before)
