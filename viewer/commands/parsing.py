"""The words of a command line, parsed; what is wrong in them is an InputError that says what may be meant."""

from __future__ import annotations

import argparse
import re
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Sequence
from importlib import import_module
from typing import Any, NoReturn

from .. import __version__
from ..errors import InputError, did_you_mean, shortened, unknown_name
from ..geometry import up_vector

_SIGNED_OPTIONS = ("--orbit", "--up")
_SIGNED_VALUE = re.compile(r"-([xyz]$|[0-9.])")
_ASSIGNING_OPTIONS = ("--set", "--look")
_OPTION = re.compile(r"(?<![\w-])(--[a-z][a-z-]*|-[a-z])\b")
_MOST_NAMED = 3  # of words that are too many


def parsed(words: Sequence[str], commands: Sequence[str]) -> Namespace:
    """The arguments, with the command's `run`. Raises InputError; SystemExit after --help and --version."""
    named = [word for word in words[:1] if not word.startswith("-")]
    if named and named[0] not in commands:
        raise unknown_name("command", named[0], commands)
    # A command's module brings what it works with: only what is named is imported, and all for the help.
    parser = _parser([] if words[:1] == ["--version"] else named or commands)
    args, unknown = parser.parse_known_args(_assigned_singly(_signed_values_joined(words)))
    if unknown:
        raise _not_understood(unknown, args)
    if args.command is None:
        parser.print_help()
        raise SystemExit
    return args


class _Parser(ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise InputError(message, hint=f"See '{self.prog} --help'")

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            raise unknown_name(f"value of {'/'.join(action.option_strings)}", value, map(str, action.choices))


def _parser(commands: Sequence[str]) -> ArgumentParser:
    """The parser of these commands."""
    parser = _Parser(
        prog="scan4d", description="Viewer and headless renderer for 4D scans.", allow_abbrev=False
    )
    parser.add_argument("--version", action="version", version=f"scan4d {__version__}")
    parser.set_defaults(parser=parser)
    its_commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    common = _common_arguments()
    for name in commands:
        module = import_module(f"{__package__}.{name}")
        text = module.__doc__ or ""
        command = its_commands.add_parser(
            name,
            help=text.splitlines()[0],
            description=text,
            parents=[common],
            formatter_class=RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        module.add_arguments(command)
        command.set_defaults(run=module.run, parser=command)
    return parser


def _common_arguments() -> _Parser:
    parser = _Parser(add_help=False)
    group = parser.add_argument_group("with every command")
    group.add_argument("--device", type=int, metavar="N", help="which GPU, where there are several")
    group.add_argument("--unit", type=_unit, metavar="U", help="the scan's unit of length, for example mm")
    group.add_argument(
        "--fps", type=float, metavar="F", help="poses a second, and pictures a second of a film"
    )
    group.add_argument(
        "--up", type=_up, default="+y", metavar="±x|±y|±z", help="the axis that is up, default +y"
    )
    group.add_argument(
        "-q", "--quiet", action="store_true", help="no progress, no warnings, no names of what was written"
    )
    group.add_argument("--debug", action="store_true", help="show the traceback of an error")
    return parser


def _up(text: str) -> str:
    up_vector(text)
    return text


def _unit(text: str) -> str:
    from ..scan.units import checked_unit

    return checked_unit(text, "--unit")


def _signed_values_joined(words: Sequence[str]) -> list[str]:
    """--orbit -30,15 as --orbit=-30,15, which argparse does not take for another option."""
    joined: list[str] = []
    for word in words:
        if joined and joined[-1] in _SIGNED_OPTIONS and _SIGNED_VALUE.match(word):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


def _assigned_singly(words: Sequence[str]) -> list[str]:
    """--set a=1 b=2 SCAN as --set=a=1 --set=b=2 SCAN, which argparse would take for a value as well."""
    single: list[str] = []
    option = None  # that the word before belongs to
    for word in words:
        if option and "=" in word and not word.startswith("-"):
            if single[-1] == option:
                single.pop()
            single.append(f"{option}={word}")
        else:
            option = word if word in _ASSIGNING_OPTIONS else None
            single.append(word)
    return single


def _not_understood(unknown: Sequence[str], args: Namespace) -> InputError:
    """The error for words that the command has no place for."""
    see = f"See '{args.parser.prog} --help'"
    options = [word.partition("=")[0] for word in unknown if word.startswith("-") and word != "-"]
    if options:
        known = sorted(set(_OPTION.findall(args.parser.format_help())))
        if options[0] in known:
            return InputError(f"'{options[0]}' stands before the command", hint=f"Write it after. {see}")
        hint = did_you_mean(options[0], known)
        return InputError(f"unknown option '{shortened(options[0])}'", hint=hint + see)
    more = ", ".join(f"'{shortened(word)}'" for word in unknown[:_MOST_NAMED])
    what = f"{more}{', ...' if len(unknown) > _MOST_NAMED else ''}: one scan is named, and this is too much"
    hint = f"If the shell has put files in the place of a pattern, quote it: 'frame*.ply'. {see}"
    return InputError(what, hint=hint)
