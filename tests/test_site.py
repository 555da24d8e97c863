"""The site that `make docs` builds: every page and link is there, and no page loads from the network."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
# An element that loads what it names, unlike a link that a reader clicks.
LOADED = re.compile(
    r"<(?:script|link|img|iframe|source)\b[^>]*?(?:src|href)=[\"']?((?:https?:)?//[^\"'\s>]+)"
)


def test_a_reference_that_loads_from_the_network_is_found() -> None:
    assert LOADED.findall('<link rel="stylesheet" href="https://a.org/b.css"><script src=//c.org/d>') == [
        "https://a.org/b.css", "//c.org/d",
    ]  # fmt: skip
    assert LOADED.findall('<a href="https://a.org"><img src="pictures/a.png">') == []


@pytest.mark.slow
def test_the_site_builds_and_loads_nothing_from_the_network(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(build, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    pages = {path.relative_to(tmp_path): path.read_text("utf-8") for path in tmp_path.rglob("*.html")}
    written = {page.relative_to(ROOT / "docs").with_suffix(".html") for page in (ROOT / "docs").rglob("*.md")}
    assert written <= pages.keys()
    assert {str(path): found for path, text in pages.items() if (found := LOADED.findall(text))} == {}
    styles = "".join(path.read_text("utf-8") for path in tmp_path.rglob("*.css"))
    assert not re.search(r"(?:url\(|@import)\s*[\"']?(?:https?:)?//", styles)
