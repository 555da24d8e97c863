"""Take docs/pictures/window.png anew: the window with the demo, a distance measured between its eyes.

    python tests/app/window_picture.py [FILE]

Needs Xvfb and xdotool.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from PIL import Image
from virtual_screen import ROOT, SIZE, running_app, virtual_screen

NOTES = 10  # seconds, after which those of the start are gone
EYES = ((418, 331), (532, 331))  # below them, pixels of the screen


def main() -> None:
    """Start the window, measure, and save what the screen shows."""
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "pictures" / "window.png"
    with tempfile.TemporaryDirectory() as folder, virtual_screen(Path(folder), SIZE) as screen:
        home = Path(folder) / "home"
        home.mkdir()
        with running_app(screen, home, "demo") as app:
            screen.do("key", "m")
            for x, y in EYES:
                screen.do("mousemove", x, y, "click", 1)
                app.settle()
            screen.do("key", "Escape", "mousemove", SIZE[0] - 1, SIZE[1] - 1)
            app.settle()
            screen.do("sleep", NOTES)
            app.settle()
            Image.fromarray(screen.picture()).save(path)


if __name__ == "__main__":
    main()
