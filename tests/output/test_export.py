"""What is written is what the Surface holds, and nothing half-written is left."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scenes import sphere
from written import bits, picture

from viewer import files
from viewer.camera import Camera
from viewer.errors import InputError
from viewer.look import Look
from viewer.output import export
from viewer.output.film import FILM_SUFFIX
from viewer.picture.surface import NOTHING, Surface

SIZE = (61, 43)  # odd on purpose
ALL_SUFFIXES = (*export.PICTURE_SUFFIXES, FILM_SUFFIX)


@pytest.fixture
def surface(draw: Callable[..., Surface]) -> Surface:
    cloud = sphere(3000)
    camera = Camera.orbit(cloud.bounds(), aspect=SIZE[0] / SIZE[1])
    return draw(cloud, camera, SIZE, "surfels", Look(color_by="height", background="#10203080"))


# --- pictures -------------------------------------------------------------------------------


def test_png_holds_the_picture_with_its_alpha(surface: Surface, tmp_path: Path) -> None:
    export.write_picture(surface, tmp_path / "a.png")
    stored = picture(tmp_path / "a.png")
    assert np.array_equal(stored, surface.image())
    assert tuple(stored[0, 0]) == (0x10, 0x20, 0x30, 0x80)


def test_exr_holds_the_surface_bit_for_bit(surface: Surface, tmp_path: Path) -> None:
    import OpenEXR

    export.write_picture(surface, tmp_path / "a.exr")
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        stored = {name: channel.pixels for name, channel in file.channels().items()}
    expected = {
        **{name: surface.color[..., i] for i, name in enumerate("RGB")},
        "A": surface.coverage,
        "Z": surface.depth,
        **{f"normal.{name}": surface.normal[..., i] for i, name in enumerate("XYZ")},
        "value": surface.value,
        "id": surface.id,
        "level": surface.level.astype(np.uint32),
    }
    assert stored.keys() == expected.keys()
    for name, array in expected.items():
        assert stored[name].dtype == array.dtype, name
        assert np.array_equal(bits(stored[name]), bits(array)), name
    assert np.isinf(stored["Z"]).any()
    assert np.isfinite(stored["value"]).any()


def test_npz_holds_the_surface(surface: Surface, tmp_path: Path) -> None:
    export.write_picture(surface, tmp_path / "a.npz")
    height, width = SIZE[1], SIZE[0]
    with np.load(tmp_path / "a.npz") as stored:
        assert {name: (array.shape, array.dtype.name) for name, array in stored.items()} == {
            "color": ((height, width, 3), "float32"),
            "normal": ((height, width, 3), "float32"),
            "depth": ((height, width), "float32"),
            "coverage": ((height, width), "float32"),
            "value": ((height, width), "float32"),
            "id": ((height, width), "uint32"),
            "level": ((height, width), "uint8"),
        }
        for name, array in surface.arrays().items():
            assert np.array_equal(bits(stored[name]), bits(array)), name
        assert (stored["id"] == NOTHING).any()


# --- files ----------------------------------------------------------------------------------


def test_a_whole_file_appears_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    with files.whole_file(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt(), ValueError()])
def test_a_failed_file_leaves_the_old_one(error: BaseException, tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    with (  # noqa: PT012
        pytest.raises(InputError if isinstance(error, OSError) else type(error)),
        files.whole_file(path) as temporary,
    ):
        temporary.write_text("half")
        raise error
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(sys.platform == "win32", reason="file size limits are POSIX's")
@pytest.mark.parametrize("suffix", ALL_SUFFIXES)
def test_a_full_disk_is_one_message_and_leaves_nothing(suffix: str, tmp_path: Path) -> None:
    code = f"""
import resource, numpy as np
from viewer import files
from viewer.output import export
from viewer.output.film import FilmTimes
class Noise:
    def image(self): return np.random.default_rng(0).integers(0, 255, (480, 640, 4), np.uint8)
    def arrays(self):
        one = np.random.default_rng(0).random((480, 640), np.float32)
        three = np.stack([one] * 3, axis=2)
        return dict(color=three, normal=three, depth=one, coverage=one, value=one, id=one, level=one)
resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))
with export.pictures(export.Path({str(tmp_path / ("a" + suffix))!r}), (640, 480), FilmTimes()) as put:
    for number in range(30):
        put(Noise(), number, number / 25, None, None)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=Path(__file__).parents[2]
    )
    assert done.stderr.splitlines()[-1].startswith("viewer.errors.InputError: "), done.stderr
    assert (
        f"a{suffix}: cannot be written: the file would be larger than this disk can store"
        in done.stderr.splitlines()[-1]
    )
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("pattern", "number", "file"),
    [
        ("out%04d.png", 7, "out0007.png"),
        ("out%d.png", 7, "out7.png"),
        ("%2d.png", 7, " 7.png"),
        ("out%04d.png", 123456, "out123456.png"),
        ("100%.png", 7, "100%.png"),
    ],
)
def test_numbers_in_names(pattern: str, number: int, file: str) -> None:
    assert export.numbered(Path("a%d/b") / pattern, number) == Path("a%d/b") / file
    assert export.is_pattern(Path(pattern)) == (pattern != file)


@pytest.mark.parametrize("name", ["a.png", "a.mp4", "a%04d.exr"])
def test_outputs_that_are_fine(name: str, tmp_path: Path) -> None:
    export.check_output(tmp_path / name, ALL_SUFFIXES, several=name != "a.png")


@pytest.mark.parametrize(
    ("name", "several", "words"),
    [
        ("a.jpg", False, [".jpg", *ALL_SUFFIXES]),
        ("a", False, ["suffix", *ALL_SUFFIXES]),
        ("missing/a.png", False, ["missing", "Create it"]),
        ("folder.png", False, ["folder"]),
        ("a.png", True, ["a%04d.png", "a.mp4"]),
        ("a%d%d.png", True, ["too many"]),
        ("a%04d.mp4", True, ["film"]),
    ],
)
def test_outputs_that_cannot_be_are_refused(
    name: str, several: bool, words: list[str], tmp_path: Path
) -> None:
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(InputError) as error:
        export.check_output(tmp_path / name, ALL_SUFFIXES, several)
    assert all(word in str(error.value) for word in words), error.value


# --- contact sheets -------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 2, 5, 9])
def test_a_contact_sheet_shows_all_images_in_order(count: int, tmp_path: Path) -> None:
    images = [np.full((6, 10, 4), (40 * k, 255 - 20 * k, 7, 255), np.uint8) for k in range(count)]
    export.contact_sheet(images, tmp_path / "a.png")
    sheet = picture(tmp_path / "a.png")
    centers = [
        (y, x) for y in range(4 + 3, sheet.shape[0], 10) for x in range(4 + 5, sheet.shape[1], 14)
    ]  # images of 10 x 6 pixels with gaps of 4
    assert len(centers) >= count
    shown = [tuple(sheet[y, x]) for y, x in centers[:count]]
    assert shown == [tuple(image[0, 0]) for image in images]


def test_thumbnails_keep_their_shape() -> None:
    image = np.zeros((600, 960, 4), np.uint8)
    image[:300] = 200
    small = export.thumbnail(image, 96)
    assert small.shape == (60, 96, 4)
    assert np.abs(small[10].astype(int) - 200).max() <= 1
    assert np.abs(small[50].astype(int)).max() <= 1
    assert export.thumbnail(small, 96) is small
