"""Maršík 2010: code words beside discs and points, in time and in what is shown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from experiments.marsik_2010 import words
from experiments.suite import Part, Suite
from experiments.tables import Column, Machines, Row, StoredRun, Table, code
from viewer.bench.run import BenchSettings


def _times(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """Milliseconds, pictures and elements a second of each renderer."""
    for row in (row for each in runs for row in each["times"]):
        for drawn_by, busy in row["busy_ms"].items():
            wall = row["wall_ms"][drawn_by]
            rates = {"pictures a second": 1e3 / wall, "elements a second, M": 1e-3 * row["n"] / wall}
            size = "{} x {}".format(*row["size"])
            yield {
                "scene": row["scene"],
                "picture": size,
                "drawn by": drawn_by,
                "busy": busy,
                "wall": wall,
                **rates,
            }


EXPERIMENT = Suite(
    page="codeword.md",
    parts={
        "times": Part(("scene", "n", "size", "busy_ms", "wall_ms"), words.measure_times, by_scene=True),
        "pixels": Part(
            ("scene", "projection", "quality", "ids", "nearest", "covered", "depth", "normal"),
            words.measure_pixels,
            by_scene=True,
        ),
        "truth": Part(
            ("scene", "quality", "samples", "psnr", "psnr_edges", "normal"), words.measure_truth,
            by_scene=True,
        ),
        "tables": Part(
            ("steps", "sizes", "normals", "busy_ms", "nbytes", "bitmap_bytes"), words.measure_tables
        ),
    },
    tables=[
        Table(
            "times",
            [
                code("scene"), Column("picture", left=True), Column("drawn by"), Column("processor, ms",
                "busy"),
                Column("wall, ms", "wall"), Column("pictures a second"), Column("elements a second, M"),
            ],
            _times,
        ),
        Table(
            "pixels",
            [
                code("scene"), Column("projection"), Column("quality"), Column("other points, %", "ids",
                "{:.2f}"),
                Column("nearest to a step of Z, %", "nearest", "{:.2f}"),
                Column("other pixels, %", "covered", "{:.2f}"), Column("depths, of the radius", "depth",
                "{:.1g}"),
                Column("normals, degrees", "normal", "{:.2f}"),
            ],
            "pixels",
        ),
        Table(
            "truth",
            [
                code("scene"), Column("quality"), Column("samples a pixel", "samples", "{}"),
                Column("PSNR, dB", "psnr", "{:.1f}"), Column("PSNR at outlines, dB", "psnr_edges", "{:.1f}"),
                Column("normals, degrees", "normal", "{:.2f}"),
            ],
            "truth",
        ),
        Table(
            "tables",
            [
                Column("steps"), Column("sizes", form="{}"), Column("normals", form="{0} x {0}"),
                Column("processor, ms", "busy_ms.table"), Column("bytes", "nbytes"),
                Column("as bitmaps", "bitmap_bytes"),
            ],
            "tables",
        ),
        Machines(),
    ],
    scenes=words.SCENES,
    usual=BenchSettings(size=words.SIZES[0], views=1, repeat=9, frames=0),
    quick=(words.SCENES[:1], 1),
)  # fmt: skip
