"""`scan4d render --no-gl`, and files of code words: where OpenGL is, and where none is to be had at all."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from PIL import Image
from small_scans import FRAMES, SMALL, finish, front, names, process, stored
from written import film, picture

from viewer.codewords.engine import draw_words, draw_words_plainly
from viewer.codewords.files import read_stream
from viewer.drawing.request import Request, view_of
from viewer.look import Look
from viewer.scan import formats
from viewer.scan.code_words import Params, words_of
from viewer.scan.pose import Pose

LIBRARIES = ("libEGL.so", "libGL.so", "libOpenGL.so.0", "libGLdispatch.so.0", "libGLX.so.0")


@pytest.fixture
def without_opengl(tmp_path: Path) -> dict[str, str]:
    """An environment in which no library of OpenGL can be loaded."""
    if not sys.platform.startswith("linux"):
        pytest.skip("libraries are found by LD_LIBRARY_PATH")
    folder = tmp_path / "broken"
    folder.mkdir()
    for name in LIBRARIES:
        (folder / name).touch()
        (folder / f"{name}.1").touch()
    return {"LD_LIBRARY_PATH": str(folder)}


def test_a_machine_without_opengl(without_opengl: dict[str, str], scans: Path, tmp_path: Path) -> None:
    scan, out = scans / "ball.npz", tmp_path / "out"
    out.mkdir()
    assert finish(process("render", scan, "-o", out / "a.png", *SMALL, **without_opengl)).code == 3
    done = finish(process("doctor", **without_opengl))
    assert (done.code, done.err) == (3, "")
    assert "scan4d render SCAN --backend codeword --no-gl -o picture.png" in done.out
    options = ("--backend", "codeword", "--no-gl")
    done = finish(process("render", scan, "-o", out / "a.png", *SMALL, *options, **without_opengl))
    assert done == (0, f"{out / 'a.png'}\n", "")
    done = finish(process("render", scan, "-o", out / "a.cw", *SMALL, **without_opengl))
    assert done == (0, f"{out / 'a.cw'}\n", "")
    done = finish(process("render", out / "a.cw", "-o", out / "b.png", **without_opengl))
    assert done == (0, f"{out / 'b.png'}\n", "")
    assert np.array_equal(picture(out / "a.png"), picture(out / "b.png"))
    assert (picture(out / "a.png")[32, 48] != picture(out / "a.png")[0, 0]).any()


@pytest.mark.slow
def test_normals_that_cannot_be_estimated(
    without_opengl: dict[str, str], scans: Path, tmp_path: Path
) -> None:
    np.save(tmp_path / "bare.npy", formats.read(scans / "ball.npz").world())
    arguments = ("render", tmp_path / "bare.npy", "-o", tmp_path / "a.png", *SMALL, "--no-gl")
    done = finish(process(*arguments, **without_opengl))
    why = "the discs face the viewer and all discs have the same size"
    assert done.code == 0
    assert done.err == f"scan4d: Scan4D cannot estimate normals or radii on this computer, so {why}\n"
    assert len(np.unique(picture(tmp_path / "a.png").reshape(-1, 4), axis=0)) > 10  # by depth


def test_a_picture_is_what_the_twin_draws(run: Run, scans: Path, tmp_path: Path) -> None:
    for quality in ("table", "exact"):
        options = ("--no-gl", "--set", f"quality={quality}", "radius_scale=1.5", "--look", "light=fixed")
        out = tmp_path / f"{quality}.png"
        assert run("render", scans / "ball.npz", "-o", out, *SMALL, *options).code == 0
        cloud = formats.read(scans / "ball.npz")
        pose = Pose(0, 0.0, "ball", cloud)
        view = view_of(Request(pose, front(cloud)), (96, 64))
        params = Params(quality=quality, radius_scale=1.5)
        stream = words_of(pose, view, Look(light="fixed", up=pose.upright.up), params)
        assert np.array_equal(picture(out), draw_words_plainly(stream).image)


def test_films_patterns_turntables_and_arrays(run: Run, scans: Path, tmp_path: Path) -> None:
    scan = scans / "sequence"
    assert run("render", scan, "--no-gl", "--all", "-o", tmp_path / "a.mp4", *SMALL).code == 0
    images, _ = film(tmp_path / "a.mp4")
    assert len(images) == FRAMES
    done = run("render", scan, "--no-gl", "--poses", "0:2", "-o", tmp_path / "p%d.cw", *SMALL)
    assert done.code == 0
    assert run("render", scan, "--no-gl", "--turntable", 3, "-o", tmp_path / "t%d.npz", *SMALL).code == 0
    assert names(tmp_path) == ["a.mp4", "p0.cw", "p1.cw", "t0.npz", "t1.npz", "t2.npz"]
    arrays = stored(tmp_path / "t0.npz")
    covered = np.isfinite(arrays["depth"])
    assert covered.any()
    assert ((arrays["id"] == 0xFFFFFFFF) == ~covered).all()
    assert (arrays["picture"][covered, 3] == 255).all()
    stream = read_stream(tmp_path / "p1.cw")
    assert draw_words(stream).covered.any()


def test_quality_is_samples(run: Run, scans: Path, tmp_path: Path) -> None:
    """By either option; in files of code words as well."""
    scan, out = scans / "ball.npz", tmp_path / "a.cw"
    levels = []
    for quality, samples in (("fast", 1), ("balanced", 4), ("fine", 16)):
        assert run("render", scan, "-o", out, *SMALL, "--quality", quality, "--force").code == 0
        assert json.loads(run("info", out, "--json").out)["samples"] == samples
        assert run("render", out, "-o", tmp_path / "a.png", "--force").code == 0
        options = ("--no-gl", "--look", f"quality={quality}", "--force")
        assert run("render", scan, "-o", tmp_path / "b.png", *SMALL, *options).code == 0
        shown = picture(tmp_path / "a.png")
        assert np.array_equal(shown, picture(tmp_path / "b.png"))
        assert shown.shape[:2] == (64, 96)
        levels.append(len(np.unique(shown.reshape(-1, 4), axis=0)))
    assert levels[0] < levels[1] < levels[2], "outlines have more levels"


def test_sequences_of_code_words(run: Run, scans: Path, tmp_path: Path) -> None:
    """One stream and numbered files hold the same poses, and play as films, pictures and other files."""
    one, many, scan = tmp_path / "a.cw", tmp_path / "c%04d.cw", scans / "sequence"
    assert run("render", scan, "--no-gl", "--all", "-o", one, *SMALL).code == 0
    assert run("render", scan, "--no-gl", "--all", "-o", many, *SMALL).code == 0
    assert names(tmp_path) == ["a.cw", *(f"c{number:04d}.cw" for number in range(FRAMES))]
    assert run("render", many, "-o", tmp_path / "b.cw", "--poses", "1:").code == 0
    for index in range(FRAMES):
        assert run("render", one, "--pose", index, "-o", tmp_path / "one.png", "--force").code == 0
        assert run("render", many, "--pose", index, "-o", tmp_path / "many.png", "--force").code == 0
        drawn = draw_words_plainly(read_stream(one, index)).image
        assert np.array_equal(picture(tmp_path / "one.png"), drawn)
        shown = picture(tmp_path / "many.png")
        drawn = draw_words_plainly(read_stream(tmp_path / f"c{index:04d}.cw")).image
        assert np.array_equal(shown, drawn)
        if index:
            assert np.array_equal(shown, draw_words(read_stream(tmp_path / "b.cw", index - 1)).image)
    assert run("render", one, "--all", "-o", tmp_path / "a.mp4").code == 0
    assert len(film(tmp_path / "a.mp4")[0]) == FRAMES
    facts = json.loads(run("info", one, "--json").out)
    assert (facts["pictures"], facts["file_bytes"]) == (FRAMES, one.stat().st_size)
    assert f"{FRAMES}, {facts['keys']} of them key pictures" in run("info", one).out
    assert f"{FRAMES}, 0 to" in run("info", many).out
    one.write_bytes(one.read_bytes()[:-1])
    for arguments in (("render", one, "-o", tmp_path / "x.png"), ("info", one)):
        assert run(*arguments) == (2, "", f"scan4d: {one}: is cut short. Write the file again\n")


def test_a_picture_lies_behind(run: Run, scans: Path, tmp_path: Path) -> None:
    """Drawn at once, or over a file of code words: what is not covered stays."""
    behind = np.random.default_rng(1).integers(0, 256, (64, 96, 3), np.uint8)
    Image.fromarray(behind).save(tmp_path / "behind.png")
    scan, over = scans / "ball.npz", ("--behind", tmp_path / "behind.png")
    assert run("render", scan, "--no-gl", "-o", tmp_path / "a.png", *SMALL, *over).code == 0
    assert run("render", scan, "-o", tmp_path / "a.cw", *SMALL).code == 0
    assert run("render", tmp_path / "a.cw", "-o", tmp_path / "b.png", *over).code == 0
    drawn, covered = picture(tmp_path / "a.png"), draw_words(read_stream(tmp_path / "a.cw")).covered
    assert np.array_equal(drawn, picture(tmp_path / "b.png"))
    assert 0.1 < covered.mean() < 0.9
    assert np.array_equal(drawn[~covered][:, :3], behind[~covered])
    assert (drawn[covered][:, :3] != behind[covered]).any(axis=1).mean() > 0.9
    for arguments, told in (
        ((scan, "--no-gl", "-o", "c.png", "--size", "50x40", *over), "has 96 x 64 pixels, but the picture"),
        ((scan, "-o", "c.cw", *SMALL, *over), "--behind: has no effect on '.cw' files"),
        (
            (scan, "-o", "c.png", *SMALL, *over),
            "--behind: applies only to pictures that Scan4D draws without OpenGL",
        ),
        ((scan, "--no-gl", "-o", "c.png", *SMALL, "--behind", scan), "is not a valid PNG or JPEG or TIFF"),
        ((scan, "--no-gl", "-o", over[1], *SMALL, "--force", *over), "behind.png"),
    ):
        done = run("render", *arguments)
        assert (done.code, done.out) == (2, ""), arguments
        assert told in done.err, arguments
    assert names(tmp_path) == ["a.cw", "a.png", "b.png", "behind.png"]


def test_what_needs_opengl_or_is_settled_is_refused(run: Run, scans: Path, tmp_path: Path) -> None:
    scan, words = scans / "ball.npz", tmp_path / "a.cw"
    assert run("render", scan, "-o", words, *SMALL).code == 0
    for arguments, told in (
        ((scan, "-o", "a.png", "--no-gl", "--backend", "surfels"), "'surfels' needs OpenGL"),
        (
            (scan, "-o", "a.png", "--no-gl", "--marks", "stamp"),
            "--marks: applies only to pictures that Scan4D draws with OpenGL, without --no-gl",
        ),
        ((scan, "-o", "a.exr", "--no-gl"), "cannot write '.exr' files"),
        (
            (scan, "-o", "a.png", "--no-gl", "--set", "normals=60"),
            "of values of n'x in the table must be odd, not 60",
        ),
        ((scan, "-o", "a.png", "--no-gl", "--set", "sises=3"), "Did you mean 'sizes'"),
        ((scan, "-o", "a.png", "--no-gl", "--look", "color_by=heat"), "unknown colour source 'heat'"),
        ((words, "-o", "a.png", "--size", "10x10"), "--size: has no effect"),
        ((words, "-o", "a.png", "--quality", "fine"), "--quality: has no effect"),
        ((words, "-o", "a.png", "--look", "light=flat"), "--look: has no effect"),
        ((words, "-o", words, "--force"), "is an input of this command"),
        ((words, "-o", "a.png", "--pose", 1), "there is no pose 1"),
        ((tmp_path / "none.cw", "-o", "a.png"), "no such file or folder"),
    ):
        done = run("render", *arguments)
        assert (done.code, done.out) == (2, ""), arguments
        assert told in done.err, arguments
        assert done.err.count("\n") == 1
    words.write_bytes(words.read_bytes()[:-1])
    done = run("render", words, "-o", tmp_path / "a.png")
    assert done == (2, "", f"scan4d: {words}: is cut short. Write the file again\n")
    assert names(tmp_path) == ["a.cw"]
