"""What commands write: never onto what they read, onto others only where that is wanted."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from disks import small_disk
from scenes import sphere
from written import picture

from viewer.camera import Camera
from viewer.document.recording import Recording
from viewer.errors import InputError
from viewer.files import printable
from viewer.output import export
from viewer.scan import formats
from viewer.scan.octree.build import Stop
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

ROOT = Path(__file__).resolve().parents[2]
SMALL = ("--size", "32x24")
Refused = Callable[..., str]
posix = pytest.mark.skipif(sys.platform == "win32", reason="terminals, links and names in bytes are POSIX's")


def cloud(scalar: str | None = None) -> PointCloud:
    ball = sphere(200)
    scalars = {} if scalar is None else {scalar: ball.positions[:, 0].copy()}
    return PointCloud(ball.positions, ball.origin, normals=ball.normals, scalars=scalars)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory: a ball, as a file, as three files, and as octrees, and its camera."""
    monkeypatch.chdir(tmp_path)
    formats.write("a.ply", cloud())
    formats.write_poses("a.svo", [Pose.of(0, 0.0, "a", cloud())], "mm")
    Path("seq").mkdir()
    for number in range(3):
        formats.write(f"seq/f{number}.ply", cloud())
    Path("seq/times.csv").write_text("file,time\n" + "".join(f"f{n}.ply,{n}\n" for n in range(3)))
    Camera(eye=(2, 3, 4), target=(0, 0, 0)).save(Path("camera.json"))
    Path("mesh.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    return tmp_path


def contents(folder: Path) -> dict[str, bytes]:
    files = [path for path in folder.rglob("*") if path.is_file() and not path.is_symlink()]
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


# --- what is read is not written --------------------------------------------------------------


@pytest.mark.parametrize(
    "command",
    [
        ("convert", "a.ply", "a.ply"),
        ("convert", "a.ply", "seq/../a.ply"),
        ("convert", "a.svo", "a.svo", "--depth", 2),
        ("convert", "seq", "seq/f%d.ply"),
        ("convert", "seq/f%d.ply", "seq/f1.ply", "--pose", 0),
        ("simulate", "mesh.obj", "-o", "copy.ply", "--faces", "copy.ply"),
        ("render", "a.ply", "-o", "b.png", "--camera", "camera.json", "--stats", "camera.json", *SMALL),
    ],
)
@pytest.mark.parametrize("force", [(), ("--force",)])
def test_an_input_is_never_replaced(
    command: tuple[object, ...], force: tuple[str, ...], refused: Refused, folder: Path
) -> None:
    formats.write("copy.ply", cloud())
    before = contents(folder)
    assert "is an input of this command" in refused(*command, *force)
    assert contents(folder) == before


@posix
@pytest.mark.parametrize("link", [os.symlink, os.link])
def test_an_input_under_another_name_is_one(
    link: Callable[..., None], refused: Refused, folder: Path
) -> None:
    link(folder / "a.ply", folder / "b.ply")
    before = contents(folder)
    assert "is an input of this command" in refused("convert", "a.ply", "b.ply", "--force")
    assert "is an input of this command" in refused("convert", "b.ply", "a.ply", "--force")
    assert contents(folder) == before


def test_a_recording_and_its_scan_are_never_replaced(run: Run, refused: Refused, folder: Path) -> None:
    assert run("render", "a.ply", "-o", "a.png", *SMALL).code == 0
    text = export.read_description(Path("a.png"))
    Path("a.json").write_text(text)
    assert "is an input of" in refused("render", "--replay", "a.png", "-o", "a.png", "--force")
    assert "is an input of" in refused(
        "render", "--replay", "a.json", "-o", "b.png", "--stats", "a.json", "--force"
    )
    assert run("simulate", "mesh.obj", "-o", "view.exr", *SMALL).code == 0
    assert run("render", "view.exr", "-o", "v.png", *SMALL).code == 0
    assert "is an input of" in refused("render", "--replay", "v.png", "-o", "view.exr", "--force")
    assert formats.read(Path("view.exr"))


def test_results_that_are_compared_with_are_never_replaced(refused: Refused, folder: Path) -> None:
    Path("old").mkdir()
    Path("old/results.jsonl").write_text("")
    arguments = ("bench", "--scene", "sphere", "--suite", "scenes", "--quick", "--force")
    assert "is an input of" in refused(*arguments, "-o", "old", "--compare", "old")


# --- what is there ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("command", "there", "more"),
    [
        (("render", "a.ply", "-o", "b.png", *SMALL), ["b.png"], 0),
        (("render", "a.ply", "-o", "b.png", *SMALL, "--stats", "s.json"), ["s.json"], 0),
        (("render", "seq", "--all", "-o", "b%02d.exr", *SMALL), ["b01.exr", "b02.exr"], 1),
        (("render", "seq", "--all", "-o", "b.mp4", *SMALL), ["b.mp4"], 0),
        (("convert", "a.ply", "b.npz"), ["b.npz"], 0),
        (("convert", "a.ply", "b.svo"), ["b.svo"], 0),
        (("convert", "seq", "b%d.pcd"), ["b2.pcd"], 0),
        (("convert", "seq", "b%d.pcd"), ["b0.pcd", "b2.pcd"], 1),
        (("simulate", "mesh.obj", "-o", "b.exr", *SMALL), ["b.exr"], 0),
        (("view", "a.ply", "--fallback", "."), ["a_ply_0000.png", "a_ply_contact_sheet.png"], 1),
    ],
)
def test_what_is_there_is_replaced_by_force_alone(
    command: tuple[str, ...], there: list[str], more: int, run: Run, folder: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    for name in there:
        Path(name).write_text("former")
    before = contents(folder)
    done = run(*command)
    assert done.code == 2
    (message,) = done.err.splitlines()
    assert f"{there[0]}: exists already" in message
    assert "--force replaces" in message
    assert ("more" in message) == bool(more)
    assert f"and {more} more" in message or not more
    assert contents(folder) == before
    assert run(*command, "--force").code == 0
    assert all(Path(name).read_bytes() != b"former" for name in there)


@pytest.mark.parametrize(
    ("out", "there"),
    [
        ("seq2/g%d.ply", "f0.ply"),
        ("seq2/g%d.npz", "f0.ply"),
        ("one/w%d.ply", "k0.ply"),
        ("whole/x%d.npz", "f0.ply"),
        ("several/o%d.npz", "f0.ply"),
    ],
)
@pytest.mark.parametrize("force", [(), ("--force",)])
def test_other_frames_do_not_lose_their_times(
    out: str, there: str, force: tuple[str, ...], refused: Refused, run: Run, folder: Path
) -> None:
    for name in ("seq2", "one", "whole/frames", "several/a", "several/b"):
        Path(name).mkdir(parents=True)
    formats.write("one/k0.ply", cloud())
    for place in ("seq2", "whole/frames"):
        for number in range(3):
            formats.write(f"{place}/f{number}.ply", cloud())
    for number, place in enumerate(("several/a", "several/b")):
        formats.write(f"{place}/f{number}.ply", cloud())
    scan = "several/*/f*.ply" if "several" in out else "seq2"
    before = contents(folder)
    message = refused("convert", scan, out, *force)
    assert there in message
    assert "Write into a separate folder" in message
    assert contents(folder) == before
    for name in ("seq2", "seq2/f%d.ply", "one", "whole", "several/*/f*.ply"):
        assert run("info", name).code == 0


def test_frames_are_written_again_and_beside_files_that_need_no_times(run: Run, refused: Refused) -> None:
    assert run("convert", "seq", "b%d.npz").code == 0  # a.ply, a.svo and mesh.obj are single files
    assert run("convert", "seq", "b%d.npz", "--force").code == 0
    Path("out").mkdir()
    Path("out/notes.txt").write_text("mine")
    assert run("convert", "seq", "out/b%d.ply", "--poses", "0:2").code == 0
    assert "times of other files" in refused("convert", "seq", "out/b%d.ply", "--poses", "2:3")
    assert run("convert", "seq", "out/b%d.ply", "--force").code == 0
    with open_scan("out") as timeline:
        assert timeline.times.tolist() == [0, 1, 2]


def test_a_link_that_leads_nowhere_is_there(refused: Refused, folder: Path) -> None:
    os.symlink("nowhere", folder / "b.ply")
    assert "exists already" in refused("convert", "a.ply", "b.ply")


@pytest.mark.parametrize(
    ("there", "suite"),
    [
        ("notes.txt", "numerics"),
        ("plots/mine.png", "numerics"),
        ("pictures/sphere--points.png", "scenes"),
    ],
)
def test_a_benchmark_replaces_nothing_that_is_not_told(
    there: str, suite: str, run: Run, folder: Path
) -> None:
    path = folder / "results" / there
    path.parent.mkdir(parents=True)
    path.write_text("mine")
    Path("data").mkdir()
    scenes = ("--scene", "sphere", "--backend", "points") if suite == "scenes" else ()
    done = run("bench", "--suite", suite, *scenes, "--quick", "--data", "data", "-o", "results")
    assert done.code == 2
    assert f"{there}: exists already" in done.err
    assert [file.read_text() for file in folder.glob("results/**/*") if file.is_file()] == ["mine"]


@pytest.mark.slow
def test_a_benchmark_keeps_former_results_whatever_their_number(run: Run, folder: Path) -> None:
    first = ("bench", "--suite", "numerics", "--backend", "points", "-o", "results")
    assert run(*first).code == 0
    before = Path("results/numerics.jsonl").read_bytes()
    assert run(*first).code == 2
    for name in ("old-numerics.jsonl", "old-2-numerics.jsonl"):
        Path("results/numerics.jsonl").write_bytes(before)
        assert run(*first, "--force").code == 0
        assert (folder / "results" / name).read_bytes() == before


@posix
@pytest.mark.parametrize(("answer", "code"), [("y", 0), ("n", 2), ("", 2)])
def test_in_a_terminal_it_is_asked_for_once(answer: str, code: int, folder: Path) -> None:
    import pty

    for number in (0, 2):
        Path(f"b{number}.pcd").write_text("former")
    keyboard, terminal = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-m", "viewer.cli", "convert", "seq", "b%d.pcd"],
        stdin=terminal, stdout=subprocess.PIPE, stderr=terminal, env={**os.environ, "PYTHONPATH": str(ROOT)},
    ) as process:  # fmt: skip
        os.close(terminal)
        shown = b""
        while b"[y/N] " not in shown:
            shown += os.read(keyboard, 1000)
        os.write(keyboard, f"{answer}\n".encode())
        assert process.wait() == code
    os.close(keyboard)
    assert b"b0.pcd: exists already, and 1 more. Replace? [y/N] " in shown
    assert (Path("b2.pcd").read_bytes() == b"former") == bool(code)


