"""Several moments of points in one file of another kind than text, told by a column of frames."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.scan import formats
from viewer.scan.open import open_scan

Columns = Mapping[str, NDArray]
POINTS = np.random.default_rng(2).normal(size=(4, 3)).astype(np.float32)
IDS = np.array([7, 3, 5, 1], np.int32)


def columns(name: str, numbers: tuple[int, ...] = (0, 10, 20), ids: bool = True) -> dict[str, NDArray]:
    """Three moments of four points, each moved on by 1."""
    found = {name: np.repeat(np.array(numbers, np.int32), 4)}
    if ids:
        found["id"] = np.tile(IDS, 3)
    positions = np.concatenate([POINTS + moment for moment in range(3)])
    dark = np.repeat(np.array([250, 40000, 250], np.uint16), 4)
    return found | dict(zip("xyz", positions.T, strict=True)) | dict.fromkeys(("red", "green", "blue"), dark)


def as_ply(path: Path, arrays: Columns) -> None:
    rows = fields(arrays)
    kinds = {"i4": "int", "f4": "float", "u2": "ushort"}
    properties = "".join(f"property {kinds[rows.dtype[name].str[1:]]} {name}\n" for name in arrays)
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n{properties}end_header\n"
    path.write_bytes(head.encode() + rows.tobytes())


def as_pcd(path: Path, arrays: Columns) -> None:
    rows = fields(arrays)
    head = {
        "FIELDS": [*arrays], "SIZE": [one.itemsize for one in arrays.values()],
        "TYPE": [one.dtype.kind.upper() for one in arrays.values()], "COUNT": [1] * len(arrays),
        "WIDTH": [len(rows)], "HEIGHT": [1], "POINTS": [len(rows)], "DATA": ["binary"],
    }  # fmt: skip
    text = "".join(f"{key} {' '.join(map(str, values))}\n" for key, values in head.items())
    path.write_bytes(text.encode() + rows.tobytes())


def as_npz(path: Path, arrays: Columns) -> None:
    named = dict(arrays)
    positions, colors = ([named.pop(name) for name in names] for names in ("xyz", ("red", "green", "blue")))
    np.savez(path, positions=np.stack(positions, 1), colors=np.stack(colors, 1), **named)


def as_npy(path: Path, arrays: Columns) -> None:
    np.save(path, fields(arrays))


def fields(arrays: Columns) -> NDArray:
    rows = np.zeros(len(arrays["x"]), [(name, values.dtype) for name, values in arrays.items()])
    for name, values in arrays.items():
        rows[name] = values
    return rows


WRITERS: dict[str, Callable[[Path, Columns], None]] = {
    ".ply": as_ply, ".pcd": as_pcd, ".npz": as_npz, ".npy": as_npy,
}  # fmt: skip


@pytest.mark.parametrize("suffix", WRITERS)
@pytest.mark.parametrize(("name", "times"), [("frame", (0, 0.4, 0.8)), ("time", (0, 10, 20))])
def test_a_column_tells_the_moments(tmp_path: Path, suffix: str, name: str, times: tuple[float, ...]) -> None:
    path = tmp_path / f"all{suffix}"
    WRITERS[suffix](path, columns(name))
    with open_scan(path) as scan:
        assert (len(scan), scan.times.tolist()) == (3, pytest.approx(times))
        order = np.argsort(IDS)
        for moment in range(3):
            cloud = scan.pose(moment).cloud
            np.testing.assert_allclose(cloud.world(), (POINTS + moment)[order], atol=1e-6)
            assert cloud.ids.tolist() == sorted(IDS)
            assert not cloud.scalars
            assert np.unique(cloud.colors[:, :3]) == [1, 156, 1][moment], "one scale for all moments"
        assert scan.reading["frames"].value == f"by column {name}"
    with open_scan(path, read={"frames": "cloud"}) as scan:
        assert (len(scan), len(scan.pose(0).cloud)) == (1, 12)


@pytest.mark.parametrize("suffix", WRITERS)
@pytest.mark.parametrize(
    "arrays", [columns("time", ids=False), columns("frame", (1, 1, 1)), columns("label")]
)
def test_other_columns_tell_none(tmp_path: Path, suffix: str, arrays: Columns) -> None:
    """Laser scanners store a time for each point."""
    path = tmp_path / f"all{suffix}"
    WRITERS[suffix](path, arrays)
    assert formats.frame_count(path) == 1
    assert len(formats.read_points(path)) == 12
