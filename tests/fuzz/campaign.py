"""Damaged files by the thousand: what crashes, hangs, takes too much memory or says badly what is wrong.

    python tests/fuzz/campaign.py [--minutes 5] [--seed 1] [--drawn 0.04] [--kind .ply ...] [-o out/fuzz]

Ends with 1 where something was found; the files that did it stand in the folder `found` of the output.
"""

from __future__ import annotations

import argparse
import json
import re
import selectors
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

HANGS = 30.0  # seconds that one input may take; compiling shaders for it counts too
STARTS = 300.0  # seconds until a worker is ready
AT_ONCE = 20_000  # inputs that one worker runs
DRAWN = 0.04  # of the scans, which takes fifty times as long as reading them
WORKER = Path(__file__).with_name("worker.py")


@dataclass
class Findings:
    """What came of a campaign. wrong: what it was -> the inputs that did it."""

    inputs: int = 0
    seconds: float = 0.0
    outcomes: Counter[str] = field(default_factory=Counter)
    wrong: dict[str, list[str]] = field(default_factory=dict)

    def note(self, what: str, where: str) -> None:
        """Add an input, with those that went wrong alike: but for numbers and names of files."""
        alike = re.sub(r"-?\d+", "N", re.sub(r"/\S+/", "", what))
        self.wrong.setdefault(alike, []).append(where)


def campaign(
    folder: Path,
    source: int | Path,
    inputs: int = sys.maxsize,
    seconds: float = float("inf"),
    kinds: Sequence[str] = (),
    drawn: float = DRAWN,
) -> Findings:
    """Run inputs 0 to `inputs` - 1, or as many as there is time for.

    folder: for what is found. source: a seed, or a folder of files. kinds: of file; none named: all.
    drawn: share of the scans that are drawn, too. Raises RuntimeError where a worker does not begin.
    """
    found, began, first = Findings(), time.monotonic(), 0
    while first < inputs and time.monotonic() < began + seconds:
        count = min(AT_ONCE, inputs - first)
        said = map(str, (source, first, count, drawn, *kinds))
        for event in _events(folder, list(said), began + seconds):
            first = event["number"] + 1
            found.inputs += 1
            found.outcomes[f"{event['kind']} {event['outcome']}"] += 1
            if event["wrong"]:
                found.note(event["wrong"], f"{event['number']} {event['kind']}")
    found.seconds = time.monotonic() - began
    return found


def _events(folder: Path, words: Sequence[str], until: float) -> Iterator[dict[str, Any]]:
    """What becomes of each input, until the worker ends, dies, hangs, or the time is over.

    words: of the worker's command line.
    """
    with tempfile.TemporaryDirectory(prefix="worker_", dir=folder) as place:
        command = [sys.executable, str(WORKER), place, *words]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        begun: dict[str, Any] | None = None
        ready = silent = False
        try:
            for line in _lines(process):
                told = json.loads(line) if line else {}
                ready = ready or "ready" in told
                if "begins" in told:
                    begun = {"number": told["begins"], "kind": told["kind"], "drawn": told["drawn"]}
                elif "ended" in told:
                    yield {**(begun or {}), **told}
                    begun = None
                    if time.monotonic() > until:
                        return
                elif not line:
                    silent = True
            if not ready:
                raise RuntimeError(f"no worker begins:\n{(Path(place) / 'output').read_text()[-2000:]}")
            if begun is not None:
                wrong = "hangs" if silent else f"dies: {process.wait()}"
                yield {**begun, "outcome": "failed", "wrong": wrong}
        finally:
            process.kill()
            process.communicate()


def _lines(process: subprocess.Popen[bytes]) -> Iterator[bytes]:
    """The lines that a worker says; an empty one where it has been silent for too long."""
    assert process.stdout is not None
    patience, rest = STARTS, b""
    with selectors.DefaultSelector() as selector:
        selector.register(process.stdout, selectors.EVENT_READ)
        while selector.select(patience):
            if not (part := process.stdout.read1(1 << 16)):
                return
            *lines, rest = (rest + part).split(b"\n")
            yield from lines
            patience = HANGS
    yield b""


def report(found: Findings) -> str:
    """What came of it, as text."""
    lines = [f"{found.inputs} inputs in {found.seconds:.0f} s, {found.inputs / found.seconds:.0f} a second"]
    lines += [f"  {count:7} {outcome}" for outcome, count in sorted(found.outcomes.items())]
    for what, where in sorted(found.wrong.items(), key=lambda item: -len(item[1])):
        lines.append(f"{len(where):5} x {what}   (first: {', '.join(where[:3])})")
    return "\n".join(lines) + ("" if found.wrong else "\nnothing was found")


def main() -> int:
    """Run a campaign and print what came of it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--drawn", type=float, default=DRAWN)
    parser.add_argument("--inputs", type=int, default=sys.maxsize)
    parser.add_argument("--kind", nargs="+", default=[])
    parser.add_argument("-o", "--output", type=Path, default=Path("out/fuzz"))
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    found = campaign(args.output, args.seed, args.inputs, 60 * args.minutes, args.kind, args.drawn)
    print(report(found))
    return int(bool(found.wrong))


if __name__ == "__main__":
    sys.exit(main())
