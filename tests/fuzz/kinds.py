"""What is fuzzed: for each kind of file some that are whole, and what the project does with one."""

from __future__ import annotations

import gzip
import io
import os
import shutil
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from zipfile import ZIP_STORED, ZipFile

import numpy as np
from whole_files import TEXTS, write_scans
from whole_folders import FOLDERS

from viewer.analysis.landmarks.files import read_landmarks, write_landmarks
from viewer.analysis.landmarks.landmark_set import LandmarkNotes, LandmarkSet
from viewer.analysis.landmarks.templates import read_template, save_template, templates
from viewer.analysis.surface_point import SurfacePoint
from viewer.app import keys, settings
from viewer.app.menus import Commands
from viewer.app.part import part_classes, stored_values
from viewer.app.session import SessionSettings
from viewer.backends import backend, backends
from viewer.camera import Camera
from viewer.document.document import Bookmark, Document
from viewer.document.landmarks import Landmarks
from viewer.document.recording import Entry, Recording
from viewer.document.saved_session import SavedSession
from viewer.document.schema import usable
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import shared_renderer
from viewer.drawing.request import Request
from viewer.errors import InputError
from viewer.look import Look
from viewer.output.export import write_png
from viewer.picture.surface import Surface
from viewer.scan import formats
from viewer.scan.listing import list_folder
from viewer.scan.open import open_scan
from viewer.scan.times import TIMES_FILE

FOLDER = ".folder"  # how the kinds end that are folders, packed
MOST_SEED = 20_000  # bytes of a real file that is worth damaging
SIZE = (48, 32)
_TEXTS = {
    "landmarks.fcsv": "# CoordinateSystem = 1\n# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc\n"
    'a,1,2,3,0,0,0,1,1,1,1,"n, tip",\nb,4,5,6,0,0,0,1,1,1,1,chin,d\n',
    "landmarks.lm": "Landmarks-1.0\n2\nnose\n1 2 3 1 1\nchin\n4 5 6 1 1\n",
}
_LANDMARKS = ("mrk.json", "tps", "txt", "c3d", "csv", "wide.csv")  # in which they are written


def seeds(folder: Path, data_dir: Path | None) -> dict[str, list[bytes]]:
    """Kind -> whole files: made here, and small real ones where they are at hand.

    Kinds are the suffixes of scans, and the names of other files that the project reads: "camera.json",
    "recording.json", "recording.png", "session.json", "times.csv", "settings.json", "keys.toml",
    "template.json", "landmarks.csv" and so on.
    """
    for name, text in _TEXTS.items():
        (folder / name).write_text(text)
    write_scans(folder)
    _write_choices(folder)
    _write_landmarks(folder)
    found: dict[str, list[bytes]] = {}
    for path in sorted(folder.iterdir()):
        found.setdefault(kind_of(path.name), []).append(path.read_bytes())
    for name, make in FOLDERS.items():
        place = folder / name
        place.mkdir()
        make(place)
        found[f"{name}{FOLDER}"] = [packed_folder(place)]
    for path in sorted((data_dir / "odd").rglob("*")) if data_dir else ():
        # LAZ is unpacked in a process of its own: too slow to be damaged by the thousand.
        known = path.suffix in formats.known_suffixes() and path.suffix != ".laz"
        if known and path.stat().st_size < MOST_SEED:
            found.setdefault(path.suffix, []).append(path.read_bytes())
    return found


