"""Points called visible against those that truly are: the accuracy experiment (7.1), noise, and peers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from experiments.machado_2014 import peers
from experiments.machado_2014.shown import ERROR_PICTURE, error_row, save_picture
from experiments.machado_2014.verdicts import (
    AUTOMATIC,
    BEST,
    EXACT,
    KATZ,
    SCENES,
    JudgedView,
    Verdicts,
    called_on_gpu,
    views,
)
from experiments.suite import row_of, subjects
from experiments.tables import Row
from viewer.bench.run import Bench
from viewer.gpu.context import Gpu
from viewer.visibility.exact import Kernel, flipping, katz_radius, searched_decades
from viewer.visibility.search import calibrated

NOISES = (0.0, 0.001, 0.005, 0.01)  # standard deviations, in diameters of the model
MOST_NOISY = 200_000  # points of scans that noise is added to: the search for the best radius takes minutes
_LOW, _HIGH = (
    2.0,
    5.0,
)  # decades of radii, in distances to the farthest point, among which the best is looked for
_SHARPEST = 0.6  # share of a hull's corners that thresholds are tried up to
_THRESHOLDS = 25

EXPONENTIAL, SHARP = "Katz and Tal 2015: exponential", "Katz and Tal 2015: confidence"
IMAGE_SPACE, RELAXED = "Biasutti 2019", "after Mehra 2010"


def measure_visibility(bench: Bench, scenes: Sequence[str] = SCENES) -> Iterator[Row]:
    """Yield a row for each scene, noise, radius and method. scenes: names, or files of meshes; what cannot be
    had is noted and left out."""
    settings = bench.settings
    for number, subject in enumerate(subjects(bench, scenes)):
        moment = subject.moment(0)
        for noise in NOISES if moment.pose.count <= MOST_NOISY else NOISES[:1]:
            found: dict[tuple[str, str], list[Row]] = {}
            for view in views(moment, settings.views, noise, settings.seed):
                if bench.folder and not (number or noise or found):
                    save_picture(error_row(bench.renderer, view), bench.folder / ERROR_PICTURE)
                for method, radius, counts in judged(bench.renderer.gpu, view):
                    found.setdefault((method, radius), []).append(counts)
            for (method, radius), by_view in found.items():
                named = {"scene": subject.name, "n": moment.pose.count, "noise": noise}
                yield row_of(bench, **named, method=method, radius=radius, by_view=by_view)


def judged(gpu: Gpu, view: JudgedView) -> Iterator[tuple[str, str, Row]]:
    """Yield the verdicts of all methods on a view: their name, that of the radius, counts and the radius."""
    automatic = calibrated(view.cloud, view.eye).radius
    best = best_radius(view, partial(flipping, view.seen))
    radii = {BEST: best, AUTOMATIC: automatic}
    if not view.noise:
        radii[KATZ] = katz_radius(view.cloud, view.eye)
    for name, radius in radii.items():
        yield EXACT, name, _row(view.hull(flipping(view.seen, radius)), view, radius)
        for method, rows in called_on_gpu(gpu, view, radius):
            yield method, name, _row(view.verdicts(rows), view, radius)
    yield from _peers(view, best)


def best_radius(view: JudgedView, kernel: Callable[[float], Kernel]) -> float:
    """The radius with which the hull errs least. kernel: of a radius."""
    farthest = view.farthest

    def right(decades: float) -> float:
        return -view.hull(kernel(farthest * 10**decades)).error

    return farthest * 10 ** searched_decades(right, _LOW, _HIGH)


def _peers(view: JudgedView, radius: float) -> Iterator[tuple[str, str, Row]]:
    """Yield what others make of it, each at its own best; radius: the best of the exact operator."""
    middle = float(np.linalg.norm(view.seen.middle))

    def exponential(radius: float) -> Kernel:
        return peers.exponential(peers.like_sphere(radius, middle))

    if not view.noise:
        own = best_radius(view, exponential)
        yield EXPONENTIAL, BEST, _row(view.hull(exponential(own)), view, own)
        yield SHARP, BEST, _sharpest(view, radius)
    image_space = np.flatnonzero(peers.image_space_visible(view.seen))
    yield IMAGE_SPACE, "", _row(view.verdicts(image_space), view)
    if view.noise:
        kernel = flipping(view.seen, radius)
        relaxed = peers.relaxed_visible(view.seen, radius, kernel, 2 * view.noise)
        yield RELAXED, BEST, _row(Verdicts.of(relaxed, view.truth), view, radius)


def _sharpest(view: JudgedView, radius: float) -> Row:
    """The least error of corners above a threshold, of the best radius and twice and thrice as large ones."""
    found = []
    for times in (1.0, 2.0, 3.0):
        sharpness = peers.sharpness(view.seen, flipping(view.seen, times * radius))
        limits = np.quantile(sharpness[sharpness > 0], np.linspace(0, _SHARPEST, _THRESHOLDS))
        found += [(Verdicts.of(sharpness >= limit, view.truth), times * radius) for limit in limits]
    verdicts, at = min(found, key=lambda one: one[0].error)
    return _row(verdicts, view, at)


def _row(verdicts: Verdicts, view: JudgedView, radius: float | None = None) -> Row:
    """Counts of one view, and the radius, where there is one, in distances to the farthest point."""
    counts = {"missed": verdicts.missed, "extra": verdicts.extra, "correct": verdicts.correct}
    return counts if radius is None else {**counts, "radius": round(radius / view.farthest, 1)}
