"""Which renderer `scan4d render` draws with: the one that is named, or the one that suits best."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace, _ArgumentGroup

from ..camera import Camera
from ..choice.choose import Choice, choose_configuration
from ..choice.goal import Goal, error_goal, in_unit, time_goal
from ..choice.known import model_of
from ..drawing.request import Request, view_of
from ..errors import InputError
from ..scan.pose import Pose
from . import _drawing as drawing
from ._console import warn

AUTO = "auto"
_OTHERS = {
    "set": "needs a named renderer",
    "quality": "draws several samples per pixel, but a limit of time or error applies to one sample",
}


def add_goal_arguments(parser: ArgumentParser | _ArgumentGroup) -> None:
    """The arguments with the limits of an automatic choice."""
    parser.add_argument(
        "--budget",
        metavar="TIME",
        help="choose the most accurate renderer that draws a picture in at most this time, such as 50ms",
    )
    parser.add_argument(
        "--error", metavar="LENGTH",
        help="choose the fastest renderer whose error is at most this length, such as 0.5px or 0.1mm",
    )  # fmt: skip


def goal_of(args: Namespace) -> Goal | None:
    """Bound that the renderer is to be chosen for; None where it is named, or the scan's default. Raises
    InputError."""
    given = [name for name in ("budget", "error") if getattr(args, name) is not None]
    if not given:
        return None
    if len(given) > 1:
        raise InputError(
            "are two limits, but Scan4D can apply only one limit", "--budget, --error", "Leave out one"
        )
    (name,) = given
    if args.backend not in (None, AUTO):
        hint = f"Use --backend {AUTO}, or leave out --{name}"
        raise InputError(
            "a limit lets Scan4D choose the renderer, but the command already names the renderer "
            f"{args.backend}",
            f"--{name}",
            hint,
        )
    for other, what in _OTHERS.items():
        if getattr(args, other):
            raise InputError(what, f"--{other}", f"Leave out --{other} or --{name}")
    return (time_goal if name == "budget" else error_goal)(getattr(args, name))


def choice_of(
    pose: Pose, camera: Camera, size: tuple[int, int], goal: Goal, unit: str, device: int | None
) -> Choice:
    """The best choice for the first picture, which all others are drawn as. unit: of the scan. Raises
    InputError where nothing is known of the device, or no renderer can be chosen for the scan."""
    model = model_of(drawing.renderer(device).gpu)
    view = view_of(Request(pose, camera), size)
    choice = choose_configuration(pose, view, in_unit(goal, unit), model)
    if choice is None:
        raise InputError(
            "Scan4D cannot choose a renderer automatically for this scan", hint="Name one with --backend"
        )
    if not choice.meets_limit:
        warn(
            f"no renderer is likely to stay within the limit of {goal}. Scan4D uses the renderer that comes "
            f"closest: {choice}"
        )
    return choice
