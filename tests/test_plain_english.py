"""Docs in plain English: short sentences and lines, and none of the words that made riddles."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
GLOSSARY = "glossary.md"  # which lists words to avoid
PAGES = [
    *(ROOT / name for name in ("README.md", "CHANGELOG.md")),
    *sorted(page for page in (ROOT / "docs").rglob("*.md") if page.name != GLOSSARY),
]
WORDS, CHARACTERS = 25, 100  # in a sentence, in a line
BANNED = re.compile(
    r"\b(told|tells|by itself|of which|anew|aslant|likewise|whoever|but for|goes? by|as it stands)\b", re.I
)
_MADE = re.compile(r"^<!-- (\w+) -->$.*?^<!-- /\1 -->$", re.M | re.S)  # tables that measurements make
_CODE = re.compile(r"^```.*?^```$", re.M | re.S)
_ITEM = re.compile(r"\s*([*-]|\d+\.|#+|>)\s+")
_END = re.compile(r"(?<=[.!?:;])[)*]*\s+")


def prose(text: str) -> str:
    """A page without code, and without the tables that measurements make."""
    return _CODE.sub("", _MADE.sub("", text))


def paragraphs(text: str) -> Iterator[str]:
    """The paragraphs, headings and items of a page, each as one line; no tables, no indented code."""
    lines: list[str] = []
    for line in [*prose(text).splitlines(), ""]:
        is_apart = not line.strip() or line.startswith(("|", "    ", "!["))
        if lines and (is_apart or _ITEM.match(line)):
            yield " ".join(lines)
            lines = []
        if not is_apart:
            item = _ITEM.match(line)
            lines.append(line[item.end() :] if item else line.strip())


def sentences(text: str) -> Iterator[str]:
    """The sentences of a page; code counts as one word, and a link as its text."""
    for paragraph in paragraphs(text):
        plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", re.sub(r"`[^`]*`", "X", paragraph))
        yield from _END.split(plain)


def words(sentence: str) -> int:
    """The number of words of a sentence; signs of formulas are none."""
    return sum(bool(re.search(r"\w", word)) for word in sentence.split())


def faults(text: str) -> list[str]:
    """What a page has against plain English."""
    long_lines = [line for line in prose(text).splitlines() if len(line) > CHARACTERS]
    return [
        *(f"{words(each)} words: {each}" for each in sentences(text) if words(each) > WORDS),
        *(f"'{found[0]}': {line}" for line in prose(text).splitlines() for found in BANNED.finditer(line)),
        *(f"{len(line)} characters: {line}" for line in long_lines if not line.startswith(("|", "!["))),
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_a_page_is_plain_english(page: Path) -> None:
    assert faults(page.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("Scan4D opens `a file`.\n\n| told | a table cell is a list of words |", ["'told'"]),
        ("A " * 26, ["26 words"]),
        ("A " * 13 + "b.\n" + "A " * 13 + "b.", []),
        ("* " + "A " * 20 + "\n* " + "A " * 20, []),
        ("A" * 101, ["101 characters"]),
        ("```sh\n" + "A" * 101 + "\n```\n<!-- t -->\n" + "told " * 30 + "\n<!-- /t -->", []),
    ],
)  # fmt: skip
def test_faults_are_found(text: str, found: list[str]) -> None:
    assert [fault.partition(":")[0] for fault in faults(text)] == found
