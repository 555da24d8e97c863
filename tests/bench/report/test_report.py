"""The report: what is computed for its plots and tables, and that its page stands alone."""

from __future__ import annotations

import math
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from test_results import a_row, times, written

from viewer.bench.report.page import fronts, overall, stability, summary_rows, three_digits, write_report
from viewer.bench.report.pictures import _HOLE, _SPILL, picture_path, side_by_side
from viewer.bench.report.plots import distinct, pareto, slope, sweeps, swept, time_against_error
from viewer.bench.report.results import METRICS, Row, error_metrics
from viewer.errors import InputError

ERRORS = {"hole_percent": 2.0, "psnr": 30.0, "depth_bias_px": -0.5, "normal_mean": 5.0}


def some_rows() -> list[Row]:
    """Floor, two backends and ceiling on two scenes, with sweeps and what is undefined."""
    rows = []
    for scene in ("torus", "bunny"):
        for rank, backend in enumerate(("gl-points", "points", "surfels", "mesh")):
            errors = {**ERRORS, "hole_percent": 3.0 - rank, "flip": math.nan}
            if backend == "mesh":
                errors["psnr"] = math.inf
            row = a_row(errors, 10.0 + 5 * rank, scene=scene, backend=backend)
            rows.append(row)
            for value in (1.0, 4.0):
                rows.append({**row, "sweep": "size", "params": {"size": value}, "gpu_ms": times(8 + value)})
            for count in (10_000, 100_000):
                rows.append({**row, "sweep": "n", "n": count, "gpu_ms": times(count / 100)})
            rows.append({**row, "sweep": "noise", "noise": 0.01})
    return rows


def numerics_line(**changes: Any) -> Row:
    bound = {"pixels": 0.01, "depth": 0.1, "color": 1.0}
    line = {
        "row": "scaled by 10^6", "backend": "points", "pixels": 0.001, "depth": 0.01, "color": 0.1,
        "bound": bound, "held": True, "limit": "", "reason": "float32",
    }  # fmt: skip
    return {**line, **changes}


# --- what is computed -----------------------------------------------------------------


def test_the_front_is_what_nothing_beats_in_both() -> None:
    #             front  slower, as good  front  beaten  front  undefined  undefined
    times_ = [1.0, 2.0, 3.0, 4.0, 5.0, math.nan, 0.5]
    losses = [9.0, 9.0, 4.0, 5.0, 1.0, 0.0, math.nan]
    assert pareto(times_, losses) == [0, 2, 4]


def test_of_equals_one_is_on_the_front() -> None:
    assert pareto([1.0, 1.0, 1.0], [2.0, 2.0, 3.0]) == [0]
    assert pareto([], []) == []


def test_the_front_of_what_should_be_high_is_by_its_loss() -> None:
    psnr = METRICS["psnr"]
    assert pareto([1.0, 2.0, 3.0], [psnr.loss(value) for value in (20.0, math.inf, 30.0)]) == [0, 1]


@pytest.mark.parametrize("power", [-0.5, 0.0, 1.0, 2.25])
def test_the_slope_of_a_power_law_is_its_exponent(power: float) -> None:
    x = [1e4, 1e5, 1e6, 1e7]
    assert slope(x, [3 * value**power for value in x]) == pytest.approx(power, abs=1e-12)


def test_the_slope_leaves_out_what_has_no_logarithm() -> None:
    assert slope([1, 10, 100, 1000, 1e4], [2, 20, 0, math.inf, math.nan]) == pytest.approx(1)
    assert math.isnan(slope([1, 10], [1, 0]))
    assert math.isnan(slope([5, 5], [1, 2]))


def test_a_sweep_includes_the_defaults_once() -> None:
    rows = some_rows()
    counts = [row["n"] for row in swept(rows, "torus", "n") if row["backend"] == "points"]
    assert sorted(counts) == [1000, 10_000, 100_000]
    assert swept([row for row in rows if row["sweep"] != "noise"], "torus", "noise") == []


