"""Folders of range images, damaged in many ways: read, or refused in one message that says where."""

from __future__ import annotations

import random
import shutil
from pathlib import Path

import pytest
from scenes import rarely
from whole_folders import FOLDERS

from viewer.errors import InputError
from viewer.scan.listing import list_folder
from viewer.scan.open import open_scan

INSERTED = (b"nan ", b"1e999 ", b"-", b"\0", b"9" * 50, b"[", b'"', b"\xff")


def damage(folder: Path, chance: random.Random) -> None:
    """Change a byte, cut, empty, insert, exchange or delete: one file of the folder."""
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    file, how = chance.choice(files), chance.randrange(6)
    data = bytearray(file.read_bytes())
    place = chance.randrange(len(data))
    if how == 0:
        data[place] = chance.randrange(256)
    elif how == 1:
        del data[place:]
    elif how == 2:
        data.clear()
    elif how == 3:
        data[place:place] = chance.choice(INSERTED)
    elif how == 4:
        data = bytearray(chance.choice(files).read_bytes())
    file.write_bytes(data)
    if how == 5:
        file.unlink()


@pytest.mark.parametrize("damages", [40, *rarely(120)])
@pytest.mark.parametrize("kind", FOLDERS)
def test_whatever_is_wrong_is_one_message(kind: str, damages: int, tmp_path: Path) -> None:
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    whole.mkdir()
    FOLDERS[kind](whole)
    with open_scan(whole) as scan:
        assert len(list(scan)) == len(scan)
    chance, refused = random.Random(1), 0
    for _ in range(damages):
        shutil.rmtree(broken, ignore_errors=True)
        shutil.copytree(whole, broken)
        damage(broken, chance)
        list_folder(broken)
        try:
            with open_scan(broken) as scan:
                for pose in scan:
                    assert len(pose.cloud)
                errors = [*scan.broken.values()]
        except InputError as error:
            errors = [error]
        for error in errors:
            assert "broken" in str(error.where) or error.where in labels(broken)
            assert len(str(error)) < 900
        refused += bool(errors)
    assert refused > damages / 4


def labels(folder: Path) -> set[str]:
    """What messages call the files of a folder for short."""
    return {file.relative_to(folder).as_posix() for file in folder.rglob("*")}
