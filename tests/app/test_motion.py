"""When what is shown moves and when it rests, by a clock of the test's own."""

from __future__ import annotations

from viewer.app.scene.motion import REST, Motion


def test_a_single_change_is_no_motion() -> None:
    motion = Motion()
    motion.change(10.0, held=False)
    assert motion.ends < 10
    motion.show(10.1)
    motion.change(10.1 + 2 * REST, held=False)
    assert motion.ends < 10


def test_changes_soon_after_one_another_are() -> None:
    motion = Motion()
    motion.change(10.0, held=False)
    motion.show(14.0)  # a slow picture is no rest
    motion.change(14.0 + REST / 2, held=False)
    assert motion.ends == 14.0 + 1.5 * REST
    motion.show(15.0)
    assert motion.ends == 15.0 + REST, "it rests when nothing has changed since the picture was there"


def test_a_drag_is_from_its_first_change_on() -> None:
    motion = Motion()
    motion.change(10.0, held=True)
    assert motion.ends == 10.0 + REST
    motion.end()
    assert motion.ends < 10
    motion.show(10.1)
    assert motion.ends < 10, "it was said to be at rest"


def test_after_its_end_the_next_change_is_a_single_one() -> None:
    motion = Motion()
    motion.show(10.0)
    motion.end()
    motion.change(10.0 + REST / 2, held=False)
    assert motion.ends < 10
