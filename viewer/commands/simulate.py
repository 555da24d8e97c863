"""Scan a mesh or a sequence of meshes with a virtual scanner.

OUT is a .exr file of range views, or their merged points as .ply, .pcd or .npz. A sequence needs a numbered
pattern such as out%04d.exr; Scan4D writes the times into times.csv beside it.
"""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..geometry import UP
from ..mesh.triangles import Mesh
from ..output.export import check_output
from ..scan import formats
from ..scan.demo import DemoSource
from ..scan.faces import Faces
from ..scan.inputs import scan_inputs
from ..scan.pose import Pose
from ..scan.range_view import merge
from ..scan.sources import FACES_FILE
from ..scan.timeline import Timeline
from ..simulate.scanner import Faults, around, capture, rig
from . import _arguments as arguments
from ._console import tell
from ._outputs import add_output_argument, claim
from ._scans import (
    add_pose_arguments,
    chosen_poses,
    frame_outputs,
    framing,
    open_timeline,
    read_poses,
    with_files,
)

_HINT = "Name a file that contains the faces with --faces"


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d simulate`."""
    parser.add_argument(
        "scan", metavar="MESH|SEQUENCE", help="a file with faces (PLY, OBJ, NPZ), a folder, a pattern, demo"
    )
    add_output_argument(parser, f"{' '.join(formats.writable_suffixes(views=True))}, or a pattern with %%04d")
    parser.add_argument(
        "--faces", type=Path, metavar="FILE",
        help=(
            f"file with the faces of all frames; default: the faces in each frame's file, or {FACES_FILE} "
            "beside the frames"
        ),
    )  # fmt: skip
    add_pose_arguments(parser)
    pods = parser.add_argument_group("scanner")
    arrangement = pods.add_mutually_exclusive_group()
    arrangement.add_argument(
        "--pods",
        type=int,
        default=2,
        metavar="N",
        help="number of pods, 1 to 8; default 2, one to the left and one to the right of the front",
    )
    arrangement.add_argument(
        "--azimuths", type=float, nargs="+", action="extend", metavar="A", help="azimuth of each pod, degrees"
    )
    pods.add_argument(
        "--elevation", type=float, default=0.0, metavar="E", help="elevation of all pods, degrees"
    )
    pods.add_argument(
        "--size",
        type=arguments.size,
        default=(640, 480),
        metavar="WxH",
        help="pixels of a range image; default 640x480",
    )
    pods.add_argument(
        "--fov", type=float, default=30.0, metavar="F", help="vertical field of view, degrees; default 30"
    )
    faults = parser.add_argument_group("faults")
    faults.add_argument(
        "--noise", type=_numbers, default=(0.0,), metavar="SIGMA[,SIGMA...]",
        help="standard deviation of the depth noise, in scan units: one value for all pods, or one per pod",
    )  # fmt: skip
    faults.add_argument(
        "--disparity", type=float, default=0.0, metavar="STEP", help="step between disparities, pixels"
    )
    faults.add_argument(
        "--dropouts",
        type=float,
        default=0.0,
        metavar="FRACTION",
        help="fraction of the pixels that get no depth",
    )
    faults.add_argument(
        "--outliers",
        type=float,
        default=0.0,
        metavar="FRACTION",
        help="fraction of the pixels that get a grossly wrong depth",
    )
    faults.add_argument(
        "--grazing",
        type=float,
        default=90.0,
        metavar="DEGREES",
        help="largest angle of incidence at which a pixel still gets a depth, degrees",
    )
    faults.add_argument(
        "--gain", type=_factors, nargs="+", action="extend", metavar="G|R,G,B",
        help="factor on the colour in linear light: one value for all pods, or one per pod",
    )  # fmt: skip
    faults.add_argument(
        "--calibration-error", type=_numbers, default=(0.0,), metavar="DEGREES[,DEGREES...]",
        help=
            "error of the stored calibration, as a turn to the left in degrees: one value for all pods, or "
            "one per pod"
        ,
    )  # fmt: skip
    faults.add_argument(
        "--seed", type=arguments.seed, default=0, metavar="N", help="seed of all random numbers; default 0"
    )


def run(args: Namespace) -> int:
    """Scan the chosen poses, by default all; broken frames among several are left out."""
    azimuths = tuple(args.azimuths) if args.azimuths else around(args.pods)
    faults = _faults(args, len(azimuths))
    with open_timeline(args, args.scan) as timeline:
        indices = chosen_poses(args, timeline) or list(range(len(timeline)))
        check_output(args.out, formats.writable_suffixes(views=True), several=len(indices) > 1)
        inputs = [*scan_inputs(timeline), *([args.faces] if args.faces else [])]
        claim(frame_outputs(args.out, indices, timeline), inputs, args.force)
        mesh_of = _mesh_maker(timeline, args.faces, indices[0])
        aspect = args.size[0] / args.size[1]
        bounds = framing(timeline, indices)
        pods = rig(bounds, azimuths, args.elevation, aspect=aspect, fov_y=args.fov, up=args.up or UP)
        for pose, path in with_files(args.out, read_poses(timeline, indices), len(indices)):
            views = capture(
                mesh_of(pose), pods, args.size, faults, seed=args.seed, frame=pose.index, unit=timeline.unit
            )
            formats.write(path, merge(views, normals=True), views)
    tell(args.out)
    return 0


def _faults(args: Namespace, pods: int) -> list[Faults]:
    """The faults of each pod."""
    common = Faults(
        disparity=args.disparity, dropouts=args.dropouts, outliers=args.outliers, grazing=args.grazing
    )
    each = {
        "noise": _for_each("--noise", args.noise, pods),
        "gain": _for_each("--gain", args.gain or [(1.0, 1.0, 1.0)], pods),
        "calibration_error": _for_each("--calibration-error", args.calibration_error, pods),
    }
    return [replace(common, **{name: values[pod] for name, values in each.items()}) for pod in range(pods)]


def _for_each(flag: str, values: Sequence[Any], pods: int) -> Sequence[Any]:
    """A value for each pod, of one for all or one for each."""
    if len(values) not in (1, pods):
        raise InputError(
            f"{len(values)} values for {pods} pods", flag, "Give one value for all pods, or one value per pod"
        )
    return values if len(values) == pods else [values[0]] * pods


def _mesh_maker(timeline: Timeline, shared: Path | None, first: int) -> Callable[[Pose], Mesh]:
    """A function from a pose to the mesh to scan: its points with its faces, or the demo's own surface.

    shared: the file that has the faces of all poses. first: the pose whose faces are asked for at once, so
    the first without ends the search.
    """
    if isinstance(source := timeline.source, DemoSource) and shared is None:
        from ..bench.truth.head_mesh import head_mesh

        return lambda pose: head_mesh(float(source.times()[pose.index]), source.motion)
    of_all = None if shared is None else formats.read_faces(shared)

    def faces_of(index: int) -> Faces:
        faces = timeline.faces(index) if of_all is None else of_all
        if not len(faces):
            raise InputError("is not a mesh: it has no faces", shared or timeline.label(index), _HINT)
        return faces

    faces_of(first)
    return lambda pose: _mesh(pose, faces_of(pose.index))


def _mesh(pose: Pose, faces: Faces) -> Mesh:
    try:
        return Mesh(pose.cloud, faces.triangles())
    except InputError as error:
        raise InputError(error.what, pose.label, "The faces do not match the vertices of the mesh") from error


def _numbers(text: str) -> tuple[float, ...]:
    return arguments.numbers(text, None, "a number, or several with commas such as 0.5,1.0")


def _factors(text: str) -> tuple[float, ...]:
    """Factors of red, green and blue, of one for all or three."""
    factors = _numbers(text)
    if len(factors) not in (1, 3):
        raise ArgumentTypeError(f"'{text}' is neither one factor nor three factors for red, green and blue")
    return factors if len(factors) == 3 else 3 * factors
