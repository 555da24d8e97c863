"""The docs tell the truth: tables come from declarations, commands run as they stand there."""

from __future__ import annotations

import re
import shlex
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from command_line import Run

from viewer.app import tools
from viewer.app.commands import Command, Menu
from viewer.app.menus import Commands
from viewer.backends import backends
from viewer.look import Look, ValueKind
from viewer.params import Parameter, describe

ROOT = Path(__file__).resolve().parents[1]
DOCS = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
SOURCES = [
    *(path for folder in ("viewer", "tools") for path in (ROOT / folder).rglob("*.py")),
    *(path for path in (ROOT / "shaders").rglob("*") if path.is_file()),
]
_PATH = re.compile(r"(?<![\w/.-])(?:viewer|shaders|tests|docs|assets|tools)/[\w/.-]*\w")
# A file whose text a page gives, to be written by the reader: its name, and then a block of code.
_GIVEN = re.compile(r"`([\w/]+\.\w+)`:?\n\n```")
# These set up, open a window or run all tests; they have tests of their own.
ELSEWHERE = ("make ", "git clone", "cd ", "pipx ", "scan4d view", "python ")


def test_the_gallery_shows_every_renderer() -> None:
    page = page_named("gallery.md").read_text(encoding="utf-8").replace("\\\n", " ")
    drawn = set(re.findall(r"^scan4d render .*--backend (\w+) .*-o gallery-\1\.png$", page, re.M))
    assert drawn == set(backends())
    for picture in re.findall(r"-o (gallery-\w+\.png)", page):
        assert f"(pictures/{picture})" in page


def table(parameters: Sequence[Parameter]) -> str:
    """A Markdown table of declared parameters."""
    rows = ["| parameter | group | default | values | affects | what it does |", "|---|---|---|---|---|---|"]
    for p in parameters:
        default = "auto" if p.default is None else str(p.default).lower() if p.type is bool else p.default
        limits = f"{p.low:g} to {p.high:g}" if p.low is not None and p.high is not None else p.type.__name__
        values = ", ".join(p.choices) or ("on, off" if p.type is bool else f"{limits} {p.unit}".rstrip())
        rows.append(f"| `{p.name}` | {p.group} | {default} | {values} | {p.affects} | {p.help} |")
    return "\n".join(rows)


def values_table(values: Mapping[str, ValueKind]) -> str:
    """A Markdown table of the numbers that a backend finds."""
    rows = ["| number | meaning |", "|---|---|"]
    return "\n".join([*rows, *(f"| `{name}` | {kind.help} |" for name, kind in values.items())])


def page_named(name: str) -> Path:
    """The one page below docs/ that has this file name."""
    (page,) = (ROOT / "docs").rglob(name)
    return page


def wrapped(text: str) -> str:
    """A text as one paragraph, in lines of at most 100 characters."""
    return textwrap.fill(" ".join(text.split()), 100, break_long_words=False, break_on_hyphens=False)


def tables_by_reader(parameters: Sequence[Parameter]) -> list[str]:
    """Parameters for every user, then those for research."""
    basic, research = ([p for p in parameters if p.basic is wanted] for wanted in (True, False))
    return [*([table(basic)] if basic else []), *(["For research:", table(research)] if research else [])]


def backends_page() -> str:
    """docs/reference/parameters.md as the declarations have it."""
    parts = [
        "# Parameters",
        wrapped(
            "This page lists the parameters of all renderers and of the look. You can change parameters in "
            "the panel of the window. On the command line, `--set name=value` sets a parameter of the "
            "renderer, and `--look name=value` sets a parameter of the look. For each renderer, the page "
            "lists parameters for every user first, and then those for research."
        ),
        wrapped(
            "The column *affects* says what a change of the parameter does. A parameter with `draw` changes "
            "the picture. If a parameter with `derive` changes, Scan4D must also prepare each pose again. A "
            "parameter with `speed` changes only the drawing time."
        ),
        wrapped(
            "The command `python -m pytest tests/test_docs.py --bless` writes this page from the "
            "declarations in the code."
        ),
    ]
    for backend in backends().values():
        about = f"`{backend.name}` {backend.about[0].lower()}{backend.about[1:]}"
        parts += [f"## {backend.title} (`--backend {backend.name}`)", wrapped(about)]
        parts += tables_by_reader(backend.parameters)
        if backend.values:
            parts += [
                "For each point, the renderer computes the next numbers, which `--look color_by=` can show:",
                values_table(backend.values),
            ]
    parts += ["## Look (`--look key=value`)", wrapped(Look.__doc__ or ""), *tables_by_reader(describe(Look))]
    return "\n\n".join(parts) + "\n"


def key_rows(menu: Menu[Any], path: str = "") -> Iterator[tuple[str, str]]:
    """The commands of a menu that have keys: the path of titles to each, and its keys."""
    for entry in (entry for group in menu.groups for entry in group):
        if isinstance(entry, Menu):
            yield from key_rows(entry, f"{path}{entry.title} > ")
        elif isinstance(entry, Command) and entry.key:
            yield path + entry.title, " or ".join(f"`{key}`" for key in entry.key.split())


