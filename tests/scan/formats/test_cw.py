"""CW files as scans: each picture of code words is the range view of its camera."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scenes import sphere

from viewer.camera import Camera
from viewer.codewords.engine import draw_words
from viewer.codewords.files import write_stream, writing_streams
from viewer.codewords.stream import WordStream
from viewer.drawing.frame import render
from viewer.drawing.request import Request, view_of
from viewer.errors import EmptyFrame, InputError
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.code_words import Params, words_of
from viewer.scan.formats import read
from viewer.scan.open import open_scan
from viewer.scan.pods import first_camera
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.range_view import RangeView

SIZE = (96, 64)
MOVED = np.array([1000.0, -250.0, 40.0])  # so that origins count


def ball() -> Pose:
    colors = np.full((4000, 3), (200, 120, 60), np.uint8)
    cloud = sphere(4000)
    return Pose(
        0, 0.0, "ball", replace(cloud, colors=colors, positions=cloud.positions, origin=cloud.origin + MOVED)
    )


def words(projection: str = "perspective", quality: str = "exact", samples: int = 1) -> WordStream:
    pose = ball()
    camera = Camera.orbit(pose.bounds, 30, 20, aspect=1.5, projection=projection)
    return words_of(
        pose, view_of(Request(pose, camera), SIZE), Look(), Params(quality=quality), samples=samples
    )


def view_read(path: Path, frame: int = 0) -> RangeView:
    found = read(path, frame)
    assert not isinstance(found, PointCloud)
    return found[0]


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_pixels_lie_on_the_surface(tmp_path: Path, projection: str, samples: int) -> None:
    stream = words(projection, samples=samples)
    write_stream(stream, tmp_path / "a.cw")
    view = view_read(tmp_path / "a.cw")
    assert np.array_equal(view.valid(), draw_words(stream).covered)
    points = view.points().world()
    assert np.abs(np.linalg.norm(points - MOVED, axis=1) - 1).max() < 0.01
    assert view.color is not None
    assert np.array_equal(view.color, draw_words(stream).image[..., :3])


def test_the_first_camera_shows_the_same_picture(tmp_path: Path) -> None:
    stream = words()
    write_stream(stream, tmp_path / "a.cw")
    with open_scan(tmp_path / "a.cw") as timeline:
        pose = timeline.pose(0)
    camera = first_camera(pose.views, pose.bounds, 1.5, pose.upright)
    surface: Surface = render(pose, camera, SIZE, "points", Look(quality="fast"), {"point_size": 1})
    picture = draw_words(stream)
    assert (np.isfinite(surface.depth) == picture.covered).all()
    assert np.allclose(surface.depth[picture.covered], picture.depths()[picture.covered], rtol=1e-5)


def test_a_sequence_plays(tmp_path: Path) -> None:
    streams = [words(quality="table"), words(), words()]
    with writing_streams(tmp_path / "a.cw") as add:
        for number, stream in enumerate(streams):
            add(stream, 0.5 * number)
            write_stream(stream, tmp_path / f"c{number:04d}.cw")
    for path in (tmp_path / "a.cw", tmp_path / "c%04d.cw"):
        with open_scan(path) as timeline:
            assert len(timeline) == 3
            for number in (2, 0, 1):
                shown = timeline.pose(number).views[0].depth
                assert np.array_equal(shown, draw_words(streams[number]).depths())
    with open_scan(tmp_path / "a.cw") as timeline:
        assert timeline.times.tolist() == [0.0, 0.5, 1.0]


def test_what_is_no_range_view(tmp_path: Path) -> None:
    stream = words()
    write_stream(replace(stream, camera=None), tmp_path / "a.cw")
    with pytest.raises(InputError, match=r"a\.cw: the code words store no camera.*scan4d render"):
        read(tmp_path / "a.cw")
    empty = replace(
        stream, words=stream.words[:0], ids=stream.ids[:0], finer=None, line_starts=0 * stream.line_starts
    )
    write_stream(empty, tmp_path / "a.cw")
    with pytest.raises(EmptyFrame, match="shows no disc"):
        read(tmp_path / "a.cw")
    huge = replace(empty, size=(1 << 13, 1 << 13), stride=512, line_starts=np.zeros((1 << 17) + 1, np.int64))
    write_stream(huge, tmp_path / "a.cw")
    with pytest.raises(InputError, match="would need"):
        read(tmp_path / "a.cw")