def _write_choices(folder: Path) -> None:
    """What belongs to scans: cameras, recordings, choices of the user."""
    camera = Camera(eye=(1.0, 1.0, 5.0), target=(1.0, 1.0, 1.0))
    camera.save(folder / "camera.json")
    entry = Entry("scan.npz", None, 0, 0.0, SIZE, camera, "points", backend("points").params(), Look())
    later = Entry(
        "scan.npz", None, 0, 0.0, SIZE, camera, "surfels", backend("surfels").params(), Look(), at=0.5
    )
    Recording((entry, later), 1.0).save(folder / "recording.json")
    write_png(np.zeros((2, 2, 4), np.uint8), folder / "recording.png", entry.description())
    (folder / TIMES_FILE).write_text("file,time\nf0.ply,0\nf1.ply,0.04\n")
    marks = (Bookmark("front", camera),)
    chosen = {"session": {"look": {"light": "head"}}, "scans": {"recent": ["demo"]}}
    settings.save(chosen, folder / "settings.json")
    end = SurfacePoint(0, 0.0, (1.0, 2.0, 3.0), 3, 0.1, 0)
    document = Document(camera, (1.0, 2.0, 3.0), Look(light="head"), "points", unit="mm", bookmarks=marks)
    document = document.with_params("points", backend("points").params()).with_part(
        Landmarks().with_distance([end], [replace(end, id=None)])
    )
    SavedSession("scan.npz", None, 3, document).save(folder / "session.json")
    keys.write_template(folder / "keys.toml", Commands())
    text = (folder / "keys.toml").read_text()
    (folder / "keys.toml").write_text(text.replace("\n# ", "\n").split("[keys]")[1].join(["[keys]", ""]))


def _write_landmarks(folder: Path) -> None:
    places = np.random.default_rng(3).normal(size=(3, 4, 3))
    places[1, 2] = np.nan
    names = ("n", "chL", "chR", 'a "b", c')
    landmarks = LandmarkSet.of(
        names, places, frames=range(3), times=np.arange(3) / 25, notes=LandmarkNotes("mm")
    )
    for suffix in _LANDMARKS:
        write_landmarks(folder / f"landmarks.{suffix}", landmarks.at(0) if "json" in suffix else landmarks)
    save_template(folder / "template.json", templates()["lips"])


# --- what is done with a file -------------------------------------------------------------------


def _open(path: Path) -> None:
    """As every command does: open it, and read its first and its last frame."""
    with open_scan(path) as timeline:
        for index in {0, len(timeline) - 1}:
            cloud = timeline.pose(index).cloud
            assert len(cloud) > 0
            assert np.isfinite(cloud.positions).all()
            assert all(len(values) == len(cloud) for values in cloud.scalars.values())


def _open_folder(path: Path, drawn: bool) -> None:
    """Unpack a folder, and do with it what is done with a scan; `info` looks at it first."""
    place = path.with_name("unpacked")
    shutil.rmtree(place, ignore_errors=True)
    with ZipFile(path) as archive:
        archive.extractall(place)
    scans = list_folder(place)
    assert scans is not None
    (_draw if drawn else _open)(place)


def packed_folder(place: Path) -> bytes:
    """The files of a folder as a ZIP archive, stored as they are: a folder to be damaged."""
    packed = io.BytesIO()
    with ZipFile(packed, "w", ZIP_STORED) as archive:
        for file in sorted(place.rglob("*")):
            if file.is_file():
                archive.write(file, file.relative_to(place).as_posix())
    return packed.getvalue()


def _draw(path: Path) -> None:
    """Draw its first frame with each renderer, as small as can be."""
    renderer = shared_renderer()
    with open_scan(path) as timeline:
        pose = timeline.pose(0)
        camera = Camera.orbit(pose.cloud.bounds(), aspect=SIZE[0] / SIZE[1])
        surface = Surface(renderer.gpu, SIZE)
        for name in (one.name for one in backends().values() if one.draws(pose)):
            look = Look(color_by=next(iter(pose.cloud.scalars), "auto").replace("auto", "depth"))
            while render_frame(renderer, Request(pose, camera, name, None, look), surface):
                pass
            depth = surface.depth
            assert not np.isnan(depth).any(), f"{name}: a depth that is none"
            assert (depth > 0).all(), f"{name}: a depth behind the eye"
        surface.release()


