"""Pictures without OpenGL: `scan4d render --no-gl`, from code words, and files of these drawn again."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..codewords import SUFFIX
from ..codewords.engine import CodePicture, draw_words
from ..codewords.files import WordFile, write_stream, writing_streams
from ..codewords.stream import WordStream
from ..codewords.words import NO_WORD
from ..drawing.request import Request, view_of
from ..errors import InputError
from ..look import Look, drawable, value_source
from ..output.export import check_output, is_pattern, numbered, write_arrays, write_png
from ..output.film import FILM_SUFFIX, FilmTimes, film
from ..params import parse
from ..scan.code_words import Params, Shared, words_of
from ..scan.estimate import with_estimates
from ..scan.inputs import scan_inputs
from ..scan.open import DEMO
from ..scan.pose import Pose
from ..scan.range_folders._pictures import read_color
from . import _arguments as arguments
from . import _drawing as drawing
from ._console import progress, say, tell, warn
from ._outputs import claim
from ._scans import chosen_poses, first_readable, frame_title, open_timeline, read_poses, stated_upright

BACKEND = "codeword"
_SUFFIXES = (".png", ".npz", FILM_SUFFIX, SUFFIX)
_SIZE = (1920, 1280)
SAMPLES = {"fast": 1, "balanced": 2, "fine": 4}  # along the edge of a pixel, by the look's quality
# Arguments of `scan4d render` that are for OpenGL's pictures alone, and those that a stream has settled.
_NEED_GL = ("marks", "stats", "repeat", "replay", "anonymous", "budget", "error")
_SETTLED = ("size", "set", "look", "camera", "orbit", "turntable", "quality")


def is_asked(args: Namespace) -> bool:
    """Whether the arguments ask for a picture without OpenGL: by name, or as they read or write code
    words."""
    reads = args.scan is not None and args.scan.lower().endswith(SUFFIX)
    return args.no_gl or reads or args.out.suffix.lower() == SUFFIX


def run(args: Namespace) -> int:
    """Draw what is asked for, on the CPU. Raises InputError."""
    if args.backend not in (None, BACKEND):
        hint = f"Use --backend {BACKEND}, or leave out --backend"
        raise InputError(f"'{args.backend}' needs OpenGL", "--no-gl", hint)
    _refuse(args, _NEED_GL, "applies only to pictures that Scan4D draws with OpenGL, without --no-gl")
    if args.behind and args.out.suffix.lower() == SUFFIX:
        raise InputError(
            f"has no effect on '{SUFFIX}' files, which do not store a background picture",
            "--behind",
            "Use this option later, when you draw a picture from the file of code words",
        )
    if args.progress:
        say(device="CPU")
    if args.scan is not None and args.scan.lower().endswith(SUFFIX):
        _replay(args, Path(args.scan))
    else:
        _draw(args)
    tell(args.out)
    return 0


def _refuse(args: Namespace, names: tuple[str, ...], what: str) -> None:
    """Raise InputError where one of these arguments is given."""
    for flag in arguments.given(args, names):
        raise InputError(what, flag, "Leave it out")


def _replay(args: Namespace, path: Path) -> None:
    """Draw files of code words, or store their pictures in others."""
    _refuse(args, _SETTLED, f"has no effect: {path.name} stores finished pictures")
    with open_timeline(args, str(path)) as timeline:
        shots = drawing.shots(timeline, chosen_poses(args, timeline) or [0], args)
        _check_output(args.out, several=len(shots) > 1)
        times = drawing.film_times(shots, args)
        shots = drawing.shown_shots(shots, times)
        outputs = drawing.outputs(args.out, [shot.number for shot in shots])
        claim(outputs, [*timeline.files, *_given(args.behind)], args.force)
        files = [WordFile(file) for file in timeline.files]

        def words(index: int) -> WordStream:
            return files[0].read(index) if len(files) == 1 else files[index].read(0)

        size = words(shots[0].pose).picture_size
        draw = partial(draw_words, background=_background(args.behind, size))
        with (
            _written(args.out, size, times, draw, len(shots)) as put,
            progress(len(shots), args.progress) as tick,
        ):
            for shot in shots:
                stream = words(shot.pose)
                drawn = stream.picture_size
                if drawn != size and (times is not None or args.behind):
                    what = "has {} x {} pixels, but the first picture has {} x {}".format(*drawn, *size)
                    raise InputError(what, timeline.label(shot.pose), "Draw this picture alone")
                put(shot, stream, None)
                tick()


def _check_output(out: Path, several: bool) -> None:
    """Raise InputError where pictures cannot go to this path; one `.cw` file can store several."""
    check_output(out, _SUFFIXES, several and not _holds_several(out, 2))


def _draw(args: Namespace) -> None:
    """Encode poses of a scan, and draw them or write their code words."""
    look, params = parse(Look, dict(args.look), "look"), _params(args)
    samples = SAMPLES[args.quality or dict(args.look).get("quality", "fast")]
    camera = Camera.load(args.camera) if args.camera else None
    with open_timeline(args, args.scan or DEMO) as timeline:
        indices, size = chosen_poses(args, timeline) or [0], args.size or _SIZE
        shots = drawing.shots(timeline, indices, args)
        _check_output(args.out, several=len(shots) > 1)
        times = drawing.film_times(shots, args)
        shots = drawing.shown_shots(shots, times)
        upright = stated_upright(args, timeline, indices)
        if "up" not in dict(args.look):
            look = replace(look, up=upright.up)
        inputs = [*scan_inputs(timeline), *_given(args.camera), *_given(args.behind)]
        claim(drawing.outputs(args.out, [shot.number for shot in shots]), inputs, args.force)
        look = drawing.ranged(look, timeline, indices)
        camera_of = None if camera is None else lambda shot: camera
        poses = list(dict.fromkeys(shot.pose for shot in shots))
        draw = partial(draw_words, window=params.window, background=_background(args.behind, size))
        shared = Shared() if _holds_several(args.out, len(shots)) else None
        with (
            _written(args.out, size, times, draw, len(shots)) as put,
            progress(len(shots), args.progress) as tick,
        ):
            for pose in read_poses(timeline, poses, with_empty=True):
                first = pose if pose.count or camera_of else first_readable(timeline, poses)
                camera_of = camera_of or drawing.shot_cameras(args, timeline, shots, size, upright, first)
                known = _with_estimates(pose, params)
                own = _own_look(look, known, frame_title(timeline, pose.index), several=len(indices) > 1)
                for shot in shots:
                    if shot.pose == pose.index:
                        view = view_of(Request(pose, camera_of(shot)), size)
                        put(shot, words_of(known, view, own, params, shared=shared, samples=samples), pose)
                        tick()


def _given(path: Path | None) -> list[Path]:
    return [] if path is None else [path]


def _background(path: Path | None, size: tuple[int, int]) -> NDArray[np.uint8] | None:
    """A picture that is drawn over, (H, W, 4). Raises InputError for one of another size."""
    if path is None:
        return None
    colors = read_color(path)
    height, width = colors.shape[:2]
    if (width, height) != size:
        what = f"has {width} x {height} pixels, but the picture has {size[0]} x {size[1]}"
        raise InputError(
            what, path, ("Resize the background picture, or change the size of the picture with --size")
        )
    return np.dstack([colors, np.full((height, width), 255, np.uint8)])


def _params(args: Namespace) -> Params:
    params = parse(Params, dict(args.set), f"parameter of '{BACKEND}'")
    params.steps  # noqa: B018  # refuses wrong ones before anything is read
    return params


def _own_look(look: Look, pose: Pose, title: str, several: bool) -> Look:
    """The look with colours of its own choice where one of several poses lacks the number that it colours
    by, and by depth where nothing else would tell a shape. Raises InputError where the only pose lacks it."""
    own = drawable(look, pose.overview.scalars)
    if own is not look and not several:
        value_source(look, pose.overview.scalars)  # raises, and lists the known ones
    if own is not look:
        warn(f"{title} has no '{look.color_by}', so Scan4D uses other colours")
    shapeless = pose.cloud.normals is None and pose.cloud.colors is None
    return replace(own, color_by="depth") if shapeless and own.color_by == "auto" else own


def _with_estimates(pose: Pose, params: Params) -> Pose:
    """The pose with the normals, and where asked for the radii, that it lacks."""
    wanted = ["normals", "radii"] if params.radius == "own" else ["normals"]
    missing = [name for name in wanted if getattr(pose.cloud, name) is None]
    if not (missing and len(pose.cloud)):
        return pose
    try:
        return with_estimates(pose, missing)
    except ImportError:  # the library that finds neighbours is linked to EGL
        effects = {"normals": "the discs face the viewer", "radii": "all discs have the same size"}
        effect = " and ".join(effects[name] for name in missing)
        warn(f"Scan4D cannot estimate {' or '.join(missing)} on this computer, so {effect}")
        return pose


def _holds_several(out: Path, count: int) -> bool:
    """Whether so many pictures go to one file of code words."""
    return count > 1 and out.suffix.lower() == SUFFIX and not is_pattern(out)


@contextmanager
def _written(
    out: Path,
    size: tuple[int, int],
    times: FilmTimes | None,
    draw: Callable[[WordStream], CodePicture],
    count: int,
) -> Iterator[Callable[[drawing.Shot, WordStream, Pose | None], None]]:
    """A function that writes a stream to the file, the numbered file or the film that the path names.

    It takes the shot, its stream and its pose. times: of a film. count: of pictures.
    """
    suffix = out.suffix.lower()
    if times is not None:
        with film(out, size, times) as add:
            yield lambda shot, stream, pose: add(draw(stream).image, shot.start)
        return
    if _holds_several(out, count):
        with writing_streams(out) as store:
            yield lambda shot, stream, pose: store(stream, shot.start)
        return

    def put(shot: drawing.Shot, stream: WordStream, pose: Pose | None) -> None:
        path = numbered(out, shot.number)
        if suffix == SUFFIX:
            write_stream(stream, path)
            return
        picture = draw(stream)
        if suffix == ".npz":
            write_arrays(_arrays(picture, pose), path)
        else:
            write_png(picture.image, path)

    yield put


def _arrays(picture: CodePicture, pose: Pose | None) -> dict[str, np.ndarray]:
    """Channels of a picture: colour as it is shown, depth, and ids in the file where the pose is known."""
    rows = picture.ids()
    ids = rows
    if pose is not None and pose.cloud.ids is not None:
        ids = np.append(pose.cloud.ids, np.uint32(NO_WORD))[np.minimum(rows, len(pose.cloud))]
    return {"picture": picture.image, "depth": picture.depths(), "id": ids}
