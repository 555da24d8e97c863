"""Runs a command line, and reports how it ends."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout

from ..errors import InputError, Scan4DError
from ..imports import uncollected
from ..signals import ending_as_interrupts, ignore_from_now_on
from ..task import listening
from ..unfinished import remove_leftovers
from ._console import NAMES_AS_THEY_ARE, Delays, PlainOutput, ReaderGone, complain, escaped, quietly, warn
from ._parsing import parsed

_MOST_SHOWN = 2000  # characters of a message


def run(words: Sequence[str], then_ends: bool = False) -> int:
    """Run the words of a command line, the first of which is a command; its exit code.

    then_ends: the process does; once it is stopped, further interrupts do not change that code.
    """
    output = PlainOutput(sys.stdout)
    try:
        with redirect_stdout(output):
            code = _run(words)
        output.flush()  # here, where a failure can still be reported
        return code
    except ReaderGone:
        return 1
    except (Exception, KeyboardInterrupt) as error:
        if then_ends and _was_interrupted(error):
            ignore_from_now_on()
        if "--debug" in words:
            import traceback

            complain(traceback.format_exc().rstrip())
        complain(f"scan4d: {_message(error)}")
        return error.exit_code if isinstance(error, Scan4DError) else 1


def _run(words: Sequence[str]) -> int:
    try:
        with uncollected():
            args = parsed(words)
        with quietly(args.quiet), _logged(args.debug), listening(Delays()), ending_as_interrupts():
            remove_leftovers()
            return args.run(args)
    except SystemExit as stop:  # --help, --version
        return int(stop.code or 0)


class _OnStandardError(logging.Handler):
    """A handler that prints what is logged: warnings, which are for users; with `debug`, everything."""

    def __init__(self, debug: bool) -> None:
        super().__init__(logging.INFO if debug else logging.WARNING)
        self.debug = debug

    def emit(self, record: logging.LogRecord) -> None:
        if record.levelno == logging.WARNING:
            warn(self.format(record))
        elif self.debug:
            complain(f"scan4d: {self.format(record)}")


@contextmanager
def _logged(debug: bool) -> Iterator[None]:
    """Meanwhile warnings in the log go to standard error; with `debug` all of it, such as failures in the
    window with their tracebacks."""
    log = logging.getLogger(__name__.partition(".")[0])
    handler = _OnStandardError(debug)
    level, propagate = log.level, log.propagate
    log.addHandler(handler)
    log.propagate = False
    log.setLevel(handler.level)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(level)
        log.propagate = propagate


def _message(error: BaseException) -> str:
    if isinstance(error, Scan4DError):
        text = str(error)
    elif _was_interrupted(error):
        text = "stopped"
    elif isinstance(error, MemoryError):
        text = "not enough memory. Close other programs, or ask for fewer frames or a smaller picture"
    else:
        text = f"internal error ({type(error).__name__}: {error}). Run the command again with --debug"
    if len(text) > _MOST_SHOWN:
        text = f"{text[: _MOST_SHOWN // 2]} ... {text[-_MOST_SHOWN // 2 :]}"
    return escaped(text) if isinstance(error, InputError) else text  # what drivers say has several lines


def _was_interrupted(error: BaseException | None) -> bool:
    """Whether an interrupt was at the beginning, which libraries turn into errors of their own."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def prepare_streams() -> None:
    """Make the standard streams of this process such that printing can fail, but do no harm.

    What they cannot show is escaped, but for names of files where no terminal shows them. Those that are
    closed are opened on nothing, so that no other file gets their number; standard output still fails then.
    """
    modes = (("stdin", os.O_RDONLY, "r"), ("stdout", os.O_RDONLY, "w"), ("stderr", os.O_WRONLY, "w"))
    for number, (name, flags, mode) in enumerate(modes):
        if getattr(sys, name) is None:
            os.dup2(os.open(os.devnull, flags), number)
            setattr(sys, name, open(number, mode, closefd=False))  # noqa: SIM115
    errors = "backslashreplace" if sys.stdout.isatty() else NAMES_AS_THEY_ARE
    sys.stdout.reconfigure(errors=errors)  # type: ignore[union-attr]