# --- frames that lack a scalar ----------------------------------------------------------------


@pytest.fixture
def uneven(folder: Path) -> Path:
    """Three frames, of which only the middle one has q."""
    (folder / "uneven").mkdir()
    for number, scalar in enumerate(("p", "q", None)):
        formats.write(folder / f"uneven/f{number}.npz", cloud(scalar))
    return folder / "uneven"


BY_Q = ("--look", "color_by=q", *SMALL)


@pytest.mark.parametrize("choice", [("--all",), ("--poses", "0:3"), ("--all", "--turntable", 6)])
def test_a_frame_without_the_scalar_is_named_and_drawn(
    choice: tuple[object, ...], run: Run, uneven: Path
) -> None:
    done = run("render", "uneven", "-o", "b%d.png", *choice, *BY_Q)
    assert done.code == 0
    assert [line for line in done.err.splitlines() if "'q'" in line] == [
        f"scan4d: uneven: frame {n + 1} (f{n}.npz) has no 'q', so Scan4D uses other colours" for n in (0, 2)
    ]
    told = [Recording.load(Path(f"b{n}.png")).entries[0].look.color_by for n in range(3)]
    assert told == ["auto", "q", "auto"]
    assert run("render", "--replay", "b0.png", "-o", "again.png").code == 0
    assert np.array_equal(picture(Path("again.png")), picture(Path("b0.png")))


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (("--pose", 2, *BY_Q), ["frame 3 (f2.npz)", "'q'", "height"]),
        (("--pose", 0, *BY_Q), ["frame 1 (f0.npz)", "'q'", " p"]),
        (("--all", "--look", "color_by=r", *SMALL), ["uneven", "'r'", " p", " q"]),
        (("--poses", "0:3:2", *BY_Q), ["uneven", "'q'", " p"]),
    ],
)
def test_where_no_frame_has_it_nothing_is_written(
    command: tuple[object, ...], words: list[str], refused: Refused, uneven: Path, folder: Path
) -> None:
    before = contents(folder)
    message = refused("render", "uneven", "-o", "b%d.png", *command)
    assert all(word in message for word in words), message
    assert contents(folder) == before