def test_a_line_joins_what_differs_in_one_parameter() -> None:
    usual = {"size": 1.0, "depth": 9, "feed": "gs"}
    changes = [
        {},
        {"size": 4.0},
        {"size": 2.0},
        {"depth": 8},
        {"depth": 7, "size": 0.0},
        {"depth": 8, "size": 0.0},
    ]
    sweep = ["", "size", "size", "depth", "depth", "depth"]
    rows = [
        a_row(ERRORS, 1.0, sweep=name, params=usual | each) for name, each in zip(sweep, changes, strict=True)
    ]
    found = [[(row["params"]["size"], row["params"]["depth"]) for row in line] for line in sweeps(rows)]
    assert found == [[(1.0, 8), (1.0, 9)], [(0.0, 7), (0.0, 8)], [(1.0, 9), (2.0, 9), (4.0, 9)]]


def test_floor_and_ceiling_frame_the_backends() -> None:
    rows = [a_row(backend=name) for name in ("mesh", "surfels", "points", "gl-points")]
    assert distinct(rows, "backend") == ["gl-points", "points", "surfels", "mesh"]


def test_floor_and_ceiling_are_on_no_front_and_the_ceiling_stretches_no_axis() -> None:
    rows = [
        a_row({"hole_percent": holes}, ms, backend=backend)
        for backend, ms, holes in (
            ("gl-points", 1.0, 8.0), ("points", 2.0, 4.0), ("surfels", 4.0, 2.0), ("mesh", 8.0, 1e-9),
        )
    ]  # fmt: skip
    (axes,) = time_against_error(rows, METRICS["hole_percent"]).axes
    (front,) = (line for line in axes.lines if line.get_drawstyle() == "steps-post")
    assert list(front.get_xdata()) == [2.0, 4.0]
    assert axes.get_ylim()[0] > 1e-9
    assert "1e-09 ↓" in {text.get_text() for text in axes.texts}


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"), (1234.5, "1234"), (12.345, "12.3"), (0.012345, "0.0123"), (9.999, "10.00"),
        (math.nan, "\N{EN DASH}"), (math.inf, "∞"), (-0.5, "\N{MINUS SIGN}0.500"),
        (1e-7, "1.00e\N{MINUS SIGN}07"),
    ],
)  # fmt: skip
def test_numbers_have_three_digits(value: float, text: str) -> None:
    assert three_digits(value) == text


def marked(rows: list[Row], column: str, kind: str = "best") -> set[str]:
    """The backends whose value in a column is marked so."""
    return {
        backend
        for backend, _, cells in summary_rows(rows)
        for cell in cells
        if cell.kind == kind and cell.note.startswith(f"{column} of")
    }


def test_the_best_of_a_column_is_marked_among_the_backends_only() -> None:
    rows = [
        a_row({"hole_percent": 0.0, "psnr": 99.0}, 1.0, backend="mesh"),
        a_row({"hole_percent": 2.0, "psnr": 30.0}, 5.0, backend="points"),
        a_row({"hole_percent": 1.0, "psnr": 20.0}, 7.0, backend="surfels"),
        a_row({"hole_percent": 3.0, "psnr": math.nan}, 9.0, backend="voxels"),
    ]
    assert marked(rows, "gpu_ms") == {"points"}
    assert marked(rows, "hole_percent") == {"surfels"}
    assert marked(rows, "psnr") == {"points"}
    assert marked(rows, "cpu_ms") == set()  # all alike
    assert marked(rows, "flip") == set()  # all undefined


def test_errors_that_nothing_faster_beats_are_marked() -> None:
    rows = [
        a_row({"hole_percent": 9.0, "psnr": 1.0}, 1.0, backend="gl-points"),
        a_row({"hole_percent": 2.0, "psnr": 30.0}, 5.0, backend="points"),
        a_row({"hole_percent": 1.0, "psnr": 20.0}, 7.0, backend="surfels"),
        a_row({"hole_percent": 3.0, "psnr": 40.0}, 9.0, backend="voxels"),
    ]
    assert fronts(rows)["hole_percent"] == ["points", "surfels"]
    assert fronts(rows)["psnr"] == ["points", "voxels"]
    assert fronts(rows)["flip"] == []
    assert marked(rows, "hole_percent", "front") == {"points"}  # the best is marked as such
    assert marked(rows, "psnr", "front") == {"points"}
    assert marked(rows, "gpu_ms", "front") == set()


