"""What the export dialog makes: the user's choices, what is wrong with them, and the recording to replay."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...camera import Camera
from ...document.recording import Entry, Recording, matrix_of
from ...errors import InputError
from ...geometry import Vector
from ...look import SAMPLES
from ...output.export import numbered
from ...output.film import FRAME_RATES, PICTURE_RATE, FilmTimes
from ...output.legend import Marks
from ...output.overlays import NOTHING_DRAWN, DrawnMarks
from ...params import describe, param
from ...rigid import Rigid
from ...scan.times import typical_rate

VIEW, TURNTABLE, FRAMES = "view", "turntable", "frames"
PNG, EXR, MP4 = "png", "exr", "mp4"
AS_SHOWN = "as shown"
_MOST_PIXELS = 16_384  # a side
_MOST_PICTURES = 3600  # of a turn
_LONGEST_NAME = 200  # bytes; file systems take 255, of which numbers and temporary files need some
_DEVICES = {"CON", "PRN", "AUX", "NUL", *(f"{name}{n}" for name in ("COM", "LPT") for n in range(10))}


@dataclass(frozen=True)
class Choices:
    """Choices of what to export. Frames are counted from 1; values may be wrong (see `problems`)."""

    what: str = param(VIEW, "What to export", choices=(VIEW, TURNTABLE, FRAMES))
    pictures: int = param(36, "Number of pictures in one turn", low=2, high=_MOST_PICTURES)
    first: int = param(1, "First frame to export")
    last: int | None = param(None, "Last frame to export; auto: the last frame of the scan", type=int)
    step: int = param(
        1, "Which frames to export. 1: every frame; 2: every second frame; and so on", low=1, high=100_000
    )
    format: str = param(PNG, "File format", choices=(PNG, EXR, MP4))
    fps: float | None = param(
        None,
        "Frames per second of a film with a constant rate; auto: the film shows each frame until the "
        "time of the next frame",
        low=FRAME_RATES[0], high=FRAME_RATES[1], type=float,
    )  # fmt: skip
    width: int = param(1920, "Pixels", low=1, high=_MOST_PIXELS)
    height: int = param(1080, "Pixels", low=1, high=_MOST_PIXELS)
    quality: str = param(
        AS_SHOWN, "Anti-aliasing: as set in Appearance, or the mean of 1, 5 or 17 samples per pixel",
        choices=(AS_SHOWN, *SAMPLES),
    )  # fmt: skip
    anonymous: bool = param(
        False,
        "Overlays leave out notes and the names of landmarks and measures. "
        "The files store no name, path or date of the scan",
    )
    folder: str = param("", "Folder of the exported files")
    name: str = param(
        "", "Name of the file. If there are several files, Scan4D adds a number to the name of each"
    )

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels."""
        return self.width, self.height

    def indices(self, count: int) -> range:
        """The frames of a scan that has so many, counted from 0; those that are not there left out."""
        last = count if self.last is None else min(self.last, count)
        return range(max(self.first, 1) - 1, last, max(self.step, 1))

    def numbers(self, count: int) -> range:
        """Numbers of the pictures of a scan with so many frames: those of the frames, else from 1."""
        if self.what == FRAMES:
            indices = self.indices(count)
            return range(indices.start + 1, indices.stop + 1, indices.step)
        return range(1, (self.pictures if self.what == TURNTABLE else 1) + 1)

    def even_rate(self, times: NDArray[np.float64]) -> float:
        """Pictures a second of an even film: as chosen, else a suggestion. times: (T,) of the scan's frames,
        seconds."""
        if self.fps is not None:
            return self.fps
        if self.what != FRAMES:
            return PICTURE_RATE
        low, high = FRAME_RATES
        return min(max(typical_rate(times[np.array(self.indices(len(times)), int)]), low), high)

    def starts(self, times: NDArray[np.float64]) -> list[float]:
        """When a film shows its pictures, seconds from the first one on. times: (T,) of the scan's frames,
        seconds."""
        if self.what != FRAMES:
            return [number / (self.fps or PICTURE_RATE) for number in range(len(self.numbers(len(times))))]
        chosen = times[np.array(self.indices(len(times)), int)]
        return (chosen - chosen[:1]).tolist()

    def out(self) -> Path:
        """The pattern of the files, as `scan4d render -o` has it."""
        several = self.what != VIEW and self.format != MP4
        return _folder(self.folder) / f"{self.name}{'_%04d' if several else ''}.{self.format}"


