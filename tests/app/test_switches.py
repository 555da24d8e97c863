"""Parameters that backends declare with a key are switched by it: pyramid levels, filling of holes."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from viewer.app.keys import chord
from viewer.app.menus import Commands
from viewer.app.scene.switching import switch_commands
from viewer.backends import Backend, backends
from viewer.errors import InputError
from viewer.params import param
from viewer.params import switches as switches_of


@dataclass(frozen=True)
class Pyramid:
    """Parameters as a backend with levels declares them."""

    size: int = param(3, "Something else", low=1, high=9)
    fill: bool = param(True, "Fill holes", key="H")
    level_1: bool = param(False, "Fills small holes", key="1", when={"fill": (True,)})
    level_2: bool = param(False, "Fills larger ones", key="2", when={"fill": (True,)})


@dataclass(frozen=True)
class Laplacian:
    """Parameters of another that has a level of the first."""

    level_2: bool = param(True, "Blends", key="2")


def test_a_key_switches_what_declares_it_while_it_matters() -> None:
    def states(values: object) -> dict[str, bool]:
        return {name: one.is_on(values) for name, one in switches_of(values).items()}

    assert states(Pyramid(level_2=True)) == {"fill": True, "level_1": False, "level_2": True}
    assert states(Pyramid(fill=False)) == {"fill": False}
    assert states(Laplacian()) == {"level_2": True}


def test_a_choice_of_two_is_a_switch_that_is_on_with_the_first() -> None:
    @dataclass(frozen=True)
    class Samples:
        shape: str = param("faces", "Shapes", choices=("dots", "faces"), title="Draw samples as", key="Q")

    (switch,) = switches_of(Samples()).values()
    assert (switch.switch_title, switch.is_on(Samples())) == ("Draw samples as dots", False)
    assert switch.switched(Samples()) == Samples("dots")
    assert switch.switched(Samples("dots")) == Samples()


def test_each_switch_is_one_command_whichever_backend_draws() -> None:
    found = switch_commands(of(kind) for kind in (Pyramid, Laplacian))
    named = [(command.name, command.title, command.key) for command in found]
    assert named == [
        ("switch_fill", "Fill", "H"), ("switch_level_1", "Level 1", "1"), ("switch_level_2", "Level 2", "2"),
    ]  # fmt: skip


@dataclass(frozen=True)
class Keyless:
    """Parameters of one that has a level without a key."""

    level_2: bool = param(True, "Blends")


@dataclass(frozen=True)
class Wrong:
    """Keys that are none."""

    fill: bool = param(True, "Fill holes", key="Shift H")


def of(kind: type) -> Backend:
    class Switched(Backend):
        params_class = kind

        def draw(self, pose: object, frame: object, surface: object) -> bool:
            raise NotImplementedError

    return Switched(kind.__name__.lower())


def test_a_backend_without_a_key_takes_none_from_another() -> None:
    assert [one.key for one in switch_commands([of(Laplacian), of(Keyless)])] == ["2"]


def test_keys_that_are_none_say_whose_they_are() -> None:
    with pytest.raises(InputError, match=r"wrong\.fill, key='Shift H': unknown key 'Shift'"):
        switch_commands([of(Wrong)])


def test_a_parameter_has_one_key() -> None:
    @dataclass(frozen=True)
    class Other:
        fill: bool = param(True, "Fill holes", key="J")

    with pytest.raises(InputError, match="'fill' has different keys"):
        switch_commands([of(Pyramid), of(Other)])


def test_the_keys_of_parameters_are_theirs_alone() -> None:
    declared = {p.key: p.name for one in backends().values() for p in one.parameters if p.key}
    names = {p.name for one in backends().values() for p in one.parameters if p.key}
    assert len(declared) == len(names)
    chords = [chord(one) for command in Commands().of.values() for one in command.key.split()]
    assert len(chords) == len(set(chords))