def test_over_all_scenes_fronts_are_counted_and_times_are_ratios() -> None:
    def scene(name: str, floor: float, points: float, surfels: float, holes: float) -> list[Row]:
        return [
            a_row({"hole_percent": 0.0}, floor, scene=name, backend="gl-points"),
            a_row({"hole_percent": 2.0}, points, scene=name, backend="points"),
            a_row({"hole_percent": holes}, surfels, scene=name, backend="surfels"),
        ]

    table = overall([scene("torus", 1.0, 2.0, 4.0, 1.0), scene("bunny", 10.0, 80.0, 160.0, 3.0)])
    assert [(name, time, won[0]) for name, time, won in table] == [
        ("points", "4.00", "2 of 2"),  # the geometric mean of 2 and 8
        ("surfels", "8.00", "1 of 2"),  # slower, and in the second scene worse
    ]
    assert {text for _, _, won in table for text in won[1:]} == {"\N{EN DASH}"}


def test_numerics_are_held_failed_or_limited() -> None:
    table = stability(
        [
            numerics_line(),
            numerics_line(backend="surfels", held=False, pixels=0.25, depth=0.5),
            numerics_line(row="zoomed", held=False, pixels=1.0, limit="float32 ends there"),
        ]
    )
    assert table["backends"] == ["points", "surfels"]
    assert table["counts"] == {"held": 1, "failed": 1, "limit": 1}
    (first, cells, reasons), (second, others, limits) = table["rows"]
    assert (first, second) == ("scaled by 10^6", "zoomed")
    assert [cell.kind for cell in cells] == ["held", "failed"]
    assert cells[1].text == "failed: 25.0 % of pixels, 0.500 px of depth"
    assert [cell.kind for cell in others] == ["limit", ""]
    assert reasons == ["tolerance: float32"]
    assert limits == ["tolerance: float32", "limit: float32 ends there"]


# --- the page -------------------------------------------------------------------------


def filled(folder: Path, *rows: Row) -> Path:
    """Results, numerics and a picture in a folder."""
    written(folder / "results.jsonl", *rows)
    written(folder / "numerics.jsonl", numerics_line(), numerics_line(backend="surfels", held=False))
    (folder / "notes.txt").write_text("stopped early\n", encoding="utf-8")
    path = picture_path(folder, "torus", "points")
    path.parent.mkdir()
    Image.fromarray(np.full((20, 30, 3), 90, np.uint8)).save(path)
    return folder


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with some rows, without a report."""
    return filled(tmp_path, *some_rows())


@pytest.fixture(scope="module")
def reported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page made of such a folder, beside its plots; tests only read it."""
    return write_report(filled(tmp_path_factory.mktemp("reported"), *some_rows()))


