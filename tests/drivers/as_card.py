"""A pytest plugin: the driver is taken for that of a graphics card, and moves corners as one.

Scan4D makes the choices that it makes on a card. The rasteriser moves corners to a grid
(viewer/bench/rounding.py).

PYTHONPATH=tests/drivers python -m pytest -p as_card tests/backends
"""

from __future__ import annotations

import pytest

from viewer.gpu import context
from viewer.gpu.shader import Source

_STEPS = 256  # a pixel, of GL_SUBPIXEL_BITS
_CLIP = "    if (view_perspective) return vec4(at, view_near, depth);\n"  # of common/view.glsl
_MOVED = f"""    float w = view_perspective ? depth : 1.0;
    vec2 steps = roundEven((at / w * 0.5 + 0.5) * view_size * {_STEPS}.0);
    if (w > 0.0) at = (steps / (vec2(view_size) * {_STEPS}.0) * 2.0 - 1.0) * w;
"""


@pytest.fixture(scope="session", autouse=True)
def as_card() -> None:
    """Let no name of a driver say that it draws in software, and move corners. Processes that tests start are
    not changed."""
    context._SOFTWARE = ()
    plain = Source._numbered

    def numbered(source: Source, name: str, text: str) -> str:
        if name == "common/view.glsl":
            assert _CLIP in text
            text = text.replace(_CLIP, _MOVED + _CLIP)
        return plain(source, name, text)

    Source._numbered = numbered  # type: ignore[method-assign]