def keys_page() -> str:
    """docs/reference/keys.md as the commands of the window and its tools declare it."""
    commands, mouse = Commands(), []
    for name in tools.tool_names():
        module = import_module(f"viewer.app.tools.{name}")
        for menu, entries in getattr(module, "COMMANDS", {}).items():
            commands.add(menu, entries, name)
        mouse += getattr(module, "MOUSE", ())
    parts = [
        "# Keys and mouse",
        wrapped(
            "This page lists all keys and mouse actions of the window. In the window, `F1` shows and "
            "searches the list of keys. The menus contain every command, also commands without a key. You "
            "can [set your own keys](../guide/looking.md#keyboard), which replace the default keys."
        ),
        wrapped(
            "The command `python -m pytest tests/test_docs.py --bless` writes this page from the "
            "declarations in the code."
        ),
        "## Mouse",
        "\n".join(
            [
                "| mouse | action |",
                "|---|---|",
                *(f"| {how} | {does} |" for how, does in [*commands.mouse, *mouse]),
            ]
        ),
    ]
    for menu in commands.menus:
        rows = [f"| {keys} | {title} |" for title, keys in key_rows(menu)]
        parts += [f"## {menu.title}", "\n".join(["| keys | command |", "|---|---|", *rows])]
    return "\n\n".join(parts) + "\n"


def test_the_page_of_keys_is_up_to_date(bless: bool) -> None:
    page = page_named("keys.md")
    if bless:
        page.write_text(keys_page(), encoding="utf-8")
    assert page.read_text(encoding="utf-8") == keys_page()


def test_the_page_of_parameters_is_up_to_date(bless: bool) -> None:
    page = page_named("parameters.md")
    if bless:
        page.write_text(backends_page(), encoding="utf-8")
    assert page.read_text(encoding="utf-8") == backends_page()


def commands(text: str) -> list[str]:
    """The lines of the sh blocks, without comments and continued lines joined."""
    lines = "\n".join(re.findall(r"^```sh\n(.*?)^```", text, re.S | re.M)).replace("\\\n", " ").splitlines()
    return [line.split("  #")[0].strip() for line in lines if line.strip() and not line.startswith("#")]


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=[pytest.mark.slow] if page.name != "README.md" else []) for page in DOCS],
    ids=lambda page: page.name,
)
def test_commands_in_the_docs_run(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run: Run
) -> None:
    monkeypatch.chdir(tmp_path)
    ran = 0
    for command in commands(page.read_text(encoding="utf-8")):
        if command.startswith(ELSEWHERE):
            continue
        name, *arguments = shlex.split(command)
        assert name == "scan4d", f"{page.name}: what is '{command}'?"
        done = run(*arguments)
        assert done.code == 0, f"{command}\n{done.err}"
        ran += 1
    assert ran or page.name != "README.md"


def anchors(page: Path) -> set[str]:
    """What links can name of a page: its headings, in lower case, words joined by hyphens."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", DOCS, ids=lambda page: page.name)
def test_links_in_the_docs_lead_somewhere(page: Path) -> None:
    for name, anchor in re.findall(r"\]\(([^)#:]*)(?:#([^)]*))?\)", page.read_text(encoding="utf-8")):
        target = page.parent / name if name else page
        assert target.exists(), f"{page.name} links to {name}"
        assert not anchor or anchor in anchors(target), f"{page.name} links to #{anchor} of {name}"


def missing_paths(text: str) -> set[str]:
    """The paths of the project that a text names and that are not there. One with NAME stands for several."""
    named = {path for path in _PATH.findall(text) if "NAME" not in path} - set(_GIVEN.findall(text))
    return {path for path in named if not (ROOT / path).exists()}


@pytest.mark.parametrize("page", DOCS, ids=lambda page: page.name)
def test_what_the_docs_name_is_there(page: Path) -> None:
    assert missing_paths(page.read_text(encoding="utf-8")) == set()


def test_the_architecture_lists_all_decisions() -> None:
    page = page_named("architecture.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| \[\d+\]\((decisions/[^)]+)\) \| (.+) \|$", page, re.M)
    there = sorted((ROOT / "docs" / "developing" / "decisions").glob("*.md"))
    titles = [path.read_text(encoding="utf-8").partition("\n")[0].removeprefix("# ") for path in there]
    assert listed == [(f"decisions/{path.name}", title) for path, title in zip(there, titles, strict=True)]


def test_what_the_sources_name_is_there() -> None:
    missing = {path: names for path in SOURCES if (names := missing_paths(path.read_text(encoding="utf-8")))}
    assert missing == {}


def test_a_path_that_is_not_there_is_found() -> None:
    text = "in `viewer/pick.py`, unlike viewer/analysis/pick.py or tests/NAME.py"
    assert missing_paths(text) == {"viewer/pick.py"}
    assert missing_paths("`viewer/new.py`:\n\n```python") == set()
