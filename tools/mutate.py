"""Do the quick tests find small mistakes? Makes mutants of the code, and runs the tests beside each.

A mutant is a copy of the checkout with one operator, number or word changed. It is killed where a test fails
or does not end. `mutants.json` has those that no test can tell from the code. Exit code 1: below 90 %.
"""

import argparse
import ast
import json
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
PICTURE = "tests/(gpu/|backends/|test_)"
PARTS = {  # code -> the tests beside it
    "viewer/analysis/": "tests/analysis/",
    "viewer/scan/": "tests/(scan/|test_)",
    "viewer/(frame|gpu/|backends/(points|surfels))": PICTURE,
    "shaders/(chunks|common|compact|points|scatter|shade|surfels)/": PICTURE,
}
PAIRS = (
    "< <=,> >=,== !=,&& ||,and or,min max,any all,True False,true false,floor ceil,argmin argmax,+ -,* /,0 1"
)
BECOMES = {a: b for pair in PAIRS.split(",") for a, b in (pair.split(), pair.split()[::-1])} | {
    "1": "2",
    "2": "3",
}
WORDS = "|".join(word for word in BECOMES if word.isalpha())
FOUND = re.compile(
    rf"(?<![\w.])[012](?![\w.])|(?<= )([-+*/]|[<>=!]=|[<>])(?= )|&&|\|\||\b(?<!strict=)({WORDS})\b"
)  # zip's strict changes no result
PATHS = [path for part in ("viewer", "shaders", "tests") for path in sorted((ROOT / part).rglob("*.*"))]
CODE = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
        for path in PATHS if path.suffix in (".py", ".glsl", ".comp", ".vert", ".frag")}  # fmt: skip


def meaning(file: str, text: str) -> str:
    """The code without comments, texts and types, which mutants leave alone."""
    if not file.endswith(".py"):
        return re.sub(r"//.*|^\s*(#|layout).*", "", text, flags=re.M)
    tree = ast.parse(text)
    for node in ast.walk(tree):
        for field in {"annotation", "returns"} & set(node._fields):
            setattr(node, field, None)
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            node.value = ""
    return ast.dump(tree)


def mutants(part: str, chance: random.Random) -> Iterator[dict[str, str]]:
    """All mutants of a part in the order of chance: file, line, what it becomes, the text with it."""
    places = [
        (file, *found.span()) for file in CODE if re.match(part, file) for found in FOUND.finditer(CODE[file])
    ]
    known = [{**each, "why": ""} for each in json.loads((ROOT / "tools" / "mutants.json").read_text("utf-8"))]
    for file, start, end in chance.sample(places, len(places)):
        text = CODE[file][:start] + BECOMES[CODE[file][start:end]] + CODE[file][end:]
        line, becomes = (each.splitlines()[text.count("\n", 0, start)].strip() for each in (CODE[file], text))
        mutant = {"file": file, "line": line, "becomes": becomes, "why": ""}
        try:
            if meaning(file, text) != meaning(file, CODE[file]) and mutant not in known:
                yield {**mutant, "text": text}
        except SyntaxError:
            continue


def tests_of(file: str, beside: str) -> list[str]:
    """The tests beside a file, nearest first: those that mention the rare words of its path most."""
    tests = {name: text for name, text in CODE.items() if re.match(beside, name) and "/test_" in name}
    words = {
        word: sum(text.count(word) for text in tests.values()) for word in re.findall(r"[^\W_]+", file)[1:-1]
    }
    stem = Path(file).stem.partition("_")[0]
    near = {name: sum(text.count(word) / (1 + words[word]) for word in words) for name, text in tests.items()}
    return sorted(tests, key=lambda name: near[name] + (f"test_{stem}" in name), reverse=True)


def failing(copy: Path, tests: list[str], seconds: int) -> str:
    """The first test that fails in a copy, and why; empty where none does within the time."""
    data = os.environ.get("SCAN4D_DATA", str(ROOT.parent / "shared" / "data"))
    env = {
        **os.environ,
        "PYTHONPATH": str(copy),
        "SCAN4D_DATA": data,
        "GALLIVM_PERF": "nopt",
        "COLUMNS": "999",
    }
    options = ["-xq", "-rfE", "-p", "no:cacheprovider", "-m", "not slow", "--tb=no", f"--seconds={seconds}"]
    command = [sys.executable, "-Bm", "pytest", *options, *tests]
    try:
        done = subprocess.run(command, cwd=copy, env=env, capture_output=True, text=True, timeout=3 * seconds)
    except subprocess.TimeoutExpired:
        return "no end"
    found = re.search("(?:FAILED|ERROR) tests/.*", done.stdout)
    return (found[0] if found else done.stdout + done.stderr) if done.returncode else ""


def judged(copies: Queue[Path], seconds: int, mutant: dict[str, str], beside: str) -> bool:
    """Whether tests kill a mutant, in one of the copies; a test that fails without it counts for nothing."""
    copy, file = copies.get(), mutant["file"]
    (copy / file).write_text(mutant.pop("text"), encoding="utf-8")
    failed = failing(copy, tests_of(file, beside), seconds)
    (copy / file).write_text(CODE[file], encoding="utf-8")
    test = re.findall("^(?:FAILED|ERROR) (.*?)(?: - |$)", failed)
    fails_anyway = bool(test) and failing(copy, test, seconds) != ""
    copies.put(copy)
    print(
        "FAILS ANYWAY" if fails_anyway else "killed" if failed else "survived",
        json.dumps(mutant),
        failed,
        flush=True,
    )
    return bool(failed) and not fails_anyway


def main() -> int:
    """Report what becomes of each mutant."""
    parser, copies = argparse.ArgumentParser(description=__doc__), Queue[Path]()
    for name, usual in (("count", 40), ("seed", 1), ("seconds", 150), ("processes", 2)):
        parser.add_argument(f"--{name}", type=int, default=usual)
    args = parser.parse_args()
    every = {
        part: islice(mutants(part, random.Random(args.seed)), args.count // len(PARTS)) for part in PARTS
    }
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(args.processes) as pool:
        for copy in (Path(folder, str(number)) for number in range(args.processes)):
            shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(".*", "__pycache__", "out"))
            copies.put(copy)
        jobs = [
            pool.submit(judged, copies, args.seconds, mutant, PARTS[part])
            for part in PARTS
            for mutant in every[part]
        ]
        killed = sum(job.result() for job in jobs)
    print(f"{killed} of {len(jobs)} mutants were killed")
    return int(killed < 0.9 * len(jobs))


if __name__ == "__main__":
    sys.exit(main())
