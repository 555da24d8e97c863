"""NPY and NPZ: attributes, sequences, and archives that lie about their size."""

from __future__ import annotations

import io
import struct
import tracemalloc
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan.formats import frame_count, read, read_times, write
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud, choose_origin

RNG = np.random.default_rng(11)
SEQUENCE = RNG.random((4, 30, 3), np.float32) - 0.5


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "scan.npz"


def header(shape: tuple[int, ...], descr: str = "<f4") -> bytes:
    """The head of an NPY file of any promised shape, without values."""
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": descr, "fortran_order": False, "shape": shape})
    return stream.getvalue()


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
@pytest.mark.parametrize("shared", [False, True])
def test_a_sequence_with_attributes_of_each_frame_or_of_all(save, shared: bool, path: Path) -> None:
    lead = (30,) if shared else (4, 30)
    arrays = {
        "normals": RNG.random((*lead, 3)),
        "colors": RNG.integers(0, 256, (*lead, 4), np.uint8),
        "radii": RNG.random(lead),
        "label": RNG.integers(0, 9, lead, np.int16),
    }
    save(path, positions=SEQUENCE, times=np.arange(4) / 30, camera=np.eye(4), note="a word", **arrays)
    assert frame_count(path) == 4
    np.testing.assert_array_equal(read_times(path), np.arange(4) / 30)
    for frame in range(4):
        cloud = read(path, frame)
        expected = {name: array if shared else array[frame] for name, array in arrays.items()}
        np.testing.assert_allclose(cloud.world(), SEQUENCE[frame], rtol=0, atol=1e-7)
        np.testing.assert_allclose(cloud.normals, expected["normals"], rtol=1e-6)
        np.testing.assert_array_equal(cloud.colors, expected["colors"])
        np.testing.assert_allclose(cloud.radii, expected["radii"], rtol=1e-6)
        assert set(cloud.scalars) == {"label"}
        np.testing.assert_array_equal(cloud.scalars["label"], expected["label"])
        assert cloud.scalars["label"].dtype == np.int16


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("dtype", ["<f4", ">f8", "<i4", "<f2"])
def test_any_real_type_and_order(order: str, dtype: str, tmp_path: Path) -> None:
    points = np.asarray((SEQUENCE * 100).astype(dtype), order=order)
    np.save(tmp_path / "scan.npy", points)
    np.savez(tmp_path / "scan.npz", positions=points)
    for name in ("scan.npy", "scan.npz"):
        assert frame_count(tmp_path / name) == 4
        np.testing.assert_allclose(read(tmp_path / name, 2).world(), points[2], rtol=0, atol=1e-5)
    np.save(tmp_path / "one.npy", points[1])
    assert frame_count(tmp_path / "one.npy") == 1
    np.testing.assert_allclose(read(tmp_path / "one.npy").world(), points[1], rtol=0, atol=1e-5)


def test_missing_frames_are_named(path: Path) -> None:
    np.savez(path, positions=SEQUENCE)
    assert read_times(path) is None
    with pytest.raises(
        InputError, match=r"has no pose 4\. The file contains 4 poses, and Scan4D counts them from 0"
    ):
        read(path, 4)


def test_an_origin_is_kept_and_added(path: Path) -> None:
    origin = np.array([500_000.25, 5_400_000.5, 100])
    np.savez(path, positions=SEQUENCE[0], origin=origin)
    cloud = read(path)
    np.testing.assert_array_equal(cloud.origin, origin)
    np.testing.assert_array_equal(cloud.positions, SEQUENCE[0])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("given", [(0, 0, 0), (500_000.25, 0, 0)])
def test_an_origin_far_from_the_points_is_chosen_anew(
    given: tuple[float, float, float], dtype: type, path: Path
) -> None:
    place = np.array([500_000, 5_400_000, 100.0])
    points = np.random.default_rng(3).random((1000, 3)).round(3) + place
    stored = (points - given).astype(dtype)
    np.savez(path, positions=stored, origin=np.array(given))
    cloud = read(path)
    world = stored.astype(np.float64) + given
    np.testing.assert_array_equal(cloud.origin, choose_origin(world))
    np.testing.assert_allclose(cloud.world(), world, rtol=0, atol=1e-6)
    np.testing.assert_array_less(np.abs(cloud.positions), 2)


