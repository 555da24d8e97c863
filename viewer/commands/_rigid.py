"""The motion of a rigid region, such as the head, in each frame, as commands find and report it."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..analysis.motion.axes import anatomical_axes
from ..analysis.motion.facts import MotionFacts
from ..analysis.motion.found import NoRigidRegion
from ..analysis.motion.partial import PartialMotions
from ..analysis.motion.region import RigidRegion
from ..analysis.motion.stabilise import FrameMotion, MotionReference, MotionState, WeakLimits, stabilise
from ..csv_text import cell
from ..document.landmarks import Landmarks
from ..document.saved_session import known_as, stored
from ..errors import InputError
from ..files import output_folder
from ..scan.spacing import typical_spacing
from ..scan.timeline import Timeline
from ..scan.times import frame_in_words
from ..scan.units import conversion
from ._console import progress, tell, warn
from ._reference import StartOfMotion, key_of_partial

_COLUMNS = (
    "frame", "time", "qw", "qx", "qy", "qz", "tx", "ty", "tz",
    "sigma_rx", "sigma_ry", "sigma_rz", "sigma_tx", "sigma_ty", "sigma_tz", "state",
)  # fmt: skip
_WORLD = np.eye(3)


@dataclass(frozen=True, eq=False)
class RigidPart:
    """The motions of a region.

    region: None where Scan4D finds none. rows: of the region in the reference pose. axes: of the subject,
    (3, 3) by row. known: by frame; without a region, all are gaps.
    """

    timeline: Timeline
    reference: StartOfMotion
    region: MotionReference | None
    rows: NDArray[np.int64]
    limits: WeakLimits
    axes: NDArray[np.float64]
    known: Mapping[int, FrameMotion]

    @cached_property
    def states(self) -> dict[int, MotionState]:
        """The states of the motions, by frame."""
        return {index: self.known[index].state(self.axes, self.limits) for index in sorted(self.known)}

    @cached_property
    def found(self) -> MotionFacts:
        """The facts about the motions."""
        return MotionFacts.of(self.known, self.reference.frame, self.axes, self.limits)

    def table(self) -> list[Sequence[object]]:
        """The rows of transforms.csv."""
        return [_COLUMNS, *map(self._row, self.states)]

    def points(self) -> RigidRegion:
        """The region as a file holds it."""
        ids = self.reference.pose.cloud.ids
        return RigidRegion(np.empty((0, 4)), self.rows if ids is None else ids[self.rows].astype(np.int64))

    def facts(self, source: object) -> dict[str, Any]:
        """The facts for the report. source: of the region."""
        pose = self.reference.pose
        region = None
        if self.region is not None:
            region = {
                "source": str(source),
                "points": len(self.rows),
                "share_of_points": len(self.rows) / pose.count,
                "middle": self.region.middle.tolist(),
            }
        found = self.found
        return {
            "region": region,
            "within": {
                "mean": found.fit and found.fit.mean,
                "least": found.fit and found.fit.least,
                "least_in_frame": found.fit and found.fit.frame + 1,
            },
            "states": {state.value: list(self.states.values()).count(state) for state in MotionState},
            "limits": {"degrees": self.limits.degrees, "length": self.limits.shift},
            "gaps": {str(frame + 1): reason for frame, reason in found.gaps.items()},
            "weak_directions": [
                {**asdict(one), "words": one.in_words(self.timeline.unit)} for one in found.weak
            ],
        }

    def _row(self, index: int) -> Sequence[object]:
        """The row of a frame."""
        from scipy.spatial.transform import Rotation

        found = self.known[index]
        if found.motion is None:
            numbers: list[float | None] = [None] * 13
        else:
            x, y, z, w = Rotation.from_matrix(found.motion.rotation).as_quat(canonical=True)
            shift, sigmas = found.motion.matrix[:3, 3], found.deviations(_WORLD)
            numbers = [cell(value) for value in (w, x, y, z, *shift, *sigmas)]
        return [index + 1, float(self.timeline.times[index]), *numbers, self.states[index].value]


def rigid_part(
    args: Namespace, timeline: Timeline, reference: StartOfMotion, partial: Path, needed: bool = True
) -> RigidPart:
    """Find the motions of the region, and keep them in a file as they are found.

    Raises InputError. needed: also where Scan4D finds no region; else each frame is a gap there.
    """
    pose = reference.pose
    limits = WeakLimits.of(timeline.unit, typical_spacing(pose.cloud))
    if conversion("mm", timeline.unit) is None:
        close = f"one point spacing, {limits.shift:.3g}, in place of 0.5 mm"
        warn(f"The unit of the scan is no known length. Scan4D uses {close}. State it with --unit")
    axes = anatomical_axes(args.up) if args.up else anatomical_axes(pose.upright.up, pose.upright.front)
    given = region_rows(args, args.region, reference) if args.region else None
    positions = pose.cloud.world()
    key = key_of_partial(args, timeline, reference, positions if given is None else positions[given])
    kept = PartialMotions(partial, key | {"is_found": given is None})
    known = kept.read()
    try:
        rows = _found_rows(args, timeline, reference, kept, known) if given is None else given
    except NoRigidRegion as error:
        if needed or reference.rest:
            raise
        warn(f"{error}. Each frame in transforms.csv is a gap")
        known = dict.fromkeys(range(len(timeline)), FrameMotion.gap(error.what))
        return RigidPart(timeline, reference, None, np.empty(0, np.int64), limits, axes, known)
    region = MotionReference.of(pose, rows, reference.frame)
    output_folder(args.out)
    if reference.rest:
        reference = reference.averaged(timeline, region)
        region = MotionReference.of(reference.pose, rows, None)
    if known:
        tell(f"Scan4D continues: the motions of {len(known)} of {len(timeline)} frames are known")
    with progress(len(timeline) - len(known)) as tick:
        for _ in stabilise(timeline, region, limits.shift, known):
            kept.save(known)
            tick()
    return RigidPart(timeline, reference, region, rows, limits, axes, known)


def tell_rigid(rigid: RigidPart) -> None:
    """The facts of the motions in words."""
    if rigid.region is None:
        return
    frames, unit, found = len(rigid.timeline), rigid.timeline.unit, rigid.found
    share = len(rigid.rows) / rigid.reference.pose.count
    tell(f"The region has {len(rigid.rows):,} points, {share:.0%} of the reference frame")
    close = f"within ±{rigid.limits.shift:.3g} {unit} of the surface"
    if found.fit is not None:
        tell(f"On average, {found.fit.mean:.1%} of the region lies {close} of a frame")
    for one in found.weak:
        warn(f"{one.in_words(unit)} (in {one.frames} of {frames} frames)")
    if found.gaps:
        frame, reason = next(iter(found.gaps.items()))
        gaps = f"{len(found.gaps)} of {frames} frames"
        warn(f"Scan4D finds no motion in {gaps}, such as {frame_in_words(frame)}: {reason}")
    if found.fit is not None and not found.fit.is_rigid:
        lies = f"in {frame_in_words(found.fit.frame)}, only {found.fit.least:.1%} of it lies"
        warn(f"The region does not stay rigid: {lies} {close}. Name another region with --region")


def region_rows(args: Namespace, file: Path, reference: StartOfMotion) -> NDArray[np.int64]:
    """The rows of the reference in the region of a file. Raises InputError, which names that file."""
    region = RigidRegion.read(file)
    try:
        places = _places(args, reference) if region.landmarks else {}
        rows = region.rows(reference.pose.cloud, places)
    except InputError as error:
        raise InputError(error.what, file, error.hint) from None
    if not len(rows):
        low, high = reference.pose.bounds.low, reference.pose.bounds.high
        where = " to ".join("(" + ", ".join(f"{value:.4g}" for value in end) + ")" for end in (low, high))
        raise InputError("has no points of the reference", file, f"The reference extends from {where}")
    if region.landmarks and region.radius is None:
        tell(f"{file}: points count up to {region.radius_in(reference.pose.cloud):.3g} from a landmark")
    return rows


def _found_rows(
    args: Namespace,
    timeline: Timeline,
    reference: StartOfMotion,
    kept: PartialMotions,
    known: Mapping[int, FrameMotion],
) -> NDArray[np.int64]:
    """The rows of the region that Scan4D finds, which are kept. Raises InputError."""
    output_folder(args.out)  # an error comes before the search
    if not kept.has_region:
        tell("Scan4D looks for a region that stays rigid in all frames")
    rows = kept.found_rows(timeline, reference.pose, reference.frame)
    kept.save(known)
    return rows


def _places(args: Namespace, reference: StartOfMotion) -> dict[str, NDArray[np.float64]]:
    """The positions of landmarks in the reference frame, by name. Raises InputError."""
    if reference.frame is None:
        raise InputError("names landmarks, but the reference is another scan")
    session = stored(known_as(args.scan))
    if session is None:
        hint = "Open the scan in the window and place landmarks"
        raise InputError("names landmarks, but the scan has no saved session", hint=hint)
    placed = {one.name: one.key_at(reference.frame) for one in session.document.part(Landmarks).all}
    return {name: np.array(key.position) for name, key in placed.items() if key is not None}
