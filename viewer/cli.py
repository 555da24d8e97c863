"""The command line: `scan4d COMMAND ...`. Each command is a module of viewer/commands."""

from __future__ import annotations

import os
import re
import sys
import traceback
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Sequence
from importlib import import_module
from typing import NoReturn

from .errors import InputError, Scan4DError
from .geometry import up_vector
from .signals import ending_as_interrupts

COMMANDS = ("view", "render", "info", "convert", "simulate", "bench", "backends", "doctor")

_SIGNED_OPTIONS = ("--orbit", "--up")
_SIGNED_VALUE = re.compile(r"-([xyz]$|[0-9.])")


class _Parser(ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise InputError(message, hint=f"See '{self.prog} --help'")


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit code.

    0 done, 2 unusable arguments or input, 3 no usable OpenGL, 1 anything else. Errors are
    one message on standard error, with a traceback only under --debug.
    """
    argv = list(sys.argv[1:] if argv is None else argv)
    try:
        with ending_as_interrupts():
            code = _run(argv)
        sys.stdout.flush()  # here, where it is noticed that nobody reads it
        return code
    except SystemExit as stop:  # --help
        return int(stop.code or 0)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (Exception, KeyboardInterrupt) as error:
        if "--debug" in argv:
            traceback.print_exc()
        print(f"scan4d: {_message(error)}", file=sys.stderr)
        return error.exit_code if isinstance(error, Scan4DError) else 1


def _message(error: BaseException) -> str:
    if isinstance(error, Scan4DError):
        return str(error)
    if isinstance(error, KeyboardInterrupt):
        return "stopped"
    return f"internal error ({type(error).__name__}: {error}). Run it again with --debug"


def _run(argv: list[str]) -> int:
    # A command's module brings what it works with: of several, only the one named is imported.
    parser = make_parser([word for word in argv[:1] if word in COMMANDS] or COMMANDS)
    args = parser.parse_args(_join_signed_values(argv))
    if args.command is None:
        parser.print_help()
        return 0
    return args.run(args)


def make_parser(names: Sequence[str] = COMMANDS) -> ArgumentParser:
    """The parser of these commands."""
    parser = _Parser(
        prog="scan4d", description="Viewer and headless renderer for 4D scans.", allow_abbrev=False
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    common = _common_arguments()
    for name in names:
        module = import_module(f"{__package__}.commands.{name}")
        text = module.__doc__ or ""
        command = commands.add_parser(
            name,
            help=text.splitlines()[0],
            description=text,
            parents=[common],
            formatter_class=RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        module.add_arguments(command)
        command.set_defaults(run=module.run)
    return parser


def _common_arguments() -> _Parser:
    parser = _Parser(add_help=False)
    group = parser.add_argument_group("with every command")
    group.add_argument("--device", type=int, metavar="N", help="which GPU, where there are several")
    group.add_argument("--unit", metavar="U", help="the scan's unit of length, for example mm")
    group.add_argument(
        "--fps", type=float, metavar="F", help="poses a second, and pictures a second of a film"
    )
    group.add_argument(
        "--up", type=_up, default="+y", metavar="±x|±y|±z", help="the axis that is up, default +y"
    )
    group.add_argument("--debug", action="store_true", help="show the traceback of an error")
    return parser


def _up(text: str) -> str:
    up_vector(text)
    return text


def _join_signed_values(argv: list[str]) -> list[str]:
    """--orbit -30,15 as --orbit=-30,15, which argparse does not take for another option."""
    joined: list[str] = []
    for word in argv:
        if joined and joined[-1] in _SIGNED_OPTIONS and _SIGNED_VALUE.match(word):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


if __name__ == "__main__":
    sys.exit(main())
