"""Preiner 2012, then and now: search, fits and pictures of splats that are found in each picture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from experiments.papers import figures
from experiments.preiner_2012.bracketing import measure_iterations
from experiments.preiner_2012.fits import measure_fits
from experiments.preiner_2012.searches import BACKEND, SEARCH, STAGES, K, measure_searches
from experiments.suite import Part, Suite, pictures
from experiments.tables import (
    Column,
    Machines,
    Row,
    StoredRun,
    Table,
    at,
    code,
    columns,
    grouped,
    of_all,
    spaced,
)
from viewer.backends import backend
from viewer.bench.plan import Contender, Group
from viewer.bench.run import BenchSettings
from viewer.camera import Camera
from viewer.scan.points import PointCloud
from viewer.view import View

PAPER = figures("preiner_2012")
PRECOMPUTED = "precomputed"
SIZE = (1760, 900)  # the paper's
PLANE_POINTS = 10  # points that a precomputed plane goes through
_PAPER = {"surface": "nearest"}  # the paper shows the nearest splat, and blends colours and normals
DEEP = "horses"  # its depth complexity is 5 to 6
_MODELS = ("bunny", "armadillo", "igea", "dragon")  # Fig. 6
_TWO_SCALES = "two-bunnies"  # Fig. 7
_ITERATIONS = 12  # of the paper's search that the page shows
_CHUNK = 1 << 18  # points whose planes are fitted at a time
_FRAMES = {"first": "first", "later": "camera moved", "still": "nothing changed"}
_ERRORS = {
    "hole_percent": "holes, %",
    "through_percent": "through, %",
    "wrong_layer_percent": "wrong layer, %",
    "spill_p95": "spill, 95 % px",
    "psnr": "PSNR, dB",
    "normal_median": "normals, median °",
    "normal_p95": "95 %, °",
    "flicker_orbit_normal": "flicker, °",
}
_KNOWN = ("tree_ms", "search_ms", "per_point", "overall")  # figures of the paper, where it has them
_SWITCHES = ("hidden_neighbors", "cull", "refine")

# --- pictures -------------------------------------------------------------------------


def groups() -> list[Group]:
    """Pictures that are judged: with and without hidden neighbours, and with the paper's two savings."""
    declared = backend(BACKEND)
    compared = (
        Contender(BACKEND, declared.params(_PAPER)),
        Contender(BACKEND, declared.params({**_PAPER, "hidden_neighbors": False}), "hidden_neighbors"),
        Contender(PRECOMPUTED, backend("surfels").params({**_PAPER, "passes": "two"}), drawn=drawn_by_planes),
    )
    switches = [(cull, refine) for cull in (False, True) for refine in (False, True)]
    saving = (
        Contender(BACKEND, declared.params({**_PAPER, "cull": cull, "refine": refine}), "cull, refine")
        for cull, refine in switches
    )
    return [*(Group(scene, compared) for scene in (*_MODELS, _TWO_SCALES)), Group(DEEP, tuple(saving))]


def drawn_by_planes(cloud: PointCloud, camera: Camera) -> tuple[PointCloud, str]:
    """What the benchmark draws of a scan: surfels of precomputed planes."""
    return with_planes(cloud, camera, PLANE_POINTS), "surfels"


def with_planes(cloud: PointCloud, camera: Camera, k: int) -> PointCloud:
    """The bare points with normals and radii of the planes through the k nearest of all of them, each its own
    neighbour, as Preiner 2012 (6) makes them: normals towards the eye, radii 2 r / sqrt(k)."""
    from scipy.spatial import cKDTree

    points = cloud.positions.astype(np.float64)
    tree = cKDTree(points)
    normals, radii = np.empty((len(cloud), 3)), np.empty(len(cloud))
    for start in range(0, len(cloud), _CHUNK):
        part = slice(start, start + _CHUNK)
        distances, rows = tree.query(points[part], min(k, len(cloud)), workers=-1)
        offsets = points[rows] - points[part, None]
        offsets -= offsets.mean(axis=1, keepdims=True)
        normals[part] = np.linalg.eigh(np.einsum("nki,nkj->nij", offsets, offsets))[1][:, :, 0]
        radii[part] = 2 * distances[:, -1] / np.sqrt(distances.shape[1])
    away = View.of(camera, (1, 1), cloud.origin, cloud.bounds()).faces_away(points, normals)
    normals[away] *= -1
    return PointCloud(
        positions=cloud.positions,
        origin=cloud.origin,
        normals=normals.astype(np.float32),
        colors=cloud.colors,
        radii=radii.astype(np.float32),
        ids=cloud.ids,
    )


