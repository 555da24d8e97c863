"""The commands of the command line, one module each.

A command module has

    a docstring             its first line is the command's help
    add_arguments(parser)   its own arguments
    run(args) -> int        does it and returns the exit code

and is found by its name in this folder; names that begin with an underscore are no commands. `_parsing.py`
adds the arguments that all have in common, and `_line.py` turns errors into messages and exit codes.
"""

from __future__ import annotations

import pkgutil
from functools import cache


@cache
def command_names() -> tuple[str, ...]:
    """The names of all commands, in alphabetical order. None of their modules is imported for it."""
    return tuple(sorted(m.name for m in pkgutil.iter_modules(__path__) if not m.name.startswith("_")))
