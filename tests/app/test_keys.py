"""The keys of commands, and the file in which a user changes them."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import pytest

pytest.importorskip("imgui_bundle")

from imgui_bundle import imgui

from viewer.app.commands import Command, Menu
from viewer.app.keys import Keys, chord, chords, load_keys, write_template
from viewer.app.menus import Commands
from viewer.errors import InputError

COMMANDS = Commands()
USUAL = {name: command.key for name, command in COMMANDS.of.items()}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "settings" / "keys.toml"


def load_text(file: Path, text: str) -> tuple[dict[str, str], list[str]]:
    file.parent.mkdir(exist_ok=True)
    file.write_text(text)
    keys, problems = load_keys(file, COMMANDS)
    return keys.of, problems


def test_every_command_has_a_name_and_a_place_of_its_own_and_no_two_have_the_same_keys() -> None:
    def count(menu: Menu) -> int:
        return sum(
            isinstance(entry, Command) + (count(entry) if isinstance(entry, Menu) else 0)
            for group in menu.groups
            for entry in group
        )

    assert sum(map(count, COMMANDS.menus)) == len(COMMANDS.of)
    every = [key for keys in USUAL.values() for key in chords(keys)]
    assert len(set(every)) == len(every)
    for group in COMMANDS.toolbar:
        assert all(COMMANDS.of[name].short for name in group if isinstance(name, str))


def test_keys_are_read_as_they_are_written() -> None:
    assert chord("Ctrl+Shift+1") == imgui.Key.mod_ctrl | imgui.Key.mod_shift | imgui.Key._1
    assert chord("p") == chord("P") == imgui.Key.p
    assert chords("p Ctrl+[") == [chord("p"), chord("Ctrl+[")]
    assert chord("Alt+[") == imgui.Key.mod_alt | imgui.Key.left_bracket


@pytest.mark.parametrize("text", ["", "Ctrl+", "Hyper+A", "F13", "+", "AB", "Ctrl", "1+Ctrl"])
def test_what_is_no_key_is_told_with_those_that_are(text: str) -> None:
    with pytest.raises(InputError, match="Known"):
        chord(text)


def test_without_a_file_the_usual_keys_hold(file: Path) -> None:
    keys, problems = load_keys(file, COMMANDS)
    assert (keys.of, problems) == (USUAL, [])


def test_the_template_changes_nothing_and_each_line_of_it_can_be_used(file: Path) -> None:
    file.parent.mkdir()
    write_template(file, COMMANDS)
    keys, problems = load_keys(file, COMMANDS)
    assert (keys.of, problems) == (USUAL, [])
    head, mark, lines = file.read_text().partition("[keys]\n")
    assert load_text(file, head + mark + lines.replace("# ", "", 1).replace("\n# ", "\n")) == (USUAL, [])


def test_changed_keys_hold_and_the_others_stay(file: Path) -> None:
    of, problems = load_text(file, '[keys]\nplay = "Ctrl+F7"\nfit = ""\n')
    assert problems == []
    assert of == USUAL | {"play": "Ctrl+F7", "fit": ""}


def test_a_key_that_two_tools_want_is_that_of_the_first(file: Path) -> None:
    commands = Commands()
    for tool in ("first", "second"):
        commands.add("Tools", (Command(f"act_{tool}", "Act", print, "Alt+Q"),), tool)
    keys, (problem,) = load_keys(file, commands)
    assert (keys.of["act_first"], keys.of["act_second"]) == ("Alt+Q", "")
    assert str(problem).startswith("The tool 'second': Alt+Q is set for both 'act_first' and 'act_second'")


def test_two_commands_can_swap_keys(file: Path) -> None:
    changes = {"screenshot": USUAL["record"], "record": USUAL["screenshot"]}
    of, problems = load_text(file, "[keys]\n" + "\n".join(f'{n} = "{k}"' for n, k in changes.items()))
    assert problems == []
    assert of == USUAL | changes


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('[keys]\nplai = "F7"\nfit = "F8"', "unknown command 'plai'"),
        ('[keys]\nplay = "Hyper+F7"\nfit = "F8"', "unknown modifier key 'Hyper'"),
        ('[keys]\nplay = 7\nfit = "F8"', "the value of 'play' is not a text"),
        ('[keys]\nfit = "F8"\nplay = "R"', "R is set for both"),
        ('[keys]\nfit = "F8"\nplay = "F7 R"', "R is set for both"),
        ('[keys]\nfit = "F8"\nplay = "F7 Ctrl"', "unknown key 'Ctrl'"),
        ('[keys]\nfit = "F8"\nplay = "f8"', "f8 is set for both 'fit' and 'play'"),
        ('[keys]\nfit = "F8"\n[colours]\n', "unknown table 'colours'"),
    ],
)
def test_what_is_wrong_in_a_file_is_told_and_the_rest_of_it_holds(file: Path, text: str, told: str) -> None:
    of, (problem,) = load_text(file, text)
    assert told in problem
    assert str(file) in problem
    assert of == USUAL | {"fit": "F8"}


@pytest.mark.parametrize("content", [b"[keys\n", b"\xff\xfe\x00", b"keys = 3\n"])
def test_a_damaged_file_is_told_and_the_usual_keys_hold(file: Path, content: bytes) -> None:
    file.parent.mkdir()
    file.write_bytes(content)
    keys, problems = load_keys(file, COMMANDS)
    assert len(problems) == 1
    assert keys.of == USUAL


def test_a_folder_in_its_place_is_told(file: Path) -> None:
    file.mkdir(parents=True)
    keys, (problem,) = load_keys(file, COMMANDS)
    assert "cannot be read" in problem
    assert keys.of == USUAL


def test_commands_are_plain_data() -> None:
    assert all(dataclasses.is_dataclass(command) for command in COMMANDS.of.values())
    assert Keys(COMMANDS, {"fit": "F8"}).of["fit"] == "F8"


def test_keys_nested_without_end_leave_the_usual_ones(file: Path) -> None:
    of, (problem,) = load_text(file, "[keys]\nplay = " + "[" * 5000)
    assert "cannot be read" in problem
    assert of == USUAL


def test_a_pipe_or_a_huge_file_is_not_waited_for(file: Path) -> None:
    file.parent.mkdir(parents=True)
    os.mkfifo(file)
    keys, (problem,) = load_keys(file, COMMANDS)
    assert "cannot be read" in problem
    assert keys.of == USUAL
    file.unlink()
    file.touch()
    os.truncate(file, 400 * 2**20)  # a hole, which takes no room
    keys, (problem,) = load_keys(file, COMMANDS)
    assert "longer than" in problem
    assert keys.of == USUAL


def test_of_many_faults_a_few_are_told(file: Path) -> None:
    of, problems = load_text(file, "[keys]\n" + "".join(f'command_{n} = "F8"\n' for n in range(50)))
    assert len(problems) == 6
    assert "45 more lines" in problems[-1]
    assert of == USUAL