class Page(HTMLParser):
    """What a page has: its elements with attributes, ids, and its text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.words += data.split()

    def values(self, *attributes: str) -> list[str]:
        """Of any of these attributes, of all elements."""
        return [given[name] or "" for _, given in self.elements for name in attributes if name in given]


@pytest.mark.slow
def test_the_page_needs_nothing_else(reported: Path) -> None:
    text = reported.read_text(encoding="utf-8")
    page = Page(text)
    ids = set(page.values("id"))
    for target in page.values("src", "href", "xlink:href"):
        assert target.startswith("data:image/") or target.removeprefix("#") in ids
    assert not {tag for tag, _ in page.elements} & {"link", "iframe", "object", "base"}
    without_names = re.sub(r'xmlns(:\w+)?="[^"]*"', "", text)
    assert not re.search(r"https?:|@import|url\((?!#)", without_names)


def test_the_page_has_every_part(reported: Path) -> None:
    page = Page(reported.read_text(encoding="utf-8"))
    assert {"summary", "against", "swept", "passes", "pictures", "numerics", "every", "glossary"} <= set(
        page.values("id")
    )
    assert {"gl-points", "surfels", "(floor)", "(ceiling)", "device", "finish", "early"} <= set(page.words)
    assert "N^1.00" in page.words  # gpu_ms of the sweep, and of the defaults near it
    plots = {path.stem for path in (reported.parent / "plots").glob("*.png")}
    assert plots == {
        "time-hole_percent", "time-psnr", "time-depth_bias_px", "time-normal_mean", "passes",
        "points-torus", "points-bunny", "noise-torus", "noise-bunny",
    }  # fmt: skip


@pytest.mark.slow
def test_the_same_rows_give_the_same_bytes(folder: Path) -> None:
    first = write_report(folder).read_bytes()
    assert write_report(folder).read_bytes() == first


def test_a_page_of_one_row(tmp_path: Path) -> None:
    written(tmp_path / "results.jsonl", a_row())
    page = Page(write_report(tmp_path).read_text(encoding="utf-8"))
    assert "numerics" not in page.values("id")
    assert "torus:" in page.words


def test_a_page_of_numerics_alone(tmp_path: Path) -> None:
    written(tmp_path / "numerics.jsonl", numerics_line())
    page = Page(write_report(tmp_path).read_text(encoding="utf-8"))
    assert "numerics" in page.values("id")
    assert "summary" not in page.values("id")


def test_a_page_where_nothing_is_known(tmp_path: Path) -> None:
    unknown = times(math.nan)
    rows = [
        {
            **row,
            "gpu_ms": unknown,
            "passes": {"shade": unknown},
            "errors": dict.fromkeys(row["errors"], math.nan),
        }
        for row in some_rows()
    ]
    written(tmp_path / "results.jsonl", *rows)
    page = Page(write_report(tmp_path).read_text(encoding="utf-8"))
    assert "summary" in page.values("id")
    assert "against" not in page.values("id")


def test_names_are_text_in_the_page(tmp_path: Path) -> None:
    written(tmp_path / "results.jsonl", a_row({"<b>": 1.0}, scene="<script>alert(1)</script>"))
    text = write_report(tmp_path).read_text(encoding="utf-8")
    assert "<script>alert" not in text
    assert "<b>" not in text


def test_nothing_to_report_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no results to report"):
        write_report(tmp_path)


def test_a_broken_picture_is_said(tmp_path: Path) -> None:
    folder = filled(tmp_path, a_row())
    picture_path(folder, "torus", "points").write_bytes(b"not a picture")
    with pytest.raises(InputError, match="is not a picture"):
        write_report(folder)


@pytest.mark.slow
def test_pictures_and_plots_of_former_results_are_not_told(folder: Path) -> None:
    for stale in (picture_path(folder, "cube", "points"), folder / "plots" / "stale.png"):
        stale.parent.mkdir(exist_ok=True)
        Image.fromarray(np.zeros((4, 4, 3), np.uint8)).save(stale)
    assert "cube" not in write_report(folder).read_text(encoding="utf-8")
    assert not (folder / "plots" / "stale.png").exists()


def test_every_known_error_is_explained() -> None:
    assert all(metric.help for metric in error_metrics([a_row(dict.fromkeys(METRICS, 0.0))]))


# --- pictures -------------------------------------------------------------------------


def a_picture(depth: np.ndarray, gray: int = 100) -> dict[str, np.ndarray]:
    normal = np.zeros((*depth.shape, 3), np.float32)
    normal[np.isfinite(depth)] = (0, 0, 1)
    return {"image": np.full((*depth.shape, 4), gray, np.uint8), "depth": depth, "normal": normal}


def test_holes_and_spill_have_their_own_colours() -> None:
    true, found = np.full((40, 60), np.inf), np.full((40, 60), np.inf)
    true[10:30, 10:40] = 5.0
    found[10:30, 20:50] = 5.0
    panels = side_by_side(a_picture(true), a_picture(found, 200), np.full(true.shape, 0.01))
    for shade in (_HOLE, _SPILL):  # 20 x 10 pixels each, besides the marks below
        assert np.count_nonzero((panels == shade).all(axis=2)) >= 200


@pytest.mark.parametrize("nothing", ["reference", "drawn", "both"])
def test_panels_of_an_empty_picture(nothing: str) -> None:
    empty, full = np.full((12, 16), np.inf), np.full((12, 16), 2.0)
    true = full if nothing == "drawn" else empty
    found = full if nothing == "reference" else empty
    panels = side_by_side(a_picture(true), a_picture(found), np.ones(true.shape))
    assert panels.dtype == np.uint8
    assert panels.shape[2] == 3


def test_wide_panels_are_made_smaller() -> None:
    depth = np.full((800, 1200), 2.0)
    height, width, _ = side_by_side(a_picture(depth), a_picture(depth), np.ones(depth.shape)).shape
    assert width < 5 * 440
    assert height < 400


def test_a_scene_that_is_a_path_has_a_picture_in_the_folder(tmp_path: Path) -> None:
    path = picture_path(tmp_path, "../scans/head.ply", "points")
    assert path.parent == tmp_path / "pictures"
    assert path.name == "..-scans-head.ply--points.png"
