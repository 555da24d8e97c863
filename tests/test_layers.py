"""The layers of the design, read from the imports: plain values <- scan <- mesh <- gpu <- ... <- cli."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from source_code import PACKAGE, modules, syntax_of

from viewer.backends import backends
from viewer.commands import command_names
from viewer.testing.tools import KNOWN

# A part of the package may import its own layer and those before it.
LAYERS = (
    {
        "errors", "csv_text", "files", "folders", "geometry", "bounds", "params", "resources", "rigid",
        "imports", "srgb", "camera", "look", "view", "task", "helper", "native", "signals", "unfinished",
        "compiled", "threads", "extensions",
    },
    {"codewords"},
    {"scan"},
    {"mesh"},
    {"simulate", "gpu"},
    {"picture"},
    {"splatting", "visibility", "projection"},
    {"backends"},
    {"drawing"},
    {"choice"},
    {"analysis"},
    {"output"},
    {"document", "__init__"},
    {"app", "bench", "testing"},
    {"cli", "commands", "__main__"},
)  # fmt: skip
LAYER_OF = {part: number for number, parts in enumerate(LAYERS) for part in parts}

WINDOW = {"imgui_bundle", "moderngl_window", "pyglet", "glfw"}
GL = {"moderngl", "glcontext", "OpenGL"} | WINDOW
COMPILED = ("_kernels", "compiled")  # how the names of modules end that are compiled by numba, or by which
SLOW = WINDOW | {
    "PIL", "OpenEXR",
    "av", "cmap", "jinja2", "lzf", "matplotlib", "open3d", "plyfile", "scipy", "skimage", "tqdm",
    "DracoPy", "numba", "cattrs", "laspy", "potpourri3d", "c3d",
}  # fmt: skip


def part_of(path: Path) -> str:
    """The part of the package that a module belongs to: `scan` for viewer/scan/points.py."""
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports(nodes: Iterable[ast.AST], path: Path) -> Iterator[str]:
    """Absolute dotted names of all that the nodes import; `from a import b` gives a.b."""
    package = ["viewer", *path.relative_to(PACKAGE).parent.parts]
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            yield from (f"{base}.{alias.name}" for alias in node.names)


def run_at_import(node: ast.AST) -> Iterator[ast.AST]:
    """The node and what below it runs when the module is imported: all but function bodies and types."""
    yield node
    for child in ast.iter_child_nodes(node):
        later = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda) or for_types(child)
        if not later:
            yield from run_at_import(child)


def for_types(node: ast.AST) -> bool:
    """Whether it is `if TYPE_CHECKING:`."""
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


@cache
def all_imports(path: Path) -> set[str]:
    return set(imports(ast.walk(syntax_of(path)), path))


def called(call: ast.Call) -> str:
    """The last name of what is called."""
    return getattr(call.func, "attr", getattr(call.func, "id", ""))


def texts(node: ast.AST) -> Iterator[str]:
    """The texts in the code below a node, docstrings aside."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant):
            continue
        if isinstance(child, ast.Constant) and isinstance(child.value, str):
            yield child.value
        yield from texts(child)


def name_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


NAMES = {name_of(path) for path in modules()}


def imported_modules(path: Path) -> set[str]:
    """The package's modules that one imports: `from a import b` is a.b where that is a module, else a."""
    found = {name if name in NAMES else name.rpartition(".")[0] for name in names_at_run_time(path)}
    return {name for name in found if name in NAMES and name != name_of(path)}


@cache
def names_at_run_time(path: Path) -> set[str]:
    return set(imports(nodes_at_run_time(syntax_of(path)), path))


def nodes_at_run_time(node: ast.AST) -> Iterator[ast.AST]:
    """All but what is for types alone."""
    yield node
    for child in ast.iter_child_nodes(node):
        if not for_types(child):
            yield from nodes_at_run_time(child)


def libraries(names: Iterable[str]) -> set[str]:
    return {name.partition(".")[0] for name in names}


TOOLS_KNOW = {*KNOWN}  # of the window

# Modules of the window that know the whole app: what runs it. It may only shrink.
KNOW_THE_APP = {"__init__", "app", "loop"}


def layer_of(name: str) -> int:
    """That of the part that a dotted name begins with; the package itself gives what frames need."""
    return LAYER_OF.get((*name.split("."), "")[1], LAYER_OF["__init__"])


def test_every_part_has_a_layer() -> None:
    assert {part_of(path) for path in modules()} <= set(LAYER_OF)


def test_imports_point_down_the_layers() -> None:
    upward = [
        f"{path.relative_to(PACKAGE)} imports {name}"
        for path in modules()
        for name in all_imports(path)
        if name.split(".")[0] == "viewer" and layer_of(name) > LAYER_OF[part_of(path)]
    ]
    assert upward == []


FOUND = re.compile(
    r"(importlib\.)?import_module\("
    r"(f'\{(__name__|__package__|package)\}\.\{|extension\.module|tools\.tool_modules\(\)\[|module\))"
)


def test_modules_found_by_folder_are_all_that_is_imported_by_name() -> None:
    """`import_module` gets a folder's name and what was found in it, or an extension, no other text."""
    odd = [
        f"{path.relative_to(PACKAGE)}: {ast.unparse(node)}"
        for path in modules()
        for node in ast.walk(syntax_of(path))
        if isinstance(node, ast.Call) and called(node).endswith(("import_module", "__import__"))
        if not FOUND.match(ast.unparse(node))
    ]
    assert odd == []


def test_no_text_hides_an_import() -> None:
    """What another process is told to run counts as well: by module name, or as code."""
    hidden = [
        f"{path.relative_to(PACKAGE)}: {text[:60]!r}"
        for path in modules()
        for text in texts(syntax_of(path))
        if re.search(r"\b(from|import) viewer\b|^viewer\.[a-z]|-m viewer", text)
    ]
    assert hidden == []


