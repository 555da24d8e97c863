"""Numbers of frames in memory: found once for what they depend on, and unknown as soon as that changes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

from rigid_hills import RigidHills, opened

from viewer.app.tool_context import ToolContext
from viewer.app.tools._frame_numbers import FrameNumbers
from viewer.scan.pose import Pose
from viewer.task import Task


class AtOnce:
    """What of a window finds numbers, on the thread of the test."""

    works: tuple[object, ...] = ()

    def __init__(self) -> None:
        self.timeline = opened(RigidHills(3))
        self.index = 1

    def run(self, name: str, work: Callable[[], Any], then: Callable[[Any], object]) -> Task:
        then(work())
        return Task(name)


def test_numbers_are_found_from_the_shown_frame_on_and_not_kept_for_another_key() -> None:
    context = AtOnce()
    poses = [context.timeline.pose(frame) for frame in range(3)]
    found: list[int] = []

    def find(pose: Pose) -> str:
        found.append(pose.index)
        return f"number {len(found)}"

    numbers = FrameNumbers[str](cast(ToolContext, context), "Finding", lambda pose: "unknown")
    keys = {0: "a", 1: "a"}
    assert numbers.of(poses[1]) == "unknown"
    for _ in range(4):
        numbers.advance(keys, find)
    assert found == [1, 0], "the frame that is shown comes first; one without a key is left"
    assert [numbers.of(pose) for pose in poses] == ["number 2", "number 1", "unknown"]
    context.index = 0
    numbers.advance({0: "b", 1: "a"}, find)
    assert numbers.of(poses[0]) == "number 3"
    numbers.advance({0: "b"}, find)
    assert numbers.of(poses[1]) == "unknown", "it depends on something that is gone"
    assert len(found) == 3