@pytest.mark.parametrize("scale", [1, 1e-3, 1e5])
def test_an_origin_that_is_written_comes_back_bit_for_bit(scale: float, path: Path) -> None:
    rng = np.random.default_rng(5)
    for place in rng.normal(0, 1e6, (8, 3)):
        cloud = PointCloud.from_arrays(rng.normal(0, scale, (200, 3)) + place)
        write(path, cloud)
        back = read(path)
        assert back.positions.tobytes() == cloud.positions.tobytes()
        assert back.origin.tobytes() == cloud.origin.tobytes()


def test_a_round_trip_is_exact(full_cloud: PointCloud, path: Path) -> None:
    write(path, full_cloud)
    back = read(path)
    np.testing.assert_array_equal(back.positions, full_cloud.positions)
    np.testing.assert_array_equal(back.origin, full_cloud.origin)


def test_scalars_of_any_name(path: Path) -> None:
    scalars = {name: np.arange(2.0) for name in ("file", "allow_pickle", "a b", "depth/left", "Ä")}
    write(path, PointCloud.from_arrays(np.eye(3)[:2], scalars=scalars))
    assert set(read(path).scalars) == set(scalars)


def test_one_frame_of_a_long_sequence_costs_one_frame(tmp_path: Path) -> None:
    frames = np.ones((500, 10_000, 3), np.float32)  # 60 MB, 120 kB a frame
    np.save(tmp_path / "long.npy", frames)
    np.savez(tmp_path / "long.npz", positions=frames)
    skipped = 2 << 24  # zipfile skips in steps of 16 MB, of which it holds two
    for name, most in (("long.npy", 2_000_000), ("long.npz", 2_000_000 + skipped)):
        tracemalloc.start()
        assert len(read(tmp_path / name, 499)) == 10_000
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < most


class Trap:
    """Pickles of it run code."""

    def __reduce__(self) -> tuple:
        return (pytest.fail, ("a pickle was loaded",))


def test_pickles_are_never_loaded(path: Path) -> None:
    objects = np.array([Trap()] * 3, object)
    with zipfile.ZipFile(path, "w") as archive:
        for name, array in {"positions": np.eye(3), "extra": objects}.items():
            with archive.open(f"{name}.npy", "w") as stream:
                np.lib.format.write_array(stream, array, allow_pickle=True)
    assert not read(path).scalars
    np.save(path.with_suffix(".npy"), np.array([[Trap()] * 3], object))
    with pytest.raises(InputError, match="pickled Python objects"):
        read(path.with_suffix(".npy"))


@pytest.mark.parametrize("shape", [(10**12, 3), (7, 3), (10**9, 10**9, 3), (-5, 3), (0, 10**12, 3)])
def test_headers_that_promise_too_much(shape: tuple[int, ...], tmp_path: Path) -> None:
    (tmp_path / "scan.npy").write_bytes(header(shape) + bytes(6 * 12))
    with zipfile.ZipFile(tmp_path / "scan.npz", "w") as archive:
        archive.writestr("positions.npy", header(shape) + bytes(6 * 12))
    for name in ("scan.npy", "scan.npz"):
        with pytest.raises(InputError, match=r"should contain .* bytes, but contains 72|holds no points"):
            read(tmp_path / name)


