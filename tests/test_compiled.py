from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from viewer.compiled import _CacheFile

NOWHERE = "import numba.core.caching as c; c.CacheImpl._locator_classes = []"  # no folder can be written
KERNEL = """
from viewer.compiled import compiled

@compiled
def twice(number):
    return 2 * number
"""


def run(folder: Path, cache: Path | None, limit: str = "") -> tuple[int, int]:
    """(what twice(21) is, how often it was found on disk) in a process of its own."""
    script = f"{limit}\nimport kernel\nprint(kernel.twice(21), sum(kernel.twice.stats.cache_hits.values()))"
    result, hits = output(script, folder, cache).split()
    return int(result), int(hits)


def output(script: str, folder: Path, cache: Path | None) -> str:
    """What a script prints, in a process of its own that may keep what it compiles in `cache`."""
    paths = os.pathsep.join([str(folder), str(Path(__file__).parents[1])])
    environment = {**os.environ, "PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"}
    environment |= {"NUMBA_CACHE_DIR": str(cache or "")}
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout


def written(tmp_path: Path) -> tuple[Path, Path]:
    """(folder of a module with a compiled function, a folder to keep the result in)."""
    (tmp_path / "kernel.py").write_text(KERNEL)
    (tmp_path / "cache").mkdir()
    return tmp_path, tmp_path / "cache"


def announced(folder: Path, cache: Path | None, limit: str = "") -> list[str]:
    """What a task is called while it waits in two calls, on a thread of several, and after them; in a process
    of its own."""
    script = f"""{limit}
import kernel
from viewer.threads import together
from viewer.task import Task, listening

heard = []
task = Task("Reading")
with task.current(), listening(lambda what: heard.extend((what, task.name))):
    together(10**6, [lambda: kernel.twice(21)] * 2)
    together(10**6, [lambda: kernel.twice(21)] * 2)
print(*heard, task.name, sep="|")
"""
    return output(script, folder, cache).strip().split("|")


@pytest.mark.slow
def test_what_has_to_be_compiled_is_announced_and_what_is_kept_is_not(tmp_path: Path) -> None:
    folder, cache = written(tmp_path)
    once = "Compiling code for this computer, which happens only once"
    assert announced(folder, cache) == [once, once, "Reading"]
    assert announced(folder, cache) == ["Reading"]
    assert announced(folder, None, NOWHERE) == ["Preparing", "Preparing", "Reading"]


@pytest.mark.slow
def test_what_was_compiled_is_found_again(tmp_path: Path) -> None:
    folder, cache = written(tmp_path)
    assert run(folder, cache) == (42, 0)
    assert run(folder, cache) == (42, 1)


@pytest.mark.slow
def test_what_was_compiled_loads_without_what_numba_compiles_with(tmp_path: Path) -> None:
    folder, cache = written(tmp_path)
    script = "import sys, kernel; print(kernel.twice(21), 'numba.np.arraymath' in sys.modules)"
    assert output(script, folder, cache).split() == ["42", "True"]
    assert output(script, folder, cache).split() == ["42", "False"]


@pytest.mark.slow
def test_what_another_file_has_is_compiled_anew_where_that_changes(tmp_path: Path) -> None:
    folder, cache = written(tmp_path)
    own = KERNEL.replace("2 * number", "doubled(number) + ZERO")
    (folder / "kernel.py").write_text("from other import ZERO, doubled\n" + own)
    other = KERNEL.replace("twice", "doubled")
    (folder / "other.py").write_text(f"ZERO = 0\n{other}")
    assert [run(folder, cache) for _ in range(2)] == [(42, 0), (42, 1)]
    (folder / "other.py").write_text(f"ZERO = 0\n{other}".replace("2 *", "3 *"))
    assert [run(folder, cache) for _ in range(2)] == [(63, 0), (63, 1)]
    (folder / "other.py").write_text(f"ZERO = 5\n{other}")
    assert [run(folder, cache) for _ in range(2)] == [(47, 0), (47, 1)]


def test_machine_code_of_another_source_or_signature_is_not_run(tmp_path: Path) -> None:
    def file(stamp: str) -> _CacheFile:
        return _CacheFile(str(tmp_path), "kernel", stamp)

    file("old").save("int", "old code")
    halfway = file("new")
    halfway._save_index({"int": halfway._data_name(1)})  # stopped before it writes the machine code
    assert file("new").load("int") is None
    file("new").save("int", "new code")
    assert file("new").load("int") == "new code"
    assert file("old").load("int") is None

    both = file("new")  # as two processes leave it that number one signature each at the same time
    both._save_index({kind: both._data_name(1) for kind in ("int", "float")})
    assert (both.load("int"), both.load("float")) == ("new code", None)


@pytest.mark.slow
def test_damaged_files_are_made_anew(tmp_path: Path) -> None:
    folder, cache = written(tmp_path)
    run(folder, cache)
    for suffix in ("nbi", "nbc"):
        for file in cache.rglob(f"*.{suffix}"):
            file.write_bytes(file.read_bytes()[:20])
        assert run(folder, cache) == (42, 0)
        assert run(folder, cache) == (42, 1)


@pytest.mark.slow
def test_a_full_disk_only_costs_time(tmp_path: Path) -> None:
    folder, cache = written(tmp_path)
    full = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))"
    assert run(folder, cache, full) == (42, 0)
    assert run(folder, cache) == (42, 0)  # nothing half-written was kept


@pytest.mark.slow
def test_folders_that_cannot_be_written_only_cost_time(tmp_path: Path) -> None:
    folder, _ = written(tmp_path)
    assert run(folder, None, NOWHERE) == (42, 0)
