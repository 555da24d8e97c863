"""Marks tell the truth, stand where they should, and leave the rest of the picture alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from viewer.camera import Camera
from viewer.geometry import Vector
from viewer.look import HOLE_COLOR, LEVEL_COLORS, Look, ValueKind, rgba
from viewer.output.image_painter import ImagePainter
from viewer.output.legend import (
    Legend,
    Marks,
    number,
    quantity,
    range_note,
    round_length,
    scale_bar,
    stamp,
    swatches,
    ticks,
)
from viewer.output.marked import marked
from viewer.output.marks import INK, PLATE, text_height
from viewer.output.overlays import LABEL_EDGE, LINE_COLOR, DrawnCurve, DrawnPath, DrawnPlot, Overlay
from viewer.output.plot_below import PLOT_HEIGHT, draw_plot, round_values
from viewer.scan.points import PointCloud

if TYPE_CHECKING:
    from viewer.picture.surface import Surface

FLAT = Camera(projection="orthographic", height=10.0)  # 36 pixels a unit in a picture of SIZE
SIZE = (640, 360)
LEGEND = Legend(Marks(), FLAT, Look(color_by="height"), "mm", 2, 64, 0.08)
ALL = Marks(scale_bar=True, color_bar=True, stamp=True)
VALUES = (-1.0, 3.0)


def gray(size: tuple[int, int] = SIZE, level: int = 90, alpha: int = 255) -> NDArray[np.uint8]:
    return np.full((size[1], size[0], 4), (level, level, level, alpha), np.uint8)


def with_marks(size: tuple[int, int] = SIZE, camera: Camera = FLAT, **marks: bool) -> NDArray[np.uint8]:
    return marked(gray(size), replace(LEGEND, marks=Marks(**marks), camera=camera), VALUES)


def changed(image: NDArray[np.uint8]) -> tuple[int, int, int, int]:
    """The box of what is no longer gray: left, top, right, bottom."""
    rows, columns = np.nonzero((image != gray(image.shape[1::-1])).any(axis=2))
    return int(columns.min()), int(rows.min()), int(columns.max()) + 1, int(rows.max()) + 1


def longest_run(image: NDArray[np.uint8]) -> int:
    """Of pixels in INK that are side by side."""
    ink = (image == INK).all(axis=2)
    edges = np.diff(np.pad(ink, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    return int((np.nonzero(edges == -1)[1] - np.nonzero(edges == 1)[1]).max())


# --- what they say ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("most", "length"),
    [
        (1, 1),
        (1.9, 1),
        (2, 2),
        (4.99, 2),
        (5, 5),
        (9.9, 5),
        (10, 10),
        (0.03, 0.02),
        (7e-9, 5e-9),
        (3e12, 2e12),
    ],
)
def test_a_scale_bar_is_1_2_or_5_times_a_power_of_ten_long(most: float, length: float) -> None:
    assert round_length(most) == pytest.approx(length, rel=1e-12)


def test_an_orthographic_scale_bar_is_as_long_as_it_says() -> None:
    assert scale_bar(FLAT, SIZE) == (2, 72)  # a sixth of the width is 107 pixels, 2.96 units
    assert scale_bar(FLAT, (1280, 720)) == (2, 144)
    assert scale_bar(replace(FLAT, height=1e-4), SIZE)[0] == pytest.approx(2e-5)


def test_a_scale_bar_in_another_unit_is_round_in_that() -> None:
    assert scale_bar(FLAT, SIZE, 1000) == (2000, 72)
    inches, pixels = scale_bar(FLAT, SIZE, 1 / 0.0254)
    assert inches == 100
    assert pixels == pytest.approx(72 * 100 * 0.0254 / 2)


def test_the_colour_bar_tells_lengths_in_the_unit_that_is_shown() -> None:
    def bar(color_by: str, factor: float) -> NDArray[np.uint8]:
        legend = replace(LEGEND, marks=Marks(color_bar=True), look=Look(color_by=color_by), factor=factor)
        return marked(gray(), legend, VALUES)

    assert (bar("height", 1000) != bar("height", 1)).any()
    assert (bar("temperature", 1000) == bar("temperature", 1)).all(), "which is no length"


def test_a_perspective_scale_bar_is_right_at_the_depth_of_the_target(draw: Callable[..., Surface]) -> None:
    camera = Camera(eye=(0, 0, 50), target=(0, 0, 10), fov_y=40)
    length, pixels = scale_bar(camera, SIZE)
    ends = PointCloud.from_arrays([[-length / 2, 0, 10.0], [length / 2, 0, 10]])
    seen = draw(ends, camera, SIZE, params={"point_size": 1})
    columns = np.nonzero(seen.level == 0)[1]
    assert abs(np.ptp(columns) - pixels) <= 1


@pytest.mark.parametrize(
    ("value", "span", "text"),
    [
        (0.0, 5.0, "0"), (-0.001, 5.0, "0.00"), (1234.4, 250.0, "1,234"), (-12.345, 50.0, "-12.3"),
        (0.0012345, 0.002, "0.00123"), (1.5e-9, 3e-9, "1.50e-09"), (2.5e13, 5e13, "2.50e+13"),
        (500_000.25, 1.5, "500,000.25"), (7.0, 0.0, "7.00"), (float("nan"), 1.0, "nan"),
    ],
)  # fmt: skip
def test_numbers_have_the_digits_that_matter(value: float, span: float, text: str) -> None:
    assert number(value, span) == text


def test_lengths_have_the_unit_and_scalars_their_name() -> None:
    assert quantity(Look(color_by="depth"), "mm") == "Depth (mm)"
    assert quantity(Look(color_by="distance from reference"), "mm") == "Distance from reference (mm)"
    assert quantity(Look(color_by="temperature"), "mm") == "temperature"
    found = Look(color_by="splat_radius")
    assert quantity(found, "mm", ValueKind("", is_length=True)) == "Splat radius (mm)"
    assert quantity(found, "mm", ValueKind("")) == "Splat radius"


def test_the_bar_of_a_logarithm_has_its_geometric_mean_in_the_middle() -> None:
    assert ticks(0.0, 10.0) == ticks(0.0, 10.0, ValueKind("", is_log=True))
    assert ticks(1e-4, 1.0, ValueKind("", is_log=True)) == [(0.0, "0.000100"), (0.5, "0.0100"), (1.0, "1.00")]
    assert stamp(LEGEND) == "Frame 3 of 64, 0.080 s"


# --- where they are -----------------------------------------------------------------------------


@pytest.mark.parametrize("size", [SIZE, (1920, 1080), (300, 900)])
def test_the_line_of_a_scale_bar_has_its_exact_pixels(size: tuple[int, int]) -> None:
    image = with_marks(size, scale_bar=True)
    assert longest_run(image) == round(scale_bar(FLAT, size)[1])


@pytest.mark.parametrize("size", [SIZE, (3840, 2160), (96, 64), (300, 900)])
def test_each_mark_keeps_to_its_corner(size: tuple[int, int]) -> None:
    width, height = size
    left, top, right, bottom = changed(with_marks(size, scale_bar=True))
    assert 0 < left < right < width / 2 < width
    assert height / 2 < top < bottom < height
    left, top, right, bottom = changed(with_marks(size, color_bar=True))
    assert width / 2 < left < right < width
    assert height * 0.15 < top < bottom < height
    left, top, right, bottom = changed(with_marks(size, stamp=True))
    assert 0 < left < right < width
    assert 0 < top < bottom < height * 0.2


def test_long_names_are_shortened() -> None:
    legend = replace(LEGEND, marks=ALL, unit="m" * 500, look=Look(color_by="s" * 500))
    left, *_, bottom = changed(marked(gray(), legend, VALUES))
    assert (left, bottom) == changed(with_marks(scale_bar=True))[::3]
    assert (marked(gray(), legend, VALUES)[:, SIZE[0] // 2] == gray()[:, 0]).all()


def test_the_rest_of_the_picture_is_left_alone() -> None:
    image = np.random.default_rng(0).integers(0, 256, gray().shape, np.uint8)
    legend = replace(LEGEND, marks=Marks(scale_bar=True))
    found = marked(image, legend, VALUES).copy()
    left, top, right, bottom = changed(with_marks(scale_bar=True))
    assert (found[top:bottom, left:right] != image[top:bottom, left:right]).any()
    found[top:bottom, left:right] = image[top:bottom, left:right]
    assert (found == image).all()


def test_without_marks_the_picture_is_the_same() -> None:
    assert marked(gray(), LEGEND, VALUES) is not None
    assert (marked(gray(), LEGEND, VALUES) == gray()).all()
    assert (marked(gray(), replace(LEGEND, marks=Marks(color_bar=True)), None) == gray()).all()


def test_on_a_transparent_picture_marks_are_seen() -> None:
    image = marked(gray(alpha=0), replace(LEGEND, marks=Marks(scale_bar=True)), None)
    assert set(np.unique(image[..., 3])) >= {0, PLATE[3], 255}


# --- the colour bar and the picture ---------------------------------------------------------------


def test_the_colours_of_the_bar_are_those_of_the_surface(draw: Callable[..., Surface]) -> None:
    values = np.array([2.0, 4.0, 6.0], np.float32)
    cloud = PointCloud.from_arrays(np.array([[-1.0, 0, 0], [0, 0, 0], [1, 0, 0]]), scalars={"heat": values})
    look = Look(color_by="heat", light="flat", low=2, high=6)
    surface = draw(cloud, FLAT, SIZE, look=look, params={"point_size": 1})
    assert surface.color_range == (2, 6)
    shown = surface.image()[surface.level == 0]
    legend = replace(LEGEND, marks=Marks(color_bar=True), look=look)
    bar = marked(surface.image(), legend, surface.color_range)[SIZE[1] // 2 :, SIZE[0] // 2 :]
    stripe = next(column for column in bar.swapaxes(0, 1) if (column == shown[0]).all(axis=1).any())
    rows = np.nonzero(np.ptp(stripe[:, :3], axis=1) > 40)[0]  # what is coloured
    assert (stripe[rows[0]] == shown[2]).all(), "high is at the top"
    assert (stripe[rows[-1]] == shown[0]).all()
    nearest = np.abs(stripe[rows].astype(int) - shown[1]).sum(axis=1).argmin()
    assert abs(nearest - len(rows) / 2) <= 1


def distance(one: Vector, other: Vector, text: str) -> DrawnPath:
    return DrawnPath((one, other), (LINE_COLOR,), name=text, has_ends=True)


def overlay_of(lines: Sequence[DrawnPath]) -> Overlay:
    return Overlay.of((), [(line, np.array(line.places, float)) for line in lines], 0.0)


def test_measured_lines_go_from_end_to_end_and_their_texts_keep_off_each_other() -> None:
    """One near the upper edge, and four at one place, whose texts would hide each other."""
    lines = [
        distance((-3.0, -4.9, 0.0), (3.0, -4.9, 0.0), "1: 6 mm"),
        *(distance((-2, 0, 0), (2, 1, 0), "4.1 mm"),) * 4,
    ]
    shown = replace(LEGEND, marks=Marks(measure_lines=True), overlay=overlay_of(lines))
    told = marked(gray(), shown, None)
    color = np.array(rgba(f"#{LINE_COLOR:06x}"), int)
    there = np.abs(told.astype(int) - color).max(axis=2) <= 2
    for x, y in ((-3, -4.9), (3, -4.9), (-2, 0), (2, 1)):
        assert there[round(180 - 36 * y - 0.5), round(320 + 36 * x - 0.5)], "its end"
    assert there[round(180 + 36 * 4.9), 240:400].mean() > 0.9, "all along, but where a text is"

    wide, high = max(2, round(LABEL_EDGE * text_height(SIZE))), round(2 * text_height(SIZE))
    whole = np.logical_and.reduce([there[row : len(there) - high + row + 1] for row in range(high)])
    begins = whole & ~np.roll(whole, 1, axis=0)
    assert begins.sum() == len(lines) * wide, "no label covers a part of another one's edge"
    one_end = overlay_of(lines).with_seen(lambda places, _: np.arange(len(places)) % 2 == 0)
    hidden = marked(gray(), replace(shown, overlay=one_end), None)
    assert not (np.abs(hidden.astype(int) - color).max(axis=2) <= 2).any(), "faint where an end is hidden"


VALUES_OF_RISE = (0.0, 1.0, 2.0, None, None, 5.0, 6.0, 7.0, 8.0, 9.0)
RISE = DrawnCurve("rise", "mm", 0xFF8000, VALUES_OF_RISE, (1.5,) * 10)
PLOT = DrawnPlot("time [s]", tuple(float(n) for n in range(10)), (RISE,))


def test_the_legend_of_a_plot_gives_values_with_their_uncertainty(monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[str] = []
    monkeypatch.setattr(ImagePainter, "text", lambda _, left, top, text: written.append(text))
    for pose, words in ((5, "rise: 5.0 ± 1.5 mm"), (3, "rise: -")):
        written.clear()
        assert draw_plot(ImagePainter(SIZE), SIZE, PLOT, pose)
        assert words in written
    bare = replace(PLOT, curves=(replace(RISE, band=()),))
    assert draw_plot(ImagePainter(SIZE), SIZE, bare, 5)
    assert "rise: 5 mm" in written


def plotted(plot: DrawnPlot, pose: int = 0, size: tuple[int, int] = SIZE) -> NDArray[np.int64]:
    """The lower part of a picture with a plot."""
    legend = replace(LEGEND, plot=plot, pose=pose, marks=Marks(plot=True))
    return marked(gray(size), legend, None)[round((1 - PLOT_HEIGHT) * size[1]) :, :, :3].astype(int)


def pixels_near(image: NDArray[np.int64], color: tuple[int, int, int]) -> NDArray[np.bool_]:
    return np.asarray(np.abs(image - color).max(axis=2) < 40)


def test_a_plot_has_its_curves_and_a_line_at_the_frame() -> None:
    """A rise with a gap, and one that is nowhere known; the picture with its marks stands above, smaller."""
    unknown = DrawnCurve("none", "mm", 0x00FF00, (None,) * 10)
    plot = replace(PLOT, curves=(RISE, unknown))
    places = []
    for pose in (0, 5, 9):
        image = plotted(plot, pose)
        assert not pixels_near(image, (0, 255, 0)).any()
        white = (image.min(axis=2) > 200)[: -3 * text_height(SIZE)].sum(axis=0)
        places.append(np.flatnonzero(white > 0.8 * white.max()).mean())
    assert (places[1] - places[0]) / (places[2] - places[0]) == pytest.approx(5 / 9, abs=0.01)
    legend_row = 2 * text_height(SIZE)
    rows, columns = pixels_near(image, (255, 128, 0))[legend_row:].nonzero()
    assert np.polyfit(columns, rows, 1)[0] < -0.03, "it rises to the right"
    assert [columns.min(), columns.max()] == pytest.approx([places[0], places[2]], abs=2)
    legend = replace(LEGEND, plot=plot, marks=Marks(plot=True, color_bar=True))
    image = marked(gray(), legend, (0.0, 1.0)).astype(int)
    alone = Image.fromarray(marked(gray(), replace(legend, plot=None), (0.0, 1.0)))
    high, wide = (round((1 - PLOT_HEIGHT) * extent) for extent in SIZE[::-1])
    above = np.asarray(alone.resize((wide, high))).astype(int)
    left = (SIZE[0] - wide) // 2
    assert (image[: high - 2, left : left + wide] == above[: high - 2]).all()


def test_a_plot_has_values_at_its_axes_with_their_units_and_a_band() -> None:
    """Each is where the plot without it has nothing; the values are those at their places."""

    class Written(ImagePainter):
        texts: list[tuple[float, float, str]]

        def text(self, left: float, top: float, text: str) -> None:
            self.texts = [*getattr(self, "texts", []), (left, top, text)]

    area = DrawnCurve("area", "mm²", 0x3D9BE0, tuple(100.0 + 50 * n for n in range(10)))
    painter = Written((1280, 720))
    assert draw_plot(painter, painter.image.size, replace(PLOT, curves=(RISE, area)), 9)
    texts = {text: (left, top) for left, top, text in painter.texts}
    assert {"time [s]", "mm", "mm²", "rise: 9.0 ± 1.5 mm", "area: 550 mm²"} <= set(texts)
    numbers = [(left, top, float(text)) for left, top, text in painter.texts if text[-1].isdecimal()]
    foot = texts["time [s]"][1] - 30
    left_axis = [(top, value) for left, top, value in numbers if left < 100 and top < foot]
    right_axis = [(top, value) for left, top, value in numbers if left > 1180 and value > 9]
    for axis, low, high in ((left_axis, -1.5, 10.5), (right_axis, 100, 550)):
        assert len(axis) >= 2
        tops, values = np.array(axis).T
        assert ((values >= low) & (values <= high)).all()
        assert np.ptp(np.diff(values)) < 1e-9
        assert np.diff(tops) / np.diff(values) == pytest.approx(np.diff(tops)[0] / np.diff(values)[0])
        assert tops[0] > tops[-1], "up is more"
    below = [value for left, top, value in numbers if top > foot]
    assert below[:2] == [0, 1]
    assert below[-1] == 9
    band = np.abs(plotted(PLOT) - plotted(replace(PLOT, curves=(replace(RISE, band=()),)))).max(axis=2) > 20
    assert band.mean() > 0.02
    anonymous = replace(PLOT, curves=(RISE, area)).without_names()
    assert (anonymous.x_label, {curve.name for curve in anonymous.curves}) == ("[s]", {""})


@pytest.mark.parametrize("size", [(96, 64), (300, 900), (20, 20), (1, 1)])
def test_a_plot_of_many_curves_keeps_to_its_place(size: tuple[int, int]) -> None:
    curves = tuple(replace(RISE, name=f"a measure {n}", unit="mm" * (n % 3)) for n in range(30))
    painter = ImagePainter(size)
    draw_plot(painter, size, replace(PLOT, curves=curves), 3)
    top = round((1 - PLOT_HEIGHT) * size[1])
    assert not np.asarray(painter.image)[: max(top - 1, 0), :, 3].any()


@pytest.mark.parametrize("seed", range(20))
def test_values_at_axes_are_round_and_as_many_as_fit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    low = rng.normal() * 10 ** rng.uniform(-6, 6)
    high = low + 10 ** rng.uniform(-5, 5)
    for most in (2, 3, 5, 10):
        values = round_values(low, high, most)
        assert len(values) <= most
        assert len(values) >= (most - 1) // 2 - 1
        slack = 1e-6 * (high - low)
        assert all(low - slack <= value <= high + slack for value in values)
        for step in np.diff(values):
            assert f"{step:.3e}"[:5] in ("1.000", "2.000", "5.000", "10.00")


def test_what_is_behind_the_eye_is_no_line() -> None:
    camera = Camera(eye=(0, 0, 5), target=(0, 0, 0), up=(0, 1, 0))
    line = distance((0, 0, 6), (1, 0, 6), "behind")
    legend = replace(LEGEND, marks=Marks(measure_lines=True), camera=camera, overlay=overlay_of([line]))
    assert (marked(gray(), legend, None) == gray()).all()


def test_levels_and_holes_have_a_swatch_each_in_the_colour_that_is_shown() -> None:
    assert not swatches(LEGEND.look)
    told = swatches(Look(color_by="level", holes=True))
    assert [text for _, text in told] == [
        "Measured", "Level 1", "Level 2", "Level 3", "Level 4", "Level 5 and above", "Hole",
    ]  # fmt: skip
    assert [color for color, _ in told[1:]] == [rgba(color) for color in (*LEVEL_COLORS, HOLE_COLOR)]
    for size in (SIZE, (300, 900), (96, 64)):
        legend = replace(LEGEND, marks=Marks(color_bar=True), look=Look(color_by="level", holes=True))
        image = marked(gray(size), legend, None)
        rows = [np.nonzero((image == color).all(axis=2))[0] for color, _ in told[1:]]
        assert all(len(above) for above in rows)
        assert all(above.max() < below.min() for above, below in pairwise(rows)), "in their order"
        left, top, right, bottom = changed(image)
        assert size[0] / 2 < left < right < size[0]
        assert size[1] / 8 < top < bottom < size[1]


def test_swatches_stand_above_the_colour_bar() -> None:
    legend = replace(LEGEND, marks=Marks(color_bar=True), look=replace(LEGEND.look, holes=True))
    image = marked(gray(), legend, VALUES)
    bar = with_marks(color_bar=True)
    top = changed(bar)[1]
    assert (image[top:] == bar[top:]).all()
    assert (image[:top] == rgba(HOLE_COLOR)).all(axis=2).any()


def test_the_range_is_the_one_that_was_shaded_with(draw: Callable[..., Surface]) -> None:
    rng = np.random.default_rng(0)
    cloud = PointCloud.from_arrays(rng.random((500, 3)) + np.array([0, 1e7, 0]))
    surface = draw(cloud, Camera.orbit(cloud.bounds()), look=Look(color_by="height"))
    assert surface.color_range is not None
    assert 1e7 < surface.color_range[0] < 1e7 + 0.1 < 1e7 + 0.9 < surface.color_range[1] < 1e7 + 1
    assert draw(cloud, Camera.orbit(cloud.bounds())).color_range is None


def test_the_colour_bar_says_where_its_range_is_from() -> None:
    height = replace(LEGEND, look=Look(color_by="height"), count=8)
    assert range_note(height) == ""
    assert range_note(replace(height, range_note="range of 2 of 8 frames")) == "range of 2 of 8 frames"
    own = replace(height, look=Look(color_by="height", range="frame", low=1.0))
    assert range_note(own) == "range of this frame"
    assert range_note(replace(own, count=1)) == "", "which all frames have"
    assert range_note(replace(own, look=replace(own.look, high=2.0))) == "", "which is given"
    plain = marked(gray(), replace(height, marks=Marks(color_bar=True)), VALUES)
    told = marked(gray(), replace(own, marks=Marks(color_bar=True)), VALUES)
    assert changed(told)[1] < changed(plain)[1], "a line more"


@pytest.mark.parametrize("size", [(1, 1), (10, 8), (3, 100), (100, 3), (20, 20)])
def test_in_the_smallest_pictures_what_has_no_pixel_is_left_out(size: tuple[int, int]) -> None:
    assert marked(gray(size), replace(LEGEND, marks=ALL), VALUES).shape == (*size[::-1], 4)


def test_notes_on_a_frame_stand_below_the_stamp() -> None:
    stamped = marked(gray(), replace(LEGEND, marks=Marks(stamp=True)), None)
    told = marked(gray(), replace(LEGEND, marks=Marks(stamp=True, notes=True), notes=("scar",)), None)
    rows = np.flatnonzero((told != stamped).any(axis=(1, 2)))
    stamp_rows = np.flatnonzero((stamped != gray()).any(axis=(1, 2)))
    assert rows.min() > stamp_rows.max(), "off the stamp"
    assert rows.max() < stamp_rows.max() + 2 * len(stamp_rows)
