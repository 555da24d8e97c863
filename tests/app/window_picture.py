"""Take docs/pictures/window*.png anew: the window as a user sees it, with the demo.

    python tests/app/window_picture.py [FOLDER]

window.png: a distance between the eyes. window-landmarks.png: landmarks of a face, tracked, with the
plot of their measures. window-dense-tracking.png: displacements of a face. window-deviation.png: how far a
smile is from the face at rest. Needs Xvfb and xdotool.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from experiments.landmarks.places import truth_places
from PIL import Image
from virtual_screen import PANEL, ROOT, RunningApp, running_app, virtual_screen

from viewer.analysis.landmarks.templates import templates
from viewer.camera import Camera
from viewer.geometry import vector

SIZE = (1280, 800)
FRAME = 20  # in which the mouth of demo:sway is open
SMILE = 30  # the frame of demo:smile that smiles
EYES = ("endocanthion right", "endocanthion left")
# Landmarks of the template, by the places of the demo's face. The others are skipped.
CLICKED = {
    "g": "glabella", "n": "nasion", "prn": "pronasale", "sn": "subnasale", "ls": "labiale superius",
    "li": "labiale inferius", "pg": "pogonion",
    **{
        short + side[0].upper(): f"{place} {side}"
        for short, place in (
            ("en", "endocanthion"), ("ex", "exocanthion"), ("al", "alare"), ("cph", "crista philtri"),
            ("ch", "cheilion"),
        )
        for side in ("left", "right")
    },
}  # fmt: skip


def click(app: RunningApp, place: str) -> None:
    """Click a place of the demo's face, as the first frame has it."""
    left, top, width, height = app.view()
    spot = Camera.from_json(app.state.camera).place_in_picture(vector(truth_places([place])[0]))
    assert spot is not None
    x, y = left + width / 2 + spot[0] * height, top + height / 2 - spot[1] * height
    app.screen.do("mousemove", round(x), round(y), "click", 1)
    app.settle()


def measured(app: RunningApp) -> None:
    """A distance between the eyes."""
    app.press("m")
    for eye in EYES:
        click(app, eye)
    app.press("Escape")


def tracked(app: RunningApp) -> None:
    """Landmarks of the face, and the plot of their measures."""
    app.choose(PANEL, "##template", "###template face-21")
    app.see(clicking="landmarks")
    for landmark in templates()["face-21"].landmarks:
        if landmark.name in CLICKED:
            click(app, CLICKED[landmark.name])
        else:
            app.press("x")
    app.press("Escape", "v")


def followed(app: RunningApp) -> None:
    """How the face has moved against the head, by colours."""
    app.press("shift+d", "u", *["Right"] * FRAME)


def compared(app: RunningApp) -> None:
    """How far the smile is from the face at rest."""
    app.press("shift+m", *["Right"] * SMILE)


PICTURES: dict[str, tuple[str, Callable[[RunningApp], None]]] = {
    "window": ("demo", measured),
    "window-landmarks": ("demo:smile", tracked),
    "window-dense-tracking": ("demo:sway", followed),
    "window-deviation": ("demo:smile", compared),
}


def main() -> None:
    """Start the window for each picture, do what it is to show, and save what the screen shows."""
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "pictures"
    for name, (scan, do) in PICTURES.items():
        with tempfile.TemporaryDirectory() as folder, virtual_screen(Path(folder), SIZE) as screen:
            home = Path(folder) / "home"
            home.mkdir()
            with running_app(screen, home, scan) as app:
                app.send_notes_away()
                do(app)
                screen.do("mousemove", SIZE[0] - 1, SIZE[1] - 1)
                app.send_notes_away()
                Image.fromarray(screen.picture()).save(out / f"{name}.png")


if __name__ == "__main__":
    main()
