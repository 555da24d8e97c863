"""What Scan4D keeps is for its user alone, and all that it writes is made in one place."""

from __future__ import annotations

import ast
import os
import stat
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from command_line import Run
from source_code import PACKAGE, modules, syntax_of

from viewer.app.settings import FILE, save
from viewer.document.document import Document
from viewer.document.journal import Journal, journal_folder
from viewer.document.saved_session import SavedSession, store, stored_file
from viewer.errors import InputError
from viewer.files import whole_file
from viewer.folders import cache_folder, new_file, new_folder, state_folder, user_folder

ROOTS = [user_folder, cache_folder, state_folder]

posix = pytest.mark.skipif(sys.platform == "win32", reason="modes of files are POSIX's")


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A user without any folder yet, who lets others read what they write."""
    for name in ("CONFIG", "CACHE", "STATE"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / "home" / name))
    before = os.umask(0o022)
    yield
    os.umask(before)


def mode(path: Path) -> int:
    return stat.S_IMODE(path.lstat().st_mode)


def modes(folder: Path) -> dict[str, int]:
    """The modes of a folder and of all in it."""
    return {str(path): mode(path) for path in [folder, *folder.rglob("*")]}


@posix
@pytest.mark.parametrize("umask", [0o000, 0o002])
def test_nobody_else_can_replace_the_folders_that_are_made_for_a_user(umask: int, tmp_path: Path) -> None:
    """Who can write to the folder around it can put another one in its place."""
    os.umask(umask)
    save({}, user_folder() / FILE)
    assert {mode(folder) for folder in user_folder().parents if folder.is_relative_to(tmp_path / "home")} == {
        0o700
    }


@posix
def test_nobody_else_can_read_what_is_kept_of_a_user(run: Run, tmp_path: Path) -> None:
    store(SavedSession("/scans/doe.ply", None, 0, Document()))
    save({}, user_folder() / FILE)
    journal = Journal(tmp_path)
    with whole_file(cache_folder() / "facts.json") as temporary:
        temporary.write_text("{}")
    with whole_file(tmp_path / "out.txt") as temporary:
        kept = {name: found for root in ROOTS for name, found in modes(root()).items()}
        assert mode(temporary) == 0o644
    journal.remove()
    assert {found for name, found in kept.items() if os.path.isdir(name)} == {0o700}
    assert sum(not os.path.isdir(name) for name in kept) >= 5
    for name, found in modes(tmp_path / "home").items():
        if os.path.isfile(name):
            assert found == 0o600
    assert mode(tmp_path / "out.txt") == 0o644, "what the user asks for is as the user's other files"


@posix
def test_folders_of_earlier_versions_are_closed_with_all_in_them(tmp_path: Path) -> None:
    file = stored_file("/scans/doe.ply")
    file.parent.mkdir(parents=True)
    (user_folder() / FILE).write_text("{}")
    (tmp_path / "elsewhere").touch()
    (user_folder() / "link").symlink_to(tmp_path / "elsewhere")
    journal_folder().mkdir(parents=True)
    (journal_folder() / "1_a.jsonl").touch()
    assert mode(user_folder()) == 0o755
    store(SavedSession("/scans/doe.ply", None, 0, Document()))
    Journal(tmp_path).remove()
    assert mode(user_folder()) == mode(file.parent) == mode(state_folder()) == mode(journal_folder()) == 0o700
    assert mode(user_folder() / FILE) == mode(journal_folder() / "1_a.jsonl") == 0o600
    assert mode(tmp_path / "elsewhere") == 0o644
    assert mode(user_folder().parent) == 0o755


@posix
def test_only_inner_folders_that_are_open_are_closed_as_well() -> None:
    user_folder().mkdir(parents=True, mode=0o700)
    stored_file("a").parent.mkdir()
    store(SavedSession("/scans/doe.ply", None, 0, Document()))
    assert mode(stored_file("a").parent) == 0o700


@posix
@pytest.mark.skipif(sys.platform == "win32" or os.geteuid() != 0, reason="only root can give files away")
def test_nothing_is_kept_in_a_folder_of_another_user() -> None:
    user_folder().mkdir(parents=True)
    os.chown(user_folder(), 12345, 12345)
    with pytest.raises(InputError, match="permission denied"):
        save({}, user_folder() / FILE)
    assert list(user_folder().iterdir()) == []


@posix
def test_new_files_and_folders_are_none_that_exist(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("precious")
    (tmp_path / "dangling").symlink_to(tmp_path / "missing")
    (tmp_path / "link").symlink_to(tmp_path / "file")
    for name in ("file", "dangling", "link"):
        with pytest.raises(FileExistsError):
            new_file(tmp_path / name)
        with pytest.raises(FileExistsError):
            new_folder(tmp_path / name)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["dangling", "file", "link"]
    assert (tmp_path / "file").read_text() == "precious"


# --- the source ---------------------------------------------------------------------------

MAKERS = {"folders.py", "unfinished.py", "files.py"}  # where files and folders are made
GIVEN = {"whole_file", "temporary_file", "_writing"}  # what gives a file that is there to be written
WRITERS = {  # what is called with such a file
    "scan/formats", "scan/octree/file.py", "analysis/landmarks/files", "output/export.py",
}  # fmt: skip
# They write into /proc, open the standard streams, and make damaged files in a folder of their own.
ELSEWHERE = {"drawing/timing.py", "commands/_line.py", "testing/readers.py"}
NO_PATHS = ("self.", "window.", "app.window.", "side_kernels.")  # whose methods have names of those of paths
NAMES = {"mkdir", "makedirs", "touch", "mkstemp", "mkdtemp", "mktemp", "mkfifo", "link", "symlink"}


def called(call: ast.Call) -> str:
    """Last name of what is called: `open` of `archive.open(...)`."""
    function = call.func
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")


def given(node: ast.With) -> set[str]:
    """Names of the files that a block is given."""
    return {
        item.optional_vars.id
        for item in node.items
        if isinstance(item.context_expr, ast.Call) and called(item.context_expr) in GIVEN
        if isinstance(item.optional_vars, ast.Name)
    }


def opens_to_write(call: ast.Call) -> bool:
    """Whether it is `open(path, MODE)` that writes over what is there or may follow a link: not with "x"."""
    if not isinstance(call.func, ast.Name) or call.func.id != "open":
        return False
    modes = [*call.args[1:2], *(word.value for word in call.keywords if word.arg == "mode")]
    return any(not isinstance(mode, ast.Constant) or set("wa+") & set(str(mode.value)) for mode in modes)


def makes(node: ast.AST, files: frozenset[str], writer: bool) -> Iterator[ast.Call]:
    """Calls below a node that make or write another file than the given ones."""
    if isinstance(node, ast.With):
        files |= given(node)
    if isinstance(node, ast.Call):
        name, target = called(node), node.args[0] if node.args else None
        if isinstance(node.func, ast.Attribute) and name in {"write_text", "write_bytes"}:
            target = node.func.value
        is_given = writer or (isinstance(target, ast.Name) and target.id in files)
        writes = opens_to_write(node) or name in {"write_text", "write_bytes"}
        spelled = ast.unparse(node.func)
        makes_one = name in NAMES and not spelled.startswith(NO_PATHS)
        if makes_one or spelled == "os.open" or (writes and not is_given):
            yield node
    for child in ast.iter_child_nodes(node):
        yield from makes(child, files, writer)


def test_all_files_are_made_by_the_one_that_makes_them_safely() -> None:
    found = []
    for path in modules():
        name = path.relative_to(PACKAGE).as_posix()
        tree = syntax_of(path)
        imported = {
            alias.name
            for node in ast.walk(tree)
            if isinstance(node, ast.Import | ast.ImportFrom)
            for alias in [*node.names, ast.alias(getattr(node, "module", None) or "")]
        }
        if name in ELSEWHERE:
            continue
        if "tempfile" in imported and name != "unfinished.py":
            found.append(f"{name}: tempfile")
        if name in MAKERS:
            continue
        writer = any(name.startswith(part) for part in WRITERS)
        for call in makes(tree, frozenset(), writer):
            if "devnull" not in ast.dump(call):
                found.append(f"{name}:{call.lineno}: {ast.unparse(call)}")
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    "code",
    [
        "open(path, 'w')", "open(path, mode='ab')", "path.write_text('')", "path.parent.mkdir()",
        "os.makedirs(path)", "os.open(path, os.O_CREAT)", "path.touch()", "open(path, mode)",
        "with whole_file(path) as temporary:\n    open(path, 'w')",
    ],
)  # fmt: skip
def test_the_reading_of_the_source_finds(code: str) -> None:
    assert list(makes(ast.parse(code), frozenset(), writer=False))


def test_the_reading_of_the_source_passes_over_what_is_given() -> None:
    code = "with whole_file(path) as new, open(new, 'w') as stream:\n    new.write_text('')\nopen(path)"
    assert not list(makes(ast.parse(code), frozenset(), writer=False))
