"""What holds for every command line: arguments, messages, exit codes, interrupts, output, help."""

from __future__ import annotations

import json
import logging
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from command_line import Run
from scenes import rarely
from small_scans import ROOT, SMALL, finish, names, process

import viewer
from viewer import cli
from viewer.backends import backends
from viewer.commands import _drawing as drawing
from viewer.commands import command_names
from viewer.drawing import frame
from viewer.drawing.renderer import Renderer
from viewer.errors import NoOpenGLError


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.ply"], ["nowhere.ply", "no such file"]),
        (["--pose", "5"], ["no pose 5", "0 to 4"]),
        (["--pose", "-1"], ["no pose -1"]),
        (["--pose", "x"], ["--pose", "'x'"]),
        (["--poses", "7:9"], ["7:9", "0 to 4"]),
        (["--poses", "2"], ["'2'", "A:B"]),
        (["--poses", "0:4:0"], ["0:4:0", "A:B"]),
        (["--poses", "-3:"], ["--poses"]),
        (["--all"], ["p%04d.png", "p.mp4"]),
        (["--turntable", "3"], ["p%04d.png", "p.mp4"]),
        (["--turntable", "0"], ["--turntable", "'0'"]),
        (["--all", "--pose", "1"], ["--pose", "--all"]),
        (["--orbit", "1,2", "--turntable", "3"], ["--turntable", "--orbit"]),
        (["--orbit", "1"], ["--orbit", "AZIMUTH,ELEVATION"]),
        (["--orbit", "1,nan"], ["--orbit", "AZIMUTH,ELEVATION"]),
        (["--orbit", "1,2,-3"], ["distance"]),
        (["--size", "12"], ["--size", "'12'", "1920x1280"]),
        (["--size", "0x5"], ["0x5"]),
        (["--size", "100000x100000"], ["too large", "--size"]),
        (["--backend", "nope"], ["'nope'", *backends()]),
        (["--backend", "points", "--set", "nope=1"], ["'nope'", "Known: hide_hidden, point_size"]),
        (["--backend", "points", "--set", "point_size=-1"], ["point_size", "0 to 32"]),
        (["--backend", "points", "--set", "point_size=big"], ["point_size", "'big'"]),
        (["--set", "size"], ["'size'", "key=value"]),
        (["--look", "nope=1"], ["'nope'", "color_by", "background"]),
        (["--look", "color_by=nope"], ["'nope'", "depth", "height"]),
        (["--look", "background=red"], ["'red'", "#rrggbb"]),
        (["--camera", "nowhere.json"], ["nowhere.json"]),
        (["--repeat", "3"], ["--stats"]),
        (["--stats", "a.txt"], ["a.txt", ".json"]),
        (["--stats", "missing/a.json"], ["missing"]),
        (["-o", "p.jpg"], [".jpg", ".png", ".exr", ".npz", ".mp4"]),
        (["-o", "missing/p.png"], ["missing", "Create it"]),
        (["-o", "p%04d.mp4", "--all"], ["p%04d.mp4", "film"]),
        (["--up", "+w"], ["'+w'", "+x"]),
        (["--fps", "0"], ["frame rate"]),
        (["--fps", "fast"], ["--fps", "'fast'"]),
        (["--nope"], ["unknown option '--nope'", "'scan4d render --help'"]),
        (["--bac", "points"], ["unknown option '--bac'", "'--backend'"]),
        (["--bakend=points"], ["'--bakend'. Did you mean '--backend' or '--behind'?"]),
        (["--backend", "pionts"], ["Did you mean 'points'?"]),
        (["--backend", "points", "--set", "pointsize=2"], ["Did you mean 'point_size'?"]),
        (["--look", "colour_by=depth"], ["Did you mean 'color_by' or 'color_map'?"]),
        (["--look", "color_by=hight"], ["Did you mean 'height'?"]),
        (["--marks", "stmp"], ["--marks 'stmp'. Did you mean 'stamp'?"]),
        (
            ["b.npz", "c.npz"],
            ["'b.npz', 'c.npz'", "takes SCAN", "put it in quotes", "'scan4d render --help'"],
        ),
        (["--marks", "stamp", "colr_bar"], ["--marks 'colr_bar'. Did you mean 'color_bar'"]),
        (["--camera", ""], ["after '--camera' is empty"]),
        (["--output="], ["after '--output=' is empty"]),
        (["-y"], ["unknown option '-y'"]),
        (["--unit", "m" * 5000], ["--unit", "not a usable name"]),
        (["--unit", "\x1b[31m"], [r"'\x1b[31m' is not a usable name"]),
        (["--backend", "\x1b]0;p\x07\n\u202e"], [r"'\x1b]0;p\x07\n\u202e'"]),
    ],
)
def test_unusable_arguments_are_one_message(
    arguments: list[str], words: list[str], refused: Callable[..., str], scans: Path, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    scan = [] if arguments[0].endswith(".ply") else [scans / "sequence"]
    message = refused("render", *scan, *SMALL, "-o", "p.png", *arguments)
    assert all(word in message for word in words), message
    assert names(tmp_path) == []


def test_missing_and_unknown_commands(refused: Callable[..., str], run: Run, scans: Path) -> None:
    message = refused("rendre", "x")
    assert all(name in message for name in ("'rendre'. Did you mean 'render'?", *command_names()))
    assert "'scan4d --help'" in refused("--bogus")
    assert "Write '-q' after 'info'" in refused("-q", "info", scans / "ball.npz")
    assert "-o" in refused("render", scans / "ball.npz")
    assert "'--outptu'. Did you mean '--output'" in refused("render", "demo", "--outptu", "x.png")
    for words in (["--set", "a=1", scans / "ball.npz"], [scans / "ball.npz"]):
        message = refused(*words)
        assert f"a command is missing. 'scan4d view {scans / 'ball.npz'}' shows the scan" in message
        assert all(name in message for name in command_names())
    assert "a command is missing before '--set'" in refused("--set", "a=1", "nowhere.ply")
    for command in ("doctor", "backends"):
        message = refused(command, "extra")
        assert f"'extra': not expected here, because 'scan4d {command}' takes only options" in message
        assert "quote" not in message
    assert "'c': not expected here, because 'scan4d convert' takes SCAN OUT" in refused(
        "convert", "a", "b", "c"
    )
    assert "the word after 'scan4d info' is empty" in refused("info", "")
    assert "SCAN" in refused("info")
    done = run()
    assert (done.code, done.err) == (0, "")
    assert all(f"\n    {name} " in done.out for name in command_names())


def test_an_unexpected_error_is_one_message(
    run: Run, scans: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError("by nought")

    monkeypatch.setattr(drawing, "shots", fail)
    ball = ["render", str(scans / "ball.npz"), "-o", str(tmp_path / "a.png")]
    done = run(*ball)
    assert done.code == 1
    assert done.err == (
        "scan4d: internal error (ZeroDivisionError: by nought). Run the command again with --debug\n"
    )
    assert cli.main([*ball, "--debug"]) == 1
    err = capsys.readouterr().err
    assert err.startswith("Traceback")
    assert err.endswith(done.err)


def test_errors_that_follow_an_interrupt_are_the_interrupt(
    run: Run, scans: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt:
            raise ImportError("it failed to import") from None

    monkeypatch.setattr(drawing, "shots", fail)
    done = run("render", scans / "ball.npz", "-o", tmp_path / "a.png")
    assert done == (1, "", "scan4d: stopped\n")


def test_debug_shows_the_traceback_of_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["info", "nowhere.ply", "--debug"]) == 2
    assert capsys.readouterr().err.startswith("Traceback")


@pytest.mark.parametrize("debug", [False, True])
def test_debug_shows_what_fails_in_the_window(
    debug: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from viewer import app

    def fail(*_: object, **__: object) -> int:
        log = logging.getLogger("viewer.app.failures")
        try:
            raise ZeroDivisionError("by \x1bnought")
        except ZeroDivisionError as error:
            log.error("%s failed", "A frame", exc_info=error)
        log.debug("all else")
        return 0

    monkeypatch.setattr(app, "run", fail)
    monkeypatch.setenv("DISPLAY", ":7")
    before = list(logging.getLogger("viewer").handlers)
    assert cli.main(["view", "demo", *(["--debug"] if debug else [])]) == 0
    err = capsys.readouterr().err
    if debug:
        assert err.startswith("scan4d: A frame failed\nTraceback")
        assert err.endswith("ZeroDivisionError: by \\x1bnought\n")
    else:
        assert err == ""
    assert logging.getLogger("viewer").handlers == before


def test_no_opengl_is_code_3(run: Run, scans: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> Renderer:
        raise NoOpenGLError("no usable OpenGL", hint="Install a driver")

    monkeypatch.setattr(frame, "shared_renderer", none)
    done = run("render", scans / "ball.npz", "-o", tmp_path / "a.png")
    assert done == (3, "", "scan4d: no usable OpenGL. Install a driver\n")
    listed = json.loads(run("backends", "--json").out)
    assert {b["name"]: b["available"] for b in listed} == dict.fromkeys(backends(), False)
    assert all("no usable OpenGL" in b["why_not"] for b in listed)
    assert "no usable OpenGL" in run("backends").out
    assert run("info", scans / "ball.npz").code == 0


@pytest.mark.slow
def test_the_device_is_passed_on(scans: Path, tmp_path: Path) -> None:
    ball = ("render", scans / "ball.npz", "-o", tmp_path / "a.png", *SMALL, "--force")
    assert finish(process(*ball, "--device", 0)).code == 0
    done = finish(process(*ball, "--device", 99))
    assert done.code == 3
    assert "99" in done.err


def test_an_interrupt_leaves_nothing(tmp_path: Path) -> None:
    running = process("render", "demo", "-o", tmp_path / "a.mp4", "--all", "--turntable", 9)
    deadline = time.monotonic() + 300
    while not names(tmp_path) and running.poll() is None and time.monotonic() < deadline:
        time.sleep(0.02)
    assert [name[0] for name in names(tmp_path)] == ["."], "it writes under another name first"
    running.send_signal(signal.SIGINT)
    done = finish(running)
    assert (done.code, done.err.splitlines()[-1]) == (1, "scan4d: stopped")
    assert names(tmp_path) == []


def test_a_reader_that_goes_away_is_no_error(scans: Path) -> None:
    running = process("info", scans / "ball.npz")
    assert running.stdout is not None
    running.stdout.close()
    assert running.stderr is not None
    assert running.stderr.read() == ""
    assert running.wait() == 1
    running.stderr.close()


IMPORTED_NEXT = """
import os, signal, sys
class Finder:
    def find_spec(self, name, path, target=None):
        if name == {name!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
from viewer.cli import main
sys.argv[1:] = {argv!r}
sys.exit(main())
"""


@pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")
@pytest.mark.parametrize(
    "name",
    [
        "viewer.commands._line",
        "argparse",
        "numpy",
        "numpy._core._multiarray_umath",
        "moderngl",
        "PIL",
        "cmap",
    ],
)
@pytest.mark.slow
def test_an_interrupt_while_libraries_are_imported_is_quiet(name: str, scans: Path, tmp_path: Path) -> None:
    argv = [
        "render",
        str(scans / "ball.npz"),
        "-o",
        str(tmp_path / "a.png"),
        *SMALL,
        "--look",
        "color_by=height",
    ]
    code = IMPORTED_NEXT.format(name=name, argv=argv)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert (done.returncode, done.stderr) in ((-signal.SIGINT, ""), (1, "scan4d: stopped\n"))
    assert names(tmp_path) == []


@pytest.mark.skipif(sys.platform == "win32", reason="has no /dev/full")
@pytest.mark.each_value
@pytest.mark.parametrize("where", [">&-", "> /dev/full"])
@pytest.mark.parametrize(
    "words", ["info demo", "backends --json", "--help", "render demo -o {}/a.png --size 9x9"]
)
def test_output_that_cannot_be_written_is_told(where: str, words: str, tmp_path: Path) -> None:
    line = f"{sys.executable} -m viewer.cli {words.format(tmp_path)} {where}"
    done = subprocess.run(line, shell=True, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 1
    why = (
        "the stream is closed" if where == ">&-" else "the disk is full. Free some space, or use another disk"
    )
    assert done.stderr == f"scan4d: standard output: cannot be written: {why}\n"


@pytest.mark.skipif(sys.platform != "linux", reason="names are text elsewhere")
@pytest.mark.parametrize("in_terminal", [False, True])
def test_what_was_written_is_named_byte_by_byte_for_programs(in_terminal: bool, tmp_path: Path) -> None:
    name = b"a\xff\x1b\n\xe2\x82\xac.ply"
    shown = b"a\\udcff\\x1b\\n\xe2\x82\xac.ply" if in_terminal else name
    path = tmp_path / os.fsdecode(name)
    words = [sys.executable, "-m", "viewer.cli", "convert", "demo", "--pose", "0", path]
    environment = {**os.environ, "PYTHONIOENCODING": "utf-8"}
    keyboard, terminal = os.openpty()
    done = subprocess.run(
        words, stdout=terminal if in_terminal else subprocess.PIPE, cwd=ROOT, env=environment, check=True
    )
    os.close(terminal)
    out = os.read(keyboard, 1000).replace(b"\r\n", b"\n") if in_terminal else done.stdout
    os.close(keyboard)
    assert out == os.fsencode(tmp_path) + b"/" + shown + b"\n"
    assert path.exists()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="has no /dev/full")
@pytest.mark.parametrize("where", [*rarely("2>&-"), "2> /dev/full", *rarely("<&- 2>&-")])
def test_messages_that_nobody_can_read_are_lost(where: str, scans: Path, tmp_path: Path) -> None:
    line = (
        f"{sys.executable} -m viewer.cli render {scans}/broken --all -o {tmp_path}/p%d.png --size 9x9 {where}"
    )
    done = subprocess.run(line, shell=True, capture_output=True, text=True, cwd=ROOT)
    assert (done.returncode, done.stdout) == (0, f"{tmp_path}/p%d.png\n")
    assert (
        subprocess.run(f"{sys.executable} -m viewer.cli info no.ply {where}", shell=True, cwd=ROOT).returncode
        == 2
    )


def test_what_a_terminal_cannot_show_is_escaped() -> None:
    done = finish(process("render", "--help", PYTHONIOENCODING="ascii"))
    assert (done.code, done.err) == (0, "")
    assert r"--up \xb1x|\xb1y|\xb1z" in done.out


def test_control_characters_of_files_do_nothing(run: Run, tmp_path: Path) -> None:
    name = "\x1b[31mred\x1b]0;p\x07"
    rows = "property float x\nproperty float y\nproperty float z\n"
    header = f"ply\nformat ascii 1.0\nelement vertex 2\n{rows}property float {name}\nend_header\n"
    (tmp_path / "a\x1b[2J.ply").write_text(header + "1 2 3 4\nnan 2 3 4\n")
    done = run("info", tmp_path / "a\x1b[2J.ply")
    assert done.code == 0
    assert r"\x1b[31mred\x1b]0;p\x07  float32" in done.out
    assert r"a\x1b[2J.ply" in done.err, "it warns of the point that is dropped"
    assert not re.search("[\x00-\x09\x0b-\x1f\x7f-\x9f]", done.out + done.err)
    assert json.loads(run("info", tmp_path / "a\x1b[2J.ply", "--json").out)["attributes"].keys() == {name}


def test_quiet_says_nothing_but_errors(run: Run, scans: Path, tmp_path: Path) -> None:
    assert run("render", scans / "broken", "-o", tmp_path / "p%d.png", *SMALL, "--all", "-q") == (0, "", "")
    assert run("convert", scans / "broken", tmp_path / "p%d.ply", "--quiet") == (0, "", "")
    assert run("info", scans / "nowhere", "-q").err.startswith("scan4d: ")
    assert "points" in run("info", scans / "ball.npz", "-q").out


def test_the_version(run: Run) -> None:
    assert run("--version") == (0, f"scan4d {viewer.__version__}\n", "")


def test_progress_is_for_terminals_alone(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from viewer.commands import _console as console

    def play() -> str:
        with console.progress(3) as tick:
            for _ in range(3):
                time.sleep(0.6)
                tick()
            console.warn("a word")
        return capsys.readouterr().err

    monkeypatch.delitem(sys.modules, "tqdm", raising=False)
    assert play() == "scan4d: a word\n"
    assert "tqdm" not in sys.modules
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    shown = play()
    assert "3/3" in shown
    assert "\nscan4d: a word\n" in shown.replace("\r", "\n")


@pytest.mark.parametrize("command", command_names())
def test_help(command: str, run: Run) -> None:
    done = run(command, "--help")
    assert (done.code, done.err) == (0, "")
    for flag in ("--device N", "--unit U", "--fps F", "--up ±x|±y|±z", "-q, --quiet", "--debug"):
        assert flag in done.out


def test_the_summary_of_each_command_is_one_sentence_on_one_line(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    rows = re.findall(r"^    (\w+) +(.*)\n(?=    \w|\n)", run("--help").out, re.M)
    assert [name for name, _ in rows] == list(command_names())
    assert [text for _, text in rows if not re.fullmatch(r"[A-Z][^.]+\.", text)] == []


def test_the_docs_name_every_flag_and_no_other(run: Run) -> None:
    page = (ROOT / "docs" / "reference" / "command-line.md").read_text(encoding="utf-8")
    sections = dict(re.findall(r"^## `scan4d (\w+).*?`\n(.*?)(?=^## |\Z)", page, re.M | re.S))
    common = {"--device", "--unit", "--fps", "--read", "--take", "--up", "--quiet", "--debug"}
    assert sorted(sections) == list(command_names())
    for command in command_names():
        flags = set(re.findall(r"(?<![\w-])--[a-z]+", run(command, "--help").out)) - common - {"--help"}
        assert set(re.findall(r"`(--[a-z]+)", sections[command])) - common == flags - {"--output"}, command
    assert common <= set(re.findall(r"`(--[a-z]+)", page.partition("\n## `scan4d")[0]))