def problems(choices: Choices, times: NDArray[np.float64], most_pixels: int) -> dict[str, str]:
    """Find what is wrong, by the field where it is.

    times: (T,) of the scan's frames, seconds. most_pixels: of a picture.
    """
    found, count = {}, len(times)
    for parameter in describe(Choices):
        try:
            parameter.parse(getattr(choices, parameter.name))
        except InputError as error:
            found[parameter.name] = error.what
    if "width" not in found and "height" not in found and choices.width * choices.height > most_pixels:
        found["height"] = (
            f"Choose a smaller size: the graphics driver can draw at most {most_pixels:,} pixels"
        )
    if choices.what == FRAMES:
        last = count if choices.last is None else choices.last
        if not 1 <= choices.first <= count:
            found["first"] = f"Choose a first frame from 1 to {count}"
        elif not choices.first <= last <= count:
            found["last"] = f"Choose a last frame from {choices.first} to {count}"
    if choices.format == MP4 and choices.what == VIEW:
        found["format"] = "A film needs a turntable or an image sequence"
    if choices.format == MP4 and not found.keys() & {"fps", "format", "first", "last", "step", "pictures"}:
        try:
            FilmTimes.of(choices.starts(times), choices.fps)
        except InputError as error:
            found["fps"] = f"{error.what}. {error.hint}"
    if not os.path.isdir(_folder(choices.folder)):
        found["folder"] = "This folder does not exist"
    if problem := _problem_of_name(choices.name):
        found["name"] = problem
    return found


def _problem_of_name(name: str) -> str:
    """Why a file cannot have this name on every system; empty where it can."""
    if not name.strip() or set(name) & set('/\\%:*?"<>|\0'):
        return 'Use a name without / \\ % : * ? " < > |'
    if name[-1] in " .":
        return "The name of a file cannot end with a space or a dot"
    if name.partition(".")[0].rstrip().upper() in _DEVICES:
        return "Windows reserves this name for a device"
    if len(os.fsencode(name)) > _LONGEST_NAME:
        return f"The name is longer than {_LONGEST_NAME} bytes"
    return ""


def present(choices: Choices, count: int) -> list[Path]:
    """The files that are there already and would be replaced."""
    out = choices.out()
    return [
        path
        for path in dict.fromkeys(numbered(out, n) for n in choices.numbers(count))
        if os.path.exists(path)
    ]


def recording(
    choices: Choices,
    shown: Entry,
    marks: Marks,
    times: NDArray[np.float64],
    pivot: Vector | None,
    motion_of: Callable[[int], Rigid],
    drawn: Callable[[int], DrawnMarks] = lambda _: NOTHING_DRAWN,
) -> Recording:
    """The pictures to make. shown: what the view shows. times: (T,) of the scan's frames, seconds.

    pivot: what a turntable turns about; None: the camera's target. motion_of: the motion of a frame, by its
    index. drawn: what tools draw over a frame, likewise.
    """
    look = shown.look if choices.quality == AS_SHOWN else replace(shown.look, quality=choices.quality)
    base = replace(shown, size=choices.size, marks=marks, look=look)
    if choices.what == TURNTABLE:
        angles = [360 * number / choices.pictures for number in range(choices.pictures)]
        first, *others = [replace(base, camera=_turned(base.camera, angle, pivot)) for angle in angles]
        entries = [first, *(replace(other, labels=()) for other in others)]  # those are of the first view
    elif choices.what == FRAMES:
        entries = [
            replace(base, pose=i, time=float(times[i]), place=matrix_of(motion_of(i))).with_drawn(drawn(i))
            for i in choices.indices(len(times))
        ]
    else:
        entries = [base]
    if choices.format != MP4:
        return Recording(tuple(entries))
    starts = choices.starts(times)
    placed = tuple(replace(entry, at=start) for entry, start in zip(entries, starts, strict=True))
    return Recording(placed, FilmTimes.of(starts, choices.fps).end)


def _turned(camera: Camera, angle: float, pivot: Vector | None) -> Camera:
    return camera.orbited(angle, 0.0, pivot) if angle else camera


def _folder(text: str) -> Path:
    return Path(os.path.expanduser(text))


def free_name(folder: Path) -> str:
    """scan4d_0001, or the next number that no file in the folder begins with."""
    paths = folder.glob("scan4d_[0-9][0-9][0-9][0-9]*") if os.path.isdir(folder) else ()
    taken = {path.name[:11] for path in paths}
    return next(name for n in range(1, len(taken) + 2) if (name := f"scan4d_{n:04d}") not in taken)
