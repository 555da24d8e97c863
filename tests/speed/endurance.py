"""Plays and scrubs a sequence larger than the cache for so many seconds. Prints memory as it goes.

    python tests/speed/endurance.py [SECONDS]
    python tests/speed/endurance.py --pictures 5000

Ends with an error where memory went beyond its budget or grew, or the log tells of something wrong. With
--pictures, one process draws so many pictures without a window; its own memory may grow by 2 % from the first
tenth on.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "app"))
from endurance import CACHE_MB, FRAMES, POINTS, endure, own_megabytes, playing_app, problems, trouble

from viewer.backends import backends
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import shared_renderer
from viewer.drawing.request import Request
from viewer.picture.surface import Surface
from viewer.scan.open import open_scan

PICTURE = (320, 240)
GROWTH = 1.02


def own_bytes() -> int:
    """Bytes of this process that it shares with nobody, and that no file holds."""
    status = Path("/proc/self/status").read_text()
    return 1024 * int(next(line for line in status.splitlines() if line.startswith("RssAnon")).split()[1])


def draw_pictures(count: int) -> None:
    """Draw frames of the demo with each renderer in turn, from another side each, and watch memory."""
    renderer, sizes = shared_renderer(), []
    names = sorted(backends())
    every = max(1, count // 50 // len(names)) * len(names)  # after the same renderer each time
    with open_scan("demo") as timeline:
        poses = [timeline.pose(index) for index in range(4)]
        for number in range(count):
            pose, name = poses[number // len(names) % len(poses)], names[number % len(names)]
            surface = Surface(renderer.gpu, PICTURE)
            camera = Camera.orbit(pose.bounds, azimuth=number % 360, aspect=PICTURE[0] / PICTURE[1])
            if backends()[name].draws(pose):
                while render_frame(renderer, Request(pose, camera, name), surface):
                    pass
                surface.image()
            surface.release()
            if number % every == every - 1:
                sizes.append(own_bytes())
                print(f"{number + 1:6} pictures {sizes[-1] / 1e6:8.1f} MB", flush=True)
    begun = sizes[len(sizes) // 10]
    print(f"{begun / 1e6:.1f} MB after a tenth, {sizes[-1] / 1e6:.1f} MB in the end")
    if sizes[-1] > GROWTH * begun:
        sys.exit(f"memory has grown by {100 * (sizes[-1] / begun - 1):.1f} %")


def main() -> None:
    if sys.argv[1:2] == ["--pictures"]:
        draw_pictures(int(sys.argv[2]))
        return
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 600.0
    sizes: list[int] = []
    with tempfile.TemporaryDirectory() as folder, playing_app(Path(folder)) as app:
        print(f"{FRAMES} frames of {POINTS:,} points, cache of {CACHE_MB} MB")
        before = own_megabytes(app)
        print(f"{'s':>6} {'own memory, MB':>15} {'pictures':>9}")
        for now, megabytes in endure(app, seconds):
            sizes.append(megabytes)
            print(f"{now:6.0f} {megabytes:15} {app.state.pictures:9}", flush=True)
        lines = trouble(app)
    print(
        f"{before} MB before, then {min(sizes)} to {max(sizes)} MB; {len(lines)} lines of trouble in the log"
    )
    if wrong := [*problems(before, sizes), *lines[:20]]:
        sys.exit("\n".join(wrong))


if __name__ == "__main__":
    main()
