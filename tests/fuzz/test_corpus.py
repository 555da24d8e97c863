"""Files that once did harm, and some thousand damaged ones; `make fuzz MINUTES=60` goes on from there."""

from __future__ import annotations

from pathlib import Path

import pytest
from campaign import campaign, report
from kinds import corpus_files, kind_of

CORPUS = Path(__file__).with_name("corpus")
INPUTS = 3000


@pytest.mark.parametrize("drawn", [pytest.param(1.0, marks=pytest.mark.slow), 0.0])
def test_files_that_once_did_harm(tmp_path: Path, drawn: float) -> None:
    files = corpus_files(CORPUS)
    kinds = sorted({kind_of(path.name.removesuffix(".gz")) for path in files})
    found = campaign(tmp_path, CORPUS, len(files), kinds=kinds, drawn=drawn)
    assert found.inputs == len(files)
    assert not found.wrong, report(found)


@pytest.mark.slow
def test_damaged_files_do_no_harm(tmp_path: Path) -> None:
    found = campaign(tmp_path, 0, INPUTS)
    assert found.inputs == INPUTS
    assert not found.wrong, report(found)
    outcomes = {outcome.split()[1] for outcome in found.outcomes}
    assert outcomes == {"read", "refused"}  # neither all nor none of them is damaged beyond use


PLANTS = {
    "raises": "exception: ValueError at kinds.py",
    "hides": "fault: IndexError at kinds.py",
    "takes memory": "allocation: MemoryError at kinds.py",
    "dies": "dies: N",
    "warns": "warning: UserWarning: planted",
    "writes": "output: b'planted'",
}


@pytest.mark.slow
def test_what_goes_wrong_is_found(tmp_path: Path) -> None:
    assert_found(PLANTS, tmp_path)


@pytest.mark.slow
def test_what_hangs_is_found(tmp_path: Path) -> None:
    assert_found({"hangs": "hangs"}, tmp_path)


def assert_found(plants: dict[str, str], tmp_path: Path) -> None:
    """Each is found for what it is, and the campaign goes on behind it."""
    planted = tmp_path / "planted"
    planted.mkdir()
    for number, plant in enumerate([*plants, "nothing"]):
        (planted / f"planted_{number}.txt").write_text(plant)
    found = campaign(tmp_path, planted, len(plants) + 1)
    assert found.inputs == len(plants) + 1
    for number, (plant, told) in enumerate(plants.items()):
        (what,) = (what for what, where in found.wrong.items() if f"{number} planted.txt" in where)
        assert what.startswith(told), plant
    assert len(found.wrong) == len(plants)
