"""Stopped suites go on after what they have stored, and only where nothing differs."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
from command_line import Run
from experiments.resuming import JOURNAL, Journal, JournaledBench
from experiments.suite import Part, Suite, row_of
from experiments.tables import Row

from viewer.bench.baselines import FLOOR
from viewer.bench.plan import Contender, Group
from viewer.bench.report.results import RESULTS, read_rows, write_row
from viewer.bench.run import Bench, BenchSettings
from viewer.drawing.renderer import Renderer

SCENES = ("torus", "sphere", "box")


class Measured:
    """Parts of a small suite. calls: what was measured; stop_at: where Ctrl-C comes, once."""

    def __init__(self) -> None:
        self.calls: list[str] = []
        self.stop_at = ""

    def by_scene(self, bench: Bench, scenes: Sequence[str]) -> Iterator[Row]:
        for scene in scenes:
            yield from (self._row(bench, scene, number) for number in range(2))

    def _row(self, bench: Bench, scene: str, number: int) -> Row:
        self.calls.append(f"{scene} {number}")
        if self.calls[-1] == self.stop_at:
            self.stop_at = ""
            raise KeyboardInterrupt
        bench.note(f"seen {scene}")
        return row_of(bench, scene=scene, number=number)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> Measured:
    """Stands as the experiment `measuring`."""
    measured = Measured()
    parts = {
        "rows": Part(("scene", "number"), measured.by_scene, by_scene=True),
        "others": Part(("scene", "number"), measured.by_scene),
    }
    suite = Suite(page="measuring.md", parts=parts, tables=[], scenes=SCENES)
    monkeypatch.setattr("experiments.command.experiment", lambda _: suite)
    return measured


def stored(out: Path) -> Row:
    run = json.loads((out / "measuring.json").read_text(encoding="utf-8"))
    assert isinstance(run, dict)
    return run


@pytest.mark.parametrize(
    ("stop_at", "again"),
    [("torus 1", "torus 0"), ("sphere 1", "sphere 0"), ("box 0", "box 0")],
)
def test_a_stopped_suite_goes_on_with_the_piece_that_it_was_stopped_at(
    run_experiment: Run, small: Measured, tmp_path: Path, stop_at: str, again: str
) -> None:
    words = ("measuring", "--size", "32x32", "-o", tmp_path)
    small.stop_at = stop_at
    assert run_experiment(*words).code == 1
    small.calls.clear()
    done = run_experiment(*words, "--resume")
    assert done.code == 0, done.err
    assert small.calls[0] == again
    assert f"pieces that the run keeps: {SCENES.index(again.split()[0])}\n" in done.err + done.out
    whole = [{"scene": scene, "number": number} for scene in SCENES for number in range(2)]
    run = stored(tmp_path)
    assert run["rows"] == run["others"] == whole
    assert run["resumed"] == [run.get("commit", "")]
    notes = (tmp_path / "notes.txt").read_text(encoding="utf-8").split("\n")
    assert [note for note in notes if note.startswith("seen")] == [f"seen {scene}" for scene in SCENES]
    again_done = run_experiment(*words, "--resume")
    assert (again_done.code, "finished run" in again_done.err) == (2, True)


def test_a_run_that_is_stopped_twice_loses_nothing(
    run_experiment: Run, small: Measured, tmp_path: Path
) -> None:
    words = ("measuring", "--size", "32x32", "-o", tmp_path)
    small.stop_at = "sphere 0"
    assert run_experiment(*words).code == 1
    small.stop_at = "box 1"
    assert run_experiment(*words, "--resume").code == 1
    small.calls.clear()
    assert run_experiment(*words, "--resume").code == 0
    assert small.calls[:2] == ["box 0", "box 1"]
    assert len(stored(tmp_path)["rows"]) == len(stored(tmp_path)["others"]) == 6
    assert len(stored(tmp_path)["resumed"]) == 2
    report = run_experiment(*words, "--report", "--force")
    assert (report.code, len(stored(tmp_path)["resumed"])) == (0, 2)


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        (("--size", "64x32"), "size was (32, 32), now (64, 32)"),
        (("--scene", "torus"), "--scene was not given, now torus"),
        (("--quick",), "--quick was not given, now given"),
        ((), "commit was 0123456789ab, now fedcba987654"),
    ],
)
def test_a_run_that_differs_does_not_go_on(
    run_experiment: Run,
    small: Measured,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    changed: tuple[str, ...],
    named: str,
) -> None:
    monkeypatch.setattr("experiments.resuming.commit", lambda: "0123456789ab")
    small.stop_at = "sphere 0"
    assert run_experiment("measuring", "--size", "32x32", "-o", tmp_path).code == 1
    if not changed:
        monkeypatch.setattr("experiments.resuming.commit", lambda: "fedcba987654")
    before = (tmp_path / JOURNAL).read_bytes()
    small.calls.clear()
    done = run_experiment("measuring", "--size", "32x32", "-o", tmp_path, "--resume", *changed)
    assert (done.code, small.calls, named in done.err) == (2, [], True), done.err
    assert (tmp_path / JOURNAL).read_bytes() == before


def test_a_folder_without_a_run_and_one_that_lost_rows_are_refused(
    run_experiment: Run, small: Measured, tmp_path: Path
) -> None:
    words = ("measuring", "--size", "32x32", "-o", tmp_path)
    done = run_experiment(*words, "--resume")
    assert (done.code, "no run that could go on" in done.err) == (2, True)
    small.stop_at = "sphere 0"
    assert run_experiment(*words).code == 1
    (tmp_path / "rows.jsonl").write_text("")
    done = run_experiment(*words, "--resume")
    assert (done.code, "fewer rows" in done.err, "old-rows.jsonl" in done.err) == (2, True, True)


@pytest.mark.slow
def test_groups_of_pictures_are_measured_once(renderer: Renderer, tmp_path: Path) -> None:
    settings = BenchSettings(size=(32, 32), views=1, repeat=1, frames=0)
    groups = [Group("sphere", (Contender(FLOOR),), count=count, judged=False) for count in (100, 200)]
    bench = JournaledBench(renderer, settings, Journal.of_new(tmp_path, {}))
    with open(tmp_path / RESULTS, "w", encoding="utf-8") as stream:
        for row in bench.measure(groups[0]):
            write_row(stream, row)
    bench.measure(groups[1])  # and stopped before its row is written
    again = JournaledBench(renderer, settings, Journal.resumed(tmp_path, {}))
    (first,), (second,) = (again.measure(group) for group in groups)
    assert first == read_rows(tmp_path / RESULTS)[0]
    assert (first["n"], second["n"]) == (100, 200)
