"""Farooq 2013, then and now: hole filling, hidden points, large views and playing."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from experiments.farooq_2013.large_views import measure_large_views
from experiments.farooq_2013.playing import measure_playing
from experiments.farooq_2013.pyramids import BACKEND, HIDE, MOST_LEVELS, PAPER, PRIMITIVES, with_levels
from experiments.suite import Part, Suite, pictures
from experiments.tables import Column, Machines, Row, StoredRun, Table, at, code, columns, grouped, of_all
from viewer.bench.baselines import RANGE_MESH
from viewer.bench.plan import Contender, Group
from viewer.bench.run import BenchSettings

ZOOMS = (0.25, 1.0, 2.0, 4.0, 8.0)
HIDDEN_ZOOM = 4.0
_SCENES = ("demo-pair", "armadillo-pair", "dragon-scans", "bunny-scans", "truedepth-head")
_COVERED_SCENES = ("armadillo-pair", "hand-before-face-pair")  # which cover themselves
ERRORS = {
    "hole_percent": "holes, %",
    "hole_scanned_percent": "of what was scanned, %",
    "through_percent": "through, %",
    "wrong_layer_percent": "wrong layer, %",
    "psnr": "PSNR, dB",
    "psnr_scanned": "of what was scanned, dB",
    "depth_median_px": "depth, median px",
    "boundary_p95": "outline, 95 % px",
    "spill_p95": "spill, 95 % px",
}
_MEGA = 1e6

# --- pictures -------------------------------------------------------------------------


def groups() -> list[Group]:
    """A group for each scene and zoom; then those of hidden points.

    Scans of two pods, and real ones with a truth, are looked at from far and from near: by each number of
    levels, as polygons, and as the triangles of their neighbours, which scanners' own software makes of them.
    """
    drawn = [with_levels(count, "points") for count in range(1, MOST_LEVELS + 1)]
    drawn.append(with_levels(MOST_LEVELS, "polygons"))
    contenders = (*(Contender(BACKEND, params) for params in drawn), Contender(RANGE_MESH))
    hiding = tuple(
        Contender(BACKEND, with_levels(count, primitive, **{HIDE: hides}), HIDE)
        for primitive in PRIMITIVES
        for count in (1, MOST_LEVELS)
        for hides in (False, True)
    )
    return [
        *(_group(scene, zoom, contenders) for scene in _SCENES for zoom in ZOOMS),
        *(_group(scene, HIDDEN_ZOOM, hiding) for scene in _COVERED_SCENES),
    ]


def _group(scene: str, zoom: float, contenders: tuple[Contender, ...]) -> Group:
    noise = 0.0 if scene.endswith("-pair") else None  # the real scans have their own
    return Group(scene, contenders, noise=noise, zoom=zoom, sweep="zoom")


def levels_of(row: Row) -> int:
    """The number of levels that the parameters of a row show; 1: what was measured alone."""
    params = row["params"]
    return sum(params[f"level_{level}"] for level in range(MOST_LEVELS)) if params["fill"] else 1


def stored_pictures(rows: Sequence[Row]) -> Iterator[Row]:
    """Of each picture its zoom, primitive, levels, time and errors."""
    part = pictures(ERRORS, {"primitive": "primitive", HIDE: HIDE})
    for row, stored in zip(rows, part.digest(rows), strict=True):
        yield {**stored, **({"levels": levels_of(row)} if row["backend"] == BACKEND else {})}


# --- tables ---------------------------------------------------------------------------


def drawn_as(row: Row) -> str:
    """How a row was drawn, in words."""
    if row["backend"] == RANGE_MESH:
        return f"`{RANGE_MESH}`"
    levels = "level 0 alone" if row["levels"] == 1 else f"{row['levels']} levels"
    return levels if row["primitive"] == "points" else f"{row['primitive']}, {levels}"


def _zoomed(runs: Sequence[StoredRun], hidden: bool = False) -> list[Row]:
    """The pictures of the first machine: of the suite's scenes, or those of hidden points."""
    rows = [row for each in runs[:1] for row in each["rows"]]
    return [{**row, "drawn": drawn_as(row)} for row in rows if (row["sweep"] == HIDE) == hidden]


def _by_zoom(error: str) -> Table:
    """One error by the number of levels, against zoom."""

    def rows(runs: Sequence[StoredRun]) -> Iterator[Row]:
        for (scene, drawn), some in grouped(_zoomed(runs), "scene", "drawn").items():
            found = {row["zoom"]: row["errors"][error] for row in some if error in row["errors"]}
            yield {"scene": scene, "drawn": drawn, "at": dict.fromkeys(ZOOMS, np.nan) | found}

    zooms = [Column(f"{zoom:g}", at("at", zoom)) for zoom in ZOOMS]
    name = "holes" if error.startswith("hole") else "psnr"
    return Table(name, [code("scene"), Column("drawn"), *zooms], rows, merged=1)


