"""Drawing for the command line: which pictures of which poses, and from where."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from itertools import compress
from pathlib import Path

from ..backends import backend as find_backend
from ..backends import missing_source
from ..bounds import Bounds
from ..camera import Camera
from ..document.recording import Entry
from ..drawing import frame
from ..drawing.renderer import Renderer
from ..drawing.request import Request, backend_for
from ..errors import InputError
from ..gpu.context import headless
from ..look import COLOR_BY, Look, drawable, is_open_range, with_range
from ..output.export import numbered
from ..output.film import FILM_SUFFIX, PICTURE_RATE, FilmTimes
from ..output.legend import Legend
from ..picture.surface import Surface
from ..scan.pods import first_camera
from ..scan.pose import Pose
from ..scan.ranges import ValueRanges
from ..scan.timeline import Timeline
from ..scan.upright import Upright
from ._scans import frame_title, framing


@dataclass(frozen=True)
class Plan:
    """Pictures to draw.

    count: how many there are. size: of the first one, and of a film. times: of a film, None without one.
    pictures: number of the file, request, entry that describes it with its start in a film, and legend of its
    marks.
    """

    count: int
    size: tuple[int, int]
    times: FilmTimes | None
    pictures: Iterator[tuple[int, Request, Entry, Legend]]


@dataclass(frozen=True)
class Shot:
    """One picture. number: its file's. pose: an index. start: when a film shows it, seconds.
    azimuth: degrees on the turntable."""

    number: int
    pose: int
    start: float
    azimuth: float = 0.0


def shots(timeline: Timeline, indices: Sequence[int], args: Namespace) -> list[Shot]:
    """The pictures of these poses. A film shows each from its time until that of the next one.

    args.turntable: how many make a turn; a single pose gets a whole one, at args.fps.
    """
    turn = args.turntable
    if turn and len(indices) == 1:
        rate = args.fps or PICTURE_RATE
        return [Shot(k, indices[0], k / rate, 360 * k / turn) for k in range(turn)]
    times = timeline.times - timeline.times[indices[0]]
    return [
        Shot(index, index, float(times[index]), 360 * k / turn if turn else 0.0)
        for k, index in enumerate(indices)
    ]


def film_times(shots: Sequence[Shot], args: Namespace) -> FilmTimes | None:
    """The times of a film of these pictures, even ones with --fps; None where there is no film.

    Raises InputError where no player shows such a film.
    """
    if args.out.suffix.lower() != FILM_SUFFIX:
        return None
    return FilmTimes.of([shot.start for shot in shots], args.fps)


def shown_shots(shots: list[Shot], times: FilmTimes | None) -> list[Shot]:
    """The pictures that a film shows; an even one may pass over some."""
    if times is None:
        return shots
    return list(compress(shots, times.are_shown([shot.start for shot in shots])))


def outputs(out: Path, numbers: Iterable[int], stats: Path | None = None) -> list[Path]:
    """The files that pictures of these numbers go to, and that of their stats."""
    pictures = dict.fromkeys(numbered(out, number) for number in numbers)  # once, for a film
    return [*pictures, *([stats] if stats else [])]


def turntable_camera(
    bounds: Bounds, azimuths: Sequence[float], aspect: float, upright: Upright
) -> Callable[[Shot], Camera]:
    """A camera for each shot, from the front on, at the one distance that shows the whole bounds from all
    azimuths."""
    up, front = upright.up, upright.front
    turned = (Camera.orbit(bounds, front + azimuth, aspect=aspect, up=up) for azimuth in azimuths)
    distance = max(camera.distance for camera in turned)
    return lambda shot: Camera.orbit(bounds, front + shot.azimuth, distance=distance, up=up)


def shot_cameras(
    args: Namespace,
    timeline: Timeline,
    shots: list[Shot],
    size: tuple[int, int],
    upright: Upright,
    first: Pose,
) -> Callable[[Shot], Camera]:
    """The camera of each shot, fitted as the arguments say. first: the first pose that can be read."""
    aspect = size[0] / size[1]
    bounds = framing(timeline, list(dict.fromkeys(shot.pose for shot in shots)))
    if args.turntable:
        return turntable_camera(bounds, [shot.azimuth for shot in shots], aspect, upright)
    if args.orbit:
        camera = Camera.orbit(bounds, *args.orbit, aspect=aspect, up=upright.up)
    else:
        camera = first_camera(first.views, bounds, aspect, upright)
    return lambda shot: camera


def check_color_source(
    look: Look, timeline: Timeline, indices: Sequence[int], backend: str | None = None
) -> None:
    """Raise InputError where neither one of these poses nor the backend has what the look colours by; it
    lists what there is.

    Broken ones are passed over; it reads until one has it. backend: None for the default of the first.
    """
    if look.color_by in COLOR_BY:
        return
    drawn_by, scalars = None, dict[str, None]()
    for index in indices:
        try:
            pose = timeline.pose(index)
        except InputError:
            continue
        drawn_by = drawn_by or find_backend(backend_for(pose, backend)[0])
        if drawable(look, pose.overview.scalars, drawn_by.values) is look:
            return
        scalars |= dict.fromkeys(pose.overview.scalars)
    if drawn_by is not None:
        where = timeline.name if len(indices) > 1 else frame_title(timeline, indices[0])
        raise missing_source(look.color_by, drawn_by, scalars, where)


def ranged(look: Look, timeline: Timeline, indices: Sequence[int]) -> Look:
    """The look with the range over these poses together for the ends that it leaves open; of one pose, its
    own. All are read for it where there are several."""
    poses = list(dict.fromkeys(indices))
    if len(timeline) == 1 or not is_open_range(look):
        return look
    if len(poses) == 1:
        return with_range(look, None)
    ranges = ValueRanges(len(poses))
    ranges.gather(timeline, look, poses)
    return with_range(look, ranges.range(look))


def renderer(device: int | None) -> Renderer:
    """The headless renderer on this device; None: the one that `viewer.render` uses."""
    return frame.shared_renderer() if device is None else _renderer_on(device)


@cache
def _renderer_on(device: int) -> Renderer:
    return Renderer(headless(device))


@contextmanager
def canvases(
    device: int | None, size: tuple[int, int]
) -> Iterator[tuple[Renderer, Callable[[tuple[int, int], float], Surface]]]:
    """A headless renderer, and a function that gives the surface of a size, drawn on a scale of it; it
    holds one at a time.

    size: of the first one. Raises InputError where that cannot be drawn.
    """
    its_renderer = renderer(device)
    held = [Surface(its_renderer.gpu, size)]

    def surface_of(size: tuple[int, int], scale: float) -> Surface:
        drawn = frame.scaled_size(size, scale)
        if (held[-1].size, held[-1].shown) != (drawn, size):
            held.pop().release()
            held.append(Surface(its_renderer.gpu, drawn, size))
        return held[-1]

    try:
        yield its_renderer, surface_of
    finally:
        for surface in held:
            surface.release()


@contextmanager
def canvas(device: int | None, size: tuple[int, int]) -> Iterator[tuple[Renderer, Surface]]:
    """A headless renderer and a surface to draw to."""
    with canvases(device, size) as (its_renderer, surface_of):
        yield its_renderer, surface_of(size, 1.0)
