"""Which stored runs are older than the code that they measure."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator

from experiments.suite import DOCS, ROOT

_MEASURED = ("viewer", "shaders", "tools/experiments")


def commit() -> str | None:
    """The commit of this checkout, with + where its code was changed since; None where git knows none."""
    found = _git("rev-parse", "--short=12", "HEAD")
    return found and found.strip() + ("+" if _git("status", "--porcelain", "--", *_MEASURED) else "")


def stale() -> Iterator[str]:
    """A line for each stored run: its date, its commit, and how many commits changed the code since.

    Runs without a commit go by the start of their day."""
    for path in sorted((DOCS / "data").glob("*.json")):
        run = json.loads(path.read_text(encoding="utf-8"))
        of = run.get("commit")
        since = [f"{of.rstrip('+')}..HEAD"] if of else [f"--since={run['date']}T00:00:00", "HEAD"]
        log = _git("rev-list", "--count", *since, "--", *_MEASURED)
        changes = "its commit is not in this checkout" if log is None else f"{log.strip()} commits since"
        yield f"{path.name}  {run['date']}  {of or 'no commit'}  {changes}"


def _git(*words: str) -> str | None:
    """What git prints; None where it fails or is missing."""
    try:
        done = subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True, check=False)
    except OSError:
        return None
    return done.stdout if done.returncode == 0 else None
