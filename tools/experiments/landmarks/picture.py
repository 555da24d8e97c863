"""The picture of docs/how-it-works/landmarks.md: tracked and true paths of landmarks over the demo.

The scan has no two frames with the same points: two pods measure `demo:smile:1` with a noise of 0.1 mm.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator

import numpy as np

from experiments.landmarks.known import scanned_demo
from experiments.landmarks.landmark_judge import keyed_landmarks
from experiments.pictures import drawn, request
from experiments.script import Script
from experiments.suite import DOCS
from experiments.tables import Row
from viewer.analysis.curves import Smoothing
from viewer.analysis.tracking import track_landmarks
from viewer.analysis.trajectories import trajectory_of
from viewer.bounds import Bounds
from viewer.camera import Camera
from viewer.files import whole_file
from viewer.look import Look
from viewer.scan.pose import Pose
from viewer.scan.timeline import Timeline

PICTURE = DOCS / "pictures" / "landmarks.png"
SCAN, NOISE = "demo:smile:1", 0.1
SIZE = (520, 640)
FACE = Bounds(np.array([-62.0, -112.0, 20.0]), np.array([62.0, 40.0, 110.0]))
CLOSE = 11.0  # mm around the path of the landmark that moves most


def picture(_: Namespace) -> Iterator[Row]:
    """Track, draw the frame of the widest smile from two sides, and draw paths and truth over it."""
    (known,) = scanned_demo(SCAN, [NOISE])
    with Timeline(known.source, known.source.times(), "mm") as timeline:
        tracks = track_landmarks(timeline, keyed_landmarks(known))
    moved = np.linalg.norm(known.paths - known.paths[0], axis=2)
    frame, most = map(int, np.unravel_index(int(moved.argmax()), moved.shape))
    middle = known.paths[[0, frame], most].mean(axis=0)
    corner = Bounds(middle - CLOSE, middle + CLOSE)
    pose = Pose(int(frame), float(known.source.times()[frame]), "", known.source.load(frame))
    paths = [trajectory_of(tracks[name], Smoothing()) for name in known.names]
    fastest = max(float(np.nanmax(path.speeds)) for path in paths)

    from matplotlib import colormaps
    from matplotlib.figure import Figure

    figure = Figure((2 * SIZE[0] / 100, SIZE[1] / 100), dpi=100)
    for part, (bounds, azimuth) in enumerate(((FACE, 0.0), (corner, 25.0 * np.sign(middle[0])))):
        camera = Camera.orbit(bounds, azimuth, aspect=SIZE[0] / SIZE[1])
        surface = drawn(request(pose, camera, "surfels", {}, Look(light="head")), SIZE)
        axes = figure.add_axes((part / 2, 0, 0.5, 1))
        axes.imshow(surface.image(), extent=(0, SIZE[0], SIZE[1], 0))
        axes.set_axis_off()
        for number, path in enumerate(paths):
            line, truth = (
                surface.view.project(positions - pose.origin)[0]
                for positions in (path.positions, known.paths[:, number])
            )
            shades = colormaps["viridis"](np.nan_to_num(path.speeds / fastest))
            axes.scatter(line[:, 0], line[:, 1], c=shades, s=60 if part else 6, linewidths=0, zorder=2)
            axes.plot(*truth.T, color="white", linewidth=0.8, zorder=3)
            axes.scatter(
                line[frame, 0],
                line[frame, 1],
                s=34,
                facecolors="none",
                edgecolors="#ff5a36",
                linewidths=1.4,
                zorder=4,
            )
        axes.set_xlim(0, SIZE[0])
        axes.set_ylim(SIZE[1], 0)
    with whole_file(PICTURE) as temporary:
        figure.savefig(temporary, format="png")
    yield {"picture": PICTURE.name}


EXPERIMENT = Script([picture])