def test_no_modules_import_each_other_in_a_circle() -> None:
    """What is imported where it is used counts too; in the window also what is for types alone."""
    graph = {name_of(path): sorted(imported_modules(path)) for path in modules()}
    for path in modules():
        if part_of(path) == "app" and not name_of(path).startswith("viewer.app.tools."):
            found = {name if name in NAMES else name.rpartition(".")[0] for name in all_imports(path)}
            graph[name_of(path)] = sorted(found & NAMES - {name_of(path)})
    circles = []
    seen: dict[str, int] = {}  # 1: on the way, 2: done

    def visit(name: str, way: tuple[str, ...]) -> None:
        seen[name] = 1
        for other in graph.get(name, ()):
            if seen.get(other) == 1:
                circles.append(" -> ".join([*way[way.index(other) :], other]))
            elif other not in seen:
                visit(other, (*way, other))
        seen[name] = 2

    for name in graph:
        if name not in seen:
            visit(name, (name,))
    assert circles == []


def backend_of(name: str) -> str | None:
    """The backend that a module belongs to."""
    package, _, rest = name.partition("viewer.backends.")
    return rest.partition(".")[0] if not package and rest else None


def test_no_backend_imports_another() -> None:
    """What several of them need stands below them."""
    crossed = [
        f"{name_of(path)} imports {name}"
        for path in modules()
        if (own := backend_of(name_of(path)))
        for name in imported_modules(path)
        if backend_of(name) not in (None, own)
    ]
    assert crossed == []


def test_the_gpu_layer_serves_no_single_backend() -> None:
    users: dict[str, set[str]] = {}
    for path in modules():
        for name in imported_modules(path):
            users.setdefault(name, set()).add(backend_of(name_of(path)) or "others")
    single = {name: found for name, found in users.items() if name.startswith("viewer.gpu.")}
    assert not {name: found for name, found in single.items() if len(found) == 1 and found != {"others"}}


def test_entries_have_no_underscore() -> None:
    assert {"_line", "_parsing"}.isdisjoint(command_names())
    assert not [name for name in (*backends(), *command_names()) if name.startswith("_")]


def test_tools_know_their_context_and_not_the_whole_window() -> None:
    beyond = {
        f"{path.relative_to(PACKAGE)} imports {name}"
        for path in modules()
        if name_of(path).startswith("viewer.app.tools.")
        for name in all_imports(path)
        if (inner := name.removeprefix("viewer.app.")) != name
        and not any(f"{inner}.".startswith(f"{known}.") for known in TOOLS_KNOW)
    }
    private = {
        f"{path.relative_to(PACKAGE)} reads {node.value.attr}.{node.attr}"
        for path in modules()
        if name_of(path).startswith("viewer.app.tools.")
        for node in ast.walk(syntax_of(path))
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Attribute)
        if node.value.attr == "context" and node.attr.startswith("_")
    }
    assert beyond | private == set()
    page = (PACKAGE.parent / "docs" / "developing" / "adding-a-tool.md").read_text(encoding="utf-8")
    told = re.findall(r"`viewer\.app\.([a-z_.]+)`", page)
    assert set(told) == TOOLS_KNOW - {"tools"}, "the page names what tools may import"


def test_parts_of_the_window_know_what_they_need_and_not_the_whole_app() -> None:
    knowing = {
        name_of(path).removeprefix("viewer.app.") if path != PACKAGE / "app" / "__init__.py" else "__init__"
        for path in modules()
        if part_of(path) == "app"
        if path.stem == "app" or any(f"{name}.".startswith("viewer.app.app.") for name in all_imports(path))
    }
    assert knowing - KNOW_THE_APP == set(), "hand these what they need"
    assert KNOW_THE_APP - knowing == set(), "take these from the list"


def test_scan_and_plain_values_know_no_gl() -> None:
    knowing = {
        f"{path.relative_to(PACKAGE)} imports {library}"
        for path in modules()
        if LAYER_OF[part_of(path)] < LAYER_OF["gpu"] or part_of(path) == "simulate"
        for library in libraries(all_imports(path)) & GL
    }
    assert knowing == set()


def test_raw_gl_calls_are_in_one_file() -> None:
    assert {
        path.relative_to(PACKAGE).as_posix() for path in modules() if "OpenGL" in libraries(all_imports(path))
    } <= {"gpu/gl.py"}


def test_only_the_app_knows_a_window() -> None:
    assert {part_of(path) for path in modules() if libraries(all_imports(path)) & WINDOW} <= {"app"}


def test_slow_libraries_are_imported_where_they_are_used() -> None:
    early = {
        f"{path.relative_to(PACKAGE)} imports {library}"
        for path in modules()
        if part_of(path) != "app" and not path.stem.endswith(COMPILED)
        for library in libraries(imports(run_at_import(syntax_of(path)), path)) & SLOW
    }
    assert early == set()


def test_compiled_loops_are_imported_where_they_are_used() -> None:
    """Their decorators need numba, so whoever imports them does."""
    early = {
        f"{path.relative_to(PACKAGE)} imports {name}"
        for path in modules()
        if not path.stem.endswith(COMPILED)
        for name in imports(run_at_import(syntax_of(path)), path)
        if any(part.endswith(COMPILED) for part in name.split("."))
    }
    assert early == set()


def test_importing_viewer_imports_no_slow_library() -> None:
    code = "import sys, viewer; print(*{name.partition('.')[0] for name in sys.modules})"
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=PACKAGE.parent, capture_output=True, text=True, check=True
    )
    assert set(result.stdout.split()) & SLOW == set()
