"""The tables of docs/how-it-works/auto-splats.md, measured anew.

    python docs/tables/auto_splats.py [NAME ...]

All but the times of `savings` give the same figures on any machine with the same driver. They need the data
folder.
"""

from __future__ import annotations

from functools import partial
from itertools import product

import numpy as np
from pictures import DATA, DOCS, ERROR_NAMES, draw, error_cells, errors_of, processor_ms, renderer, request

from viewer.bench.papers.preiner_2012.fits import fit_errors, noisy
from viewer.bench.report.measurement import markdown_table, remeasure_tables, spaced
from viewer.bench.run import BenchSettings
from viewer.bench.scenes import catalog
from viewer.bench.scenes.viewpoints import viewpoints
from viewer.picture.surface import Surface

PAGE = DOCS / "how-it-works" / "auto-splats.md"
BACKEND = "auto_splats"
VIEWS, SIZE = 2, (880, 450)
ROUNDS = 3


def normals() -> str:
    """Angles to the true normals by numbers of neighbours, of one model with and without noise."""
    settings = BenchSettings(size=SIZE, views=1)
    counts = {f"k = {k}": {"k": k, "adaptive": False} for k in (6, 10, 32)}
    counts |= {f"adaptive, {k}": {"k": k, "adaptive": True} for k in (10, 32)}
    moment = catalog.subject("armadillo", DATA).moment(0)
    rows = []
    for noise in (0.0, 0.1, 0.3, 0.6):
        cloud = noisy(moment.pose.cloud, noise, 0)
        found = [
            fit_errors(cloud, moment.mesh, settings, params)["found_inside"] for params in counts.values()
        ]
        rows.append([str(noise), *(f"{each['median']:.1f}, {each['p95']:.0f}" for each in found)])
    return markdown_table(["noise", *counts], rows, left=("noise",))


def uneven() -> str:
    """Errors where points lie evenly and where they do not."""
    rows = []
    for name in ("armadillo-bare", "armadillo-ramp-bare", "igea-bare", "igea-ramp-bare"):
        subject = catalog.subject(name, DATA)
        (errors,) = errors_of(subject, BACKEND, [{}], VIEWS, SIZE)
        rows.append([f"`{name}`, {spaced(len(subject.moment(0).pose.cloud))}", *error_cells(errors)])
    return markdown_table(["scene", *ERROR_NAMES], rows, left=("scene",))


def savings() -> str:
    """Errors and times with refinement and grid culling, and without."""
    rows = []
    settings = [{"refine": refine, "cull": cull} for refine, cull in product((False, True), repeat=2)]
    for name, count in (("horses", 100_000), ("dragon", None)):
        subject = catalog.subject(name, DATA, count=count)
        pose = subject.moment(0).pose
        camera = viewpoints(subject.moment(0).mesh, 1, SIZE, up=subject.up)[0]
        surface, least = Surface(renderer().gpu, SIZE), np.full(len(settings), np.inf)
        for turn in range(1 + ROUNDS):
            for number, params in enumerate(settings):
                # From elsewhere, so that nothing of the picture before helps.
                draw(request(pose, camera.orbited(90, 0), BACKEND, params), surface)
                ms = processor_ms(partial(draw, request(pose, camera, BACKEND, params), surface)) / 2
                least[number] = min(least[number], ms) if turn else np.inf
        told = errors_of(subject, BACKEND, settings, VIEWS, SIZE)
        for params, errors, ms in zip(settings, told, least, strict=True):
            switched = " and ".join(f"`{key}`" for key, on in params.items() if on) or "neither"
            rows.append(
                [f"{name}, {spaced(len(pose.cloud))}", switched, *error_cells(errors), f"{ms:.0f} ms"]
            )
    return markdown_table(["scene", "with", *ERROR_NAMES, "time"], rows, left=("scene", "with"))


if __name__ == "__main__":
    remeasure_tables(PAGE, normals, uneven, savings)
