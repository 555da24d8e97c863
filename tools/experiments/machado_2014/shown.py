"""Pictures of what is called visible: where it is wrong (Fig. 12), and by the number of sectors (Fig. 13)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.machado_2014.verdicts import EXACT, HULL, JudgedView, called_on_gpu
from viewer.backends import backend
from viewer.bench.report.pictures import Image, titled_row
from viewer.bench.scenes.subjects import with_rows
from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.drawing.timing import draw
from viewer.files import output_folder, whole_file
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.visibility.exact import exact_visible_points
from viewer.visibility.search import MODES, calibrated, visible_points

ERROR_PICTURE, SECTOR_PICTURE = "pictures/hpr-errors.png", "pictures/hpr-sectors.png"
GROWTH_PICTURE = "pictures/hpr-growth.png"
SHOWN_COUNTS = (40_000, 100_000, 10_000_000)  # Fig. 13
_SIZE = (420, 400)
_CLOSER = 0.8  # of the field of view that shows the sphere around a model
_MISSED, _EXTRA, _CORRECT = (220, 20, 20, 255), (30, 60, 235, 255), (175, 178, 182, 255)


def error_row(renderer: Renderer, view: JudgedView) -> Image:
    """Points called visible at the automatic radius: missed ones red, extra ones blue, others grey."""
    pose = Pose(0, 0.0, "", view.cloud)
    radius = calibrated(pose, view.eye).radius
    called = {EXACT: exact_visible_points(pose, view.eye, radius)}
    called |= {name: rows for name, rows in called_on_gpu(renderer.gpu, view, radius) if name in MODES}
    look, drawn = Look(light="flat", eye_dome=False, background="#ffffff"), {}
    for name, rows in called.items():
        verdicts = view.verdicts(rows)
        cloud = marked(view, rows)
        drawn[f"{name}: {verdicts.error:.1f} %"] = _picture(renderer, cloud, view.camera, look, 2)
    return titled_row(drawn)


def marked(view: JudgedView, rows: NDArray[np.integer]) -> PointCloud:
    """The points that are visible or called so, coloured by the verdict on them."""
    called = np.zeros(len(view.truth), bool)
    called[rows] = True
    colors = np.empty((len(called), 4), np.uint8)
    colors[:] = _CORRECT
    colors[view.truth & ~called] = _MISSED
    colors[called & ~view.truth] = _EXTRA
    return with_rows(replace(view.cloud, colors=colors), np.flatnonzero(called | view.truth))


def sector_row(renderer: Renderer, view: JudgedView) -> Image:
    """Visible points by numbers of sectors, and those of the exact operator, lit."""
    pose = Pose(0, 0.0, "", view.cloud)
    radius = calibrated(pose, view.eye).radius
    called = {
        f"k = {count:,}": visible_points(
            pose, view.eye, radius=radius, sectors=count, mode=HULL, gpu=renderer.gpu
        )
        for count in SHOWN_COUNTS
    }
    called[EXACT] = exact_visible_points(pose, view.eye, radius)
    look = Look(light="head", color_by="plain")
    return titled_row(
        {
            f"{name}: {len(rows):,} points": _picture(
                renderer, with_rows(view.cloud, rows), view.camera, look, 0
            )
            for name, rows in called.items()
        }
    )


def _picture(renderer: Renderer, cloud: PointCloud, camera: Camera, look: Look, point_size: int) -> Image:
    surface = Surface(renderer.gpu, _SIZE)
    camera = replace(camera, fov_y=_CLOSER * camera.fov_y)
    params = backend("points").params({"point_size": point_size})
    draw(renderer, Request(Pose(0, 0.0, "", cloud), camera, "points", params, look), surface)
    image = surface.image()[..., :3].copy()
    surface.release()
    return image


def save_picture(pixels: Image, path: Path) -> None:
    """Write a picture as PNG, into a folder that is made where there is none."""
    from PIL import Image as Pillow

    output_folder(path.parent)
    with whole_file(path) as temporary:
        Pillow.fromarray(pixels).save(temporary)
