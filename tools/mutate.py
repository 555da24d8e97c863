"""Do the quick tests find small mistakes? `mutate.py COUNT SEED SECONDS` runs the tests beside each mutant.

A mutant has one operator, number or word changed. Tests kill it where one fails that passes without it, or
where they do not end. Exit code 1: they kill fewer than 90 %.
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
PARTS = {  # code -> the tests beside it
    "viewer/analysis/": "tests/analysis/",
    "viewer/scan/": "tests/(scan/|test_)",
    "viewer/(frame|gpu/|backends/(points|surfels))": "tests/(gpu/|backends/|test_)",
    "shaders/(chunks|common|compact|points|scatter|shade|surfels)/": "tests/(gpu/|backends/)",
}
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
    """The mutants of a part in an order by chance: file, function, change of a line, new text."""
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
    stem, beside = Path(file).stem, next(PARTS[part] for part in PARTS if re.match(part, file))
    names = [name for name in CODE if re.match("tests/(?!app).*test_", name)]
    near = {name: 0.0 for name in names if re.match(beside, name) or f"{stem} import" in CODE[name]}
    for word in re.findall(r"[^\W_]{3,}", f"{file.partition('/')[2]} {stem} {function}".lower()):
        counts = {name: len(re.findall(f"(?<![a-z]){word}", 9 * name + CODE[name])) for name in near}
        near = {name: near[name] + (counts[name] / (1 + sum(counts.values()))) ** 2 for name in near}
    return sorted(near, key=near.__getitem__, reverse=True)[:8]


def failing(copy: Path, tests: list[str], seconds: int, mutant: str = "") -> str:
    """The first test that fails in a copy, or how the tests end; empty where none does within the time."""
    env = {"SCAN4D_DATA": str(ROOT.parent / "shared" / "data"), **os.environ, "PYTHONPATH": str(copy)}
    if "kernels" in mutant:  # what numba compiles from other files, too, may hold the mutant
        env["NUMBA_CACHE_DIR"], seconds = tempfile.mkdtemp(dir=copy), 3 * seconds
    command = ["timeout", str(3 * seconds), sys.executable, "-Bm", "pytest", "-xq", "-rfE", "--tb=no", *tests]
    options = ["-p", "no:cacheprovider", "-m", "not slow", f"--seconds={seconds}"]
    done = subprocess.run([*command, *options], cwd=copy, env=env, capture_output=True, text=True)
    found = re.search("(?:FAILED|ERROR) (tests/.*?)(?: - |\n)", done.stdout)
    return (found[1] if found else f"exit code {done.returncode}") if done.returncode else ""


def judged(copies: "Queue[Path]", mutant: tuple[str, ...], tests: list[str], seconds: int) -> bool:
    """Whether tests kill a mutant, in one of the copies; what fails without it, too, kills nothing."""
    (file, _, change, text), copy = mutant, copies.get()
    (copy / file).write_text(text, encoding="utf-8")
    failed = failing(copy, tests, seconds, file)
    shutil.copy2(ROOT / file, copy / file)
    killed = failed != "" and not failing(copy, [failed] if "::" in failed else tests, seconds)
    copies.put(copy)
    print("killed  " if killed else "SURVIVES", change, "by", failed or "none", flush=True)
    return killed


def main(count: int = 40, seed: int = 1, seconds: int = 60) -> int:
    """Report what becomes of each mutant."""
    share, copies = count // len(PARTS), Queue[Path]()
    chosen = [each for part in PARTS for each in islice(mutants(part, seed), share)]
    every = [(each, tests_of(*each[:2])) for each in chosen]
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as pool:
        for place in (f"{folder}/a", f"{folder}/b"):  # with what is compiled, which holds for files as old
            copies.put(Path(shutil.copytree(ROOT, place, ignore=shutil.ignore_patterns(".*", "out"))))
        killed = sum(pool.map(lambda each: judged(copies, *each, seconds), every))
    print(f"{killed} of {len(every)} mutants are killed")
    return int(killed < 0.9 * len(every))


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
