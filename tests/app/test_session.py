"""What the user has chosen outlives a switch, and each change of it can be undone."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from viewer.app.playing.playback import Playback
from viewer.app.scene.rendering import Rendering
from viewer.app.session import Session, SessionSettings, edit_name
from viewer.backends import backend
from viewer.camera import Camera
from viewer.choice.configurations import Configuration
from viewer.choice.goal import Goal
from viewer.document.document import Document
from viewer.document.saved_session import SavedSession
from viewer.document.schema import usable
from viewer.look import Look
from viewer.rigid import STILL, Rigid
from viewer.scan.layers import NO_LAYERS
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

BARE = Pose(3, 0.5, "three", PointCloud.from_arrays([[0.0, 0, 0], [1, 1, 0], [0.3, 0.8, 0.5]]))
LARGE = backend("points").params({"point_size": 7})


def test_parameters_outlive_a_switch_of_backends() -> None:
    document = Document(camera=Camera(), backend="points").with_params("points", LARGE)
    document = replace(document, backend="surfels")
    document.request(BARE)
    assert replace(document, backend="points").request(BARE).params.point_size == 7


def test_the_scan_decides_until_the_user_does() -> None:
    by_itself = Document().chosen(BARE)
    assert by_itself == ("points", backend("points").params({"point_size": 0}))
    assert Document(backend="points").chosen(BARE) == by_itself
    assert Document(backend="surfels").chosen(BARE)[0] == "surfels"


def test_a_scan_is_found_again_where_it_was_left() -> None:
    session = Session("one", Document(camera=Camera(), pivot=(1, 2, 3)))
    session.index = 4
    session.change("Name unit", unit="mm")
    session.turn_to("two")
    assert session.document == Document(), "another scan's place means nothing here"
    assert session.index == 0
    session.index = 2
    session.turn_to("one")
    assert (session.index, session.document) == (4, Document(Camera(), (1, 2, 3), unit="mm"))
    session.history.undo()
    assert session.document == Document(Camera(), (1, 2, 3)), "what was done before can be undone"
    session.turn_to("two")
    assert session.index == 2


def restarted(session: Session) -> Document:
    """The document that a new scan begins with after a restart."""
    return usable(SessionSettings(), json.loads(json.dumps(session.remembered()))).document


SOME = Pose(0, 0.0, "some", PointCloud.from_arrays([[0.0, 0, 0], [1, 1, 0]], normals=[[0.0, 0, 1]] * 2))


def rendered(session: Session, pose: Pose = SOME) -> tuple[str, object]:
    """The renderer of a pose, and its parameters."""
    return session.document.chosen(pose)


def test_a_choice_for_one_scan_says_nothing_of_the_next() -> None:
    session = Session("one")
    of_its_own = rendered(session)
    assert of_its_own[0] == "surfels"
    session.change("Choose", backend="points", params={"points": LARGE}, goal=Goal("time", 20.0))
    session.change("Colour", look=Look(light="flat", color_by="#1", low=3.0, high=4.0))
    session.turn_to("two")
    assert rendered(session) == of_its_own
    assert session.document == Document(look=Look(light="flat")), "how light it is goes with the user"
    assert restarted(session) == session.document, "after a restart as well"
    session.turn_to("one")
    assert session.document.goal == Goal("time", 20.0), "where it was chosen it stays"


def rendering_of(session: Session) -> Iterator[Rendering]:
    with closing(open_scan("demo")) as timeline:
        playback = Playback(timeline, session)
        playback.pose = SOME
        yield Rendering(session, playback, pytest.fail)


def test_a_renderer_for_all_scans_is_chosen_and_cleared() -> None:
    session = Session("one")
    for rendering in rendering_of(session):
        assert not rendering.is_for_all
        rendering.choose("points")
        rendering.edit_params(LARGE)
        rendering.toggle_for_all()
        assert rendering.is_for_all
        session.turn_to("two")
        assert rendered(session) == ("points", LARGE)
        again = Session("three", restarted(session))
        assert rendered(again) == ("points", LARGE), "after a restart as well"

        rendering.choose("voxels")
        assert not rendering.is_for_all
        assert rendering.others_begin_with == "Points"
        rendering.clear_for_all()
        assert rendering.others_begin_with == ""
        session.turn_to("four")
        assert rendered(session)[0] == "surfels"

        rendering.aim(Goal("time", 20.0))
        rendering.toggle_for_all()
        session.turn_to("five")
        assert (session.document.goal, session.document.backend) == (Goal("time", 20.0), None)
        assert rendering.is_for_all
        rendering.toggle_for_all()
        session.turn_to("six")
        assert session.document == Document()


def test_a_renderer_for_all_scans_that_cannot_draw_one_is_told() -> None:
    session = Session("one", Document(backend="laplacian"))
    told: list[str] = []
    with closing(open_scan("demo")) as timeline:
        Rendering(session, Playback(timeline, session), told.append).tell_missing(SOME)
    assert rendered(session)[0] == "surfels"
    assert told == ["Merged views cannot draw this scan. Discs draws the scan instead."]


def test_what_is_up_in_one_scan_says_nothing_of_the_next() -> None:
    session = Session("one", Document(look=Look(light="flat", up="-y")))
    session.turn_to("two")
    assert session.document.look == Look(light="flat")
    session.turn_to("three", up="+z")
    assert session.document.look.up == "+z"
    session.turn_to("one", up="+z")
    assert session.document.look.up == "-y", "as it was left"


def test_a_saved_session_takes_the_place_of_what_is_there_and_can_be_undone() -> None:
    session = Session("one", Document(camera=Camera()))
    session.turn_to("two")
    saved = SavedSession("one", None, 5, Document(camera=Camera(eye=(0, 0, 9))))
    session.turn_to("one")
    session.take_up(saved)
    assert session.document == saved.document
    session.history.undo()
    assert session.document == Document(camera=Camera())
    session.turn_to("three", saved)
    assert (session.index, session.document) == (5, saved.document)
    assert session.history.undoes is None, "that is how it begins"


def test_a_frame_without_the_chosen_scalar_is_drawn_in_other_colours_and_the_choice_stays() -> None:
    with_q = replace(BARE, points=replace(BARE.cloud, scalars={"q": np.zeros(3, np.float32)}))
    document = Document(camera=Camera(), look=Look(color_by="q", light="flat"))
    assert document.request(with_q).look == document.look
    assert document.request(BARE).look == Look(color_by="auto", light="flat")
    assert document.request(with_q).look.color_by == "q"


def test_a_renderer_that_is_not_there_is_told_once_and_another_one_draws() -> None:
    document = Document(camera=Camera(), backend="gone", params={"gone": {"size": 3}})
    assert document.defaults(BARE) == Document().defaults(BARE)
    assert document.request(BARE).backend.name == "points"
    told: list[str] = []
    session = Session("one", document)
    with closing(open_scan("demo")) as timeline:
        rendering = Rendering(session, Playback(timeline, session), told.append)
        for _ in range(2):
            rendering.tell_missing(BARE)
    assert told == ["This version of Scan4D has no renderer 'gone'. Points draws the scan instead."]
    assert session.document == document, "it comes back where the renderer is there"


ONE_PASS = Configuration("surfels", {"passes": "one"})


def test_what_is_chosen_automatically_stands_in_for_what_the_user_chose() -> None:
    own = Document(camera=Camera(), backend="points").with_params("points", LARGE)
    document = replace(own, goal=Goal("time", 50.0))
    assert document.chosen(BARE) == own.chosen(BARE), "until one is chosen"
    document = replace(document, configuration=ONE_PASS)
    assert document.chosen(BARE) == ("surfels", backend("surfels").params({"passes": "one"}))
    assert document.defaults(BARE) == ("surfels", backend("surfels").params())
    assert document.drawn_by("points").chosen(BARE) == own.chosen(BARE)
    assert replace(document, goal=None).chosen(BARE) == own.chosen(BARE)


def test_a_scan_begins_with_the_goal_of_the_one_before_and_chooses_anew() -> None:
    session = Session("one", Document(camera=Camera(), goal=Goal("time", 50.0), configuration=ONE_PASS))
    session.turn_to("two")
    assert session.document == Document(goal=Goal("time", 50.0))


@pytest.mark.parametrize("act", ["renderer", "parameter", "switch off", "defaults"])
def test_the_automatic_choice_ends_with_what_is_done_by_hand_and_comes_back_by_undo(act: str) -> None:
    document = Document(camera=Camera(), backend="points").with_params("points", LARGE)
    session = Session("demo", document)
    with closing(open_scan("demo")) as timeline:
        playback = Playback(timeline, session)
        playback.pose = timeline.pose(0)
        rendering = Rendering(session, playback, str)
        rendering.aim(Goal("time", 50.0))
        session.amend(configuration=ONE_PASS)
        aimed = session.document
        two = backend("surfels").params({"passes": "two"})
        {
            "renderer": lambda: rendering.choose("voxels"),
            "parameter": lambda: rendering.edit_params(two),
            "switch off": lambda: rendering.aim(None),
            "defaults": rendering.reset,
        }[act]()
    expected = {
        "renderer": document.drawn_by("voxels"),
        "parameter": document.drawn_by("surfels").with_params("surfels", two),
        "switch off": document,
        "defaults": replace(document.drawn_by(None), params={}),
    }
    assert session.document == expected[act]
    session.history.undo()
    assert session.document == aimed
    session.history.undo()
    assert session.document == document
    session.history.redo()
    assert session.document == aimed


def test_bounds_that_follow_one_another_are_one_step() -> None:
    session = Session("demo")
    with closing(open_scan("demo")) as timeline:
        rendering = Rendering(session, Playback(timeline, session), str)
        for bound in (50.0, 40.0, 30.0):
            rendering.aim(Goal("time", bound))
    assert session.document.goal == Goal("time", 30.0)
    session.history.undo()
    assert session.document.goal == Goal("time", 50.0)


def moved(x: float) -> Rigid:
    return Rigid(np.block([[np.eye(3), np.array([[x], [0], [0]])], [np.zeros((1, 3)), 1]]))


def test_what_tools_lay_is_merged_and_goes_with_the_scan() -> None:
    quarter = Rigid(np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]))
    first, second = np.arange(3.0), -np.arange(3.0)
    session = Session("one")
    laid = session.laid
    assert laid.layers(BARE) is NO_LAYERS
    laid.lay("a", lambda pose: {"q": first, "a": first}, moved)
    laid.lay("b", lambda pose: {"q": second}, lambda index: quarter)
    layers = laid.layers(BARE)
    assert laid.layers(BARE) is layers, "so that nothing is drawn again"
    assert layers.scalars["q"] is second
    assert layers.scalars["a"] is first
    np.testing.assert_array_equal(layers.world_from_pose.points(np.zeros(3)), (0, 3, 0))
    laid.lay("a", lambda pose: {"q": first}, moved)
    layers = laid.layers(BARE)
    assert layers.scalars["q"] is first
    np.testing.assert_array_equal(layers.world_from_pose.points(np.array([1.0, 0, 0])), (3, 1, 0))
    laid.take_away("b")
    np.testing.assert_array_equal(laid.world_from_pose(7).points(np.zeros(3)), (7, 0, 0))
    session.turn_to("two")
    assert laid.layers(BARE) is NO_LAYERS


def test_a_pose_that_is_replayed_stands_where_it_was_and_has_its_own_numbers() -> None:
    pose = replace(BARE, points=replace(BARE.cloud, scalars={"q": np.zeros(3)}))
    laid = Session("one").laid
    laid.lay("a", lambda pose: {"q": np.ones(3), "a": np.ones(3)}, moved)
    laid.replay(pose.index, moved(-1))
    assert list(laid.layers(pose).scalars) == ["a"]
    np.testing.assert_array_equal(laid.layers(pose).world_from_pose.points(np.zeros(3)), (-1, 0, 0))
    np.testing.assert_array_equal(laid.world_from_pose(4).points(np.zeros(3)), (4, 0, 0))
    laid.lay("b", lambda pose: {}, lambda index: STILL)
    assert list(laid.layers(pose).scalars) == ["q", "a"]
    np.testing.assert_array_equal(laid.layers(pose).world_from_pose.points(np.zeros(3)), (3, 0, 0))


def test_a_change_of_a_parameter_is_called_by_its_name() -> None:
    assert edit_name(Look(), Look(color_map="oslo")) == "Change colour map"
    assert edit_name(backend("points").params(), LARGE) == "Change point size"
    assert edit_name(Look(), Look(color_map="oslo", light="flat")) == "Change parameters"
