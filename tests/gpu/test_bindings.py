"""Bindings and constants stand in one table each: no other file has a number of its own."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from viewer.drawing.renderer import Renderer
from viewer.gpu import constants
from viewer.gpu.bindings import Storage, Texture, UniformBlock, bindings_glsl
from viewer.resources import resource_path

SHADERS = Path(str(resource_path("shaders")))
VIEWER = Path(__file__).resolve().parents[2] / "viewer"
# Calls that bind to a number, and layouts.
CALL = r"\.(?:bind|use|bind_images|bind_to_storage_buffer|bind_to_uniform_block)\((?:\w+=)?\d.*"
LAYOUT = r"\bbinding\s*=\s*\d.*"
# Bit patterns and numbers of gpu/constants.py, as somebody would write them in a shader.
WRITTEN_OUT = r"(?i)0xFFFFFFFF|0x7F800000|\b3e38|\b0\.7072\b|\b256u\b|\b65535|\b12\.92\b"


def texts(folder: Path, pattern: str) -> dict[str, str]:
    paths = [path for path in sorted(folder.rglob(pattern)) if path.is_file()]
    return {path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8") for path in paths}


@pytest.mark.parametrize(
    ("folder", "files", "literal", "example"),
    [
        (SHADERS, "*", LAYOUT, "layout(binding = 3) uniform samplerBuffer positions;"),
        (SHADERS, "*", WRITTEN_OUT, "const uint NOTHING = 0xffffffffu;"),
        (VIEWER, "*.py", CALL, "texture.bind(3)"),
    ],
)
def test_no_file_has_a_number_of_its_own(folder: Path, files: str, literal: str, example: str) -> None:
    assert re.search(literal, example)
    found = {file: re.findall(literal, text) for file, text in texts(folder, files).items()}
    assert len(found) > 20
    assert not {file: literals for file, literals in found.items() if literals}


def test_what_is_no_row_is_written_once() -> None:
    literal = re.compile(r"(?i)[=(<>]\s*0xFFFFFFFF")
    assert [file for file, text in texts(VIEWER, "*.py").items() if literal.search(text)] == [
        "codewords/words.py",  # which knows no scans: the index of no word
        "scan/points.py",
    ]


def test_numbers_are_within_what_every_driver_has() -> None:
    """OpenGL 4.3, table 23.60 and those around it."""
    assert max(Storage) < 8
    assert max(UniformBlock) < 72
    assert max(Texture) < 96


def test_every_binding_is_used() -> None:
    used = set(re.findall(r"\b(?:TEXTURE|STORAGE|BLOCK)_\w+", "".join(texts(SHADERS, "*").values())))
    told = set(re.findall(r"#define (\w+)", bindings_glsl()))
    assert used - told == set()
    assert told - used == {"TEXTURE_SCRATCH", "BLOCK_VIEW", "BLOCK_PARAMS"}  # named by Python alone


def test_shaders_have_the_constants(renderer: Renderer, tmp_path: Path) -> None:
    """As Python has them, bit for bit."""
    names = re.findall(r"#define (\w+)", constants.constants_glsl())
    assert {"NOTHING", "GROUP", "LEAST_RADIUS", "SRGB_POWER"} <= set(names)
    expected = [
        np.uint32(value) if isinstance(value, int) else np.float32(value).view(np.uint32)
        for value in (getattr(constants, name) for name in names)
    ]
    bits = [
        f"uint({name})" if isinstance(getattr(constants, name), int) else f"floatBitsToUint({name})"
        for name in names
    ]
    stores = "".join(f"    seen[{i}] = {word};\n" for i, word in enumerate(bits))
    file = tmp_path / "constants.comp"
    file.write_text(
        "layout(local_size_x = 1) in;\n"
        "layout(std430, binding = STORAGE_WORDS) writeonly buffer Words { uint seen[]; };\n"
        f"void main() {{\n{stores}}}\n"
    )
    gpu = renderer.gpu
    gpu.activate()
    program = gpu.compute(str(file))
    seen = gpu.ctx.buffer(reserve=4 * len(names))
    seen.bind_to_storage_buffer(Storage.WORDS)
    program.run()
    gpu.ctx.memory_barrier()
    np.testing.assert_array_equal(np.frombuffer(seen.read(), np.uint32), expected)
