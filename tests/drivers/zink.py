"""Runs pytest on a second driver, Mesa's Zink: OpenGL over Vulkan, by another compiler.

    python tests/drivers/zink.py tests/gpu tests/backends -m "not slow"

Where Zink is missing it says so and counts as passed.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile

_PROBE = """
import moderngl
print(moderngl.create_context(standalone=True, require=430, backend="egl").info["GL_RENDERER"])
"""


def main() -> int:
    """The exit code of pytest."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {
            "XDG_RUNTIME_DIR": folder,  # which Vulkan asks for
            **os.environ,
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "GALLIUM_DRIVER": "zink",
        }
        probe = subprocess.run(
            [sys.executable, "-c", _PROBE], env=environment, capture_output=True, text=True, check=False
        )
        driver = probe.stdout.strip()
        if not driver.startswith("zink"):
            print(f"no Zink here ({driver or 'no OpenGL'}); Debian has it in mesa-vulkan-drivers")
            return 1
        print(f"on {driver}", flush=True)
        return subprocess.call([sys.executable, "-m", "pytest", *sys.argv[1:]], env=environment)


if __name__ == "__main__":
    sys.exit(main())
