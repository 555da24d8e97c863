"""Poses on the GPU within a budget of memory, with the data that was estimated and derived from them."""

from __future__ import annotations

import math
import weakref
from collections import OrderedDict
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field, replace

from ..backends import Derived
from ..gpu.context import Gpu
from ..gpu.pose import GpuPose
from ..scan.pose import Life, Pose
from .jobs import DerivedKey, Jobs

_VIEWS = 4  # results of a pose that depend on the view, for each backend and parameters
_CONFIGURATIONS = 4  # results of a pose for different backends and parameters


@dataclass(eq=False)
class Resident:
    """A pose on the GPU. life: of the pose as it was given; that of the GpuPose is the same but does not keep
    it alive. derived: what was derived, the last used last. foreseen: backends and parameters for which the
    facts about the points are known."""

    life: weakref.ref[Life]
    gpu_pose: GpuPose
    derived: OrderedDict[DerivedKey, Derived] = field(default_factory=OrderedDict)
    jobs: Jobs = field(default_factory=Jobs)
    foreseen: set[object] = field(default_factory=set)

    def store(self, key: DerivedKey, derived: Derived) -> None:
        """Store derived data. The results for the views and the parameters used longest ago go."""
        self.derived[key] = derived
        of_views = [other for other in self.derived if other.what == key.what and other.view is not None]
        recent = list(dict.fromkeys(other.what for other in reversed(self.derived)))[:_CONFIGURATIONS]
        others = [other for other in self.derived if other.what not in recent]
        for old in of_views[:-_VIEWS] + others:
            self.derived.pop(old).release()

    def find(self, key: DerivedKey, used: bool) -> Derived:
        """The derived data of this key. used: whether it counts as used now."""
        if used:
            self.derived.move_to_end(key)
        return self.derived[key]

    @property
    def nbytes(self) -> int:
        """Bytes on the GPU; of what it shares with other poses, its part."""
        return self.gpu_pose.counted_bytes + sum(derived.nbytes for derived in self.derived.values())

    @property
    def held_bytes(self) -> int:
        """Bytes on the GPU, and of the estimates that it keeps on the CPU."""
        return self.nbytes + self.gpu_pose.estimated_bytes

    def with_estimates(self, names: Collection[str]) -> Pose:
        """The pose with the estimates of its points, which this merges. names: where radii are not
        among them, those that another backend asked for stay out."""
        found = self.gpu_pose.cloud
        if "radii" not in names and found.radii is not self.gpu_pose.stored.radii:
            found = replace(found, radii=None)
        return self.gpu_pose.pose.with_cloud(found)

    def release(self) -> None:
        """End its jobs, and delete what was derived."""
        for key in list(self.jobs):
            self.jobs.cancel(key)
        for derived in self.derived.values():
            derived.release()


class Residents:
    """The poses on the GPU.

    The pose that is drawn always stays. A pose that nobody else holds goes with the next frame, so a
    timeline's cache bounds what is kept here, too.

    budget_bytes: most bytes of all poses. steps_to: how many poses are drawn before one, as far as known. The
    pose that is drawn last goes first, and among equals the one that was drawn longest ago.
    """

    def __init__(self, gpu: Gpu, budget_bytes: int) -> None:
        self.gpu, self.budget_bytes = gpu, budget_bytes
        self.steps_to: Callable[[Pose], int] = lambda pose: 0
        self._by_life: OrderedDict[int, Resident] = OrderedDict()
        self._drawn = 0  # key of the pose that was asked for last

    def __iter__(self) -> Iterator[Resident]:
        return iter(list(self._by_life.values()))

    @property
    def nbytes(self) -> int:
        """Bytes that poses hold on the GPU."""
        return sum(resident.nbytes for resident in self)

    @property
    def held_bytes(self) -> int:
        """Bytes that poses hold on the GPU, and of the estimates on the CPU."""
        return sum(resident.held_bytes for resident in self)

    def bytes_of(self, pose: Pose) -> int:
        """Bytes that one pose holds on the GPU, with its derived data and its part of what it shares with
        others; 0 for a pose that is not there."""
        found = self._by_life.get(id(pose.life))
        return 0 if found is None else found.nbytes

    def find(self, pose: Pose) -> Resident:
        """The entry of a pose; a new, empty one, which is not held, for a pose that is not there."""
        found = self._by_life.get(id(pose.life))
        if found is None or found.life() is not pose.life:
            found = Resident(weakref.ref(pose.life), GpuPose(self.gpu, replace(pose)))
        return found

    def hold(self, pose: Pose, resident: Resident) -> None:
        """Hold a pose from now on, and let go of those that nobody else holds."""
        for gone in [key for key, other in self._by_life.items() if other.life() is None]:
            passed = self._by_life.pop(gone)
            resident.gpu_pose.adopt(passed.gpu_pose)
            passed.release()
        self._by_life[id(pose.life)] = resident

    def draw(self, pose: Pose) -> Resident:
        """Hold a pose that is drawn now. Others go if memory is short."""
        self.gpu.collect()
        found = self.find(pose)
        self.hold(pose, found)
        self._drawn = id(pose.life)
        self._by_life.move_to_end(self._drawn)
        self.make_room()
        return found

    def resident(self, pose: Pose) -> GpuPose:
        """The pose on the GPU, which is drawn now. An array is uploaded when something first reads it."""
        return self.draw(pose).gpu_pose

    def make_room(self) -> None:
        """Let go of what is drawn last until the rest is within the budget."""
        while len(self._by_life) > 1 and self.held_bytes > self.budget_bytes:
            others = [key for key in self._by_life if key != self._drawn]
            farthest = max(others, key=lambda key: self._steps_to(self._by_life[key]))
            self._by_life.pop(farthest).release()

    def has_room(self, pose: Pose) -> bool:
        """Whether the budget holds another pose beside those that are drawn sooner than this one."""
        steps = self.steps_to(pose)
        sooner = [r.held_bytes for r in self if r.life() is not pose.life and self._steps_to(r) <= steps]
        largest = max((resident.held_bytes for resident in self), default=0)
        return sum(sooner) + largest <= self.budget_bytes

    def _steps_to(self, resident: Resident) -> float:
        return math.inf if resident.life() is None else self.steps_to(resident.gpu_pose.pose)

    def release(self) -> None:
        """Let go of every pose."""
        while self._by_life:
            self._by_life.popitem()[1].release()
