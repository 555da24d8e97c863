"""Shader files: `#include`, defines, generated declarations, and compile errors that name file and line."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

from ..errors import Scan4DError
from ..resources import resource_path
from .bindings import bindings_glsl
from .blocks import Values, block_of
from .constants import constants_glsl
from .view import ViewBlock

_INCLUDE = re.compile(r'\s*#include\s+(?:"([^"]+)"|<([^>]+)>)\s*$')
# "0:12(3): error" (Mesa), "0(12) : error" (NVIDIA), "ERROR: 0:12:" (AMD, Intel)
_LOCATION = re.compile(r"\b\d+(?::(\d+)(?:\(\d+\))?|\((\d+)\))(?=\s*:)")
# Lines of a file: the number of a line says the file too, since Mesa tells 0 for the number of most files.
_LINES = 100_000
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_UNIFORMS = re.compile(r"\buniform\b([^;{]*);")  # a declaration, of one or more
_IN_BRACKETS = re.compile(r"\([^()]*\)|\[[^][]*\]")
_TABLES = bindings_glsl() + constants_glsl()


class ShaderError(Scan4DError):
    """A shader that does not compile or link, or is given what it does not declare: a mistake in the project
    or the driver."""


class Source:
    """One stage's text, put together from its file and what it includes.

    name: path under `shaders/`, or an absolute one. defines: macro name -> value. parts: what a file in angle
    brackets stands for, so that one file can serve several shapes: `#include <shape>`. params: the dataclass
    whose numbers `#include <params>` declares; `<view>` is always there, and so are, without being included,
    the macros of gpu/bindings.py and gpu/constants.py. text: all of it; body: without macros. files: what it
    is made of, in the order of their line numbers in a compiler's log.
    """

    def __init__(
        self,
        name: str,
        defines: Mapping[str, object] | None = None,
        parts: Mapping[str, str] | None = None,
        params: type[Values] | None = None,
    ) -> None:
        self.name = name
        self.files: list[str] = []
        self._parts = parts or {}
        self._params = params
        macros = "".join(f"#define {key} {value}\n" for key, value in (defines or {}).items())
        self.body = self._expand(name)
        version = 450 if "WIDE" in (defines or {}) else 430  # of 64-bit atomics, and of all else
        self.text = f"#version {version} core\n{_TABLES}{macros}{self.body}"

    @cached_property
    def uniforms(self) -> frozenset[str]:
        """The names of all uniforms that stand in it outside blocks, used or not."""
        return frozenset(
            name
            for declared in _UNIFORMS.findall(_COMMENT.sub(" ", self.text))
            for name in _declared(declared)
        )

    def _expand(self, name: str) -> str:
        text = resource_path("shaders", name).read_text(encoding="utf-8")
        return self._numbered(name, text)

    def _expand_part(self, name: str) -> str:
        if name in self._parts:
            return self._expand(self._parts[name])
        declared = {"view": ViewBlock, "params": self._params}.get(name)
        if declared is not None:
            block = block_of(declared)
            return self._numbered(f"<{name}: {block.name}>", block.glsl(name))
        raise ShaderError(f"nothing was given for <{name}>", f"shaders/{self.name}")

    def _numbered(self, name: str, text: str) -> str:
        """A text with what it includes, and where each line stands."""
        if name in self.files:
            return ""  # each once, as with #pragma once
        index = len(self.files)
        self.files.append(name)
        lines = [f"#line {index * _LINES + 1}"]
        for number, line in enumerate(text.splitlines(), start=1):
            found = _INCLUDE.match(line)
            if found is None:
                lines.append(line)
            else:
                included = self._expand(_beside(name, found[1])) if found[1] else self._expand_part(found[2])
                lines.append(included)
                lines.append(f"#line {index * _LINES + number + 1}")
        if lines[-1].startswith("#line"):
            lines.pop()  # NVIDIA takes none that nothing follows
        return "\n".join(lines) + "\n"

    def explain(self, log: str) -> str:
        """A compiler's log with file names instead of file numbers."""

        def location(match: re.Match[str]) -> str:
            index, line = divmod(int(match[1] or match[2]), _LINES)
            return f"{self.files[index]}:{line}" if index < len(self.files) else match[0]

        return _LOCATION.sub(location, log)


def _beside(name: str, included: str) -> str:
    """The name of an included file: beside the file of another package that includes it, else Scan4D's."""
    beside = Path(name).parent / included
    return str(beside) if beside.is_absolute() and beside.is_file() else included


def _declared(declaration: str) -> list[str]:
    """The names that a declaration such as `highp float a, b[2] = float[](0.0, 1.0)` declares."""
    found = 1
    while found:
        declaration, found = _IN_BRACKETS.subn(" ", declaration)
    return [each.partition("=")[0].split()[-1] for each in declaration.split(",")]


def shader_error(sources: list[Source], error: Exception) -> ShaderError:
    """The error to raise for a moderngl compile error of these stages."""
    log = str(error)
    stage = next((s for s in sources if f"{_stage_of(s.name)}_shader" in log), sources[0])
    return ShaderError(
        f"does not compile with this graphics driver:\n{stage.explain(log)}", f"shaders/{stage.name}"
    )


def _stage_of(name: str) -> str:
    suffix = name.rsplit(".", 1)[-1]
    return {"vert": "vertex", "geom": "geometry", "frag": "fragment", "comp": "compute"}.get(suffix, "")
