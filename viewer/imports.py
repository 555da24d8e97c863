"""Importing: libraries that are missing, and many modules in less time."""

from __future__ import annotations

import gc
import sys

TYPE_CHECKING = False  # as `typing` has it, which takes its time to import
if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import FrameType, ModuleType

    from .errors import MissingPackageError

# What Scan4D imports, and what pip installs it as: dependencies and extras of pyproject.toml.
PACKAGES = {
    "DracoPy": "DracoPy",
    "OpenEXR": "OpenEXR",
    "OpenGL": "PyOpenGL",
    "PIL": "pillow",
    "av": "av",
    "c3d": "c3d",
    "cattrs": "cattrs",
    "cmap": "cmap",
    "filelock": "filelock",
    "flip_evaluator": "flip-evaluator",
    "glfw": "glfw",
    "imgui_bundle": "imgui-bundle",
    "jinja2": "jinja2",
    "laspy": "'laspy[lazrs]'",
    "lzf": "python-neo-lzf",
    "markupsafe": "jinja2",
    "matplotlib": "matplotlib",
    "moderngl": "moderngl",
    "moderngl_window": "moderngl-window",
    "numba": "numba",
    "numpy": "numpy",
    "open3d": "open3d-cpu" if sys.platform == "linux" else "open3d",
    "platformdirs": "platformdirs",
    "potpourri3d": "potpourri3d",
    "scipy": "scipy",
    "skimage": "scikit-image",
    "tqdm": "tqdm",
}


def require(*names: str) -> None:
    """Raise MissingPackageError where one of these libraries is not installed, before work begins.

    names: as `PACKAGES` lists them.
    """
    from importlib.machinery import PathFinder

    if missing := [name for name in names if PathFinder.find_spec(name) is None]:
        raise missing_packages(*missing)


def missing_packages(*names: str) -> MissingPackageError:
    """The error for libraries that are not installed, by the names that `PACKAGES` lists."""
    from .errors import MissingPackageError

    what = f"Scan4D needs packages that are not installed: {', '.join(names)}"
    packages = " ".join(PACKAGES[name] for name in names)
    error = MissingPackageError(
        what, hint=f"Install the missing packages: {sys.executable} -m pip install {packages}"
    )
    error.name = names[0]
    return error


def explain_missing_packages() -> None:
    """Let imports by Scan4D raise MissingPackageError where a dependency is not installed."""
    if _Missing not in sys.meta_path:
        sys.meta_path.append(_Missing)


class _Missing:
    """The last finder of modules, asked where no other found one.

    Other libraries try imports and go on without: theirs fail as ever.
    """

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> None:
        if name in PACKAGES and _importer().partition(".")[0] == __name__.partition(".")[0]:
            raise missing_packages(name)


def _importer() -> str:
    """The name of the module whose import runs."""
    frame = sys._getframe(2)
    while _name(frame).partition(".")[0] in ("importlib", "_frozen_importlib") and frame.f_back:
        frame = frame.f_back
    return _name(frame)


def _name(frame: FrameType) -> str:
    return str(frame.f_globals.get("__name__", ""))


class uncollected:
    """A context in which Python's collector of cycles rests.

    What modules are made of stays: going through it again and again takes a seventh of the time that the
    window's modules take to import.
    """

    def __enter__(self) -> None:
        self._was_enabled = gc.isenabled()
        gc.disable()

    def __exit__(self, *_: object) -> None:
        if self._was_enabled:
            gc.enable()
