"""Draw pictures and films of a scan without a window.

OUT is a .png, .exr or .npz file, a .mp4 film, or for several pictures a numbered pattern such as out%04d.png.
PNG and MP4 show the look. EXR and NPZ store depth, normals and ids of each pixel. Scan4D fits the camera to
the first pose and leaves it there. --replay draws a recording or a saved picture again. --no-gl draws without
OpenGL, from code words, and can write them to .cw files; SCAN can be such a file or a pattern.
"""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from ..backends import backend as find_backend
from ..camera import Camera
from ..choice.choose import Choice
from ..choice.goal import Goal
from ..document.anonymous import anonymous_request
from ..document.recording import Entry, fingerprint, new_salt
from ..drawing.frame import supersample
from ..drawing.request import Request, backend_for
from ..drawing.timing import draw
from ..errors import InputError
from ..files import save_json
from ..look import SAMPLES, Look, drawable
from ..output.export import DESCRIBED_SUFFIXES, OUTPUT_SUFFIXES, UNMARKED_SUFFIXES, check_output, pictures
from ..output.legend import MARKS, Legend, marks_of
from ..params import parse
from ..scan.averaging import Averaging
from ..scan.inputs import scan_inputs
from ..scan.open import DEMO
from ..scan.timeline import Timeline
from ..scan.upright import Upright
from . import _arguments as arguments
from . import _drawing as drawing
from . import _levels as levels
from . import _replay as replay
from . import _stats as stats
from . import _without_gl as without_gl
from ._choosing import AUTO, add_goal_arguments, choice_of, goal_of
from ._console import progress, say, tell, warn
from ._drawing import Plan, Shot
from ._outputs import add_output_argument, claim
from ._scans import (
    SCAN_HELP,
    add_average_argument,
    add_pose_arguments,
    chosen_poses,
    first_readable,
    frame_title,
    open_timeline,
    read_poses,
    stated_upright,
)

