"""The words of a command line, parsed; what is wrong in them is an InputError that says what may be meant."""

from __future__ import annotations

import os
import re
import shlex
from argparse import Action, ArgumentParser, ArgumentTypeError, Namespace, RawDescriptionHelpFormatter
from collections.abc import Sequence
from importlib import import_module
from itertools import takewhile
from typing import Any, NoReturn

from .. import __version__
from ..errors import InputError, did_you_mean, shortened, unknown_name
from ..geometry import up_vector
from . import command_names

_SIGNED_OPTIONS = ("--orbit", "--up")
_SIGNED_VALUE = re.compile(r"-([xyz]$|[0-9.])")
_MOST_NAMED = 3  # of words that are too many


def parsed(words: Sequence[str]) -> Namespace:
    """The arguments, with the command's `run`. Raises InputError; SystemExit after -h and -V."""
    commands = command_names()
    named = [word for word in words[:1] if word in commands]
    if not named and words and words[0] not in ("-V", "--version", "--help", "-h"):
        raise _no_command(words, commands)
    # A command's module brings what it works with: only what is named is imported, and all for the help.
    parser, parsers = _parsers([] if words[:1] in (["-V"], ["--version"]) else named or commands)
    if not named:
        parser.parse_args(words[:1])  # ends with what they ask for
        parser.print_help()
        raise SystemExit
    words = _signed_values_joined(words[1:])
    parsers[named[0]].check_words(words)
    args, unknown = parser.parse_known_args([*named, *parsers[named[0]].said_singly(words)])
    if unknown:
        raise _too_many(unknown, args.parser)
    return args