def _recorded(path: Path) -> None:
    for entry in Recording.load(path).entries:
        entry.description()


def _kept(path: Path) -> None:
    session = SavedSession.load(path)
    session.document.part(Landmarks)
    session.save(path)


def _times(path: Path) -> None:
    for name in ("f0.ply", "f1.ply"):
        (path.parent / name).write_text(TEXTS["mesh.ply"])
    with open_scan(path.parent / "f*.ply") as timeline:
        timeline.pose(1)


def _settings(path: Path) -> None:
    stored = settings.load(path)[0]
    for name, part in part_classes().items():
        stored_values(part, stored.get(name))
    usable(SessionSettings(), stored.get("session"))
    settings.save(stored, path)


def _landmarks(path: Path) -> None:
    found = read_landmarks(path, "mm")
    assert len(set(found.names)) == len(found.names) > 0
    assert np.isfinite(found.positions[found.is_defined]).all()
    write_landmarks(path.with_name("again.csv"), found)


def _planted(path: Path) -> None:
    """What goes wrong on purpose, to see that it is found."""
    match path.read_text():
        case "raises":
            raise ValueError("planted")
        case "hides":
            try:
                [].pop()
            except IndexError as error:
                raise InputError("cannot be read", path) from error
        case "takes memory":
            bytearray(1 << 30)
        case "hangs":
            time.sleep(3600)
        case "dies":
            os.abort()
        case "warns":
            warnings.warn("planted", stacklevel=1)
        case "writes":
            os.write(2, b"planted")


_CHOICES: dict[str, Callable[[Path], Any]] = {
    "camera.json": Camera.load,
    "recording.json": _recorded,
    "session.json": _kept,
    "recording.png": _recorded,
    "times.csv": _times,
    "settings.json": _settings,
    "keys.toml": lambda path: keys.load_keys(path, Commands()),
    "planted.txt": _planted,
    "template.json": read_template,
    **dict.fromkeys([f"landmarks.{suffix}" for suffix in (*_LANDMARKS, "fcsv", "lm")], _landmarks),
}


def use(kind: str, drawn: bool) -> Callable[[Path], Any]:
    """What the project does with a file of a kind. drawn: scans are drawn, too."""
    if kind.endswith(FOLDER):
        return partial(_open_folder, drawn=drawn)
    return _CHOICES.get(kind, _draw if drawn else _open)


def file_name(kind: str) -> str:
    """What a file of a kind is called."""
    return kind if kind in _CHOICES or kind.endswith(FOLDER) else f"input{kind}"


def kind_of(name: str) -> str:
    """The kind of a file of the corpus: `camera_1.json` is a camera, `1.npy` a scan."""
    word, suffix = Path(name).stem.split("_")[0], Path(name).suffix
    if suffix == FOLDER:
        return next(f"{kind}{FOLDER}" for kind in FOLDERS if name.startswith(kind))
    return f"{word}{suffix}" if f"{word}{suffix}" in _CHOICES else suffix


def corpus(folder: Path, drawn: bool) -> Callable[[int], tuple[str, bytes, bool]]:
    """The files of a folder by number, those that end in .gz unpacked: kind, bytes, and `drawn`."""
    files = corpus_files(folder)

    def of(number: int) -> tuple[str, bytes, bool]:
        path = files[number]
        data = path.read_bytes()
        if path.suffix == ".gz":
            path, data = path.with_suffix(""), gzip.decompress(data)
        return kind_of(path.name), data, drawn

    return of


def corpus_files(folder: Path) -> list[Path]:
    """The files of a corpus, in order."""
    return sorted(folder.iterdir())


def data_folder() -> Path | None:
    """The folder of real scans, where there is one: as the fixture `data_dir` finds it."""
    beside = Path(__file__).resolve().parents[3] / "shared" / "data"
    folder = Path(os.environ.get("SCAN4D_DATA", beside))
    return folder if folder.is_dir() else None
