"""Whether memory stays within its bounds while the window plays for long, and while many pictures are drawn.

`playing` plays and scrubs a sequence larger than the cache for --seconds. It fails where memory goes beyond
its budget or grows, or the log has something wrong. `pictures` draws frames of the demo in one process
without a window, with each renderer in turn, from another side each. Its own memory may grow by 2 % from the
first tenth on."""

from __future__ import annotations

import tempfile
from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path

from endurance import endure, own_megabytes, playing_app, problems, trouble

from experiments.pictures import draw, renderer
from experiments.script import Failed, Script
from experiments.tables import Row
from viewer.backends import backends
from viewer.camera import Camera
from viewer.drawing.request import Request
from viewer.picture.surface import Surface
from viewer.scan.open import open_scan

PICTURE = (320, 240)
GROWTH = 1.02


def own_bytes() -> int:
    """Bytes of this process that it shares with nobody, and that no file holds."""
    status = Path("/proc/self/status").read_text()
    return 1024 * int(next(line for line in status.splitlines() if line.startswith("RssAnon")).split()[1])


def playing(options: Namespace) -> Iterator[Row]:
    """Memory after each round. Raises Failed."""
    sizes: list[int] = []
    with tempfile.TemporaryDirectory() as folder, playing_app(Path(folder)) as app:
        before = own_megabytes(app)
        for now, megabytes in endure(app, options.seconds):
            sizes.append(megabytes)
            yield {"s": f"{now:.0f}", "own memory, MB": megabytes, "pictures": app.state.pictures}
        lines = trouble(app)
    if wrong := [*problems(before, sizes), *lines[:20]]:
        raise Failed("\n".join(wrong))


def pictures(options: Namespace) -> Iterator[Row]:
    """Memory after each fiftieth of the pictures. Raises Failed."""
    sizes, names, count = [], sorted(backends()), options.pictures
    every = max(1, count // 50 // len(names)) * len(names)  # after the same renderer each time
    with open_scan("demo") as timeline:
        poses = [timeline.pose(index) for index in range(4)]
        for number in range(count):
            pose, name = poses[number // len(names) % len(poses)], names[number % len(names)]
            surface = Surface(renderer().gpu, PICTURE)
            camera = Camera.orbit(pose.bounds, azimuth=number % 360, aspect=PICTURE[0] / PICTURE[1])
            if backends()[name].draws(pose):
                draw(Request(pose, camera, name), surface)
                surface.image()
            surface.release()
            if number % every == every - 1:
                sizes.append(own_bytes())
                yield {"pictures": number + 1, "own memory, MB": sizes[-1] / 1e6}
    begun = sizes[len(sizes) // 10]
    if sizes[-1] > GROWTH * begun:
        raise Failed(f"memory has grown by {100 * (sizes[-1] / begun - 1):.1f} %")


EXPERIMENT = Script([playing, pictures], {"seconds": 600.0, "pictures": 5000})
