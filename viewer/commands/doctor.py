"""Report whether Scan4D can draw here, and what is missing."""

from __future__ import annotations

import os
import platform
import re
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator

from .. import __version__
from ..analysis.measures.kinds import measure_kinds
from ..backends import backends
from ..errors import NoOpenGLError
from ..extensions import check_import, extension_problems, installed_extensions
from ..gpu.context import REQUIRED_EXTENSIONS, Attempts, Gpu, headless
from ..gpu.shader_cache import shader_cache
from ..scan.formats import known_suffixes

# What decides how large pictures and poses may be, and how work is cut up.
_LIMITS = (
    "GL_MAX_SHADER_STORAGE_BLOCK_SIZE",
    "GL_MAX_TEXTURE_BUFFER_SIZE",
    "GL_MAX_TEXTURE_SIZE",
    "GL_MAX_VIEWPORT_DIMS",
    "GL_MAX_COMPUTE_WORK_GROUP_COUNT",
    "GL_MAX_COMPUTE_WORK_GROUP_INVOCATIONS",
    "GL_MAX_GEOMETRY_OUTPUT_VERTICES",
    "GL_MAX_UNIFORM_BLOCK_SIZE",
)
# Not needed, but of use where they are.
_OPTIONAL_EXTENSIONS = (
    "GL_ARB_buffer_storage",
    "GL_ARB_gpu_shader_int64",
    "GL_ARB_timer_query",
    "GL_KHR_debug",
    "GL_KHR_shader_subgroup",
    "GL_NV_shader_atomic_int64",
)
_MOST_DEVICES = 16
_WITHOUT_GL = (
    "Scan4D can draw pictures without OpenGL: 'scan4d render SCAN --backend codeword --no-gl -o picture.png'."
)


def add_arguments(parser: ArgumentParser) -> None:
    """`scan4d doctor` has no arguments of its own."""


def run(args: Namespace) -> int:
    """Print it; 0 where Scan4D can draw, else 3."""
    attempts, gpu, trouble = Attempts(), None, None
    try:
        gpu = headless(args.device, attempts)
    except NoOpenGLError as error:
        trouble = error
    sections = {
        "OpenGL, tried": attempts.log,
        "OpenGL": _driver(gpu) if gpu else [],
        "Extensions": _extensions(gpu) if gpu else [],
        "Devices (--device)": list(_devices()),
        "Window": [("display", display() or "none: neither DISPLAY nor WAYLAND_DISPLAY is set")],
        "Software": _software(),
        "Extensions of other packages": list(_from_other_packages()),
    }
    for title, rows in sections.items():
        if rows:
            width = max(len(name) for name, _ in rows)
            print(f"{title}\n" + "\n".join(f"  {name:{width}}  {value}" for name, value in rows) + "\n")
    if trouble is None:
        print("Scan4D can draw here." if display() else "Scan4D can draw here, but not open a window.")
        return 0
    print(f"Scan4D cannot draw with OpenGL here. {trouble.hint}")
    print(_WITHOUT_GL)
    return trouble.exit_code


def display() -> str | None:
    """The display that a window would open on; None where there is none."""
    if not sys.platform.startswith("linux"):
        return "the system's"
    for variable in ("WAYLAND_DISPLAY", "DISPLAY"):
        if os.environ.get(variable):
            return f"{variable}={os.environ[variable]}"
    return None


def _driver(gpu: Gpu) -> list[tuple[str, str]]:
    info = gpu.ctx.info
    limits = [(name.removeprefix("GL_").lower(), _number(info[name])) for name in _LIMITS if name in info]
    return [
        ("device", gpu.device),
        ("vendor", info["GL_VENDOR"]),
        ("version", gpu.driver),
        ("kind", "software" if gpu.software else "hardware"),
        ("pass timer", gpu.timers.kind),
        ("largest picture", f"{gpu.max_pixels:,} pixels"),
        ("largest pose", f"{gpu.max_points:,} points"),
        *([("shader cache", cache)] if (cache := shader_cache()) else []),
        *limits,
    ]


def _number(value: object) -> str:
    return f"{value:,}" if isinstance(value, int) else str(value)


def _extensions(gpu: Gpu) -> list[tuple[str, str]]:
    def row(name: str, role: str) -> tuple[str, str]:
        return name, f"{'yes' if name in gpu.ctx.extensions else 'no'} ({role})"

    return [row(n, "needed") for n in REQUIRED_EXTENSIONS] + [
        row(n, "optional") for n in _OPTIONAL_EXTENSIONS
    ]


def _devices() -> Iterator[tuple[str, str]]:
    """EGL's devices and what each gives."""
    if not sys.platform.startswith("linux"):
        return
    for device in range(_MOST_DEVICES):
        attempts = Attempts()
        try:
            headless(device, attempts).ctx.release()
        except NoOpenGLError as error:
            if "requested device index" in str(error):  # glcontext: there is no such device
                return
        yield str(device), attempts.log[-1][1]


def _software() -> list[tuple[str, str]]:
    """Versions of this program, of Python, and of the libraries that it needs."""
    return [
        ("scan4d", __version__),
        ("Python", f"{platform.python_version()} ({sys.executable})"),
        ("system", platform.platform()),
        *_libraries(),
    ]


def _from_other_packages() -> Iterator[tuple[str, str]]:
    """Extensions of other packages: where each comes from, or why it cannot be used."""
    extensions = installed_extensions()
    if not extensions:
        return
    backends(), measure_kinds(), known_suffixes()
    for extension in extensions:
        if extension.kind == "tools":
            check_import(extension)
        found = f"{extension.package}, module {extension.module}"
        yield (
            f"{extension.kind.removesuffix('s')} {extension.name}",
            extension_problems().get(extension, found),
        )


def _libraries() -> Iterator[tuple[str, str]]:
    from importlib import metadata  # 15 ms

    try:
        requirements = metadata.requires("scan4d") or []
    except metadata.PackageNotFoundError:
        return
    for requirement in requirements:
        name = re.split(r"[^\w.-]", requirement)[0]
        _, _, condition = requirement.partition(";")
        if "extra ==" in condition:
            continue
        try:
            yield name, metadata.version(name)
        except metadata.PackageNotFoundError:
            if not condition:  # those for other machines may be missing
                yield name, f"missing: pip install '{requirement}'"
