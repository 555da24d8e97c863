"""Decisions that the frames of a scan share, and how readers get them."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.scan.reading.corrections import Corrections
from viewer.scan.reading.record import Aside, Decision
from viewer.scan.reading.sequence import Decided, ask


def test_a_settled_decision_is_made_once_for_all_frames_and_threads() -> None:
    decided, made = Decided(), []

    def decide() -> Decision:
        made.append(threading.get_ident())
        return Decision("colors", 255)

    threads = [threading.Thread(target=lambda i=i: decided.at(i).settle("colors", decide)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(made) == 1
    assert decided.settle("colors", lambda: Decision("colors", 1)).value == 255
    assert decided.reading["colors"].value == 255


def test_the_first_note_of_a_key_stays_until_it_is_replaced() -> None:
    decided = Decided()
    decided.note(Decision("format", "PLY"))
    decided.at(3).note(Decision("format", "PCD"))
    assert decided.reading["format"].value == "PLY"
    decided.replace(Decision("format", "PCD"))
    assert decided.reading["format"].value == "PCD"


def test_a_contradiction_is_recorded_and_reported_once_a_frame() -> None:
    decided = Decided()
    for frame in (2, 2, 5):
        decided.at(frame).contradict("colors", f"colors of frame {frame + 1} go up to 65535")
    assert [one.frame for one in decided.reading.contradictions] == [2, 5]
    reports = decided.reports()
    assert [(one.kind, one.frame) for one in reports] == [("contradiction", 2), ("contradiction", 5)]
    assert decided.reports(1) == reports[1:]


def test_what_is_left_aside_or_unused_is_recorded_once() -> None:
    decided = Decided()
    for _ in range(2):
        decided.leave_aside(Aside("a.ply", "copy of b.ply"))
        decided.note_unused("45 harmonics")
    assert decided.reading.aside == (Aside("a.ply", "copy of b.ply"),)
    assert decided.reading.unused == ("45 harmonics",)


def test_corrections_that_no_decision_uses_are_known() -> None:
    decided = Decided(Corrections.parse({"decimal": ",", "unit": "mm"}))
    decided.note(Decision("unit", "mm", "user"), Decision("decimal", ".", "file"))
    assert decided.ignored() == ["decimal"]


def test_hooks_of_readers_get_the_decisions_where_they_ask_for_them() -> None:
    decided = Decided()
    assert ask(lambda path: path, Path("a"), decided=decided) == Path("a")
    assert ask(lambda path, decided: decided, Path("a"), decided=decided) is decided


DARK, BRIGHT = (250, 200, 100), (40000, 20000, 10000)


def write_fields(path: Path, positions: NDArray, colors: NDArray) -> None:
    names = ["x", "y", "z", "red", "green", "blue"]
    fields = np.zeros(len(positions), [(name, "f4" if name in "xyz" else "u2") for name in names])
    for name, values in zip(names, [*positions.T, *colors.T], strict=True):
        fields[name] = values
    np.save(path, fields)


def write_archive(path: Path, positions: NDArray, colors: NDArray) -> None:
    np.savez(path, positions=positions, colors=colors)


def write_table(path: Path, positions: NDArray, colors: NDArray) -> None:
    """A table, with a column of frames where there are several."""
    frames = (
        np.broadcast_to(np.arange(len(colors))[:, None, None], (*colors.shape[:2], 1))
        if colors.ndim == 3
        else []
    )
    parts = [positions, colors] if colors.ndim == 2 else [frames, positions, colors]
    table = np.concatenate(parts, axis=-1).reshape(-1, sum(part.shape[-1] for part in parts))
    names = "x,y,z,red,green,blue" if colors.ndim == 2 else "frame,x,y,z,red,green,blue"
    np.savetxt(path, table, "%g", ",", header=names, comments="")


def write_picture(path: Path, positions: NDArray, colors: NDArray) -> None:
    """Depth pictures instead, of the same colours."""
    shape = (*colors.shape[:-2], 2, 5, 3)
    color = np.broadcast_to(colors[..., None, :1, :], shape)
    np.savez(path, depth=np.ones(shape[:-1]), color=np.ascontiguousarray(color), fx=3, fy=3, cx=1, cy=1)


@pytest.mark.parametrize("first", [DARK, BRIGHT])
@pytest.mark.parametrize(
    ("suffix", "write", "is_one_file"),
    [
        (".npy", write_fields, False),
        (".npz", write_archive, False),
        (".npz", write_archive, True),
        (".csv", write_table, False),
        (".csv", write_table, True),
        (".npz", write_picture, False),
        (".npz", write_picture, True),
    ],
)
def test_a_dark_frame_of_arrays_does_not_decide(
    tmp_path: Path,
    suffix: str,
    write: Callable[[Path, NDArray, NDArray], None],
    is_one_file: bool,
    first: tuple[int, int, int],
) -> None:
    """The colours of all frames have the scale of the brightest one, whichever frame is read first."""
    from viewer.scan.open import open_scan

    frames = [first, DARK, BRIGHT]
    positions = np.arange(12.0).reshape(4, 3)
    colors = np.array([[color] * 4 for color in frames], np.uint16)
    if is_one_file:
        write(tmp_path / f"all{suffix}", np.stack([positions] * 3), colors)
    else:
        for index in range(3):
            write(tmp_path / f"f{index}{suffix}", positions, colors[index])
    with open_scan(tmp_path / f"all{suffix}" if is_one_file else tmp_path) as scan:
        found = [pose.cloud.colors[0, :3].tolist() for pose in scan]
        assert (scan.reading["colors"].value, scan.reading["colors"].source) == (65535, "file")
    assert found == [[1, 1, 0] if color == DARK else [156, 78, 39] for color in frames]
