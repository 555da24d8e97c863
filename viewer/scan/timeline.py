"""A scan in time: the time and the source of each pose, which it reads when asked."""

from __future__ import annotations

import atexit
import copy
import operator
import threading
import traceback
import weakref
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import EmptyFrame, InputError, shortened
from ..task import Cancelled, Task
from .averaging import Averaging, averaged
from .cache import PoseCache, default_budget
from .faces import Faces
from .points import UNKNOWN_UNIT, PointCloud
from .pose import Pose, ScanKey
from .range_view import RangeView, in_one_unit
from .reading.record import Reading
from .reading.sequence import Decided, ReportKind
from .sources import FrameSource
from .times import frame_in_words
from .units import conversion, usable_unit

_TRACEBACKS = 10  # of broken frames that are stored: each takes a millisecond to write, and kilobytes
_CLOSE_WAIT = 2.0  # seconds that closing waits for a pose that is being read


@dataclass(frozen=True)
class ScanMessage:
    """A message about a scan for the user.

    kind: "broken" (the frame cannot be read), "empty" (it holds no points), "dropped" (points that are
    not finite or not measured were left out), "shortened" (splats far larger than the scan were), "unit"
    (lengths in another unit than the scan's, or a name of it that is no unit), "assumed" (what range
    views do not state), "times" or "beside" (files in its folder may be another scan), "normals",
    "camera", "aside" (files that the scan leaves out), "take" (its folder holds several), "contradiction"
    (a frame does not fit the scan's decisions) or "correction" (one that nothing uses). index: the frame;
    None where it concerns all.
    """

    kind: Literal["broken", "empty", "dropped", "shortened", "beside"] | ReportKind
    text: str
    index: int | None = None


class TimelineClosed(ValueError):
    """The timeline is closed because another scan is open; it reads no more poses."""