_SIZE = (1920, 1280)


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d render`."""
    parser.add_argument("scan", metavar="SCAN", nargs="?", help=SCAN_HELP)
    add_output_argument(parser, ".png .exr .npz .mp4, or a pattern with %%04d; with --no-gl also .cw")
    parser.add_argument(
        "--replay", type=Path, metavar="FILE",
        help="draw a recording (.json) or a saved picture (.png, .exr) again, or draw it with the scan SCAN",
    )  # fmt: skip
    parser.add_argument(
        "--anonymous", action="store_true",
        help="store no name, folder or time of the scan in the output",
    )  # fmt: skip
    parser.add_argument(
        "--progress", action="store_true", help="print the progress: a line of JSON for each picture"
    )
    add_pose_arguments(parser)
    picture = parser.add_argument_group("picture")
    picture.add_argument(
        "--size", type=arguments.size, metavar="WxH", help="size in pixels; default 1920x1280"
    )
    picture.add_argument(
        "--backend", metavar="NAME", help="renderer; default auto: the renderer that suits the scan"
    )
    add_goal_arguments(picture)
    picture.add_argument(
        "--levels", action="store_true",
        help="write a picture of each level of an octree file as it arrives, with --backend voxels",
    )  # fmt: skip
    picture.add_argument("--no-gl", action="store_true", help="draw without OpenGL, with --backend codeword")
    picture.add_argument(
        "--behind",
        type=Path,
        metavar="FILE",
        help="background picture of the same size as the output, for --no-gl",
    )
    picture.add_argument(
        "--set", type=_assignment, nargs="+", action="extend", default=[], metavar="key=value",
        help="the renderer's parameters; 'scan4d backends' lists them",
    )  # fmt: skip
    picture.add_argument(
        "--look", type=_assignment, nargs="+", action="extend", default=[], metavar="key=value",
        help="lighting, colours and background",
    )  # fmt: skip
    picture.add_argument(
        "--quality", choices=tuple(SAMPLES),
        help=(
            "anti-aliasing of .png and .mp4: the mean of 1, 5 or 17 samples per pixel; default: "
            "balanced, or as in the recording"
        ),
    )  # fmt: skip
    picture.add_argument(
        "--marks", choices=MARKS, nargs="+", action="extend", metavar="MARK",
        help=f"overlays of .png and .mp4: {', '.join(MARKS)}",
    )  # fmt: skip
    camera = parser.add_argument_group("camera").add_mutually_exclusive_group()
    camera.add_argument("--camera", type=Path, metavar="FILE.json", help="camera from a file")
    camera.add_argument(
        "--orbit", type=_orbit, metavar="AZIMUTH,ELEVATION[,DISTANCE]",
        help=
            "camera that looks at the scan from these angles (degrees) and this distance (scan units); "
            "without a distance, the scan fills the picture"
        ,
    )  # fmt: skip
    camera.add_argument(
        "--turntable",
        type=arguments.count,
        metavar="N",
        help="draw N pictures of one full turn around the scan; a sequence plays during the turn",
    )
    add_average_argument(picture)
    measuring = parser.add_argument_group("statistics")
    measuring.add_argument(
        "--stats",
        type=Path,
        metavar="FILE.json",
        help="write drawing times and numbers of points of each picture",
    )
    measuring.add_argument(
        "--repeat",
        type=arguments.count,
        metavar="N",
        help="measure the times of N drawings of each picture, after two without measuring; --stats writes "
        "the medians",
    )


def run(args: Namespace) -> int:
    """Draw what is asked for; broken frames among several are left out."""
    if without_gl.is_asked(args):
        return without_gl.run(args)
    if args.levels:
        return levels.run(args, args.size or _SIZE)
    if args.behind:
        raise InputError(
            "applies only to pictures that Scan4D draws without OpenGL", "--behind", "Add --no-gl"
        )
    if args.repeat and not args.stats:
        raise InputError("--repeat needs --stats", hint="Add --stats FILE.json")
    if args.stats:
        check_output(args.stats, (".json",), several=False)
    if args.marks and args.out.suffix.lower() in UNMARKED_SUFFIXES:
        hint = "Such files store the surface, not a picture. Use .png or .mp4"
        raise InputError(f"Scan4D draws no overlays in '{args.out.suffix}' files", "--marks", hint)
    with (replay.planned if args.replay else _planned)(args) as plan:
        _draw(plan, args)
    tell(args.out)
    return 0


@contextmanager
def _planned(args: Namespace) -> Iterator[Plan]:
    """The pictures that the arguments describe."""
    look, values, goal = parse(Look, dict(args.look), "look"), dict(args.set), goal_of(args)
    name = None if args.backend == AUTO else args.backend
    if name:
        find_backend(name).params(values)  # refuses wrong names before anything is read
    camera = Camera.load(args.camera) if args.camera else None
    scan, size = args.scan or DEMO, args.size or _SIZE
    with open_timeline(args, scan) as timeline:
        timeline.average(Averaging(args.average or 0))
        indices = chosen_poses(args, timeline) or [0]
        shots = drawing.shots(timeline, indices, args)
        check_output(args.out, OUTPUT_SUFFIXES, several=len(shots) > 1)
        times = drawing.film_times(shots, args)
        shots = drawing.shown_shots(shots, times)
        outputs = drawing.outputs(args.out, [shot.number for shot in shots], args.stats)
        upright = stated_upright(args, timeline, indices)
        if "up" not in dict(args.look):
            look = replace(look, up=upright.up)
        look = replace(look, quality="fast" if goal else args.quality or look.quality)
        claim(outputs, [*scan_inputs(timeline), *([args.camera] if camera else [])], args.force)
        drawing.check_color_source(look, timeline, indices, name)
        look = drawing.ranged(look, timeline, indices)
        salt = new_salt() if args.anonymous else None
        hash = fingerprint(timeline.files, salt) if args.out.suffix.lower() in DESCRIBED_SUFFIXES else None
        marks = marks_of(args.marks)

        def pictures() -> Iterator[tuple[int, Request, Entry, Legend]]:
            wanted = _Wanted(size, look, values, camera, upright, name, goal)
            drawn = _requests(args, timeline, shots, wanted)
            for shot, request, choice in drawn:
                if args.anonymous:
                    request = anonymous_request(request, start=float(timeline.times[0]))
                entry = Entry.of(request, scan, hash, size, timeline.unit, marks, choice=choice)
                entry = entry.with_reading(timeline)
                entry = replace(entry.without_names() if args.anonymous else entry, at=shot.start)
                yield shot.number, request, entry, entry.legend(timeline, request.pose)

        yield Plan(len(shots), size, times, pictures())


def _draw(plan: Plan, args: Namespace) -> None:
    """Draw a plan, and write its pictures and what they took."""
    frames = []
    with (
        drawing.canvases(args.device, plan.size) as (renderer, surface_of),
        pictures(args.out, plan.size, plan.times) as put,
        progress(plan.count * stats.draw_count(args.repeat), args.progress) as tick,
    ):
        if args.progress:
            say(device=renderer.gpu.device)
        for number, request, entry, legend in plan.pictures:
            surface = surface_of(entry.size, entry.scale)
            if args.stats:
                frames.append(stats.draw_measured(renderer, request, surface, args.repeat, tick))
            else:
                draw(renderer, request, surface)
                tick()
            if args.out.suffix.lower() not in UNMARKED_SUFFIXES:
                while supersample(renderer, request, surface):
                    pass
            put(surface, number, entry.at, entry.after_drawing(request.pose).description(), legend)
        if args.stats:
            save_json(args.stats, stats.summary(renderer, surface, request, frames, entry.automatic))


class _Wanted(NamedTuple):
    """The settings of all pictures. values: of the backend's parameters, by name."""

    size: tuple[int, int]
    look: Look
    values: dict[str, object]
    camera: Camera | None
    upright: Upright
    backend: str | None
    goal: Goal | None


def _requests(
    args: Namespace, timeline: Timeline, shots: list[Shot], wanted: _Wanted
) -> Iterator[tuple[Shot, Request, Choice | None]]:
    """Requests for each shot, and how backend and parameters were chosen, where they were for a goal. The
    first pose settles the backend, several the camera if there is none.

    A pose without the number that the look colours by is reported, and has colours of its own choice.
    """
    size, look, values, camera, upright, backend, goal = wanted
    chosen, choice = None, None
    camera_of = None if camera is None else lambda shot: camera
    indices = list(dict.fromkeys(shot.pose for shot in shots))
    for pose in read_poses(timeline, indices, with_empty=True):
        first = pose if pose.count or chosen else first_readable(timeline, indices)
        camera_of = camera_of or drawing.shot_cameras(args, timeline, shots, size, upright, first)
        if chosen is None and goal is not None:
            shown = next((shot for shot in shots if shot.pose == first.index), shots[0])
            choice = choice_of(first, camera_of(shown), size, goal, timeline.unit, args.device)
            chosen = choice.configuration.backend, choice.configuration.params
        chosen = chosen or backend_for(first, backend, values)
        own = drawable(look, pose.overview.scalars, find_backend(chosen[0]).values)
        if own is not look and pose.count:
            title = frame_title(timeline, pose.index)
            warn(f"{timeline.name}: {title} has no '{look.color_by}', so Scan4D uses other colours")
        for shot in shots:
            if shot.pose == pose.index:
                yield shot, Request(pose, camera_of(shot), *chosen, own), choice


def _assignment(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise ArgumentTypeError(f"'{text}' does not have the form key=value")
    return name, value


def _orbit(text: str) -> tuple[float, ...]:
    return arguments.numbers(text, (2, 3), "AZIMUTH,ELEVATION[,DISTANCE] such as 30,15")
