"""The scans that can be gone to without a dialog: their list, and those opened lately."""

from __future__ import annotations

import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from viewer.app.files.scans import Scans, title
from viewer.app.session import Session


@pytest.fixture
def names(tmp_path: Path) -> list[str]:
    for name in ("a.ply", "b.ply", "c.ply"):
        (tmp_path / name).touch()
    return [str(tmp_path / name) for name in ("a.ply", "b.ply", "c.ply")]


def looked(scans: Scans) -> None:
    """Wait until it has taken in what it looked for."""
    until = time.monotonic() + 10
    while scans.waits:
        assert time.monotonic() < until
        scans.advance(0.0)
        time.sleep(0.001)


def test_steps_go_through_what_was_named_together_and_round_its_end(names: list[str]) -> None:
    opened: list[str] = []
    session = Session(names[0])
    scans = Scans(session, pytest.fail, pytest.fail, opened.append, names)
    scans.begin_scan(SimpleNamespace())  # type: ignore[arg-type]
    looked(scans)
    assert (scans.listed, scans.are_together) == (names, True)
    scans.step(1)
    scans.step(1)
    scans.step(1)
    assert opened == [*names[1:], names[0]], "also past those that are still being opened"
    assert [(name, is_open) for name, _, is_open in scans.items(scans.listed)] == [
        ("a.ply", True), ("b.ply", False), ("c.ply", False),
    ]  # fmt: skip


def test_those_opened_lately_are_told_without_the_open_one_and_what_is_gone(names: list[str]) -> None:
    session = Session(names[0])
    scans = Scans(session, pytest.fail, pytest.fail, pytest.fail, names[:1], recent=(names[1], names[2]))
    Path(names[2]).unlink()
    scans.begin_scan(SimpleNamespace())  # type: ignore[arg-type]
    looked(scans)
    assert scans.recent == tuple(names)
    assert [title(scan) for scan in scans.lately] == ["b.ply"]
    assert (scans.listed, scans.are_together) == (names[:2], False), "what stands in the same folder"


@pytest.mark.parametrize(
    ("scan", "name"),
    [
        ("demo", "Demo scan"),
        ("-", "Standard input"),
        ("https://x.org/a/b.svo", "b.svo"),
        ("/a/b.ply", "b.ply"),
    ],
)
def test_scans_have_titles(scan: str, name: str) -> None:
    assert title(scan) == name
