"""The commands of the command line, one module each.

A command module has

    a docstring             its first line is the command's help
    add_arguments(parser)   its own arguments
    run(args) -> int        does it and returns the exit code

`viewer/cli.py` names them in the order of the help; `parsing.py` adds the arguments that all have in common,
and `line.py` turns errors into messages and exit codes.
"""