class Timeline:
    """The poses of a scan, read when asked for and held in a cache of bounded size.

    times:    (T,) float64, seconds, increasing, read-only
    unit:     the name of the scan's unit of length
    name:     the scan's name
    messages: reports for the user; it only grows, by one of a kind per frame
    is_measured: whether a file beside the frames states the times
    source:   where the frames come from
    opened_with: the times that it began with
    decided:  how Scan4D reads it: `reading` is the record
    finish:   called with each pose on the thread that has read it, before anybody gets it; for what
              would take too long where it is shown

    Every method may be called from any thread. One worker thread, started by the first `request` or
    `prefetch`, reads ahead; it knows no GL. Scripts use `pose`, which waits; a window uses `request` or
    `prefetch`, and `ready`, which do not.

    The class has more than 30 methods because the cache, the worker and the reports share one lock.
    """

    def __init__(
        self, source: FrameSource, times: ArrayLike, unit: str = UNKNOWN_UNIT, cache_bytes: int | None = None
    ) -> None:
        """times: (T,) seconds. cache_bytes: what poses may take; None: `default_budget()`.

        Raises InputError where there is no frame, or the times do not fit or increase.
        """
        self.times = self.opened_with = _checked_times(times, source)
        self.is_measured = False
        self.unit = unit
        self.name = source.name
        self.messages: list[ScanMessage] = []
        self.finish: Callable[[Pose], object] = lambda pose: None
        self.source = source
        self.decided: Decided = getattr(source, "decided", None) or Decided()
        self._scan = ScanKey(self.decided)
        self._state = threading.Condition()  # guards all that follows
        self._cache = PoseCache(default_budget() if cache_bytes is None else cache_bytes)
        self._loading: dict[int, Future[Pose]] = {}
        self._broken: dict[int, InputError] = {}
        self._sizes: dict[int, int] = {}  # bytes of every pose read so far
        self._typical_size = 0
        self._requests: list[int] = []  # latest last
        self._playhead, self._direction = 0, 1
        self._ahead: Iterator[int] | None = None  # what is to be read ahead, while there is something
        self._wanted: int | None = None  # what was asked of the worker last,
        self._coarse: Pose | None = None  # of a frame that is being read
        self._in_use: Pose | None = None  # held here even where it exceeds the cache
        self._last_read: Callable[[], PointCloud | None] = lambda: None
        self._worker: threading.Thread | None = None
        self._reading: Task | None = None  # what the worker does
        self._reported = 0  # messages about decisions
        self._averaging = Averaging()
        self._averages = threading.Lock()  # held by whoever averages a pose
        self._closed = False

    def __len__(self) -> int:
        return len(self.times)

    def __iter__(self) -> Iterator[Pose]:
        """All poses in order. Broken frames are left out; `broken` and `messages` name them."""
        for index in range(len(self)):
            try:
                pose = self.pose(index)
            except InputError:
                continue
            yield pose

    def retime(self, times: ArrayLike) -> None:
        """Have the frames be at other times from now on, (T,) seconds, also those of poses in memory.

        Raises InputError where the times do not fit or increase.
        """
        checked = _checked_times(times, self.source)
        if np.array_equal(checked, self.times):
            return
        with self._state:
            self.times = checked
            self._cache.exchange(self._timed)
            if self._in_use is not None:
                self._in_use = self._cache.get(self._in_use.index) or self._timed(self._in_use)

    @property
    def averaging(self) -> Averaging:
        """How `drawn` and `ready` average frames."""
        return self._averaging

    def average(self, averaging: Averaging) -> None:
        """Average frames this way from now on. The worker makes averages of what it was asked for last."""
        with self._state:
            if averaging == self._averaging:
                return
            before, self._averaging = self._averaging, averaging

            def changed(pose: Pose) -> Pose:
                if pose.average is None or averaging.frames != before.frames:
                    return pose.raw
                return replace(pose, average=replace(pose.average, is_measured=averaging.is_measured))

            self._cache.exchange(changed)
            if self._in_use is not None:
                self._in_use = self._cache.get(self._in_use.index) or changed(self._in_use)
            if self._wanted is not None:
                self._requests.append(self._wanted)
                self._ahead = None if self._ahead is None else self._upcoming()
            self._state.notify_all()

    def _timed(self, pose: Pose) -> Pose:
        """The pose at the time that its frame has now."""
        time = float(self.times[pose.index])
        return pose if pose.time == time else pose.at(time)

    @property
    def reading(self) -> Reading:
        """The record of how Scan4D reads the scan, as far as it has read frames."""
        return self.decided.reading

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that hold its frames; none for the demo."""
        return self.source.files

    def gives_unit_to(self, other: Timeline) -> bool:
        """Whether a scan to compare with states no unit, so that Scan4D assumes this one's for it.

        Raises InputError where it states another unit.
        """
        if other.unit == UNKNOWN_UNIT != self.unit:
            return True
        if conversion(other.unit, self.unit) != 1.0:
            what = f"has the unit '{other.unit}', but the scan has '{self.unit}'"
            raise InputError(what, other.name, "Use a reference in the unit of the scan")
        return False

    def label(self, index: int) -> str:
        """The name of a frame, for example its file's."""
        return self.source.label(self._checked_index(index))

    def faces(self, index: int) -> Faces:
        """Read the faces between the points of a frame, perhaps none. Raises InputError."""
        return self.source.faces(self._checked_index(index))

    def nearest(self, time: float) -> int:
        """The index of the pose nearest to a time in seconds, the earlier one of two."""
        return int(np.abs(self.times - time).argmin())

    @property
    def broken(self) -> dict[int, InputError]:
        """The frames found unreadable or empty so far, and why."""
        with self._state:
            return dict(self._broken)

    @property
    def empty(self) -> frozenset[int]:
        """The frames found so far that hold no points, beside others that do."""
        with self._state:
            found = self._broken.items()
            return frozenset(
                index for index, error in found if isinstance(error, EmptyFrame) and len(self) > 1
            )

    @property
    def loading(self) -> Task | None:
        """The work on the pose that was asked for last, while the worker is at it.

        Where it is cancelled, the frame counts as broken.
        """
        with self._state:
            return self._reading if self._wanted in self._loading else None

    @property
    def _is_given_up(self) -> bool:
        return self._reading is not None and self._reading.cancelled and not self._closed

    def cached(self) -> list[range]:
        """The runs of poses that the cache holds, in order."""
        with self._state:
            indices = sorted(self._cache)
        runs: list[range] = []
        for index in indices:
            if runs and runs[-1].stop == index:
                runs[-1] = range(runs[-1].start, index + 1)
            else:
                runs.append(range(index, index + 1))
        return runs

    def pose(self, index: int) -> Pose:
        """One pose as scanned, read now unless it is in memory; threads that ask for it at once read it once.

        Raises InputError where there is no such pose, or its frame is broken; a broken frame is not read
        again.
        """
        return self._pose(self._checked_index(index))

    def _pose(self, index: int, ahead: bool = False) -> Pose:
        """The work of `pose`. ahead: whether it evicts none that is needed sooner."""
        with self._state:
            self._check_open()
            if index in self._broken:
                raise copy.copy(self._broken[index])
            if (held := self._held(index)) is not None:
                return held.raw
            begun = self._loading.get(index)
            future = begun or self._begin(index)
        if begun is None:
            self._load(index, future, ahead)
        return future.result()

    def drawn(self, index: int) -> Pose:
        """The pose that a picture shows: as `pose` gives it, averaged if the timeline averages. Where the
        frame of a sequence is empty, one without points. Raises InputError as `pose` does for other frames.
        """
        try:
            pose = self.pose(index)
            return self._average(pose) if self._averaging.is_on else pose
        except EmptyFrame:
            if len(self) == 1:
                raise
            return Pose(index, float(self.times[index]), self.label(index), _no_points())

    def visit(self, index: int) -> Pose:
        """One pose as `pose` gives it, for who goes through all frames: one that is read for this takes no
        place in memory, and nothing else is found of it. Raises InputError likewise."""
        index = self._checked_index(index)
        with self._state:
            self._check_open()
            if index in self._broken:
                raise copy.copy(self._broken[index])
            held, begun = self._held(index), self._loading.get(index)
        if held is not None or begun is not None:
            return held.raw if held is not None else begun.result()  # type: ignore[union-attr]
        try:
            return self._read(index)
        except InputError as error:
            with self._state:
                raise self._note_broken(index, error) from None

    def ready(self, index: int) -> Pose | None:
        """The pose that a picture shows if it is in memory, averaged if the timeline averages; while it is
        being read, a coarser one where its source gives one; else None at once."""
        with self._state:
            held = self._held(index)
            if held is None and self._coarse is not None and self._coarse.index == index:
                return self._coarse
            return held if held is not None and self._is_averaged(held) else None

    def request(self, index: int) -> None:
        """Ask the worker for a pose, before all that was asked of it earlier."""
        index = self._checked_index(index)
        with self._state:
            if index in self._requests:
                self._requests.remove(index)
            self._requests.append(index)
            self._want(index)

    def prefetch(self, index: int, direction: int = 1) -> None:
        """Ask the worker for the pose at the playhead, then for those that playing reaches next.

        It reads on, round the end, as far as the cache holds them, and evicts none that is reached earlier
        than the one it reads. Replaces all that was asked of it earlier. direction: 1 or -1.
        """
        index = self._checked_index(index)
        with self._state:
            self._requests.clear()
            self._playhead, self._direction = index, direction
            self._ahead = self._upcoming()
            self._cache.touch(sorted(self._cache, key=self._distance, reverse=True))
            self._want(index)

    def close(self) -> None:
        """Stop the worker and let go of all poses; nothing is read any more."""
        with self._state:
            self._closed = True
            if self._reading is not None:
                self._reading.cancel()
            self._cache.clear()
            self._in_use = None
            self._state.notify_all()
        if self._worker is not None:
            atexit.unregister(self.close)
            self._worker.join(_CLOSE_WAIT)

    def __enter__(self) -> Timeline:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _checked_index(self, index: int) -> int:
        index = operator.index(index)
        if not 0 <= index < len(self):
            raise InputError(
                f"there is no pose {index}", self.name, f"The scan has the poses 0 to {len(self) - 1}"
            )
        return index

    def _check_open(self) -> None:
        if self._closed:
            raise TimelineClosed("the timeline is closed")

    def _note_broken(self, index: int, error: InputError) -> InputError:
        """Note why a frame cannot be read, once; returns the error to raise. Runs locked."""
        if index not in self._broken:
            self._broken[index] = _at_rest(error, len(self._broken) < _TRACEBACKS)
            is_empty = isinstance(error, EmptyFrame) and len(self) > 1
            kind: Literal["empty", "broken"] = "empty" if is_empty else "broken"
            done = "shows an empty picture for" if is_empty else "leaves out"
            what = f"Scan4D {done} {frame_in_words(index)}: {error}"
            self.messages.append(ScanMessage(kind, what, index))
        return copy.copy(self._broken[index])

    def _held(self, index: int) -> Pose | None:
        if self._in_use is not None and self._in_use.index == index:
            return self._in_use
        return self._cache.get(index)

    def _want(self, index: int) -> None:
        """Note what is in use from now on, and have the worker look at what is to do."""
        if self._closed:
            return
        self._wanted, self._in_use = index, self._held(index)
        self._cache.trim()
        if self._worker is None:
            self._worker = threading.Thread(target=self._work, name="scan4d-poses", daemon=True)
            self._worker.start()
            atexit.register(self.close)  # a worker inside a native library must not outlive it
        self._state.notify_all()

    def _work(self) -> None:
        while True:
            with self._state:
                while (task := self._next_task()) is None and not self._closed:
                    self._state.wait()
                if task is None or self._closed:
                    return
                index, ahead = task
                held = self._held(index)
                future = self._begin(index) if held is None else None
                reading = self._reading = Task(f"Reading {self.source.label(index)}")
            with reading.current():
                if held is None and not self._averaging.is_on:
                    self._read_coarser(index)
                pose = held.raw if held is not None else self._load(index, future, ahead)
                if pose is not None and self._averaging.is_on:
                    self._average_ahead(pose, ahead)
            self._reading = None
            if self._coarse is not None and pose is not None and self._coarse.index == pose.index:
                self._coarse = None
            del future, held, pose  # they hold the pose

    def _read_coarser(self, index: int) -> None:
        """Hold coarser poses of a frame while it is being read, one after the other. An error is left to
        reading the frame, which comes upon it too."""
        clouds = getattr(self.source, "coarser", None)
        try:
            for cloud in () if clouds is None else clouds(index):
                pose = Pose.of(index, float(self.times[index]), self.source.label(index), cloud, self._scan)
                _find_what_pictures_need(pose)
                with self._state:
                    if self._closed:
                        return
                    if index == self._wanted:
                        self._coarse = pose
        except (InputError, Cancelled, OSError):
            return

    def _next_task(self) -> tuple[int, bool] | None:
        """The frame that the worker reads next, and whether ahead or as requested; None: nothing."""
        while self._requests:
            if self._is_missing(index := self._requests.pop()):
                return index, False
        if self._ahead is not None:
            for index in self._ahead:
                return index, True
            self._ahead = None
        return None

    def _upcoming(self) -> Iterator[int]:
        """The missing frames that playing reaches next, as many as the cache holds; runs locked."""
        nearer_bytes = 0
        for step in range(len(self)):
            index = (self._playhead + self._direction * step) % len(self)
            if self._is_missing(index):
                if nearer_bytes + self._size_of(index) > self._cache.budget and index != self._wanted:
                    return
                yield index
            if index in self._cache or index in self._loading:
                nearer_bytes += self._size_of(index)

    def _size_of(self, index: int) -> int:
        """Bytes of a pose as it is, else as it was read before, else of another one."""
        held = self._cache.size_of(index)
        return self._sizes.get(index, self._typical_size) if held is None else held

    def _is_missing(self, index: int) -> bool:
        if index in self._loading or index in self._broken:
            return False
        is_in_use = self._in_use is not None and self._in_use.index == index
        held = self._in_use if is_in_use else self._cache.peek(index)
        return held is None or not self._is_averaged(held)

    def _is_averaged(self, pose: Pose) -> bool:
        """Whether a pose is averaged as the timeline averages."""
        average, wanted = pose.average, self._averaging
        if average is None:
            return not wanted.is_on
        return (average.frames, average.is_measured) == (wanted.frames, wanted.is_measured)

    def _distance(self, index: int) -> int:
        """How many steps playing takes from the playhead to a pose, or to the first that averages it."""
        before = max(self._averaging.frames - 1, 0)
        if 0 <= self._playhead - index <= before:
            return 0
        first = index if self._direction > 0 else min(index + before, len(self) - 1)
        return (first - self._playhead) * self._direction % len(self)

    def _begin(self, index: int) -> Future[Pose]:
        """Have others wait for this future from here on, until `_load` is done."""
        future = self._loading[index] = Future()
        return future

    def _load(self, index: int, future: Future[Pose] | None, ahead: bool = False) -> Pose | None:
        """Read a pose outside the lock and note what came of it; the future gets the pose or the error.
        Returns the pose, None where there was an error."""
        assert future is not None
        try:
            pose = self._shared(self._read(index))
            _find_what_pictures_need(pose)
            self.finish(pose)
        except BaseException as error:
            with self._state:
                del self._loading[index]
                if isinstance(error, Cancelled) and self._is_given_up:
                    error = InputError("reading was cancelled", self.source.label(index), "Open it again")
                if isinstance(error, InputError):
                    error = self._note_broken(index, error)
            future.set_exception(error)
            return None
        with self._state:
            del self._loading[index]
            pose = self._timed(pose)  # where times have changed meanwhile
            if pose.dropped and index not in self._sizes:
                what = f"{pose.label}: Scan4D leaves out {pose.cloud.dropped_in_words}"
                self.messages.append(ScanMessage("dropped", what, index))
            if (shortened := pose.overview.shortened) and index not in self._sizes:
                what = f"{pose.label}: Scan4D shrinks {shortened} splats that are far larger than the scan"
                self.messages.append(ScanMessage("shortened", what, index))
            self._sizes[index] = self._typical_size = pose.nbytes
            if not self._closed:
                distance = self._distance(index) if ahead else 0
                self._cache.put(pose, is_needed=lambda other: self._distance(other) < distance)
                if index == self._wanted:
                    self._in_use = pose
        future.set_result(pose)
        return pose

    def _average_ahead(self, pose: Pose, ahead: bool) -> None:
        """Average a pose on the worker's thread. A frame that cannot be averaged counts as broken."""
        try:
            self._average(pose, partial(self._pose, ahead=True), ahead)
        except (Cancelled, TimelineClosed):
            return
        except Exception as error:  # whatever a scan brings, playing goes on
            what = f"cannot be averaged ({type(error).__name__}: {error})"
            with self._state:
                self._note_broken(pose.index, InputError(what, pose.label))

    def _average(self, pose: Pose, read: Callable[[int], Pose] | None = None, ahead: bool = False) -> Pose:
        """Average a pose as scanned over the frames before it, and hold it. read: reads these."""
        with self._averages:
            with self._state:
                averaging, held = self._averaging, self._held(pose.index)
            if held is not None and held.average is not None and self._is_averaged(held):
                return held
            earlier = self._earlier(pose.index, averaging.frames, read or self.pose)
            made = averaged(pose, earlier, averaging)
            _find_what_pictures_need(made)
            self.finish(made)
            with self._state:
                made = self._timed(made)
                if averaging == self._averaging and not self._closed:
                    self._sizes[made.index] = self._typical_size = made.nbytes
                    distance = self._distance(made.index) if ahead else 0
                    self._cache.put(made, is_needed=lambda other: self._distance(other) < distance)
                    if made.index == self._wanted:
                        self._in_use = made
            return made

    def _earlier(self, index: int, frames: int, read: Callable[[int], Pose]) -> Iterator[Pose]:
        """The poses before one that an average may take in, the latest first, without broken ones."""
        for number in range(index - 1, max(index - frames, -1), -1):
            try:
                pose = read(number)
            except InputError:
                continue
            yield pose

    def _shared(self, pose: Pose) -> Pose:
        """The pose with the arrays of the one read before where they are the same."""
        if not isinstance(pose.points, PointCloud):
            return pose
        before = self._last_read()
        shared = pose if before is None else pose.with_cloud(pose.points.sharing(before))
        self._last_read = weakref.ref(shared.cloud)
        return shared

    def _read(self, index: int) -> Pose:
        label = self.source.label(index)
        try:
            with np.errstate(all="ignore"):  # odd numbers in a file are data
                scanned = self.source.load(index)
                self._report_decisions()
                if not isinstance(scanned, PointCloud):
                    scanned = self._in_unit(index, scanned)
                    for assumed in {view.assumed for view in scanned if view.assumed}:
                        self._tell_once("assumed", f"{label}: {shortened(assumed)}", index)
                return Pose.of(index, float(self.times[index]), label, scanned, self._scan)
        except InputError as error:
            if error.where is None:
                error.where = label
            raise
        except Exception as error:  # whatever a damaged file does to a reader, playing goes on
            raise InputError(f"cannot be read ({type(error).__name__}: {error})", label) from error

    def _report_decisions(self) -> None:
        """Pass on the messages about decisions, and name the corrections that none has used."""
        for key in self.decided.ignored():
            what = (
                f"The correction {key}={self.decided.corrections.texts[key]} does not apply to this scan, "
                "so Scan4D ignores it"
            )
            self.decided.report("correction", what)
        stated = self.reading["unit"]
        with self._state:
            if self.unit == UNKNOWN_UNIT and stated.source == "file" and stated.value is not None:
                self.unit = stated.value  # by what the frame states, which opening did not read
            reports = self.decided.reports(self._reported)
            self._reported += len(reports)
            self.messages += [ScanMessage(one.kind, one.text, one.frame) for one in reports]

    def _in_unit(self, index: int, views: tuple[RangeView, ...]) -> tuple[RangeView, ...]:
        """The views in the unit of the scan; a message says once that they have another one."""
        unit = usable_unit(self.source.unit) or UNKNOWN_UNIT
        converted = in_one_unit(views, unit)
        others = [before.unit for before in views if before.unit != unit]
        if others:
            done = (
                "Scan4D converts the lengths"
                if all(view.unit == unit for view in converted)
                else "Scan4D does not convert the lengths"
            )
            what = f"{self.source.label(index)} is in {others[0]}, but the scan is in {unit}: {done}"
            self._tell_once("unit", what, index)
        return converted

    def _tell_once(self, kind: Literal["unit", "assumed"], text: str, index: int) -> None:
        with self._state:
            if not any(notice.kind == kind for notice in self.messages):
                self.messages.append(ScanMessage(kind, text, index))


