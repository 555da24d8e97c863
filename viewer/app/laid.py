"""What tools lay over the poses of the open scan, beside its document: it is computed, and not kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from ..rigid import STILL, Rigid
from ..scan.layers import NO_LAYERS, Layers
from ..scan.pose import Pose

Numbers = Mapping[str, NDArray[np.generic]]
NumbersOf = Callable[[Pose], Numbers]
MotionOf = Callable[[int], Rigid]


class Laid:
    """Layers over the open scan, of all tools together.

    Of numbers that have one name those count that were laid last. A pose is moved by one tool's motion after
    the other's, in the order in which they were laid.

    names: of the numbers that were found over the poses shown since something was laid last. version: another
    one after each time that something was laid or taken away.
    """

    def __init__(self) -> None:
        self.names: set[str] = set()
        self.version = 0
        self._by_tool: dict[str, tuple[NumbersOf, MotionOf]] = {}
        self._replayed: tuple[int, Rigid] | None = None
        self._found: tuple[Pose, Layers] | None = None

    def lay(self, tool: str, numbers: NumbersOf, world_from_pose: MotionOf) -> None:
        """Lay a tool's numbers and places over the poses, instead of what it laid before.

        numbers: of a pose. world_from_pose: of a pose, by its index.
        """
        self.take_away(tool)
        self._by_tool[tool] = numbers, world_from_pose

    def take_away(self, tool: str) -> None:
        """Take away what a tool laid."""
        self._by_tool.pop(tool, None)
        self._forget()

    def replay(self, index: int, world_from_pose: Rigid) -> None:
        """Have a pose stand where a recording has it, and its scan's own numbers stand for layers of the same
        name; until another pose is replayed, or a tool lays something.
        """
        self._replayed, self._found = (index, world_from_pose), None

    def clear(self) -> None:
        """Take away all, since another scan is opened."""
        self._by_tool.clear()
        self._forget()

    def layers(self, pose: Pose) -> Layers:
        """The layers over a pose, the same object for as long as nothing else is laid."""
        if self._found is None or self._found[0] is not pose:
            self._found = pose, self._merged(pose)
        return self._found[1]

    def world_from_pose(self, index: int) -> Rigid:
        """The motion of a pose, by its index, which need not have been read."""
        if self._replayed is not None and self._replayed[0] == index:
            return self._replayed[1]
        world_from_pose = STILL
        for _, motion_of in list(self._by_tool.values()):  # a tool that fails is taken away
            world_from_pose = motion_of(index).after(world_from_pose)
        return world_from_pose

    def ask_anew(self) -> None:
        """Have tools asked for their numbers again, since the document shows another one."""
        self._forget()

    def _forget(self) -> None:
        """Forget what was replayed and found."""
        self._replayed = self._found = None
        self.names = set()
        self.version += 1

    def _merged(self, pose: Pose) -> Layers:
        scalars: dict[str, NDArray[np.generic]] = {}
        for numbers_of, _ in list(self._by_tool.values()):
            scalars |= numbers_of(pose)
        self.names |= scalars.keys()
        if self._replayed is not None and self._replayed[0] == pose.index:
            scalars = {name: values for name, values in scalars.items() if name not in pose.overview.scalars}
        world_from_pose = self.world_from_pose(pose.index)
        return Layers(scalars, world_from_pose) if scalars or not world_from_pose.is_identity else NO_LAYERS
