"""Pictures of the levels of an octree file, each written when the level has arrived (Slomp 2014, VI)."""

from __future__ import annotations

import itertools
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from ..backends import backend as find_backend
from ..camera import Camera
from ..drawing.request import Request
from ..drawing.timing import draw
from ..errors import InputError
from ..look import Look
from ..output.export import check_output, numbered, write_png
from ..params import parse
from ..scan.inputs import scan_inputs
from ..scan.octree.stored import octree_of
from ..scan.open import DEMO
from ..scan.pods import first_camera
from ..scan.pose import Pose
from ..scan.timeline import Timeline
from ..scan.upright import UP, Upright
from . import _drawing as drawing
from ._console import tell
from ._outputs import claim
from ._scans import chosen_poses, open_timeline

_BACKEND = "voxels"


def run(args: Namespace, size: tuple[int, int]) -> int:
    """Draw each level as it arrives. Raises InputError where the scan is no octree, or is damaged."""
    check_output(args.out, (".png",), several=True)
    drawn_by = find_backend(args.backend or _BACKEND)
    params, look = drawn_by.params(dict(args.set)), parse(Look, dict(args.look), "look")
    camera = Camera.load(args.camera) if args.camera else None
    with open_timeline(args, args.scan or DEMO) as timeline:
        index, *others = chosen_poses(args, timeline) or [0]
        if others:
            raise InputError("applies to one frame", "--levels", "Choose a frame with --pose")
        with drawing.canvas(args.device, size) as (renderer, surface):
            for level, pose in _levels(timeline, index):
                if camera is None:
                    up = args.up or (look.up if "up" in dict(args.look) else pose.upright.up)
                    look = replace(look, up=up)
                    camera = _fitted(args, pose, size, replace(pose.upright, up=up))
                draw(renderer, Request(pose, camera, drawn_by, params, look), surface)
                out = numbered(args.out, level)
                claim([out], scan_inputs(timeline), args.force)
                write_png(surface.image(), out)
                tell(Path(out))
    return 0


def _fitted(args: Namespace, pose: Pose, size: tuple[int, int], upright: Upright) -> Camera:
    """The camera for the first level that is drawn, which later ones keep."""
    aspect = size[0] / size[1]
    if args.orbit:
        return Camera.orbit(pose.bounds, *args.orbit, aspect=aspect, up=upright.up or UP)
    return first_camera(pose.views, pose.bounds, aspect, upright)


def _levels(timeline: Timeline, index: int) -> Iterator[tuple[int, Pose]]:
    """The levels of a frame as they arrive: numbers, and what they show. The last is the frame as it is."""
    source, time, label = timeline.source, float(timeline.times[index]), timeline.label(index)
    clouds = getattr(source, "coarser", None)
    coarser = () if clouds is None else clouds(index)
    coarse = (Pose.of(index, time, label, cloud) for cloud in coarser)
    try:
        for pose in itertools.chain(coarse, (timeline.pose(each) for each in [index])):
            octree = octree_of(pose.cloud)
            if octree is None:
                raise InputError("stores no octree", hint="--levels draws octree files (.svo)")
            yield octree.depth, pose
    except InputError as error:
        error.where = error.where or label
        raise
