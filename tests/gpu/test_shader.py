from __future__ import annotations

from pathlib import Path

import pytest

from viewer.drawing.renderer import Renderer
from viewer.gpu import shader
from viewer.gpu.shader import ShaderError, Source


@pytest.fixture
def shaders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A shader folder of the test's own."""
    monkeypatch.setattr(shader, "resource_path", lambda *parts: tmp_path.joinpath(*parts[1:]))
    (tmp_path / "common").mkdir()
    (tmp_path / "common" / "one.glsl").write_text("float one() { return 1.0; }\n")
    return tmp_path


def test_includes_are_expanded_once_with_line_numbers(shaders: Path) -> None:
    (shaders / "a.comp").write_text('#include "common/one.glsl"\n#include <part>\nfloat last;\n')
    (shaders / "b.glsl").write_text('#include "common/one.glsl"\nfloat b;\n')
    source = Source("a.comp", {"SIZE": 3}, {"part": "b.glsl"})
    assert source.files == ["a.comp", "common/one.glsl", "b.glsl"]
    assert source.text.count("float one()") == 1
    assert source.text.startswith("#version 430 core\n")
    assert "\n#define SIZE 3\n#line 1\n#line 100001\n" in source.text
    assert source.text.rstrip().endswith("#line 3\nfloat last;")


def test_a_compile_error_names_file_and_line(shaders: Path, renderer: Renderer) -> None:
    (shaders / "common" / "bad.glsl").write_text("float fine;\nflaot wrong;\n")
    (shaders / "bad.comp").write_text(
        'layout(local_size_x = 1) in;\n#include "common/bad.glsl"\nvoid main() {}\n'
    )
    with pytest.raises(ShaderError, match=r"common/bad\.glsl:2") as caught:
        renderer.gpu.compute("bad.comp")
    assert str(caught.value).startswith("shaders/bad.comp")


def test_an_error_of_meaning_names_the_part_that_it_is_in(shaders: Path, renderer: Renderer) -> None:
    """Compilers that keep no number of the file for what parses keep that of the line."""
    (shaders / "part.glsl").write_text("float wrong() {\n    return unheard_of();\n}\n")
    (shaders / "whole.comp").write_text(
        "layout(local_size_x = 1) in;\n#include <part>\nvoid main() { wrong(); }\n"
    )
    with pytest.raises(ShaderError, match=r"part\.glsl:2"):
        renderer.gpu.compute("whole.comp", parts={"part": "part.glsl"})


def test_no_text_ends_with_the_number_of_a_line(shaders: Path) -> None:
    """NVIDIA's compiler calls such a number invalid."""
    (shaders / "common" / "two.glsl").write_text('#include "common/one.glsl"\n')
    (shaders / "a.comp").write_text('float first;\n#include "common/two.glsl"\n')
    assert Source("a.comp").text.rstrip().endswith("float one() { return 1.0; }")
    (shaders / "b.comp").write_text('#include "common/two.glsl"\nfloat last;\n')
    assert Source("b.comp").text.endswith("#line 2\nfloat last;\n")


@pytest.mark.parametrize("log", ["0:12(5): error: x", "0(12) : error C0000: x", "ERROR: 0:12: 'x' : y"])
def test_places_of_every_vendor_are_understood(shaders: Path, log: str) -> None:
    (shaders / "a.comp").write_text("\n")
    assert "a.comp:12" in Source("a.comp").explain(log)


def test_what_was_not_given_is_named(shaders: Path) -> None:
    (shaders / "a.comp").write_text("#include <params>\n")
    with pytest.raises(ShaderError, match=r"a\.comp: nothing was given for <params>"):
        Source("a.comp")


def test_a_uniform_that_no_source_declares_is_an_error(shaders: Path, renderer: Renderer) -> None:
    (shaders / "set.comp").write_text("layout(local_size_x = 1) in;\nuniform float unused;\nvoid main() {}\n")
    program = renderer.gpu.compute("set.comp")
    renderer.gpu.set(program, unused=1.0)  # the compiler took it out
    with pytest.raises(ShaderError, match=r"set\.comp: no uniform is called 'misspelt'"):
        renderer.gpu.set(program, misspelt=1.0)


def test_uniforms_are_found_however_they_are_declared(shaders: Path) -> None:
    (shaders / "a.comp").write_text("""
uniform float a, b;  // uniform float commented;
layout(location = 3) uniform highp vec2 c;
uniform mediump int d[2], e = max(1, 2), f[] = int[](1, 2);
/* uniform float out_of_use;
uniform float too; */ uniform
    sampler2D g;
layout(std140, binding = 0) uniform Block { float inside; };
""")
    assert Source("a.comp").uniforms == {*"abcdefg"}


def test_programs_are_built_once(renderer: Renderer) -> None:
    renderer.gpu.activate()  # other tests leave contexts of their own current
    one = renderer.gpu.compute("compact/covered.comp")
    assert renderer.gpu.compute("compact/covered.comp") is one