class _Parser(ArgumentParser):
    """A parser whose errors are InputErrors."""

    def error(self, message: str) -> NoReturn:
        raise InputError(message, hint=self.see)

    def _check_value(self, action: Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            raise unknown_name(f"value of {'/'.join(action.option_strings)}", value, map(str, action.choices))

    @property
    def see(self) -> str:
        """A hint where to find more."""
        return f"See '{self.prog} --help'"

    @property
    def takes(self) -> str:
        """The names that are given without an option."""
        return " ".join(str(action.metavar) for action in self._get_positional_actions())

    @property
    def options(self) -> dict[str, Action]:
        """Descriptions of what each option does."""
        return {name: action for action in self._actions for name in action.option_strings}

    def check_words(self, words: Sequence[str]) -> None:
        """Raise InputError for unknown options and empty names, before any of those that are missing."""
        options = self.options
        for word in takewhile(lambda word: word != "--", words):
            name = word.partition("=")[0]
            joined = "" if word.startswith("--") else word[:2]  # a short one with its value right behind it
            if _is_option(word) and name not in options and joined not in options:
                hint = did_you_mean(name, options)
                raise InputError(f"unknown option '{shortened(name)}'", hint=hint + self.see)
        for before, word in zip([self.prog, *words], words, strict=False):
            if not word or (word[-1] == "=" and word[:-1] in options):
                hint = f"A variable in the command may be empty. {self.see}"
                raise InputError(f"the word after '{word or shortened(before)}' is empty", hint=hint)

    def said_singly(self, words: Sequence[str]) -> list[str]:
        """--set a=1 b=2 SCAN as --set=a=1 --set=b=2 SCAN, as argparse would take SCAN for a value as well.

        The same for all options of several words: the first one that cannot be meant for it ends it.
        """
        single: list[str] = []
        option = None  # that the word before belongs to
        for word in words:
            action = self.options.get(option or "")
            is_first = single[-1:] == [option]  # an error names it, if it is wrong
            if action and not _is_option(word) and (is_first or _is_meant(word, action)):
                if is_first:
                    single.pop()
                single.append(f"{option}={word}")
            else:
                single.append(word)
                own = self.options.get(word)
                option = word if own and own.nargs == "+" and "--" not in single else None
        return single


def _is_option(word: str) -> bool:
    """Whether argparse takes a word for an option: not "-", nor -30, nor where a blank is in it."""
    return word.startswith("-") and word[1:2] not in {"", ".", *"0123456789"} and " " not in word


def _is_meant(word: str, action: Action) -> bool:
    """Whether a word can be a value of an option, or one that is spelt wrong."""
    try:
        value = action.type(word) if callable(action.type) else word
    except (ArgumentTypeError, ValueError):
        return False
    if action.choices is None or value in action.choices:
        return True
    return not os.path.exists(word) and bool(did_you_mean(word, map(str, action.choices)))


def _parsers(commands: Sequence[str]) -> tuple[_Parser, dict[str, _Parser]]:
    """The parser of these commands, and that of each of them."""
    parser = _Parser(
        prog="scan4d", description="Viewer and headless renderer for 4D scans.", allow_abbrev=False
    )
    parser.add_argument("-V", "--version", action="version", version=f"scan4d {__version__}")
    parsers: dict[str, _Parser] = {}
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
        parsers[name] = command
    return parser, parsers


def _common_arguments() -> _Parser:
    parser = _Parser(add_help=False)
    group = parser.add_argument_group("all commands")
    group.add_argument(
        "--device",
        type=int,
        metavar="N",
        help="number of the GPU to use, if there are several; 'scan4d doctor' lists all GPUs",
    )
    group.add_argument(
        "--unit", type=_unit, metavar="U", help="unit of length of the scan's coordinates, for example mm"
    )
    group.add_argument(
        "--fps", type=float, metavar="F", help="frame rate of the scan, and of a film, in frames per second"
    )
    group.add_argument(
        "--read",
        action=_Corrections,
        type=_pair,
        nargs="+",
        default={},
        metavar="KEY=VALUE",
        help="correct a decision about how Scan4D reads the scan, for example unit=mm. 'scan4d info' lists "
        "all decisions",
    )
    group.add_argument(
        "--take",
        metavar="NAME",
        help="name of one scan in a folder with several scans, or 'all' to open all of them as one scan",
    )
    group.add_argument(
        "--up",
        type=_up,
        metavar="±x|±y|±z",
        help="axis of the scan that points up; default: estimated from the scan",
    )
    group.add_argument(
        "-q",
        "--quiet",
        action="store_true",
        help="print no progress, no warnings and no names of written files",
    )
    group.add_argument("--debug", action="store_true", help="print the tracebacks of errors")
    return parser


class _Corrections(Action):
    """Collects `--read KEY=VALUE` into one dictionary."""

    def __call__(
        self, parser: ArgumentParser, namespace: Namespace, values: Any, option_string: str | None = None
    ) -> None:
        setattr(namespace, self.dest, {**getattr(namespace, self.dest), **dict(values)})


def _pair(text: str) -> tuple[str, str]:
    """KEY=VALUE of `--read`. Raises InputError where it is unusable."""
    from ..scan.reading.corrections import parsed_pair

    if "=" not in text:
        raise ArgumentTypeError(f"'{shortened(text)}' does not have the form KEY=VALUE")
    return parsed_pair(text)


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


def _no_command(words: Sequence[str], commands: Sequence[str]) -> InputError:
    """The error for words that do not begin with a command."""
    see = f"Known: {', '.join(commands)}. See 'scan4d --help'"
    first = shortened(words[0])
    if later := [word for word in words if word in commands]:
        hint = f"Write '{first}' after '{later[0]}'. See 'scan4d {later[0]} --help'"
        return InputError(f"'{first}' must come after the command", hint=hint)
    if files := [word for word in words if os.path.exists(word)]:
        name = shlex.quote(files[0])
        hint = f"'scan4d view {name}' shows the scan, 'scan4d render {name} -o picture.png' draws it. {see}"
        return InputError("a command is missing", hint=hint)
    if first and not first.startswith("-"):
        return unknown_name("command", words[0], commands)
    return InputError(f"a command is missing before '{first}'", hint=see)


def _too_many(words: Sequence[str], parser: _Parser) -> InputError:
    """The error for words that the command does not take."""
    more = ", ".join(f"'{shortened(word)}'" for word in words[:_MOST_NAMED])
    rest = ", ..." if len(words) > _MOST_NAMED else ""
    what = f"{more}{rest}: not expected here, because '{parser.prog}' takes {parser.takes or 'only options'}"
    if not parser.takes:
        return InputError(what, hint=parser.see)
    hint = f"If the shell expanded a pattern, put it in quotes: 'frame*.ply'. {parser.see}"
    return InputError(what, hint=hint)