# --- names ------------------------------------------------------------------------------------


@pytest.fixture
def odd(folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A name that is no UTF-8; the working directory has it as well, and a ball and three in it."""
    name = os.fsdecode(b"caf\xe9")
    try:
        (folder / name).mkdir()
    except OSError:
        pytest.skip("names are UTF-8 here")
    monkeypatch.chdir(folder / name)
    formats.write(f"{name}.ply", cloud("q"))
    Path(name).mkdir()
    for number in range(3):
        formats.write(f"{name}/{name}{number}.ply", cloud("q"))
    return name


@posix
@pytest.mark.parametrize("suffix", export.OUTPUT_SUFFIXES)
@pytest.mark.parametrize("several", [False, True])
def test_pictures_of_names_that_are_no_utf_8(suffix: str, several: bool, odd: str, run: Run) -> None:
    pattern = several and suffix != export.FILM_SUFFIX
    out = Path(f"{odd}_%d{suffix}" if pattern else f"{odd}_{suffix}").absolute()
    choice = (odd, "--all") if several else (f"{odd}.ply",)
    done = run("render", *choice, "-o", out, *SMALL, "--stats", f"{odd}.json", "--marks", "stamp")
    if done.code == 2 and suffix in export.UNMARKED_SUFFIXES:
        done = run("render", *choice, "-o", out, *SMALL, "--stats", f"{odd}.json")
    assert (done.code, done.err) == (0, "")
    assert json.loads(Path(f"{odd}.json").read_text())["frames"]
    written = export.numbered(out, 2 if several else 0)
    assert written.stat().st_size > 100
    if suffix in export.DESCRIBED_SUFFIXES:
        assert Recording.load(written).entries[0].scan == choice[0]
        done = run("render", "--replay", written, "-o", f"{odd}again{suffix}")
        assert (done.code, done.err) == (0, "")


@pytest.mark.slow
@posix
@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".npz", ".svo"])
def test_conversions_to_names_that_are_no_utf_8(suffix: str, odd: str, run: Run) -> None:
    Path("out").mkdir()
    assert run("convert", f"{odd}.ply", f"out/{odd}{suffix}").code == 0
    assert run("info", f"out/{odd}{suffix}").code == 0


@posix
def test_times_of_names_that_are_no_utf_8(odd: str, run: Run) -> None:
    Path("out").mkdir()
    assert run("convert", odd, f"out/{odd}%d.npz", "--fps", 10).code == 0
    with open_scan("out") as timeline:
        assert timeline.times.tolist() == [0, 0.1, 0.2]
    assert run("convert", odd, f"out/{odd}%d.npz", "--fps", 10, "--force").code == 0


@posix
def test_meshes_of_names_that_are_no_utf_8(odd: str, run: Run, folder: Path) -> None:
    Path(f"{odd}.obj").write_bytes((folder / "mesh.obj").read_bytes())
    assert run("simulate", f"{odd}.obj", "-o", f"{odd}_.exr", *SMALL).code == 0
    assert run("info", f"{odd}_.exr").code == 0
    assert run("convert", f"{odd}_.exr", f"{odd}_.ply").code == 0
    assert run("simulate", f"{odd}.obj", "-o", f"{odd}_.pcd", *SMALL).code == 0


@pytest.mark.slow
@posix
def test_playing_names_that_are_no_utf_8(odd: str, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    done = run("view", f"{odd}.ply", odd, "--fallback", f"{odd}out")
    assert (done.code, done.err) == (0, "")
    assert len(list(Path(f"{odd}out").iterdir())) == 3 + 5
    assert "\ufffd" in printable(odd)


@pytest.mark.parametrize("suffix", [*export.OUTPUT_SUFFIXES, ".ply", ".pcd", ".svo"])
def test_a_name_as_long_as_can_be(suffix: str, run: Run, refused: Refused, folder: Path) -> None:
    command = ("render", "a.ply", *SMALL, "-o") if suffix in export.OUTPUT_SUFFIXES else ("convert", "a.ply")
    name = "n" * (255 - len(suffix)) + suffix
    before = set(folder.iterdir())
    assert run(*command, name).code == 0
    assert {path.name for path in set(folder.iterdir()) - before} == {name}
    assert "the name of the file is too long" in refused(*command, f"n{name}")


# --- small pictures, small disks --------------------------------------------------------------


@pytest.mark.parametrize("size", ["10x8", "1x1", "3x100", "100x3"])
def test_marks_on_the_smallest_pictures(size: str, run: Run) -> None:
    marks = ("--look", "color_by=height", "--marks", "scale_bar", "color_bar", "stamp")
    assert run("render", "a.ply", "-o", "b.png", "--size", size, *marks).code == 0
    assert picture(Path("b.png")).shape[1::-1] == tuple(map(int, size.split("x")))


class Noise:
    """A surface that nothing packs, at any moment another one."""

    color_range = None

    def __init__(self) -> None:
        self._generator = np.random.default_rng(0)

    def image(self) -> np.ndarray:
        return self._generator.integers(0, 255, (240, 320, 4), np.uint8)

    def arrays(self) -> dict[str, np.ndarray]:
        one = self._generator.random((240, 320), np.float32)
        three = np.stack([one] * 3, axis=2)
        return {
            "color": three, "normal": three,
            **dict.fromkeys(("depth", "coverage", "value", "id", "level"), one),
        }  # fmt: skip


@pytest.mark.parametrize("suffix", [*export.OUTPUT_SUFFIXES, ".ply", ".pcd", ".svo"])
def test_a_full_disk_is_told_and_nothing_is_left(suffix: str, tmp_path: Path) -> None:
    points = PointCloud(np.random.default_rng(0).random((50_000, 3), np.float32), np.zeros(3))
    noise = Noise()
    with small_disk(tmp_path / "disk", 64) as disk:
        path = disk / f"a{suffix}"
        with pytest.raises(InputError, match="the disk is full") as error:  # noqa: PT012
            if suffix in export.OUTPUT_SUFFIXES:
                with export.pictures(path, (320, 240), None) as put:
                    for number in range(20 if suffix == ".mp4" else 1):
                        put(noise, number, number / 25, None, None)  # type: ignore[arg-type]
            elif suffix == ".svo":
                formats.write_poses(path, [Pose.of(0, 0.0, "a", points)], "mm", stop=Stop("depth", depth=16))
            else:
                formats.write(path, points)
        assert "Free some space" in str(error.value)
        assert list(disk.iterdir()) == []
