"""The command line: `scan4d COMMAND ...`. Each command is a module of viewer/commands."""

from __future__ import annotations

import _signal as signal  # type: ignore[import-not-found]  # as `signal` has it, which takes 5 ms
import _thread
import sys
from collections.abc import Sequence

TYPE_CHECKING = False  # as `typing` has it, which takes its time to import
if TYPE_CHECKING:
    from types import TracebackType


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit code.

    argv: its words. None: those of this process, which is the program then, and ends when this returns.
    0 done, 2 unusable arguments or input, 3 no usable OpenGL, 1 anything else. Errors are
    one message on standard error, with a traceback only under --debug.
    """
    if argv is None:
        _end_quietly_when_interrupted()
    from .commands import _line  # not before: it imports for a tenth of a second and more

    if argv is not None:
        return _line.run(list(argv))
    _line.prepare_streams()
    return _line.run(sys.argv[1:], then_ends=True)


def _end_quietly_when_interrupted() -> None:
    """Have an interrupt end the process at once from now on, as it does other programs.

    While libraries are imported there is nothing to tidy up, and Python would show a traceback; commands
    take interrupts as exceptions while they work. Those that a library swallows meanwhile come again.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it is ignored
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    def on_error(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        if not _interrupts_again(kind):
            sys.__excepthook__(kind, error, trace)

    def on_loss(lost: sys.UnraisableHookArgs) -> None:
        if not _interrupts_again(lost.exc_type):
            sys.__unraisablehook__(lost)

    sys.excepthook, sys.unraisablehook = on_error, on_loss


def _interrupts_again(kind: type[BaseException]) -> bool:
    """Whether an exception that nobody takes is an interrupt, which is raised once more then."""
    if issubclass(kind, KeyboardInterrupt):
        _thread.start_new_thread(_thread.interrupt_main, ())  # by another, since here it would be lost again
        return True
    return False


if __name__ == "__main__":
    sys.exit(main())
