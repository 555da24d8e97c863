"""What changes is saved now and then, beside whoever changes it; what cannot be saved is told once, and tried
again."""

from __future__ import annotations

import threading
from itertools import count

from viewer.document.saver import Saver


def finish(keeper: Saver[int]) -> None:
    """Wait until it has written."""
    for _, future in keeper._writing:
        future.exception()


def test_it_saves_now_and_then_also_what_goes_on_changing() -> None:
    written: list[int] = []
    keeper = Saver("Numbers", written.append, 0, every=3.0)
    looks = 0

    def current() -> int:
        nonlocal looks
        looks += 1
        return number

    number = 0
    for now in (0.0, 0.1, 5.0):
        assert keeper.look(now, current) is None
    assert looks == 2, "now and then"
    assert written == [], "nothing has changed"
    for number in range(1, 6):
        keeper.look(10.0 + 5 * number, current)
        finish(keeper)
    number = 6
    keeper.look(35.5, current)
    finish(keeper)
    assert written == [1, 2, 3, 4, 5], "it was saved a moment ago"
    assert keeper.close(6) is None
    assert written == [1, 2, 3, 4, 5, 6]


def test_closing_saves_only_what_has_changed() -> None:
    written: list[int] = []
    assert Saver("Numbers", written.append, 1, 3.0).close(1) is None
    assert written == []
    assert Saver("Numbers", written.append, 0, 3.0).close(1) is None
    assert written == [1]


def test_nobody_waits_for_a_slow_disk_and_nothing_is_lost_meanwhile() -> None:
    written: list[int] = []
    goes_on = threading.Event()

    def save(number: int) -> None:
        goes_on.wait()
        written.append(number)

    keeper = Saver("Numbers", save, 0, every=3.0)
    for number in (1, 2, 3):
        keeper.look(10.0 * number, lambda number=number: number)  # type: ignore[misc]
    keeper.note(4)
    goes_on.set()
    assert keeper.close(5) is None
    assert written == [1, 4, 5]


def test_what_saving_has_to_say_is_told() -> None:
    keeper = Saver("Numbers", lambda number: f"{number} is much", 0, every=3.0)
    keeper.note(7)
    finish(keeper)
    assert keeper.look(5.0, lambda: 7) == "7 is much"
    assert keeper.look(10.0, lambda: 7) is None
    assert keeper.close(8) == "8 is much"


def test_what_cannot_be_kept_is_told_once() -> None:
    def fail(number: int) -> None:
        raise OSError("no room")

    keeper = Saver("Numbers", fail, 0, every=3.0)

    def look(now: float) -> str | None:
        problem = keeper.look(now, lambda: 7)
        finish(keeper)
        return problem

    problem = next(filter(None, map(look, count(0.0, 5.0))))
    assert problem == "Numbers cannot be saved: no room"
    assert not any(map(look, (1e6, 2e6, 3e6)))
    assert "cannot be saved" in str(keeper.close(8))


class Disk:
    """Where numbers are saved by tens. is_full: whether that fails."""

    def __init__(self) -> None:
        self.is_full = False
        self.attempts = 0
        self.held: dict[int, int] = {}

    def save(self, number: int) -> None:
        self.attempts += 1
        if self.is_full:
            raise OSError("no room")
        self.held[number // 10] = number


class Saved:
    """Looks at a number each three seconds, until it is written."""

    def __init__(self, disk: Disk) -> None:
        self.keeper = Saver("Numbers", disk.save, None, 3.0, lambda number: number // 10)
        self.now = 0.0

    def look(self, number: int, times: int = 1) -> list[str]:
        told = []
        for _ in range(times):
            self.now += 3.0
            told.append(self.keeper.look(self.now, lambda: number))
            finish(self.keeper)
        return list(filter(None, told))


def test_what_could_not_be_saved_is_saved_when_there_is_room_again() -> None:
    disk = Disk()
    saved = Saved(disk)
    disk.is_full = True
    assert saved.look(11, 3) == ["Numbers cannot be saved: no room"]
    assert saved.look(12, 1000) == []
    assert 40 <= disk.attempts <= 60, "now and then, at most once a minute"
    disk.is_full = False
    assert saved.look(13, 25) == []
    assert disk.held == {1: 13}
    saved.look(14, 2)
    assert disk.held == {1: 14}, "at once again"
    disk.is_full = True
    assert saved.look(15, 3) == ["Numbers cannot be saved: no room"]
    disk.is_full = False
    assert saved.keeper.close(15) is None
    assert disk.held == {1: 15}


def test_each_file_that_cannot_be_written_is_told_and_none_is_forgotten() -> None:
    disk = Disk()
    saved = Saved(disk)
    disk.is_full = True
    saved.keeper.note(11)
    finish(saved.keeper)
    saved.keeper.note(21)  # before anybody looked
    assert saved.look(21, 4) == ["Numbers cannot be saved: no room"] * 2
    saved.look(21, 100)
    disk.is_full = False
    assert saved.look(31, 2) == []
    assert disk.held[3] == 31, "another file does not wait"
    saved.look(31, 25)
    assert disk.held == {1: 11, 2: 21, 3: 31}


def test_closing_saves_what_could_not_be_saved_before() -> None:
    disk = Disk()
    saved = Saved(disk)
    disk.is_full = True
    for number in (11, 21, 31):
        saved.look(number, 3)
    disk.is_full = False
    saved.keeper.close(31)
    assert disk.held == {1: 11, 2: 21, 3: 31}
