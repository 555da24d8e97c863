"""Levels of a pyramid are switched by number, where a backend has them."""

from __future__ import annotations

from dataclasses import dataclass

from viewer.app.scene.levels import is_filling, levels, toggled, with_filling
from viewer.params import param


@dataclass(frozen=True)
class Pyramid:
    """Parameters as a backend with levels declares them."""

    size: int = param(3, "Something else", low=1, high=9)
    level_0: bool = param(True, "The native level")
    level_1: bool = param(False, "Fills small holes")
    level_2: bool = param(False, "Fills larger ones")


@dataclass(frozen=True)
class Plain:
    """Parameters of a backend without levels."""

    size: int = param(3, "Something else", low=1, high=9)


def test_a_digit_switches_its_level_alone() -> None:
    assert levels(Pyramid()) == {0: True, 1: False, 2: False}
    assert toggled(Pyramid(size=5), 2) == Pyramid(size=5, level_2=True)
    assert toggled(toggled(Pyramid(), 0), 0) == Pyramid()


def test_a_level_that_is_not_there_changes_nothing() -> None:
    assert toggled(Pyramid(), 3) == Pyramid()
    assert levels(Plain()) == {}
    assert toggled(Plain(), 1) == with_filling(Plain(), True) == Plain()
    assert not is_filling(Plain())


def test_filling_is_all_levels_but_the_native_one() -> None:
    filled = with_filling(Pyramid(level_0=False, level_1=True), True)
    assert filled == Pyramid(level_0=False, level_1=True, level_2=True)
    assert is_filling(filled)
    assert not is_filling(Pyramid(level_1=True))
    assert with_filling(filled, False) == Pyramid(level_0=False)
