"""What more sectors bring and take (Fig. 14; 8): visible points, errors, memory, how many hold a point."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from experiments.machado_2014.shown import SECTOR_PICTURE, save_picture, sector_row
from experiments.machado_2014.verdicts import EXACT, HULL, MOST_PER_POINT, SCENES, JudgedView, Verdicts, views
from experiments.suite import row_of, subjects
from experiments.tables import Row
from viewer.bench.run import Bench
from viewer.scan.pose import Pose
from viewer.visibility.candidates import Candidates
from viewer.visibility.exact import flipping
from viewer.visibility.search import calibrated, chosen_search, visible_points

# 40 K, 100 K and 10 M are those of Fig. 13, 4 M that of the paper's experiment.
COUNTS = (40_000, 100_000, 250_000, 630_000, 1_600_000, 4_000_000, 10_000_000)


def measure_growth(bench: Bench, scenes: Sequence[str] = SCENES) -> Iterator[Row]:
    """Yield a row for each scene and number of sectors, from the first side, at the automatic radius."""
    found = list(subjects(bench, scenes))
    for subject in found:
        moment = subject.moment(0)
        (view,) = views(moment, 1)
        if bench.folder and subject is found[-1]:
            save_picture(sector_row(bench.renderer, view), bench.folder / SECTOR_PICTURE)
        for row in growth(bench, view):
            yield {**row_of(bench, scene=subject.name, n=moment.pose.count), "views": 1, **row}


def growth(bench: Bench, view: JudgedView) -> Iterator[Row]:
    """Rows of a view: the exact operator, and each number of sectors."""
    gpu, pose = bench.renderer.gpu, Pose(0, 0.0, "", view.cloud)
    found = calibrated(pose, view.eye)
    yield {"method": EXACT, **_counts(view.hull(flipping(view.seen, found.radius)))}
    for count in (*(k for k in COUNTS if k <= MOST_PER_POINT * len(view.cloud)), None):
        rows = visible_points(pose, view.eye, radius=found.radius, sectors=count, mode=HULL, gpu=gpu)
        sectors, steps, _ = chosen_search(found, count, None)
        candidates = Candidates(gpu, sectors, len(view.cloud))
        nbytes = candidates.nbytes
        candidates.release()
        cells = sectors.sector_of(sectors.sector_positions(view.cloud.positions.astype(np.float64)))
        yield {
            "method": HULL,
            "sectors": sectors.count,
            "automatic": count is None,
            "steps": steps,
            "nbytes": nbytes,
            "held": round(len(np.unique(cells)) / sectors.count, 5),
            "inside": round(found.occupied, 5),
            **_counts(view.verdicts(rows)),
        }


def _counts(verdicts: Verdicts) -> Row:
    return {"visible": verdicts.correct + verdicts.extra, "error": round(verdicts.error, 3)}
