"""Modules that extend Scan4D: its own, found by folder, and those of other packages, found by entry points.

Backends, readers, tools and measures are modules of a form that their folder's docstring describes. Another
package names its module in its `pyproject.toml`:

    [project.entry-points."scan4d.backends"]
    dots = "scan4d_dots"

A package that cannot be used is reported once, as a warning of the log `viewer.extensions` and in `problems`,
and Scan4D goes on without it. A name belongs to Scan4D first, then to the package whose name comes first.
"""

from __future__ import annotations

import logging
import os
import pkgutil
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from types import ModuleType

from .errors import InputError, Scan4DError

KINDS = ("backends", "readers", "tools", "measures")
_GROUP = "scan4d."  # in front of the kind
_METADATA = (".dist-info", ".egg-info")  # how the names of folders end that describe installed packages
_LONGEST = 300  # characters of a library's message

log = logging.getLogger(__name__)
_problems: dict[Extension, str] = {}


@dataclass(frozen=True)
class Extension:
    """A module of another package.

    kind: one of `KINDS`. name: of the entry point. module: its dotted name. package: name and version of the
    distribution that brings it, such as "scan4d-dots 1.0".
    """

    kind: str
    name: str
    module: str
    package: str


def names_in(folder: Iterable[str]) -> list[str]:
    """The names of Scan4D's own modules in a package's `__path__`, sorted. None is imported."""
    return sorted(module.name for module in pkgutil.iter_modules(folder) if not module.name.startswith("_"))


def load_modules(
    kind: str, package: str, folder: Iterable[str], add: Callable[[str, ModuleType], object]
) -> None:
    """Import all modules of a kind and hand each to `add`, by name: Scan4D's own, then those of others.

    package, folder: `__name__` and `__path__` of the package that holds Scan4D's own. add: raises InputError
    for a module that cannot be used, such as one with a name that is taken.
    """
    own = names_in(folder)
    for name in own:
        add(name, import_module(f"{package}.{name}"))
    for extension in extensions_of(kind, own):
        if extension in _problems:
            continue
        with reported(extension):
            add(extension.name, import_module(extension.module))


def extensions_of(kind: str, own: Iterable[str]) -> list[Extension]:
    """List what other packages bring of a kind, by package and name. None is imported.

    own: names of Scan4D's own modules. A second extension of one name is left out and reported.
    """
    holders = dict.fromkeys(own, "Scan4D")
    found = []
    for extension in (each for each in installed_extensions() if each.kind == kind):
        if (holder := holders.get(extension.name)) is None:
            holders[extension.name] = extension.package
            found.append(extension)
        elif extension not in _problems:
            _report(extension, f"is not used: {holder} already has this name", "Rename its entry point")
    return found


def check_import(extension: Extension) -> None:
    """Import an extension, and report where that fails."""
    with reported(extension):
        import_module(extension.module)


def package_of(module: str) -> str:
    """Name and version of the package that extends Scan4D by a module, or one beside it; "" for Scan4D."""
    top = module.partition(".")[0]
    found = (each.package for each in installed_extensions() if each.module.partition(".")[0] == top)
    return next(found, "")


def extension_problems() -> dict[Extension, str]:
    """Extensions that cannot be used, each with its message, as far as they have been loaded."""
    return dict(_problems)


@contextmanager
def reported(extension: Extension) -> Iterator[None]:
    """Report whatever goes wrong inside, which the extension causes, as one message."""
    try:
        yield
    except InputError as error:
        _report(extension, f"is not used: {error.what}", error.hint)
    except (Exception, SystemExit) as error:
        said = str(error) if isinstance(error, Scan4DError) else " ".join(f"{error}".split())[:_LONGEST]
        _report(extension, f"cannot be imported ({type(error).__name__}: {said})")


def _report(extension: Extension, what: str, hint: str | None = None) -> None:
    name, _, _ = extension.package.partition(" ")
    remedy = f"{hint or 'Update the package'}, or remove it: {sys.executable} -m pip uninstall {name}"
    title = f"The {extension.kind.removesuffix('s')} '{extension.name}' of {extension.package}"
    _problems[extension] = f"{title} {what}. {remedy}"
    log.warning("%s", _problems[extension])


@cache
def installed_extensions() -> tuple[Extension, ...]:
    """The extensions of all installed packages, by package, kind and name. None is imported."""
    if not _is_any_named():
        return ()
    from importlib.metadata import entry_points

    found = [
        Extension(kind, entry.name, entry.module, f"{entry.dist.name} {entry.dist.version}")
        for kind in KINDS
        for entry in entry_points(group=_GROUP + kind)
        if entry.dist
    ]
    return tuple(sorted(found, key=lambda each: (each.package, KINDS.index(each.kind), each.name)))


def _is_any_named() -> bool:
    """Whether an installed package names an extension: a look at small files, a tenth of what it takes to
    import `importlib.metadata`."""
    for folder in sys.path:
        with suppress(OSError):
            for name in os.listdir(folder or "."):
                if name.endswith(_METADATA) and _names_one(os.path.join(folder, name, "entry_points.txt")):
                    return True
    return False


def _names_one(path: str) -> bool:
    with suppress(OSError), open(path, "rb") as stream:
        return f"[{_GROUP}".encode() in stream.read()
    return False
