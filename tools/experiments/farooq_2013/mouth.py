"""The picture of docs/how-it-works/pyramidal.md: the mouth of the Stanford dragon. It needs the data folder.

A sample of the fifteen scans is four pixels wide, as in a group of the suite `farooq` with this zoom.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator, Mapping

import numpy as np

from experiments.farooq_2013.pyramids import BACKEND
from experiments.machado_2014.shown import save_picture
from experiments.pictures import SHADING, drawn, request, scene
from experiments.script import Script
from experiments.suite import DOCS
from experiments.tables import Row
from viewer.camera import Camera
from viewer.look import Look

PICTURE = DOCS / "pictures" / "pyramidal.png"
SIZE = (560, 420)
CAMERA = Camera((-0.083, 0.152, 0.83), (-0.083, 0.152, 0.01), fov_y=4.5)
POINTS = {"primitive": "points"}
PANELS: tuple[tuple[Mapping[str, object], Look], ...] = (
    ({**POINTS, "fill": False, "hide": False}, SHADING),
    (POINTS, SHADING),
    (POINTS, Look(light="head", color_by="level")),
    ({}, SHADING),
)


def mouth(_: Namespace) -> Iterator[Row]:
    """Draw the four panels, two beside each other."""
    pose = scene("dragon-scans").moment(0).pose
    panels = [
        drawn(request(pose, CAMERA, BACKEND, params, look), SIZE).image()[..., :3] for params, look in PANELS
    ]
    save_picture(np.vstack([np.hstack(panels[:2]), np.hstack(panels[2:])]), PICTURE)
    yield {"picture": PICTURE.name}


EXPERIMENT = Script([mouth])