@cache
def _no_points() -> PointCloud:
    return PointCloud.from_arrays(np.zeros((0, 3), np.float32))


def _checked_times(times: ArrayLike, source: FrameSource) -> NDArray[np.float64]:
    checked = np.array(times, np.float64)
    if not len(source):
        raise InputError("holds no frames", source.name)
    if checked.shape != (len(source),):
        raise InputError(f"times have shape {checked.shape} for {len(source)} frames", source.name)
    if not (np.isfinite(checked).all() and (np.diff(checked) > 0).all()):
        raise InputError("the times of the frames do not increase", source.name, "Give a frame rate instead")
    checked.setflags(write=False)
    return checked


def _at_rest(error: InputError, has_traceback: bool) -> InputError:
    """The error as it is stored: without its stack frames, which hold what readers held. has_traceback:
    whether a note has its traceback.

    To be raised as a copy, so that it does not gather the frames of those who ask.
    """
    stored = copy.copy(error)
    if has_traceback:
        stored.add_note("".join(traceback.format_exception(error)))
    return stored


def _find_what_pictures_need(pose: Pose) -> None:
    """Let the points remember their bounds and largest splat: here, on the thread that reads."""
    pose.drawn_bounds()
    if isinstance(pose.points, PointCloud):
        pose.points.longest_reach()
