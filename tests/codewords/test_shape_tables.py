"""Tables of shapes against a rasteriser that looks at each pixel."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.codewords.tables import LARGE, PAPER, ShapeTable, Steps, shape_table
from viewer.errors import InputError


def brute_force(steps: Steps, size: int, i: int, j: int, reach: int) -> NDArray[np.bool_]:
    """Whether each pixel's centre is inside of the ellipse or on it, (2 reach, 2 reach), in fractions."""
    radius = Fraction(size, steps.size_parts)
    across, down = Fraction(i, steps.normal_parts), Fraction(j, steps.normal_parts)
    half = Fraction(1, 2)

    def covered(x: int, y: int) -> bool:
        u, v = x + half, y + half
        return u * u + v * v + (across * u + down * v) ** 2 <= radius * radius

    return np.array([[covered(x, y) for x in range(-reach, reach)] for y in range(-reach, reach)])


def bitmap(table: ShapeTable, size: int, i: int, j: int) -> NDArray[np.bool_]:
    columns = np.arange(-table.reach, table.reach)
    spans = table.spans(size, i, j)
    return (columns >= spans[:, :1]) & (columns <= spans[:, 1:])


@pytest.mark.parametrize(
    "steps", [PAPER, Steps(9, 1, 9, 2), Steps(33, 4, 21, 3)], ids=["paper", "coarse", "finer"]
)
@pytest.mark.slow
def test_entries_are_what_a_look_at_each_pixel_gives(steps: Steps) -> None:
    table, rng = shape_table(steps), np.random.default_rng(1)
    ends = (-steps.steepest, 0, steps.steepest)
    normals = [(i, j) for i in ends for j in ends]
    normals += [(int(i), int(j)) for i, j in rng.integers(-steps.steepest, steps.steepest + 1, (12, 2))]
    for size in range(steps.sizes):
        for i, j in normals[size % 3 :: 3]:
            expected = brute_force(steps, size, i, j, table.reach)
            assert np.array_equal(bitmap(table, size, i, j), expected), (size, i, j)


@pytest.mark.slow
def test_every_entry_of_the_papers_table() -> None:
    """The rule at each pixel of all shapes, of which opposite normals share one, without fractions."""
    table, steps = shape_table(), np.arange(-30, 31)
    u = 2 * np.arange(-table.reach, table.reach) + 1
    for j in steps[30:]:
        across = (steps[:, None, None] * u + j * u[:, None]) ** 2  # (i, y, x)
        form = 25 * (u * u + (u * u)[:, None]) + across
        for size in range(17):
            shapes = np.array([bitmap(table, size, int(i), int(j)) for i in steps])
            assert np.array_equal(shapes, form <= (5 * size) ** 2), (size, j)


def test_shapes_are_symmetric_about_their_middle_and_opposite_normals_share_one() -> None:
    table = shape_table()
    for size, i, j in ((3, 4, -7), (9, -30, 11), (16, 30, 30)):
        shape = bitmap(table, size, i, j)
        assert np.array_equal(shape, shape[::-1, ::-1])
        assert np.array_equal(shape, bitmap(table, size, -i, -j))
        assert np.array_equal(shape[:, ::-1], bitmap(table, size, -i, j))


def test_shapes_within_eight_pixels_are_the_field_of_a_word() -> None:
    table = shape_table()
    assert (table.entries[:9] < LARGE).all()  # radii up to 4 pixels
    assert (table.entries[14:] >= LARGE).all()
    places = np.sort(table.entries[table.entries >= LARGE] - np.uint32(LARGE))
    assert np.array_equal(places, np.arange(len(places)) * table.reach)
    assert len(table.rows) == len(places) * table.reach


def test_the_table_is_packed() -> None:
    """The figures that docs give: 17 x 61 x 61 shapes."""
    table = shape_table()
    assert table.steps.sizes * table.steps.normals**2 == 63_257
    assert (table.nbytes, table.bitmap_bytes) == (303_748, 1_037_488)


@pytest.mark.parametrize(
    ("steps", "words"),
    [
        ((17, 2, 60, 5), "number of values of n'x in the table must be odd, not 60"),
        ((17, 0, 61, 5), "at least 1"),
        ((400, 2, 61, 5), "not exceed 64 pixels"),
    ],
)
def test_steps_that_make_no_table_are_refused(steps: tuple[int, int, int, int], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Steps(*steps)
