"""Hints for files that Scan4D does not read."""

from __future__ import annotations

from pathlib import Path

import pytest

from viewer.errors import InputError
from viewer.scan import formats
from viewer.scan.open import open_scan
from viewer.scan.reading.hints import hint_for, hinted_suffixes

PEOPLE_HAVE = "e57 ptx stl glb vtp bag mkv r3d usdz abc dcm spz zip xlsx mat"


@pytest.mark.parametrize("suffix", PEOPLE_HAVE.split())
def test_a_file_that_people_have_is_refused_with_what_to_do(suffix: str, tmp_path: Path) -> None:
    file = tmp_path / f"scan.{suffix.upper()}"
    file.write_bytes(b"1")
    with pytest.raises(InputError) as refused, open_scan(file):
        pass
    hint = refused.value.hint or ""
    assert hint.startswith("Scan4D does not read ")
    assert "Known:" not in hint


def test_no_hint_is_for_a_format_that_scan4d_reads() -> None:
    assert not set(hinted_suffixes()) & set(formats.known_suffixes())


def test_other_suffixes_get_the_known_ones() -> None:
    assert hint_for(".odd", [".ply", ".xyz"]) == "Known: .ply, .xyz"


@pytest.mark.parametrize("suffix", [*PEOPLE_HAVE.split(), "nii.gz"])
def test_a_folder_of_such_files_says_what_it_holds_and_what_to_do(suffix: str, tmp_path: Path) -> None:
    for number in (1, 2):
        (tmp_path / f"scan{number}.{suffix}").write_bytes(b"1")
    with pytest.raises(InputError, match="contains no scan files, but 2 ") as refused, open_scan(tmp_path):
        pass
    assert (refused.value.hint or "").startswith("Scan4D does not read ")
    with (
        pytest.raises(InputError, match="matches no file that Scan4D can read, but 2 "),
        open_scan(tmp_path / "scan*"),
    ):
        pass


def test_dicom_without_a_suffix_is_recognised(tmp_path: Path) -> None:
    (tmp_path / "IM0001").write_bytes(bytes(128) + b"DICM")
    with pytest.raises(InputError, match="1 DICOM file") as refused, open_scan(tmp_path):
        pass
    assert "3D Slicer" in (refused.value.hint or "")


def test_a_folder_of_pictures_says_what_a_depth_camera_needs(tmp_path: Path) -> None:
    (tmp_path / "IMG_1.JPG").write_bytes(b"1")
    with pytest.raises(InputError, match=r"1 .jpg file") as refused, open_scan(tmp_path):
        pass
    assert "camera.json" in (refused.value.hint or "")
