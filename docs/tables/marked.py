"""Tables of the documentation that scripts write: in a page, between `<!-- table: SCRIPT NAME -->` and
`<!-- end -->`, both on lines of their own. Scripts that import this find `viewer` and the tests' modules."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MARKED = re.compile(r"^<!-- table: (\S+) (\w+) -->\n(.*?)^<!-- end -->$", re.S | re.M)

sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "tests" / "backends")]


def write_tables(script: str, page: str, tables: Sequence[Callable[[], str]]) -> None:
    """Write the tables that the command line names, or else all, into a page.

    script: the path of the file that calls this, page: that of the page, both from the project's folder.
    tables: functions that make a table in Markdown, by whose names the page marks its place.
    """
    by_name = {table.__name__: table for table in tables}
    unknown = set(sys.argv[1:]) - set(by_name)
    if unknown:
        sys.exit(f"no table {', '.join(sorted(unknown))}; there are {', '.join(by_name)}")
    for name in sys.argv[1:] or by_name:
        made = by_name[name]().strip()
        put_table(ROOT / page, script, name, made)
        print(f"{name}\n{made}\n", flush=True)


def put_table(page: Path, script: str, name: str, made: str) -> None:
    """Put a table in the place that a page marks for it. Exits where there is no one such place."""
    text = page.read_text(encoding="utf-8")
    places = [found for found in MARKED.finditer(text) if (found[1], found[2]) == (script, name)]
    if len(places) != 1:
        sys.exit(f"{page} marks {len(places)} places for the table {name}")
    start, end = places[0].span()
    marked = f"<!-- table: {script} {name} -->\n\n{made}\n\n<!-- end -->"
    page.write_text(text[:start] + marked + text[end:], encoding="utf-8")


def markdown(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)
