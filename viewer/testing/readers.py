"""The contract of readers: what every format refuses, what it reads of a file, and what survives writing."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

import numpy as np

from ..errors import InputError
from ..scan import formats
from ..scan.open import open_scan
from ..scan.points import PointCloud
from ..scan.pose import Scanned
from ..scan.range_view import RangeView
from .check import Check

FAR_AWAY = (665187.25, 5648349.5, 241.75)  # metres, as maps have them
_CUTS = 12  # lengths to which an example is cut


def reader_checks(suffix: str, example: Path | None = None) -> list[Check]:
    """The contract of the reader of files with this suffix, such as ".stl".

    example: a file of this format; without one, no check reads any.
    """
    module = formats.format_of(suffix)
    checks = [Check(f.__name__[1:], suffix, partial(f, suffix, module)) for f in _FOR_ALL]
    if example is not None:
        checks += [Check(f.__name__[1:], suffix, partial(f, Path(example))) for f in _WITH_EXAMPLE]
    if hasattr(module, "write"):
        checks += [Check(f.__name__[1:], suffix, partial(_in_folder, f, suffix)) for f in _WRITTEN]
    return checks


def full_cloud(offset: tuple[float, float, float] = (0, 0, 0), count: int = 50) -> PointCloud:
    """A body about 2 units wide around `offset`, with all attributes and several types of scalars."""
    rng = np.random.default_rng(7)
    normals = rng.normal(size=(count, 3))
    return PointCloud.from_arrays(
        rng.random((count, 3)) * 2 + offset,
        normals=normals / np.linalg.norm(normals, axis=1, keepdims=True),
        colors=rng.integers(0, 256, (count, 4), np.uint8),
        radii=rng.random(count),
        scalars={
            "intensity": rng.random(count, np.float32),
            "gps_time": rng.random(count) + 1e9,
            "label": rng.integers(0, 256, count, np.uint8),
            "ring": rng.integers(0, 2**16, count, np.uint16),
            "change": rng.integers(-(2**31), 2**31, count, np.int32),
        },
    )


# --- every reader -------------------------------------------------------------------------------


def _it_declares_itself(suffix: str, module: ModuleType) -> None:
    assert isinstance(module.TITLE, str), "TITLE must be the name of the format in messages"
    assert module.TITLE
    for each in module.SUFFIXES:
        assert each == each.lower(), f"{each}: suffixes must be in lower case"
        assert each.startswith("."), f"{each}: suffixes must begin with a dot"
    assert suffix in module.SUFFIXES
    hooks = [getattr(module, name, None) for name in ("contents", "read")]
    assert any(map(callable, hooks)), "a reader needs the function contents or read"


def _it_refuses_what_is_no_file(suffix: str, module: ModuleType) -> None:
    with TemporaryDirectory() as name:
        folder, empty = Path(name, f"folder{suffix}"), Path(name, f"empty{suffix}")
        folder.mkdir()
        empty.touch()
        cases = {folder: "is a folder", empty: "is empty", Path(name, f"missing{suffix}"): "no such file"}
        for path, reason in cases.items():
            message = _refused(path)
            assert message.startswith(f"{path}: "), message
            assert reason in message, message


def _it_refuses_noise_in_one_message(suffix: str, module: ModuleType) -> None:
    with TemporaryDirectory() as name:
        path = Path(name, f"noise{suffix}")
        path.write_bytes(np.random.default_rng(1).bytes(5000))
        message = _refused(path)
        assert message.startswith(f"{path}: "), message
        assert "\n" not in message, message


# --- with an example ----------------------------------------------------------------------------


def _it_opens_as_a_scan(example: Path) -> None:
    with open_scan(example) as timeline:
        assert len(timeline) == formats.frame_count(example)
        for index in {0, len(timeline) - 1}:
            cloud = timeline.pose(index).cloud
            assert len(cloud) > 0, "it holds no points"
            assert np.isfinite(cloud.positions).all()
            for values in (cloud.normals, cloud.colors, cloud.radii, *cloud.scalars.values()):
                assert values is None or len(values) == len(cloud)


def _its_suffix_may_be_in_capitals(example: Path) -> None:
    with TemporaryDirectory() as name:
        path = Path(name, f"SCAN{example.suffix.upper()}")
        shutil.copy(example, path)
        _assert_equal(formats.read(path), formats.read(example))


def _it_reads_the_same_again(example: Path) -> None:
    _assert_equal(formats.read(example), formats.read(example))


def _it_has_only_the_frames_that_it_counts(example: Path) -> None:
    count = formats.frame_count(example)
    assert count >= 1
    for frame in (count, -1):
        assert f"has no pose {frame}" in _refused(example, frame)


def _its_times_increase_and_its_unit_is_a_text(example: Path) -> None:
    times, unit = formats.read_times(example), formats.read_unit(example)
    assert unit is None or isinstance(unit, str)
    if times is not None:
        assert times.shape == (formats.frame_count(example),)
        assert (np.diff(times) > 0).all()


def _a_shortened_file_is_read_or_refused(example: Path) -> None:
    data = example.read_bytes()
    with TemporaryDirectory() as name:
        path = Path(name, f"cut{example.suffix}")
        for length in np.linspace(1, len(data) - 1, _CUTS).astype(int):
            path.write_bytes(data[:length])
            try:
                formats.read(path)
            except InputError as error:
                assert "\n" not in str(error), str(error)


# --- formats that are written -------------------------------------------------------------------


def _everything_survives_a_round_trip(path: Path) -> None:
    for offset in ((0.0, 0.0, 0.0), FAR_AWAY):
        cloud = full_cloud(offset)
        back = _written(path, cloud)
        np.testing.assert_allclose(back.world(), cloud.world(), rtol=0, atol=1e-6)
        for name in ("normals", "colors", "radii"):
            np.testing.assert_array_equal(getattr(back, name), getattr(cloud, name), err_msg=name)
        assert back.scalars.keys() == cloud.scalars.keys()
        for name, values in cloud.scalars.items():
            assert back.scalars[name].dtype == values.dtype, name
            np.testing.assert_array_equal(back.scalars[name], values, err_msg=name)


def _bare_points_gain_no_attributes(path: Path) -> None:
    points = np.random.default_rng(0).random((9, 3), np.float32)
    back = _written(path, PointCloud.from_arrays(points))
    np.testing.assert_allclose(back.world(), points, rtol=0, atol=1e-7)
    assert back.normals is back.colors is back.radii is None
    assert not back.scalars


def _scalar_types_that_files_do_not_know_keep_their_values(path: Path) -> None:
    scalars = {
        "mask": np.array([True, False]),
        "half": np.array([0.5, -2], np.float16),
        "count": np.array([2**50, -1]),
    }
    back = _written(path, PointCloud.from_arrays(np.eye(3)[:2], scalars=scalars)).scalars
    for name, values in scalars.items():
        np.testing.assert_array_equal(back[name].astype(values.dtype), values, err_msg=name)


def _points_without_finite_coordinates_are_refused(path: Path) -> None:
    formats.write(path, PointCloud(np.full((4, 3), np.nan, np.float32), np.zeros(3)))
    assert "none of the 4 points has finite coordinates" in _refused(path)


def _infinite_points_are_dropped_and_counted(path: Path) -> None:
    points = np.array([[0, 0, 0], [np.inf, 0, 0], [1, 1, 1]], np.float32)
    back = _written(path, PointCloud(points, np.zeros(3), scalars={"s": np.arange(3.0)}))
    assert back.dropped == 1
    assert back.ids is not None
    np.testing.assert_array_equal(back.ids, [0, 2])
    np.testing.assert_array_equal(back.scalars["s"], [0, 2])


_FOR_ALL = (_it_declares_itself, _it_refuses_what_is_no_file, _it_refuses_noise_in_one_message)
_WITH_EXAMPLE = (
    _it_opens_as_a_scan,
    _its_suffix_may_be_in_capitals,
    _it_reads_the_same_again,
    _it_has_only_the_frames_that_it_counts,
    _its_times_increase_and_its_unit_is_a_text,
    _a_shortened_file_is_read_or_refused,
)
_WRITTEN = (
    _everything_survives_a_round_trip,
    _bare_points_gain_no_attributes,
    _scalar_types_that_files_do_not_know_keep_their_values,
    _points_without_finite_coordinates_are_refused,
    _infinite_points_are_dropped_and_counted,
)


def _in_folder(check: Callable[[Path], None], suffix: str) -> None:
    with TemporaryDirectory() as name:
        check(Path(name, f"scan{suffix}"))


def _written(path: Path, cloud: PointCloud) -> PointCloud:
    formats.write(path, cloud)
    back = formats.read(path)
    assert isinstance(back, PointCloud)
    return back


def _refused(path: Path, frame: int = 0) -> str:
    """The message with which a file is refused, which has to say what to do."""
    try:
        formats.read(path, frame)
    except InputError as error:
        assert error.hint, f"the message does not say what to do: {error}"
        return str(error)
    raise AssertionError(f"the reader reads {path.name}, but should refuse it")


def _assert_equal(one: Scanned, other: Scanned) -> None:
    if isinstance(one, PointCloud) and isinstance(other, PointCloud):
        np.testing.assert_array_equal(one.world(), other.world())
        return
    assert not isinstance(one, PointCloud)
    assert not isinstance(other, PointCloud)
    assert len(one) == len(other)
    for a, b in zip(one, other, strict=True):
        assert isinstance(a, RangeView)
        np.testing.assert_array_equal(a.depth, b.depth)
