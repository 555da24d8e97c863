"""Experiments: all are found, stored runs make the pages as they stand, and runs survive their files."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path

import pytest
from experiments.command import experiment, found, main
from experiments.script import Script, described_text
from experiments.stale import commit, stale
from experiments.suite import DOCS, ROOT, Suite, page_named, stored_runs, write_run
from tables_of import tables_of

from viewer.bench.report.results import write_row
from viewer.drawing.renderer import Renderer
from viewer.errors import InputError

SUITES = [
    name for name, path in found().items() if "\nEXPERIMENT = Suite(" in path.read_text(encoding="utf-8")
]


def suite(name: str) -> Suite:
    declared = experiment(name)
    assert isinstance(declared, Suite)
    return declared


@pytest.mark.parametrize("name", SUITES)
def test_the_tables_of_pages_are_those_of_the_stored_runs(name: str, bless: bool) -> None:
    runs = stored_runs(suite(name), name)
    assert runs, f"no run of {name} is stored"
    page = page_named(suite(name).page)
    if bless:
        page.write_text(suite(name).filled(runs), encoding="utf-8")
    assert page.read_text(encoding="utf-8") == suite(name).filled(runs)


@pytest.mark.parametrize("name", ["hardware"])
def test_described_tables_are_those_of_the_stored_runs(name: str, bless: bool) -> None:
    script = experiment(name)
    assert isinstance(script, Script)
    page = page_named(script.described_page)
    if bless:
        page.write_text(described_text(name, script), encoding="utf-8")
    assert page.read_text(encoding="utf-8") == described_text(name, script)


def test_a_run_on_a_graphics_card_alone_is_stored(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, renderer: Renderer
) -> None:
    if not renderer.gpu.software:
        pytest.skip("this is a graphics card")
    assert main(["hardware", "--sizes", "1000", "--store", str(tmp_path)]) == 2
    assert "is no graphics card" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_each_place_of_a_table_has_what_makes_it() -> None:
    """A suite or a script; and none of them makes one without a place."""
    made = [(page_named(suite(name).page), table.name) for name in SUITES for table in suite(name).tables]
    for name, path in found().items():
        script = None if name in SUITES or path.parent.name == "window" else experiment(name)
        if isinstance(script, Script) and script.page:
            made += [(page_named(script.page), table.__name__) for table in script.tables]
        if isinstance(script, Script):
            made += [(page_named(script.described_page), table.name) for table in script.described]
    places = [
        (page, key)
        for page in DOCS.rglob("*.md")
        for key in re.findall(r"^<!-- (\w+) -->$", page.read_text(encoding="utf-8"), re.M)
    ]
    assert sorted(made) == sorted(places)


@pytest.mark.parametrize("name", SUITES)
def test_a_run_without_rows_is_refused_and_so_is_a_file_that_is_none(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such rows"):
        suite(name).read(tmp_path)
    file = tmp_path / "run.json"
    for text in ("", "[]", json.dumps({"rows": []})):
        file.write_text(text)
        with pytest.raises(InputError, match=r"run\.json"):
            suite(name).read_run(file)


@pytest.mark.parametrize("name", ["codeword", "hpr", "laplacian", "measuring"])
def test_a_run_survives_its_files(name: str, tmp_path: Path) -> None:
    (stored, *_) = stored_runs(suite(name), name)
    where = {key: value for key, value in stored.items() if key not in suite(name).parts}
    for part in suite(name).parts:
        with open(tmp_path / f"{part}.jsonl", "w", encoding="utf-8") as stream:
            for row in stored[part]:
                write_row(stream, {**where, **row})
    run = suite(name).read(tmp_path)
    assert {part: run[part] for part in suite(name).parts} == {
        part: stored[part] for part in suite(name).parts
    }
    write_run(tmp_path / "run.json", run)
    again = suite(name).read_run(tmp_path / "run.json")
    assert tables_of(suite(name), [again]) == tables_of(suite(name), [run])


def test_every_experiment_is_declared_and_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[1] for line in lines] == list(found())
    for name, path in found().items():
        if path.parent.name != "window":  # which need a screen
            assert isinstance(experiment(name), Suite | Script)
        else:
            assert ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))


def test_wrong_words_are_one_message(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["speed"]) == 2
    assert "no experiment is called speed" in capsys.readouterr().err
    assert main(["feeds", "--scene", "sphere", "-o", str(tmp_path)]) == 2
    assert "its own scenes" in capsys.readouterr().err


def test_stored_runs_say_how_old_they_are(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = sorted((DOCS / "data").glob("*.json"))
    assert main(["--stale"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == [path.name for path in files]
    (tmp_path / "data").mkdir()
    run = {"date": "2026-01-31", "commit": "0" * 12}
    (tmp_path / "data" / "known-card.json").write_text(json.dumps(run))
    monkeypatch.setattr("experiments.stale.DOCS", tmp_path)
    assert list(stale()) == [f"known-card.json  2026-01-31  {'0' * 12}  its commit is not in this checkout"]
    head = commit()
    if head is None:
        pytest.skip("this is no git checkout")
    (tmp_path / "data" / "known-card.json").write_text(json.dumps(run | {"commit": head}))
    assert list(stale()) == [f"known-card.json  2026-01-31  {head}  0 commits since"]


@pytest.mark.slow
def test_two_checkouts_are_compared_by_turns(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["points", "--counts", "1000", "--size", "64x48", "--rounds", "1"]
    assert main([*words, "--against", str(ROOT), "--turns", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3 * 4  # times and a ratio of plain points and three forms of ours
    assert all("old" in line and "new" in line for line in lines)


def test_rows_of_a_script_are_printed_and_stored(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    words = ["splats", "--counts", "1000", "--size", "64x48", "--rounds", "1", "--table", "splats"]
    assert main([*words, "--feeds", "tbo", "tiles", "--store", str(tmp_path)]) == 0
    assert "instancing" in capsys.readouterr().out
    (file,) = tmp_path.iterdir()
    stored = json.loads(file.read_text(encoding="utf-8"))
    assert [row["instancing"] for row in stored["splats"]] == ["tbo", "tiles"] * 2
    assert stored["device"]
