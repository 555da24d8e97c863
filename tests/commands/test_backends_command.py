"""`scan4d backends`."""

from __future__ import annotations

import json
import re
from pathlib import Path

from command_line import Run

from viewer.backends import backends


def documented() -> set[str]:
    """The names in the JSON list as docs/reference/command-line.md has them."""
    page = (Path(__file__).resolve().parents[2] / "docs/reference/command-line.md").read_text(
        encoding="utf-8"
    )
    section = page.partition("## `scan4d backends`")[2].partition("\n## ")[0]
    return set(re.findall(r"`(\w+)`", section))


def test_backends_as_json(run: Run) -> None:
    listed = json.loads(run("backends", "--json").out)
    assert [b["name"] for b in listed] == list(backends())
    for facts, backend in zip(listed, backends().values(), strict=True):
        assert (facts["title"], facts["help"]) == (backend.title, backend.help)
        assert (facts["available"], facts["why_not"]) == (True, None)
        assert [p["name"] for p in facts["parameters"]] == [p.name for p in backend.parameters]
        for parameter in facts["parameters"]:
            assert {*facts, *parameter} == documented()
    by_name = {b["name"]: b for b in listed}
    assert by_name["points"]["needs"] == []
    assert by_name["surfels"]["needs"] == ["normals"]
    assert by_name["points"]["parameters"][0]["range"] == [0, 32]


def test_backends_as_text(run: Run) -> None:
    out = run("backends").out
    for backend in backends().values():
        assert f"{backend.name}: {backend.help}" in out
        for parameter in backend.parameters:
            assert re.search(rf"^  {parameter.name} .*{re.escape(parameter.help)}$", out, re.M)


def test_backends_separate_what_everybody_sets_from_research(run: Run) -> None:
    """Parameters that the panel shows at once stand before the headings for research, the others below."""
    for backend, text in zip(backends().values(), run("backends").out.split("\n\n"), strict=True):
        everybody, _, research = text.partition("\n  For research: ")
        for parameter in backend.parameters:
            section = everybody if parameter.basic else research
            assert re.search(rf"^  {parameter.name} ", section, re.M), (backend.name, parameter.name)