def test_a_zip_bomb_is_refused_before_it_unpacks(path: Path) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        count = 25_000_000
        with archive.open("positions.npy", "w", force_zip64=True) as stream:
            stream.write(header((count, 3)))
            for _ in range(count // 1_000_000):
                stream.write(bytes(12_000_000))
    tracemalloc.start()
    with pytest.raises(InputError, match="bytes of the file would unpack to 300000"):
        read(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1_000_000


def end_of_archive(entry: bytes, count: int, told: int, large: bool) -> bytes:
    """A directory of so many members and the records behind it, which tell of `told`."""
    directory = entry * count
    small = (0xFFFF, 0xFFFFFFFF) if large else (told, len(directory))
    records = b""
    if large:
        records += struct.pack("<4sQ2H2L4Q", b"PK\6\6", 44, 45, 45, 0, 0, told, told, len(directory), 0)
        records += struct.pack("<4sLQL", b"PK\6\7", 0, len(directory), 1)
    records += struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, small[0], *small, 0, 0)
    return directory + records


@pytest.mark.parametrize(
    ("told", "large", "reason"),
    [
        (60_000, True, "has 60,000 members, but Scan4D reads at most 4,096"),
        (60_000, False, "has 60,000 members, but Scan4D reads at most"),
        (1, True, "has 2,820,000 bytes of names, but Scan4D reads at most"),
        (1, False, "has 2,820,000 bytes of names, but Scan4D reads at most"),
    ],
)
def test_a_directory_of_very_many_members_is_refused_before_it_is_read(
    told: int, large: bool, reason: str, path: Path
) -> None:
    entry = struct.pack("<4s4B4HL2L5H2L", b"PK\1\2", 20, 0, 20, *[0] * 8, 1, *[0] * 6) + b"a"
    path.write_bytes(end_of_archive(entry, 60_000, told, large))
    tracemalloc.start()
    with pytest.raises(InputError, match=reason):
        read(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2_000_000


def test_an_archive_may_end_with_a_remark_and_hold_other_members(path: Path) -> None:
    np.savez(path, positions=SEQUENCE[0])
    with zipfile.ZipFile(path, "a") as archive:
        archive.comment = b"PK" * 20_000
        for number in range(2000):
            archive.writestr(f"{number}.txt", "")
    assert len(read(path)) == len(SEQUENCE[0])


def test_an_array_that_is_damaged_is_told(path: Path) -> None:
    """Arrays are read when the cloud is made, and what goes wrong then is one message too."""
    np.savez(path, positions=SEQUENCE[0], heat=np.full(len(SEQUENCE[0]), 7.25))
    path.write_bytes(path.read_bytes().replace(struct.pack("<d", 7.25), struct.pack("<d", 7.5), 1))
    with pytest.raises(InputError, match=r"Bad CRC-32 for file 'heat\.npy'"):
        read(path)


def test_constant_arrays_of_modest_size_are_no_bomb(path: Path) -> None:
    np.savez_compressed(path, positions=np.zeros((1_000_000, 3), np.float32))
    assert len(read(path)) == 1_000_000


@pytest.mark.parametrize(
    ("arrays", "reason"),
    [
        ({"corners": np.eye(3)}, "no array of points, only: corners"),
        (
            {"positions": np.zeros((4, 2))},
            r"array 'positions' has shape \(4, 2\). The shape of points must be \(N, 3\)",
        ),
        ({"positions": np.zeros((2, 2, 2, 4, 3))}, "has shape"),
        ({"positions": np.zeros((0, 5, 3))}, "holds no points"),
        ({"positions": np.zeros((0, 3))}, "holds no points"),
        ({"positions": np.array([["a", "b", "c"]])}, "expected numbers"),
        ({"positions": np.zeros((1, 3), complex)}, "expected numbers"),
        ({"positions": np.eye(3), "normals": np.eye(2)}, "'normals' has shape"),
        ({"positions": np.eye(3), "colors": np.zeros((3, 5))}, "'colors' has shape"),
        ({"positions": np.eye(3), "radii": np.zeros(4)}, "'radii' has shape"),
        ({"positions": np.eye(3), "origin": np.zeros(2)}, "'origin' is not 3 finite numbers"),
        ({"positions": np.eye(3), "origin": np.full(3, np.nan)}, "'origin' is not 3 finite numbers"),
    ],
)
def test_arrays_that_cannot_be_used(arrays: dict[str, np.ndarray], reason: str, path: Path) -> None:
    np.savez(path, **arrays)
    with pytest.raises(InputError, match=reason):
        read(path)


@pytest.mark.parametrize(
    ("shape", "descr", "reason"),
    [
        ((10**9, 1, 3), "<f4", "should contain 12000000000 bytes, but contains 12"),
        ((10**18, 0, 3), "<f4", "holds no points"),
        ((10**18, 1, 3), "<U0", "is of type <U0, expected numbers"),
        ((-1, 1, 3), "<f4", "should contain -12 bytes, but contains 12"),
        ((2**63, 1, 3), "<f4", "should contain"),
    ],
)
def test_frames_that_the_file_cannot_hold_are_refused_before_they_are_counted(
    shape: tuple[int, ...], descr: str, reason: str, tmp_path: Path
) -> None:
    (tmp_path / "scan.npy").write_bytes(header(shape, descr) + bytes(12))
    with zipfile.ZipFile(tmp_path / "scan.npz", "w") as archive:
        archive.writestr("positions.npy", header(shape, descr) + bytes(12))
    for name in ("scan.npy", "scan.npz"):
        with pytest.raises(InputError, match=reason):
            frame_count(tmp_path / name)


def test_a_million_frames_open_and_more_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "scan.npy"
    np.save(path, np.ones((1 << 20, 1, 3), np.int8))
    timeline = open_scan(path)
    assert len(timeline) == 1 << 20
    assert timeline.times[-1] == pytest.approx(((1 << 20) - 1) / 25)
    np.save(path, np.ones(((1 << 20) + 1, 1, 3), np.int8))
    with pytest.raises(InputError, match="has 1,048,577 frames, but Scan4D reads at most"):
        open_scan(path)


def test_a_long_header_is_refused(tmp_path: Path) -> None:
    (tmp_path / "scan.npy").write_bytes(b"\x93NUMPY\x02\x00" + (10**9).to_bytes(4, "little") + bytes(100))
    with pytest.raises(InputError, match="has a header of 1,000,000,000 bytes"):
        read(tmp_path / "scan.npy")


def test_a_header_of_python_2_is_read_without_a_warning(tmp_path: Path) -> None:
    old = header((2, 3)).replace(b"(2, 3)", b"(2L,3)")
    (tmp_path / "scan.npy").write_bytes(old + bytes(24))
    with warnings.catch_warnings(action="error"):
        assert len(read(tmp_path / "scan.npy")) == 2


def test_a_viewpoint_is_kept(path: Path) -> None:
    cloud = PointCloud.from_arrays(np.eye(4)[:, :3], viewpoint=(0.1, 2, 3e6))
    write(path, cloud)
    assert np.array_equal(read(path).viewpoint, cloud.viewpoint)
    np.savez(path, positions=np.eye(4)[:, :3], viewpoint=np.array([1.0, np.nan, 3.0]))
    with pytest.raises(InputError, match="'viewpoint' is not 3 finite numbers"):
        read(path)
    np.savez(path, positions=np.eye(4)[:, :3], viewpoint=np.zeros(4))
    assert read(path).viewpoint is None


@pytest.mark.parametrize("name", ["points", "vertices", "xyz"])
def test_points_by_other_names(name: str, path: Path) -> None:
    normals = RNG.random((30, 3), np.float32)
    np.savez(path, **{name: SEQUENCE[1], "normals": normals, "weight": np.arange(30)})
    cloud = read(path)
    np.testing.assert_array_equal(cloud.world(), SEQUENCE[1])
    np.testing.assert_array_equal(cloud.normals, normals)
    assert list(cloud.scalars) == ["weight"]
    np.savez(path, **{name: SEQUENCE[1], "positions": SEQUENCE[2]})
    np.testing.assert_array_equal(read(path).world(), SEQUENCE[2])


def test_sequences_by_other_names_have_their_frames(path: Path) -> None:
    for name in ("points", "vertices"):
        np.savez(path, **{name: SEQUENCE, "times": np.arange(4) / 10})
        assert frame_count(path) == 4
        np.testing.assert_array_equal(read(path, 2).world(), SEQUENCE[2])
        np.testing.assert_array_equal(read_times(path), np.arange(4) / 10)


def test_time_stamps_without_a_unit_are_marked_where_they_may_be_milliseconds(path: Path) -> None:
    np.savez(path, positions=SEQUENCE, timestamps=np.arange(4) * 100)
    with open_scan(path) as scan:
        assert scan.times.tolist() == [0, 100, 200, 300]
        assert (scan.reading["times"].source, scan.reading["times"].is_marked) == ("assumed", True)
    with open_scan(path, fps=10) as scan:
        assert scan.reading["times"].source == "user"
    np.savez(path, positions=SEQUENCE, timestamps_ms=np.arange(4) * 100)
    with open_scan(path) as scan:
        assert scan.times == pytest.approx([0, 0.1, 0.2, 0.3])
        assert scan.reading["times"].source == "file"
