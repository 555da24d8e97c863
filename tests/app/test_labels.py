"""Labels over the view stay readable: in it, off their lines, off ends and off each other."""

from __future__ import annotations

import numpy as np
from imgui_bundle import ImVec2

from viewer.app.scene.labels import Box, free_place, usual_place

AREA, SIZE, GAP = Box(ImVec2(0, 40), ImVec2(600, 400)), ImVec2(90, 30), 8
LINE = ImVec2(200, 200), ImVec2(400, 200)


def test_they_cover_neither_their_line_nor_ends_nor_each_other() -> None:
    rng = np.random.default_rng(0)
    for count in (1, 3, 6):
        for _ in range(20):
            lines = [(ImVec2(*a), ImVec2(*b)) for a, b in rng.uniform((0, 40), (600, 400), (count, 2, 2))]
            taken = [Box.around(end, ImVec2(9, 9)) for line in lines for end in line]
            placed = 0
            for line in lines:
                if box := free_place(SIZE, line, GAP, AREA, taken, lines):
                    assert inside(box)
                    assert box.clipped(*line) is None
                    assert not any(box.overlaps(other) for other in taken)
                    taken.append(box)
                    placed += 1
            assert placed >= min(count, 5), "there is room"


def test_other_lines_are_left_free_where_they_can_be() -> None:
    above = ImVec2(150, 175), ImVec2(450, 175)
    assert usual_place(SIZE, LINE, GAP, AREA).clipped(*above) is not None
    box = free_place(SIZE, LINE, GAP, AREA, [], [LINE, above])
    assert box is not None
    assert box.clipped(*above) is None


def test_without_room_there_is_no_place_and_the_usual_one_stays_in_the_view() -> None:
    assert free_place(SIZE, LINE, GAP, AREA, [AREA], [LINE]) is None
    for x, y in ((0, 40), (600, 40), (300, 400)):
        corner = ImVec2(x, y)
        assert inside(usual_place(SIZE, (corner, corner), GAP, AREA))
    assert usual_place(ImVec2(900, 30), LINE, GAP, AREA).low.x == 0, "its beginning is read"


def inside(box: Box) -> bool:
    return (
        AREA.low.x <= box.low.x and box.high.x <= AREA.high.x + 1e-3
        and AREA.low.y <= box.low.y and box.high.y <= AREA.high.y + 1e-3
    )  # fmt: skip
