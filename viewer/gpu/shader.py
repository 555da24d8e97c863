"""Shader files: `#include`, defines, and compile errors that name file and line."""

from __future__ import annotations

import re
from collections.abc import Mapping

from ..errors import Scan4DError
from ..resources import resource_path

_INCLUDE = re.compile(r'\s*#include\s+(?:"([^"]+)"|<([^>]+)>)\s*$')
# "0:12(3): error" (Mesa), "0(12) : error" (NVIDIA), "ERROR: 0:12:" (AMD, Intel)
_PLACE = re.compile(r"\b(\d+)(?::(\d+)(?:\(\d+\))?|\((\d+)\))(?=\s*:)")
_HEADER = "#version 430 core\n"


class ShaderError(Scan4DError):
    """A shader that does not compile or link: a mistake in the project or the driver."""


class Source:
    """One stage's text, put together from its file and what it includes.

    name: path under `shaders/`. defines: macro name -> value. parts: what a file in angle
    brackets stands for, so that one file can serve several shapes: `#include <shape>`.
    """

    def __init__(
        self, name: str, defines: Mapping[str, object] | None = None, parts: Mapping[str, str] | None = None
    ) -> None:
        self.name = name
        self.files: list[str] = []
        self._parts = parts or {}
        macros = "".join(f"#define {key} {value}\n" for key, value in (defines or {}).items())
        self.text = _HEADER + macros + self._expand(name)

    def _expand(self, name: str) -> str:
        if name in self.files:
            return ""  # each file once, as with #pragma once
        index = len(self.files)
        self.files.append(name)
        lines = [f"#line 1 {index}"]
        text = resource_path("shaders", *name.split("/")).read_text(encoding="utf-8")
        for number, line in enumerate(text.splitlines(), start=1):
            found = _INCLUDE.match(line)
            if found is None:
                lines.append(line)
            else:
                lines.append(self._expand(found[1] or self._parts[found[2]]))
                lines.append(f"#line {number + 1} {index}")
        return "\n".join(lines) + "\n"

    def explain(self, log: str) -> str:
        """A compiler's log with file names in the place of file numbers."""

        def place(match: re.Match[str]) -> str:
            index = int(match[1])
            line = match[2] or match[3]
            return f"{self.files[index]}:{line}" if index < len(self.files) else match[0]

        return _PLACE.sub(place, log)


def shader_error(sources: list[Source], error: Exception) -> ShaderError:
    """The error to raise for a moderngl compile error of these stages."""
    log = str(error)
    stage = next((s for s in sources if f"{_stage_of(s.name)}_shader" in log), sources[0])
    return ShaderError(f"does not compile on this driver:\n{stage.explain(log)}", f"shaders/{stage.name}")


def _stage_of(name: str) -> str:
    suffix = name.rsplit(".", 1)[-1]
    return {"vert": "vertex", "geom": "geometry", "frag": "fragment", "comp": "compute"}.get(suffix, "")
