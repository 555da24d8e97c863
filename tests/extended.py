"""Packages that extend Scan4D, installed into folders of their own, and commands run with them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGES = {
    "backend": "scan4d-dots",
    "reader": "scan4d-stl",
    "measure": "scan4d-triangle",
    "tool": "scan4d-pins",
}
MOST_LINES = 100  # of the package of a page


def write_package(kind: str, folder: Path) -> Path:
    """Write the package of the page docs/developing/adding-a-KIND.md into a folder; where it is."""
    page = (ROOT / "docs" / "developing" / f"adding-a-{kind}.md").read_text(encoding="utf-8")
    files = re.findall(r"`(scan4d-[\w/.-]+\.\w+)`:\n\n```\w+\n(.*?)```", page, re.DOTALL)
    assert sum(text.count("\n") for _, text in files) <= MOST_LINES
    for name, text in files:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return folder / PAGES[kind]


def write_installed(
    target: Path, package: str, modules: Mapping[str, str], entry_points: Mapping[str, Mapping[str, str]]
) -> None:
    """Lay out a package as pip installs it. package: "NAME VERSION". entry_points: kind -> name -> module."""
    name, version = package.split()
    described = target / f"{name.replace('-', '_')}-{version}.dist-info"
    described.mkdir(parents=True)
    (described / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    lines = [
        line
        for kind, entries in entry_points.items()
        for line in (f"[scan4d.{kind}]", *(f"{key} = {module}" for key, module in entries.items()), "")
    ]
    (described / "entry_points.txt").write_text("\n".join(lines))
    for module, text in modules.items():
        (target / f"{module}.py").write_text(text)


def use_tools(folder: Path, package: str = "acme-tools 1.0") -> str:
    """Describe the modules of a folder as tools of a package; Python that makes a process find it."""
    names = {path.stem: f"{folder.name}.{path.stem}" for path in sorted(folder.glob("*.py"))}
    write_installed(folder.parent, package, {}, {"tools": names})
    return f"import sys; sys.path.insert(0, {str(folder.parent)!r})\n"


def pip_install(source: Path, target: Path) -> None:
    """Build and install a package into a folder, without a network."""
    options = ["--no-index", "--no-deps", "--no-build-isolation", "--disable-pip-version-check", "--quiet"]
    command = [sys.executable, "-m", "pip", "install", *options, "--target", str(target), str(source)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def run_with(target: Path, *words: str | Path) -> subprocess.CompletedProcess[str]:
    """Run Python with what is installed in a folder: run_with(target, "-m", "viewer", "doctor")."""
    environment = environment_with(target)
    return subprocess.run(
        [sys.executable, *map(str, words)], capture_output=True, text=True, env=environment, cwd=target
    )


def environment_with(*targets: Path) -> dict[str, str]:
    """The variables of a process that finds what is installed in these folders, and this Scan4D."""
    path = _joined([*map(str, targets), str(ROOT), os.environ.get("PYTHONPATH", "")])
    return {**os.environ, "PYTHONPATH": path}


def _joined(paths: Sequence[str]) -> str:
    return os.pathsep.join(path for path in paths if path)