# --- tables ---------------------------------------------------------------------------


def _title(row: Row) -> str:
    return f"`{row['scene']}`, {spaced(row['n'])}"


def _compared(runs: Sequence[StoredRun]) -> list[Row]:
    """The searches that a tree was compared with, of all machines."""
    return [row for row in of_all("searches")(runs) if row["trees"]]


def _table_one(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """Table 1: of each scene the paper's lines, then those of the runs."""
    for rows in grouped(_compared(runs), "scene", "n").values():
        for line in PAPER["scenes"]:
            if line["name"] == rows[0]["paper"]:
                known = {name: np.nan if line[name] is None else float(line[name]) for name in _KNOWN}
                yield {**line, **known, "scene": line["name"], "device": "2012", "visible_tree_ms": ""}
        for row in rows:
            taken, trees = row["first"][SEARCH], row["trees"]
            overall = trees["all"] / taken
            yield {
                **row, **row["params"], "scene": f"`{row['scene']}`", "points": row["n"],
                "pixels": row["visible"], "tree_ms": trees["all"], "visible_tree_ms": trees["visible"],
                "search_ms": taken, "per_point": overall * row["visible"] / row["n"], "overall": overall,
                "against": trees["visible"] / taken,
            }  # fmt: skip


def _by_stage(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """Fig. 10: milliseconds of each stage by the number of neighbours."""
    for rows in grouped(of_all("searches")(runs), "device", "scene", "n").values():
        culled = [row for row in rows if row["params"]["cull"]]
        yield from sorted(culled, key=lambda row: row["params"]["k"])


def _rounds(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """Fig. 11: percent of the points whose neighbourhood is unknown before each round."""
    for row in (row for each in runs[:1] for row in each["searches"] if row["rounds"]):
        if row["params"]["k"] == K and not row["params"]["cull"]:
            yield {"scene": _title(row), "left": _shares(row["rounds"])}


def _iterations(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """Fig. 11: percent of the visible points that are not converged before each iteration of the paper."""
    for row in (row for each in runs[:1] for row in each["iterations"]):
        yield {"scene": _title(row), "left": _shares(row["left"][:_ITERATIONS])}


def _shares(left: Sequence[int]) -> dict[str, float]:
    """Percent of the points that are left before each round, by its number."""
    return {str(number): 100 * count / left[0] for number, count in enumerate(left, 1)}


def _round_columns(rows: Sequence[Row]) -> list[Column]:
    names = dict.fromkeys(name for row in rows for name in row["left"])
    return [Column("scene"), *(Column(name, at("left", name)) for name in names)]


def _fits(runs: Sequence[StoredRun], noisy: bool) -> list[Row]:
    """The fits without noise, or those with hidden neighbours of the scenes that have noise, by noise."""
    rows = [row for each in runs[:1] for row in each["fits"]]
    if not noisy:
        return [row for row in rows if not row["noise"]]
    scenes = {row["scene"] for row in rows if row["noise"]}
    rows = [row for row in rows if row["scene"] in scenes and row["params"]["hidden_neighbors"]]
    return sorted(rows, key=lambda row: row["noise"])


def _drawn(runs: Sequence[StoredRun], deep: bool) -> list[Row]:
    """The judged pictures of the deep scene or of the others, with the time of one: on a software driver what
    the processors worked, divided by how many there are."""
    kind = {"finish": "busy_ms", "query": "gpu_ms"}
    rows = [row for row in of_all("rows")(runs[:1]) if (row["scene"] == DEEP) == deep]
    return [
        {
            **row,
            "ms": float(np.median(row[kind[row["timer"]]]))
            / (row["processors"] if row["timer"] == "finish" else 1),
        }
        for row in rows
        if not deep or row["backend"] == BACKEND
    ]


def _drawn_as(row: Row) -> str:
    if row["backend"] == PRECOMPUTED:
        return "planes of all points"
    if row["backend"] != BACKEND:
        return f"`{row['backend']}`"
    return f"`{BACKEND}`" if row["hidden_neighbors"] else f"`{BACKEND}`, what is seen alone"


def _frame(frame: str, name: str) -> list[Column]:
    """Columns of the time of the search, and of all, in one frame."""
    return [
        Column(f"search, {name}, ms", f"{frame}.{SEARCH}"),
        Column(f"all, {name}, ms", lambda row: sum(row[frame].values())),
    ]


_NEIGHBORS = Column(
    "k", lambda row: f"{'up to ' * row['params']['adaptive']}{row['params']['k']}", left=False
)
_MACHINE = Column("machine", "device", left=True)
_CULLED = Column("culled", "params.cull")
_PICTURE = [*columns("errors", _ERRORS), Column("ms")]

EXPERIMENT = Suite(
    page="preiner.md",
    parts={
        "rows": pictures(_ERRORS, {name: name for name in _SWITCHES}),
        "searches": Part(
            ("scene", "paper", "n", "visible", "participants", "params", "rounds", "trees", *_FRAMES),
            measure_searches,
        ),
        "iterations": Part(("scene", "n", "left"), measure_iterations),
        "fits": Part(
            ("scene", "noise", "params", "views", "points", "band_points", "found_inside", "found_band",
             "open3d_inside", "open3d_band", "turned", "grown"),
            measure_fits,
        ),
    },
    tables=[
        Table(
            "table",
            [
                Column("scene"), _MACHINE, Column("points"), Column("pixels"), Column("culled", "cull"),
                Column("tree of all, ms", "tree_ms"), Column("tree of the visible, ms", "visible_tree_ms"),
                Column("search, ms", "search_ms"), Column("times as fast per point", "per_point"),
                Column("overall"), Column("against the visible", lambda row: row.get("against")),
            ],
            _table_one,
        ),
        Table(
            "frames",
            [
                Column("scene", _title), _MACHINE, _CULLED,
                *(column for frame, name in _FRAMES.items() for column in _frame(frame, name)),
            ],
            _compared,
        ),
        Table(
            "passes",
            [
                Column("scene", _title), _MACHINE, Column("k", "params.k", "{}"),
                *(Column(f"{stage}, ms", f"first.{stage}") for stage in STAGES),
                Column("all, ms", lambda row: sum(row["first"].values())),
            ],
            _by_stage,
        ),
        Table("rounds", _round_columns, _rounds),
        Table("iterations", _round_columns, _iterations),
        Table(
            "fits",
            [
                code("scene"), Column("hidden neighbours", "params.hidden_neighbors"), _NEIGHBORS,
                Column("median, °", "found_inside.median"), Column("95 %, °", "found_inside.p95"),
                Column("open3d's median, °", "open3d_inside.median"), Column("95 %, °", "open3d_inside.p95"),
                Column("at silhouettes, median, °", "found_band.median"), Column("95 %, °", "found_band.p95"),
                Column("open3d's 95 %, °", "open3d_band.p95"), Column("turned in 2°, median °", "turned"),
                Column("radius, median %", lambda row: 100 * row["grown"]),
            ],
            lambda runs: _fits(runs, noisy=False),
        ),
        Table(
            "noise",
            [
                code("scene"), Column("noise", form="{:g}"), _NEIGHBORS,
                Column("median, °", "found_inside.median"), Column("95 %, °", "found_inside.p95"),
                Column("open3d's median, °", "open3d_inside.median"), Column("turned in 2°, median °",
                "turned"),
            ],
            lambda runs: _fits(runs, noisy=True),
        ),
        Table(
            "pictures",
            [code("scene"), Column("points", "n"), Column("drawn", _drawn_as), *_PICTURE],
            lambda runs: _drawn(runs, deep=False),
            merged=2,
        ),
        Table(
            "savings",
            [code("scene"), Column("culled", "cull"), Column("refined", "refine"), *_PICTURE],
            lambda runs: _drawn(runs, deep=True),
        ),
        Machines(BACKEND, PAPER),
    ],
    groups=lambda *_: groups(),
    own=BACKEND,
    usual=BenchSettings(size=SIZE, views=4, frames=3),
)  # fmt: skip
