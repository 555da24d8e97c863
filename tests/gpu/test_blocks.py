"""Blocks: what a shader reads is what the dataclass says, wherever its members lie."""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from pathlib import Path

import moderngl
import numpy as np
import pytest

from viewer.drawing.renderer import Renderer
from viewer.gpu import shader
from viewer.gpu.bindings import UniformBlock
from viewer.gpu.blocks import BlockBuffer, Mat4, Values, Vec4, block_of
from viewer.params import param


@dataclass(frozen=True)
class Everything:
    """A member of each kind; gaps of all lengths come before those that need them."""

    word: str = "for the CPU alone"
    on: bool = True
    pair: tuple[int, int] = (3, -4)
    size: int = param(-5, "Edge of something, pixels")
    four: Vec4 = (1.5, 2.5, 3.5, 4.5)
    off: bool = False
    matrix: Mat4 = ((1, 2, 3, 4), (5, 6, 7, 8), (9, 10, 11, 12), (13, 14, 15, 16))
    far: float = float("inf")
    point: tuple[float, float] = (0.25, 0.75)
    last: float = 1e39  # no float32: infinite


@dataclass(frozen=True)
class Another(Everything):
    """Another class with the same members."""


READ = """
layout(local_size_x = 1) in;
#include <params>
uniform uint item_count;
layout(std430, binding = 0) writeonly buffer Seen { float seen[]; };
void main() {
    float all[15] = float[15](float(on), float(off), float(pair.x), float(pair.y), float(size),
        four.x, four.y, four.z, four.w, matrix[0][0], matrix[2][1], far, point.x, point.y, last);
    for (int i = 0; i < 15; ++i) seen[i] = all[i];
}
"""


@pytest.fixture
def read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, renderer: Renderer):
    """What a shader finds in the block, for some values."""
    monkeypatch.setattr(shader, "resource_path", lambda *parts: tmp_path.joinpath(*parts[1:]))
    (tmp_path / "read.comp").write_text(READ)
    gpu = renderer.gpu
    gpu.activate()

    def run(values: Values) -> list[float]:
        program = gpu.compute("read.comp", params=values)
        seen = gpu.ctx.buffer(reserve=60)
        seen.bind_to_storage_buffer(0)
        gpu.dispatch(program, 1)
        return np.frombuffer(seen.read(), np.float32).tolist()

    return run


def test_a_shader_reads_each_member(read) -> None:
    numbers = [1.5, 2.5, 3.5, 4.5, 1, 10, np.inf, 0.25, 0.75, np.inf]
    assert read(Everything()) == [1, 0, 3, -4, -5, *numbers]


def test_values_are_those_of_the_last_call(read) -> None:
    first, second = Everything(), replace(Everything(), size=7, on=False)
    assert [read(values)[4] for values in (first, second, second, first)] == [-5, 7, 7, -5]
    assert read(second)[0] == 0


def test_each_program_reads_its_own_values(tmp_path: Path, read, renderer: Renderer) -> None:
    """Whichever was built last, and however it is run: two of one class, and one of another."""
    gpu = renderer.gpu
    first = gpu.compute("read.comp", {"NUMBER": 1}, params=replace(Everything(), size=1))
    second = gpu.compute("read.comp", {"NUMBER": 2}, params=replace(Everything(), size=2))
    third = gpu.compute("read.comp", params=Another(size=3))
    (tmp_path / "pixel.vert").write_text("void main() { gl_Position = vec4(0.0, 0.0, 0.0, 1.0); }\n")
    (tmp_path / "pixel.frag").write_text(
        "#include <params>\nout vec4 color;\nvoid main() { color = vec4(size); }\n"
    )
    drawn = gpu.program(("pixel.vert", "pixel.frag"), params=replace(Everything(), size=4))
    gpu.compute("read.comp", {"NUMBER": 5}, params=replace(Everything(), size=5))

    seen = gpu.ctx.buffer(reserve=60)
    seen.bind_to_storage_buffer(0)
    groups = gpu.ctx.buffer(struct.pack("3I", 1, 1, 1))
    for program, size in ((first, 1), (second, 2), (third, 3), (first, 1)):
        gpu.dispatch(program, 1)
        assert np.frombuffer(seen.read(), np.float32)[4] == size
        seen.clear()
        gpu.dispatch_indirect(program, groups)
        assert np.frombuffer(seen.read(), np.float32)[4] == size
    target = gpu.ctx.framebuffer([gpu.ctx.texture((1, 1), 4, dtype="f4")])
    target.use()
    gpu.ctx.enable_only(moderngl.NOTHING)
    with gpu.vertices(drawn) as vertices:
        vertices.render(moderngl.POINTS, vertices=1)
    assert np.frombuffer(target.read(components=1, dtype="f4"), np.float32) == 4


def test_what_did_not_change_is_not_written_again(renderer: Renderer) -> None:
    gpu = renderer.gpu
    gpu.activate()
    buffer = BlockBuffer(gpu.ctx, Everything, UniformBlock.PARAMS)
    buffer.write(Everything())
    buffer._buffer.write(b"mark")
    buffer.write(Everything(word="another"))
    assert buffer._buffer.read(4) == b"mark"
    buffer.write(Everything(on=False))
    assert buffer._buffer.read(4) == bytes(4)
    buffer.release()


def test_the_declaration_is_readable() -> None:
    lines = block_of(Everything).glsl("params").splitlines()
    assert lines[0] == "layout(std140, binding = 2) uniform Params {"
    assert "    int size;  // Edge of something, pixels" in lines
    assert "    ivec2 pair;" in lines
    assert not any("word" in line for line in lines)


def test_a_block_is_whole_vec4s() -> None:
    packed = block_of(Everything).pack(Everything())
    assert len(packed) == 10 * 16
    assert np.frombuffer(packed, np.int32)[[0, 2, 3, 4]].tolist() == [1, 3, -4, -5]


def test_what_a_block_cannot_hold_is_named() -> None:
    @dataclass(frozen=True)
    class Wrong:
        names: list[str]

    @dataclass(frozen=True)
    class Empty:
        word: str = ""

    with pytest.raises(TypeError, match=r"Wrong\.names: a uniform block cannot hold list"):
        block_of(Wrong)
    with pytest.raises(TypeError, match="Empty has no number"):
        block_of(Empty)
