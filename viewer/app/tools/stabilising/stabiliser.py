"""Has the motions of the open scan found beside the window, and keeps them for the next time."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .... import __version__
from ....analysis.motion.partial import PartialMotions
from ....analysis.motion.stabilise import FrameMotion, MotionReference, WeakLimits, stabilise
from ....document.recording import fingerprint
from ....errors import InputError
from ....folders import cache_folder, forget_oldest
from ....geometry import Vector
from ....scan.pose import Pose
from ....scan.spacing import typical_spacing
from ....scan.timeline import Timeline
from ....task import announce, over
from ...tool_context import ToolContext
from .._resumed import Resumed
from .choices import Stabilising

_MOST_KEPT = 64 * 2**20  # bytes, of all motions that are kept
_SAVING = 2.0  # seconds between two times that motions are kept


@dataclass(frozen=True)
class Asked:
    """Motions to find. choices: that motions depend on. places: landmarks of the
    region in the reference frame, scan units."""

    timeline: Timeline
    unit: str
    choices: Stabilising
    places: tuple[tuple[str, Vector], ...]

    @classmethod
    def of(cls, timeline: Timeline, unit: str, choices: Stabilising, places: Mapping[str, Vector]) -> Asked:
        """The motions to find for the choices of an open scan."""
        return cls(timeline, unit, choices.of_motions, tuple(sorted(places.items())))

    @property
    def key(self) -> dict[str, Any]:
        """Whatever the motions depend on, plain JSON: no path, and a name only where there are no files."""
        hash = fingerprint(self.timeline.files)
        return {
            "version": __version__,
            "scan": self.timeline.name if hash is None else hash,
            "times": len(self.timeline),
            "unit": self.unit,
            "places": self.places,
            **asdict(self.choices),
        }


@dataclass(eq=False)
class Motions:
    """Motions as far as a thread of its own has found them. reference: None before the region is known. rows:
    of the region, in the reference's pose. known: by frame. problem: why there are none."""

    asked: Asked
    reference: MotionReference | None = None
    pose: Pose | None = None
    rows: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    limits: WeakLimits = field(default_factory=lambda: WeakLimits(0.0))
    known: dict[int, FrameMotion] = field(default_factory=dict)
    problem: str = ""

    @property
    def is_whole(self) -> bool:
        """Whether all frames are known."""
        return len(self.known) == len(self.asked.timeline)

    def find(self) -> None:
        """Find what is not known yet. Raises Cancelled, and InputError."""
        try:
            self._find()
        except InputError as error:
            self.problem = str(error)
            raise

    def _find(self) -> None:
        timeline, frame = self.asked.timeline, self.asked.choices.reference
        key = self.asked.key
        digest = hashlib.blake2b(json.dumps(key, sort_keys=True).encode(), digest_size=16).hexdigest()
        folder = motions_folder()
        kept = PartialMotions(folder / f"{digest}.json", key)
        if self.reference is None:
            timeline.label(frame)  # raises where there is none
            pose = timeline.pose(frame)
            with suppress(InputError):  # damaged: all is found again
                self.known |= kept.read()
            rows = self._rows(pose, kept)
            reference = MotionReference.of(pose, rows, frame)
            self.rows, self.pose = rows, pose
            self.limits = WeakLimits.of(self.asked.unit, reference.surface.spacing)
            self.reference = reference
        saved = time.monotonic()
        try:
            for _ in stabilise(timeline, self.reference, self.limits.shift, self.known):
                if time.monotonic() - saved > _SAVING:
                    kept.save(self.known)
                    saved = time.monotonic()
        finally:
            with suppress(InputError):  # where it cannot be kept, it is found again next time
                kept.save(self.known)
            forget_oldest(folder, _MOST_KEPT)

    def _rows(self, pose: Pose, kept: PartialMotions) -> NDArray[np.int64]:
        """The rows of the region; those that Scan4D finds are kept."""
        region = self.asked.choices.rigid
        if region is not None:
            return region.rows(pose.cloud, {name: np.array(place) for name, place in self.asked.places})
        announce("Finding the rigid region")
        try:
            rows = kept.found_rows(self.asked.timeline, pose, self.asked.choices.reference)
        except InputError as error:
            raise InputError(error.what, error.where, "Choose the region in the section Stabilise") from None
        finally:
            over()
        with suppress(InputError):  # where it cannot be kept, it is found again next time
            kept.save(self.known)
        return rows


class Stabiliser(Resumed[Motions]):
    """Has the motions of the open scan found.

    known: the motions of frames as far as the window has taken them in; another object after each change.
    """

    def __init__(self, context: ToolContext) -> None:
        super().__init__(context, "Stabilising")
        self.known: Mapping[int, FrameMotion] = {}

    @property
    def motions(self) -> Motions | None:
        """The motions that are being found, or were; None before the first."""
        return self.work

    @property
    def close(self) -> float | None:
        """The distance up to which a region is said to fit, scan units; None where there are no points."""
        if self.motions is not None and self.motions.reference is not None:
            return self.motions.limits.shift
        pose = self._context.pose
        if pose is None or not len(pose.cloud):
            return None
        return WeakLimits.of(self._context.unit, typical_spacing(pose.cloud)).shift

    def advance(self, asked: Asked, is_wanted: bool) -> bool:
        """Have found what is asked for, and take in what was; whether there is something new. is_wanted: see
        `take`."""
        has_changed = self.take(lambda work: work.asked == asked, lambda: Motions(asked), is_wanted)
        motions = self.motions
        known = {} if motions is None or motions.reference is None else dict(motions.known)
        if len(known) != len(self.known) or has_changed:
            self.known, has_changed = known, True
        return has_changed


def motions_folder() -> Path:
    """The folder of kept motions; it need not be there yet."""
    return cache_folder() / "motions"
