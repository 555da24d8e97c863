"""Several moments of points in one file, told by a column of frames, or of times and ids."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..admission import MOST_FRAMES, check_count
from ..points import PointCloud
from ..reading.arrays import CLOUD, KEY
from ..reading.columns import MomentColumns, Moments, moment_columns, moments_of
from ..reading.record import Decision
from ..reading.sequence import Decided
from ..times import DEFAULT_FPS


@dataclass(frozen=True)
class MomentsOfCloud:
    """A cloud that holds the points of several moments."""

    cloud: PointCloud
    moments: Moments

    def __len__(self) -> int:
        return len(self.moments.numbers)

    @property
    def times(self) -> NDArray[np.float64]:
        """Seconds of the moments, (T,), from their column or the numbers of the frames."""
        stated, numbers = self.moments.times, self.moments.numbers
        return (numbers - numbers[0]) / DEFAULT_FPS if stated is None else stated

    def at(self, frame: int) -> PointCloud:
        """The points of one moment. The first one states how many points the file lacks."""
        start, end = self.moments.starts[frame : frame + 2]
        part = replace(self.cloud.of_rows(self.moments.order[start:end]), topology=None)
        if self.moments.ids is not None:
            part = replace(part, ids=self.moments.ids[start:end])
        return part if frame == 0 else replace(part, dropped_by={})


def may_hold_moments(names: Sequence[str], decided: Decided) -> bool:
    """Whether columns of these names can tell moments. A time alone does not: scanners store one a point."""
    return decided.corrections.get(KEY) != CLOUD and _can_tell(moment_columns(names))


def _can_tell(found: MomentColumns) -> bool:
    return found.frame is not None or (found.time is not None and found.id is not None)


def moments_of_cloud(cloud: PointCloud, decided: Decided) -> MomentsOfCloud | None:
    """The moments of a cloud by its scalars; None where it is one moment. Raises InputError."""
    names = [*cloud.scalars]
    found = moment_columns(names)
    if not _can_tell(found):
        return None
    frame, time, id = (
        None if at is None else cloud.scalars[names[at]].astype(np.float64) for at in found[:3]
    )
    moments = moments_of(frame, time, id, found.seconds)
    if moments is None:
        return None
    check_count(len(moments.numbers), MOST_FRAMES, "frames")
    used = [names[at] for at in found[:3] if at is not None]
    decided.note(Decision(KEY, f"by column {used[0]}", why=moments.why))
    others = {name: values for name, values in cloud.scalars.items() if name not in used}
    return MomentsOfCloud(replace(cloud, scalars=others), moments)
