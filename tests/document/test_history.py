"""Every change can be undone and redone, whatever it changes; what goes on at once is one step."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from viewer.analysis.surface_point import SurfacePoint
from viewer.backends import backend
from viewer.camera import Camera
from viewer.document.document import Bookmark, Document
from viewer.document.history import MOST_STEPS, History
from viewer.document.landmarks import Landmarks
from viewer.document.part import Part
from viewer.look import COLOR_MAPS

START = Document(camera=Camera(eye=(0, 0, 5)))
Change = Callable[[Document, np.random.Generator], Document]


def with_distance(document: Document, number: float) -> Document:
    ends = ([SurfacePoint(0, 0.0, (number, 0, side), 3, 0.1, 0)] for side in (0, 1))
    return document.with_part(document.part(Landmarks).with_distance(*ends))


def moved(document: Document, rng: np.random.Generator) -> Document:
    assert document.camera is not None
    return replace(document, camera=document.camera.orbited(*rng.uniform(-40, 40, 2)))


def recolored(document: Document, rng: np.random.Generator) -> Document:
    return replace(document, look=replace(document.look, color_map=str(rng.choice(COLOR_MAPS))))


def resized(document: Document, rng: np.random.Generator) -> Document:
    return document.with_params("points", backend("points").params({"point_size": int(rng.integers(1, 30))}))


def drawn_otherwise(document: Document, rng: np.random.Generator) -> Document:
    return replace(document, backend=str(rng.choice(["points", "surfels", "voxels"])))


def bookmarked(document: Document, rng: np.random.Generator) -> Document:
    assert document.camera is not None
    mark = Bookmark(f"View {rng.integers(100)}", document.camera)
    return replace(document, bookmarks=(*document.bookmarks, mark))


def measured(document: Document, rng: np.random.Generator) -> Document:
    return with_distance(document, float(rng.random()))


def forgotten(document: Document, rng: np.random.Generator) -> Document:
    made = document.part(Landmarks)
    return document.with_part(made.without_measures(one.name for one in made.distances[:1]))


CHANGES: tuple[Change, ...] = (
    moved, recolored, resized, drawn_otherwise, bookmarked, measured, forgotten,
)  # fmt: skip


def test_fifty_mixed_changes_are_undone_to_the_very_same_documents_and_redone() -> None:
    rng = np.random.default_rng(13)
    history, states, names = History(START), [START], []
    while len(names) < 50:
        change = CHANGES[rng.integers(len(CHANGES))]
        history.change(change.__name__, change(history.document, rng))
        if history.document != states[-1]:
            states.append(history.document)
            names.append(change.__name__)
    assert set(names) == {change.__name__ for change in CHANGES}
    for state, name in zip(states[-2::-1], names[::-1], strict=True):
        assert history.undoes == name
        history.undo()
        assert history.document is state
    assert history.undoes is None
    history.undo()
    assert history.document is START
    for state, name in zip(states[1:], names, strict=True):
        assert history.redoes == name
        history.redo()
        assert history.document is state
    assert history.redoes is None


def test_a_change_after_undo_is_the_end_of_what_was_undone() -> None:
    history = History(START)
    for unit in ("mm", "cm"):
        history.change(f"Unit {unit}", replace(history.document, unit=unit))
    history.undo()
    history.change("Unit m", replace(history.document, unit="m"))
    assert history.redoes is None
    history.undo()
    assert (history.document.unit, history.undoes, history.redoes) == ("mm", "Unit mm", "Unit m")


def test_what_changes_nothing_is_no_step() -> None:
    history = History(START)
    history.change("Fit", replace(START))
    assert history.undoes is None


def dragged(history: History, *distances: float, key: str = "drag") -> None:
    for distance in distances:
        camera = Camera(eye=(0, 0, distance))
        history.change("Move view", replace(history.document, camera=camera), key)


def test_a_drag_is_one_step_and_the_next_one_another() -> None:
    history = History(START)
    dragged(history, 6, 7, 8)
    history.settle()
    dragged(history, 9, 10)
    history.undo()
    assert history.document.camera == Camera(eye=(0, 0, 8))
    history.undo()
    assert history.document is START
    history.redo()
    dragged(history, 9)
    assert history.undoes == "Move view"
    history.undo()
    assert history.document.camera == Camera(eye=(0, 0, 8)), "what was redone is not merged with"


def test_another_change_ends_a_drag() -> None:
    history = History(START)
    dragged(history, 6)
    history.change("Name unit", replace(history.document, unit="mm"))
    dragged(history, 7)
    dragged(history, 8, key="another")
    for camera, unit in ((7, "mm"), (6, "mm"), (6, None), (5, None)):
        history.undo()
        assert history.document == Document(Camera(eye=(0, 0, camera)), unit=unit)


def test_a_drag_that_ends_where_it_began_is_no_step() -> None:
    history = History(START)
    history.change("Name unit", replace(START, unit="mm"))
    dragged(history, 6, 7, 5)
    assert history.undoes == "Name unit"
    dragged(history, 6)
    history.undo()
    assert history.document == replace(START, unit="mm")


def test_what_nobody_changed_is_no_step() -> None:
    history = History(Document())
    history.amend(START)
    assert (history.document, history.undoes) == (START, None)


def test_it_keeps_so_many_steps_which_share_what_they_do_not_change() -> None:
    document = START
    for number in range(500):
        document = with_distance(document, number)
    history = History(document)
    tracemalloc.start()
    for number in range(2 * MOST_STEPS):
        history.change("Move", replace(history.document, camera=Camera(eye=(0, 0, 6.0 + number))))
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert held < 2_000 * MOST_STEPS
    for _ in range(2 * MOST_STEPS):
        history.undo()
    assert history.document.camera == Camera(eye=(0, 0, 5.0 + MOST_STEPS))
    assert history.undoes is None


def test_a_tool_declares_what_it_keeps_and_finds_it_again() -> None:
    @dataclass(frozen=True)
    class Places(Part, name="tests.landmarks"):
        names: tuple[str, ...] = ()

    try:
        document = START.with_part(Places(("nasion",)))
        assert START.part(Places) == Places()
        assert document.part(Places).names == ("nasion",)
        assert document.part(Landmarks) == Landmarks()
        with pytest.raises(TypeError, match=r"tests\.landmarks"):

            class Others(Part, name="tests.landmarks"):
                pass
    finally:
        del Part.kinds["tests.landmarks"]
