"""Memory that runs out while a picture is drawn: one error, and the next picture is drawn as ever."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from viewer.drawing.renderer import Renderer
from viewer.errors import Scan4DError

ROOT = Path(__file__).resolve().parents[2]
SHORT_OF_MEMORY = """
import resource, sys
from pathlib import Path
from viewer.camera import Camera
from viewer.errors import Scan4DError
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import shared_renderer
from viewer.drawing.request import Request
from viewer.picture.surface import Surface
from viewer.scan.open import open_scan

renderer, pose = shared_renderer(), open_scan("demo").pose(0)

def drawn(size):
    surface = Surface(renderer.gpu, size)
    camera = Camera.orbit(pose.bounds, aspect=size[0] / size[1])
    while render_frame(renderer, Request(pose, camera, sys.argv[1]), surface):
        pass
    return surface.image()

before = drawn((64, 48))
held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (held + (150 << 20), resource.RLIM_INFINITY))
try:
    drawn((5000, 5000))
except Scan4DError as error:
    print(error)
print((drawn((64, 48)) == before).all())
"""


def test_a_buffer_without_memory_is_an_error(renderer: Renderer) -> None:
    gpu = renderer.gpu
    if not gpu.software:
        pytest.skip("drivers of graphics cards may reserve memory only when a buffer is used")
    with pytest.raises(Scan4DError, match=r"not enough memory.*Use a smaller picture"):
        gpu.buffer(reserve=1 << 42)
    assert gpu.ctx.error == "GL_NO_ERROR"
    values = np.arange(4, dtype="u4")
    np.testing.assert_array_equal(np.frombuffer(gpu.buffer(values).read(), "u4"), values)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of memory as Linux has them")
@pytest.mark.parametrize(
    "backend", ["points", *(pytest.param(name, marks=pytest.mark.slow) for name in ("surfels", "pyramidal"))]
)
def test_a_picture_without_memory_is_an_error_and_the_next_is_whole(backend: str) -> None:
    command = [sys.executable, "-c", SHORT_OF_MEMORY, backend]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    said, same = done.stdout.splitlines()
    assert re.fullmatch(
        r"not enough memory( on the graphics card)? for this picture\. "
        "Use a smaller picture, or close other programs",
        said,
    )
    assert same == "True"
