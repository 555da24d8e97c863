"""Do the quick tests find small mistakes? `mutate.py COUNT SEED SECONDS` runs the tests beside each mutant.

A mutant has one operator, number or word changed. A test kills it that fails or does not end with it alone.
"""

import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from pathlib import Path
from queue import Queue

ROOT = Path(__file__).resolve().parents[1]
PARTS = ["viewer/analysis/", "viewer/scan/", "shaders/(chunks|common|compact|points|scatter|shade|surfels)/",
         "viewer/(drawing/|gpu/|picture/|splatting/|backends/(points|surfels))"]  # fmt: skip
QUICK = (
    "tests/((analysis|scan|gpu|picture|splatting|visibility|projection|backends|drawing)/.*)?test_(?!mutate)"
)
PAIRS = "< <=,> >=,== !=,&& ||,and or,min max,any all,True False,true false,floor ceil,+ -,* /,0 1,1 2"
BECOMES = {a: b for pair in PAIRS.split(",") for a, b in (pair.split(), pair.split()[::-1])}
FOUND = re.compile(  # texts, comments and declarations of shaders first, so that nothing in them is found
    r'"""[\s\S]*?"""|"[^"\n]*"|#.*|//.*|layout.*|((?<![\w.])[012](?![\w.])|'
    rf"(?<= )(?:[-+*/]|[<>=!]=|[<>])(?= )|&&|\|\||\b(?:{'|'.join(filter(str.isalpha, BECOMES))})\b)"
)
UNSEEN = {  # lines that mutants leave alone -> why no test can tell one there from the code
    r"\b(strict|frozen|slots|repr|kw_only|cache|copy)=": "an option that changes no result",
    r"EPS|TOLERANCE|TINY|1e-": "a margin for rounding",
    r"raise |Error\(|f\"": "the words of a message",
    r"checkpoint\(|timeout|_(BYTES|MB|AT_ONCE)\b|local_size": "how work is split, watched and limited",
}
PATHS = [path for part in ("viewer", "shaders", "tests") for path in sorted((ROOT / part).rglob("*.*"))]
CODE = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
        for path in PATHS if path.suffix in (".py", ".glsl", ".comp", ".vert", ".frag")}  # fmt: skip


def mutants(part: str, seed: int) -> Iterator[tuple[str, str, str, str]]:
    """The mutants of a part in random order: file, function, change of a line, new text."""
    places = [(f, *m.span(1)) for f in CODE if re.match(part, f) for m in FOUND.finditer(CODE[f]) if m[1]]
    for file, start, end in random.Random(seed).sample(places, len(places)):
        text = CODE[file][:start] + BECOMES[CODE[file][start:end]] + CODE[file][end:]
        number = text.count("\n", 0, start)
        line, becomes = (each.splitlines()[number].strip() for each in (CODE[file], text))
        if not re.search("|".join(UNSEEN), line):
            functions = ["", *re.findall(r"^(?: {4}def|\w+) (\w+)\(", CODE[file][:start], re.M)]
            yield file, functions[-1], f"{file}:{number + 1}: {line}  ->  {becomes}", text


def tests_of(file: str, function: str) -> list[str]:
    """The tests nearest to a function, at most 8: those that have most of the rare words of its path."""
    near = {name: 0.0 for name in CODE if re.match(QUICK, name)}
    for word in [Path(file).stem, *re.findall(r"[^\W_]{3,}", f"{file.partition('/')[2]} {function}".lower())]:
        counts = {name: len(re.findall(f"(?<![a-z]){word}", 9 * name + CODE[name])) for name in near}
        near = {name: near[name] + (counts[name] / (1 + sum(counts.values()))) ** 2 for name in near}
    return sorted(near, key=lambda name: -near[name] * (1 + 2 * (file.split("/")[1] in name)))[:8]


def failing(copy: Path, tests: list[str], seconds: int, mutant: str = "") -> str:
    """The first test that fails in a copy or is not done in time, or how they end; empty where all pass."""
    env = {"SCAN4D_DATA": str(ROOT.parent / "shared" / "data"), **os.environ, "PYTHONPATH": str(copy)}
    if "kernels" in mutant:  # what numba compiles from other files, too, may hold the mutant
        env["NUMBA_CACHE_DIR"], seconds = tempfile.mkdtemp(dir=copy), 3 * seconds
    options = ["-xvv", "--tb=no", "-p", "no:cacheprovider", "-m", "not slow", f"--seconds={seconds}"]
    command = ["timeout", str(3 * seconds), sys.executable, "-Bm", "pytest", *options, *tests]
    done = subprocess.run(command, cwd=copy, env=env, capture_output=True, text=True)
    found = re.search(r"^(tests/.*?) (?:FAILED|ERROR|SKIPPED \(the time)", done.stdout, re.M)
    return found[1] if found else f"exit code {done.returncode}" if done.returncode else ""


def judged(copies: "Queue[Path]", mutant: tuple[str, str, str, str], tests: list[str], seconds: int) -> bool:
    """Whether a test, alone, fails or does not end with a mutant, and passes without it."""
    (file, _, change, text), copy = mutant, copies.get()
    (copy / file).write_text(text, encoding="utf-8")
    failed = failing(copy, tests, seconds, file)
    alone = [failed] if "::" in failed else tests
    killed = failed != "" and failing(copy, alone, seconds, file) != ""
    shutil.copy2(ROOT / file, copy / file)
    killed = killed and not failing(copy, alone, seconds)
    copies.put(copy)
    print("killed  " if killed else "SURVIVES", change, "by", failed or "none", flush=True)
    return killed


def main(count: int = 40, seed: int = 1, seconds: int = 60) -> int:
    """Report what becomes of each mutant."""
    copies = Queue[Path]()
    chosen = [each for part in PARTS for each in islice(mutants(part, seed), count // len(PARTS))]
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as pool:
        for place in "ab":  # with what is compiled, which holds for files as old
            copies.put(shutil.copytree(ROOT, Path(folder, place), ignore=shutil.ignore_patterns(".*", "out")))
        killed = sum(pool.map(lambda each: judged(copies, each, tests_of(*each[:2]), seconds), chosen))
    print(f"{killed} of {len(chosen)} mutants are killed")
    return int(killed < 0.9 * len(chosen))


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
