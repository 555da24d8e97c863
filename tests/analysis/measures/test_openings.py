"""Measures over holes, openings, folds and borders: right, or refused with the reason."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from shapes import Frames, found, pose_of, refused, track_of

from viewer.analysis.measures import Measure
from viewer.analysis.measures.series import all_series, series_of, surface_of
from viewer.analysis.measures.surface import PoseSurface
from viewer.analysis.track import Known
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud

UP = np.array([0.0, 0, 1])


def sheet(width: float, height: float, seed: int = 0) -> np.ndarray:
    """Places of a rectangle about the origin, a unit apart and moved about, (N, 2)."""
    places = np.stack(np.meshgrid(np.arange(0, width + 1), np.arange(0, height + 1)), axis=-1).reshape(-1, 2)
    shift = np.random.default_rng(seed).uniform(-0.25, 0.25, places.shape)
    return places + shift - np.array([width, height]) / 2


def flat(places: np.ndarray) -> PoseSurface:
    """The surface of points in the plane z = 0, from places (N, 2)."""
    points = np.pad(places, ((0, 0), (0, 1)))
    return PoseSurface(pose_of(points, normals=np.tile(UP, (len(points), 1))))


def ring(radius: float, count: int = 24, z: float = 0.0) -> np.ndarray:
    """Places on a circle about the z axis, (K, 3)."""
    turns = 2 * np.pi * np.arange(count) / count
    return np.stack([radius * np.cos(turns), radius * np.sin(turns), np.full(count, z)], axis=1)


def polygon(radius: float, count: int = 24) -> float:
    """The area of the polygon through such a ring."""
    return count / 2 * radius**2 * np.sin(2 * np.pi / count)


def turned(profile: Sequence[tuple[float, float]], count: int = 72) -> PoseSurface:
    """The faces that a profile of (radius, z) makes as it turns about the z axis."""
    turns = 2 * np.pi * np.arange(count) / count
    points = np.array([(r * np.cos(t), r * np.sin(t), z) for r, z in profile for t in turns])
    i, j = (each.ravel() for each in np.mgrid[: len(profile) - 1, :count])
    a, b = i * count + j, i * count + (j + 1) % count
    faces = np.concatenate([np.stack([a, b, a + count], axis=1), np.stack([b, b + count, a + count], axis=1)])
    return PoseSurface(pose_of(points), faces.astype(np.uint32))


def arc(radius: float, start: float, end: float, z: float, count: int = 24) -> list[tuple[float, float]]:
    """A profile of a sphere about (0, z) between two angles from its pole, degrees."""
    angles = np.radians(np.linspace(start, end, count))
    return [(radius * np.sin(angle), z + radius * np.cos(angle)) for angle in angles]


@pytest.fixture(scope="module")
def holed() -> PoseSurface:
    places = sheet(44, 44)
    return flat(places[np.linalg.norm(places, axis=1) > 6])


@pytest.mark.parametrize("order", [1, -1])
def test_a_region_around_a_hole_is_a_ring(holed: PoseSurface, order: int) -> None:
    corners = ring(13)[::order]
    ring_area = polygon(13) - np.pi * 6**2
    area = found(holed, "area", corners)
    assert area.value == pytest.approx(ring_area, rel=0.03)
    assert area.share == pytest.approx(ring_area / polygon(13), abs=0.02)
    outline = found(holed, "perimeter", corners)
    assert outline.value == pytest.approx(24 * 26 * np.sin(np.pi / 24), rel=5e-3)
    assert "% of the outline" in refused(holed, "volume", corners)


def test_paths_around_a_hole_are_refused_and_those_beside_it_are_not(holed: PoseSurface) -> None:
    reason = "the path from 0 to 1 goes around an opening"
    across = np.array([[-10.0, 0, 0], [10, 0, 0]])
    assert refused(holed, "path", across) == reason
    assert refused(holed, "path", across[::-1]) == reason
    assert refused(holed, "path", np.array([[0.0, 10, 0], *across])).startswith("the path from 1 to 2 goes")
    beside = np.array([[-10.0, 8, 0], [10, 8, 0]])
    assert found(holed, "path", beside).value == pytest.approx(20, rel=2e-3)


@pytest.mark.parametrize("order", [1, -1])
def test_an_outline_crosses_a_hole_straight(holed: PoseSurface, order: int) -> None:
    corners = np.array([[-10.0, 0, 0], [10, 0, 0], [0, 12, 0]])[::order]
    area, outline = (found(holed, kind, corners) for kind in ("area", "perimeter"))
    assert area.value == pytest.approx(120 - np.pi * 18, abs=2 * area.deviation + 4)
    assert area.share == pytest.approx(1 - np.pi * 18 / 120, abs=0.04)
    assert outline.value == pytest.approx(20 + 2 * np.hypot(10, 12), rel=5e-3)
    assert outline.share == pytest.approx(1 - 12 / outline.value, abs=0.03)
    assert "% of the outline" in refused(holed, "volume", corners)


def test_the_end_of_a_patch_is_no_opening() -> None:
    """What a cone has within an outline around it reaches far beyond the first patch, which ends there."""
    cone = [(12 - z / 10, float(z)) for z in range(-20, 81)]
    surface = turned([*cone, *((radius, 80.0) for radius in np.linspace(4, 0.2, 6)[1:])])
    area = found(surface, "area", ring(12))
    assert area.value == pytest.approx(np.pi * (12 + 4) * np.hypot(80, 8) + np.pi * 4**2, rel=0.02)


def test_a_path_that_touches_a_hole_tells_how_much_longer_that_may_make_it(holed: PoseSurface) -> None:
    path = found(holed, "path", np.array([[-14.0, 5.6, 0], [14, 5.6, 0]]))
    assert path.value - 28 < 2 * path.deviation
    assert path.value == pytest.approx(28, rel=0.02)


def test_two_lips_apart_are_no_region() -> None:
    """Two sheets with a gap of four spacings between, joined at one end or at none."""
    places = sheet(40, 24)
    apart = flat(places[np.abs(places[:, 1]) > 2.6])
    corners = np.array([[-10.0, -6, 0], [10, -6, 0], [10, 6, 0], [-10, 6, 0]])
    for kind in ("area", "perimeter", "volume"):
        assert refused(apart, kind, corners) == "no surface connects 1 and 2"
    joined = flat(places[(np.abs(places[:, 1]) > 2.6) | (places[:, 0] < -15)])
    for kind in ("area", "perimeter", "volume"):
        assert refused(joined, kind, corners) == "the path from 1 to 2 goes around an opening"


def test_a_cylinder_with_a_slit() -> None:
    """The slit runs along it; paths over it are refused, those beside it are helices."""
    radius, places = 20.0, sheet(80, 60)
    places = places[(np.abs(places[:, 0]) > 2.6) | (np.abs(places[:, 1]) > 14)]
    turn = places[:, 0] / radius
    normals = np.stack([np.sin(turn), 0 * turn, np.cos(turn)], axis=1)
    surface = PoseSurface(pose_of(radius * normals + places[:, [1]] * [0, 1, 0], normals=normals))

    def at(*unrolled: tuple[float, float]) -> np.ndarray:
        x, y = np.array(unrolled).T
        return np.stack([radius * np.sin(x / radius), y, radius * np.cos(x / radius)], axis=1)

    assert refused(surface, "path", at((-8, 0), (8, 0))).endswith("goes around an opening")
    assert found(surface, "path", at((-8, 18), (8, 20))).value == pytest.approx(np.hypot(16, 2), rel=5e-3)
    corners = at((-10, -20), (0, -20), (10, -20), (10, 0), (10, 20), (0, 20), (-10, 20), (-10, 0))
    area = found(surface, "area", corners)
    assert area.value == pytest.approx(20 * 40 - 5.2 * 28, rel=0.03)
    assert area.share == pytest.approx(1 - 5.2 * 28 / 800, abs=0.03)


MOUTH = [*arc(30, 60, 12, -20), *arc(14, 30, 175, -4)]  # a ball's cap, and the bag behind the opening in it


def test_what_lies_behind_an_opening_is_no_part_of_a_region() -> None:
    """The neck of a bag is an opening, wherever the bag ends."""
    surface = turned(MOUTH)
    neck, rim = np.radians(12), np.radians(40)
    corners = ring(30 * np.sin(rim), 24, 30 * np.cos(rim) - 20)
    area = found(surface, "area", corners)
    cap = 2 * np.pi * 900 * (np.cos(neck) - np.cos(rim))
    assert area.value == pytest.approx(cap, rel=0.03)
    assert area.share == pytest.approx(1 - np.sin(neck) ** 2 / np.sin(rim) ** 2, abs=0.03)
    across = ring(11, 2, np.sqrt(900 - 121) - 20)
    assert refused(surface, "path", across) == "the path from 0 to 1 goes around an opening"


def test_what_bulges_is_part_of_a_region() -> None:
    """A ball on a stalk has its neck as well, and all of it is within an outline around that."""
    surface = turned([*((r, 0.0) for r in np.linspace(30, 4, 20)), *arc(10, 156, 2, 9.2)])
    corners = ring(20)
    area = found(surface, "area", corners)
    ball = 2 * np.pi * 100 * (1 - np.cos(np.radians(156)))
    assert area.value == pytest.approx(polygon(20) - np.pi * 16 + ball, rel=0.03)


def test_an_outline_that_crosses_itself_is_refused(holed: PoseSurface) -> None:
    corners = np.array([[8.0, 8, 0], [18, 18, 0], [18, 8, 0], [8, 18, 0]])
    for kind, options in (("area", {}), ("volume", {}), ("area", {"depth": "through"})):
        assert "crosses itself" in refused(holed, kind, corners, **options)


def test_beyond_the_border_there_is_no_region() -> None:
    """A notch in the border, as deep as the region; a corner that lies beyond."""
    places = sheet(40, 40)
    notched = flat(places[(np.abs(places[:, 0]) > 4) | (places[:, 1] < 4)])
    corners = np.array([[-12.0, -8, 0], [12, -8, 0], [12, 12, 0], [-12, 12, 0]])
    assert refused(notched, "area", corners) == "the path from 2 to 3 goes around an opening"
    assert refused(notched, "perimeter", corners + np.array([16, 0, 0])) == "1 is off the surface"
    assert found(notched, "area", corners - np.array([0, 9, 0])).value == pytest.approx(480, rel=0.02)


LIPS = {  # frame -> where ten landmarks around the demo's lips are; in frame 0 the lips are closed
    0: (
        (-19.006, -54.691, 85.167), (-9.322, -52.569, 89.505), (0.215, -51.341, 88.564),
        (12.373, -52.654, 88.537), (21.246, -55.697, 83.7), (27.292, -60.337, 76.481),
        (10.329, -68.583, 82.278), (0.217, -69.793, 83.093), (-11.665, -68.662, 81.491),
        (-24.478, -60.43, 80.088),
    ),
    8: (
        (-18.584, -55.532, 85.209), (-9.183, -52.718, 89.527), (0.214, -51.341, 88.564),
        (12.145, -52.956, 88.574), (20.774, -56.738, 83.732), (26.815, -61.737, 76.41),
        (10.218, -70.746, 81.538), (0.217, -71.964, 82.296), (-11.531, -70.789, 80.768),
        (-23.999, -61.916, 79.966),
    ),
    12: (
        (-18.149, -57.302, 85.039), (-9.039, -52.951, 89.535), (0.214, -51.341, 88.564),
        (11.908, -53.495, 88.569), (20.297, -58.986, 83.457), (26.391, -64.918, 75.698),
        (10.162, -76.618, 79.171), (0.217, -78.035, 79.767), (-11.461, -76.519, 78.447),
        (-23.579, -65.348, 79.165),
    ),
    16: (
        (-17.431, -60.478, 84.616), (-8.783, -53.37, 89.553), (0.213, -51.349, 88.542),
        (11.489, -54.472, 88.554), (19.559, -62.981, 82.765), (25.957, -70.423, 73.979),
        (10.176, -86.911, 73.887), (0.217, -88.749, 74.125), (-11.481, -86.558, 73.288),
        (-23.17, -71.289, 77.262),
    ),
    24: (
        (-17.508, -60.205, 84.651), (-8.811, -53.33, 89.551), (0.214, -51.348, 88.542),
        (11.536, -54.383, 88.554), (19.635, -62.644, 82.826), (25.995, -69.976, 74.133),
        (10.174, -86.091, 74.362), (0.217, -87.897, 74.633), (-11.478, -85.758, 73.752),
        (-23.203, -70.808, 77.434),
    ),
}  # fmt: skip


def test_lips_that_part_are_measured_along_the_skin() -> None:
    """The demo has a mouth with teeth behind its lips. As these part the skin within their outline stays the
    same, to 5 %, and its wet rim comes out; teeth, and what else is behind, do not count. Where the mouth is
    wide the outline crosses its corners."""
    values, shares = {}, {}
    with open_scan("demo") as timeline:
        for frame, corners in LIPS.items():
            surface = surface_of(timeline, timeline.visit(frame))
            area, outline = (found(surface, kind, np.array(corners)) for kind in ("area", "perimeter"))
            values[frame], shares[frame] = area.value, area.share
            assert area.value < outline.value**2 / (4 * np.pi)
            assert outline.share > 0.95
            if frame < 16:
                assert outline.value == pytest.approx(121.6, rel=0.06)
    assert values[0] == pytest.approx(937, rel=0.02)
    assert [values[8], values[12]] == pytest.approx([values[0]] * 2, rel=0.05)
    assert [values[16], values[24]] == pytest.approx([values[0]] * 2, rel=0.1)
    assert shares[0] == pytest.approx(1)
    assert shares[16] < shares[24] < shares[12] < shares[8] < 0.93


@pytest.mark.slow
def test_why_a_frame_has_no_value_is_told_with_the_series() -> None:
    places = sheet(44, 44)
    holed = PointCloud.from_arrays(np.pad(places[np.linalg.norm(places, axis=1) > 6], ((0, 0), (0, 1))))
    whole = PointCloud.from_arrays(np.pad(places, ((0, 0), (0, 1))))
    tracks = {name: track_of([place] * 3) for name, place in (("a", (-10, 0, 0)), ("b", (10, 0, 0)))}
    tracks |= {f"c{n}": track_of([place] * 3) for n, place in enumerate(ring(13, 12).tolist())}
    tracks["c3"] = track_of([(0, 13, 0)] * 3, gaps=[2])
    measures = [
        Measure("way", "path", ("a", "b")),
        Measure("ring", "area", tuple(f"c{n}" for n in range(12))),
    ]
    with Frames([whole, holed, whole]).timeline() as timeline:
        series = all_series(measures, tracks, timeline)
    way, area = series["way"], series["ring"]
    assert np.isfinite(way.values).tolist() == [True, False, True]
    assert way.known.tolist() == [Known.TRACKED, Known.GAP, Known.TRACKED]
    assert [way.note(frame) for frame in range(3)] == ["", "the path from a to b goes around an opening", ""]
    assert way.warning == "no value in 1 of 3 frames: the path from a to b goes around an opening"
    assert area.note(1) == f"the surface fills {100 * area.shares[1]:.0f} % of the outline"
    assert area.note(2) == "c3 has no data"
    rim = Measure("rim", "perimeter", ("a", "b", "c3"))
    with Frames([whole, holed]).timeline() as timeline:
        pair = {name: track_of(track.positions[:2].tolist()) for name, track in tracks.items()}
        across = series_of(rim, pair, timeline)
    told = f"{100 * across.shares[1]:.0f} % of the line lies on the surface"
    assert [across.note(frame) for frame in range(2)] == ["", told]
    assert across.warning == f"the surface has openings in 1 of 2 frames: as little as {told}"
    assert (
        "no value in 1 of 3 frames: c3 has no data; the surface has openings in 1 of 3 frames" in area.warning
    )
    assert way.in_frames([1, 2]).note(0) == way.note(1)


@pytest.mark.parametrize("order", [1, -1])
def test_a_limb_that_sticks_out_is_part_of_a_region(order: int) -> None:
    """A region may have any number of times the area of a circle as long as its outline."""
    limb = [*((radius, 0.0) for radius in np.linspace(30, 4, 27)), *((4.0, float(z)) for z in range(1, 41))]
    surface = turned([*limb, *arc(4, 88, 2, 40)])
    area, outline = (found(surface, kind, ring(10)[::order]) for kind in ("area", "perimeter"))
    assert area.value == pytest.approx(polygon(10) - 16 * np.pi + 320 * np.pi + 32 * np.pi, rel=0.02)
    assert area.value > 4 * outline.value**2 / (4 * np.pi)


@pytest.mark.parametrize("is_body", [False, True])
def test_through_an_opening_there_is_less_surface(is_body: bool) -> None:
    """A sheet with a hole; and a body of that and a whole sheet behind, which does not fill the hole."""
    places = sheet(44, 44)
    above = np.pad(places[np.linalg.norm(places, axis=1) > 6], ((0, 0), (0, 1)))
    points, normals = above, np.tile(UP, (len(above), 1))
    if is_body:
        below = np.pad(sheet(44, 44, seed=1), ((0, 0), (0, 1))) - 30 * UP
        points = np.concatenate([above, below])
        normals = np.concatenate([normals, np.tile(-UP, (len(below), 1))])
    surface = PoseSurface(pose_of(points, normals=normals))
    ring_area = polygon(13) - np.pi * 36
    area = found(surface, "area", ring(13), depth="through")
    assert area.value == pytest.approx(ring_area + is_body * polygon(13), rel=0.03)
    assert area.share == pytest.approx(ring_area / polygon(13), abs=0.03)
    assert found(surface, "perimeter", ring(13), depth="through").share == pytest.approx(1)
    across = np.array([[-10.0, 0, 0], [10, 0, 0], [0, 12, 0]])
    outline = found(surface, "perimeter", across, depth="through")
    assert outline.share == pytest.approx(1 - 12 / (20 + 2 * np.hypot(10, 12)), abs=0.05)


def test_a_section_that_ends_at_an_opening_is_refused() -> None:
    """Around a tube with a window, and along a sheet with a hole; a line from border to border is whole."""
    radius, places = 20.0, sheet(125, 60)
    turn = (places[:, 0] + 62.5) / 126 * 2 * np.pi
    normals = np.stack([np.sin(turn), 0 * turn, np.cos(turn)], axis=1)
    points = radius * normals + places[:, [1]] * [0, 1, 0]
    is_window = np.hypot(radius * (turn - np.pi), places[:, 1]) < 6
    tube = PoseSurface(pose_of(points[~is_window], normals=normals[~is_window]))

    def around(height: float) -> np.ndarray:
        return np.array([[radius, height, 0], [0, height, radius], [-radius, height, 0]])

    assert found(tube, "section", around(15)).value == pytest.approx(2 * np.pi * radius, rel=0.01)
    assert refused(tube, "section", around(0)).startswith(
        "the line where the plane cuts the surface ends at an opening"
    )
    both = found(tube, "section", around(0), lines="all")
    assert both.value == pytest.approx(2 * np.pi * radius - 12, abs=2)
    places = sheet(44, 44)
    bent = np.column_stack([places, -(places[:, 0] ** 2) / 60])
    holed = PoseSurface(pose_of(bent[np.linalg.norm(places, axis=1) > 6]))
    upright = np.array([[-15.0, 0, -15 * 15 / 60], [15, 0, -15 * 15 / 60], [10, 0, -40]])
    assert refused(holed, "section", upright).startswith(
        "the line where the plane cuts the surface ends at an opening"
    )
    beside = found(holed, "section", upright + np.array([0, 12, 0]))
    steps = np.linspace(-22, 22, 400)
    expected = np.hypot(np.diff(steps), np.diff(-(steps**2) / 60)).sum()
    assert beside.value == pytest.approx(expected, rel=0.02)


def test_an_outline_crosses_a_crack() -> None:
    """Faces of a sheet part along a line, as at seams of textures; a crack without width is no opening."""
    x, y = (each.ravel() - 10.0 for each in np.meshgrid(np.arange(21), np.arange(21)))
    a = (np.arange(20)[:, None] * 21 + np.arange(20)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + 21], axis=1), np.stack([a + 1, a + 22, a + 21], axis=1)])
    parted = np.flatnonzero((y == 0) & (np.abs(x) < 6))
    points = np.stack([x, y, 0 * x], axis=1)
    other = np.arange(len(points))
    other[parted] = len(points) + np.arange(len(parted))
    above = y[faces].mean(axis=1) > 0
    faces[above] = other[faces[above]]
    corners = np.array([[-4.0, -4, 0], [4, -4, 0], [4, 4, 0], [-4, 4, 0]])
    for width in (0.0, 1e-12, 0.3):
        cracked = np.concatenate([points, points[parted] + np.array([0, width, 0])])
        surface = PoseSurface(pose_of(cracked), faces.astype(np.uint32))
        outline = found(surface, "perimeter", corners)
        assert outline.value == pytest.approx(32, abs=0.01 + 2 * outline.deviation)
        if width > 0.1:
            area = found(surface, "area", corners)
            assert area.value == pytest.approx(64 - 8 * width, rel=0.01)
            assert outline.share == pytest.approx(1 - 2 * width / 32, abs=2e-3)