def _at_zoom(name: str, zoom: float) -> Table:
    """All errors at one zoom, and times."""
    ms = Column("ms", lambda row: float(np.median(row["gpu_ms"])))
    return Table(
        name,
        [code("scene"), Column("drawn"), *columns("errors", ERRORS), ms],
        lambda runs: [row for row in _zoomed(runs) if row["zoom"] == zoom],
        merged=1,
    )


def _hidden(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """Errors with and without looking for hidden points."""
    for (scene, drawn), some in grouped(_zoomed(runs, hidden=True), "scene", "drawn").items():
        without, found = ({row[HIDE]: row["errors"] for row in some}[hides] for hides in (False, True))
        before, after = without["wrong_layer_percent"], found["wrong_layer_percent"]
        less = before / after if after else np.inf
        yield {"scene": scene, "drawn": drawn, "without": without, "with": found, "less": less}


def _large(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """Table 7.2: of each line the thesis', then those of the runs."""
    for line in PAPER["scenarios"]:
        rates = {"speed": line["samples_per_second"] / _MEGA, "fps": float(line["frames_per_second"])}
        empty = dict.fromkeys(("zoom", "covered", "ms", "unskipped_ms", "slower"))
        yield {**line, **rates, **empty, "device": "2013", "primitive": "points"}
        for row in of_all("large")(runs):
            if row["scenario"] == line["scenario"]:
                seconds = row["ms"] / 1e3
                rates = {"speed": row["samples"] / _MEGA / seconds, "fps": 1 / seconds}
                yield {
                    **row,
                    **rates,
                    "scenario": "",
                    "levels": "",
                    "slower": row["unskipped_ms"] / row["ms"],
                }


def _memory(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """Bytes a sample on the GPU, and how long it takes to open two large views."""
    empty = dict.fromkeys(("samples", "measured", "read_ms", "open_ms"))
    for form, count in PAPER["bytes_per_sample"].items():
        yield {**empty, "form": form, "device": "2013", "bytes_per_sample": float(count)}
    for each in runs:
        for row in each["large"][:1]:
            yield {**row, "form": "Scan4D, its pyramid", "device": each["device"]}


def _seconds(name: str) -> Callable[[Row], float | None]:
    return lambda row: None if row[name] is None else row[name] / 1e3


EXPERIMENT = Suite(
    page="farooq.md",
    parts={
        "rows": Part(stored_pictures, sweeps=["zoom", HIDE]),
        "large": Part(
            ("scenario", "levels", "primitive", "samples", "measured", "zoom", "ms", "unskipped_ms",
            "covered",
             "open_ms", "read_ms", "bytes_per_sample"),
            measure_large_views,
        ),
        "playing": Part(("scene", "poses", "primitive", "size", "reading", "playing"), measure_playing),
    },
    tables=[
        _by_zoom("hole_scanned_percent"),
        _by_zoom("psnr_scanned"),
        _at_zoom("errors", HIDDEN_ZOOM),
        _at_zoom("near", max(ZOOMS)),
        Table(
            "hidden",
            [
                code("scene"), Column("drawn"),
                Column("wrong layer without, %", "without.wrong_layer_percent"),
                Column("with, %", "with.wrong_layer_percent"), Column("times less", "less"),
                Column("through without, %", "without.through_percent"), Column("with, %",
                "with.through_percent"),
            ],
            _hidden,
        ),
        Table(
            "large",
            [
                Column("scenario"), Column("levels"), Column("machine", "device", left=True),
                Column("drawn as", "primitive"), Column("pixels a sample", "zoom"),
                Column("covered", form="{:.0f} %"), Column("million samples a second", "speed"),
                Column("pictures a second", "fps"), Column("ms"),
                Column("without skipping, ms", "unskipped_ms"), Column("times as long", "slower"),
            ],
            _large,
        ),
        Table(
            "memory",
            [
                Column("form"), Column("machine", "device", left=True),
                Column("bytes a sample", "bytes_per_sample"), Column("samples"),
                Column("of them measured", "measured"), Column("read, s", _seconds("read_ms")),
                Column("first picture, s", _seconds("open_ms")),
            ],
            _memory,
        ),
        Table(
            "playing",
            [
                Column("machine", "device", left=True), Column("drawn as", "primitive"),
                Column("poses", form="{}"),
                Column("picture", lambda row: "x".join(map(str, row["size"])), left=True),
                Column("while it is read, a second", "reading.fps"), Column("from memory, a second",
                "playing.fps"),
                Column("to the GPU, ms a pose", "playing.upload_ms"),
                Column("prepared on the CPU, ms a pose", "playing.derive_ms"),
            ],
            of_all("playing"),
        ),
        Machines(BACKEND, PAPER),
    ],
    groups=lambda *_: groups(),
    own=BACKEND,
    usual=BenchSettings(size=(640, 480), views=8, frames=0),
    quick=(_SCENES[:1], 1),
)  # fmt: skip
