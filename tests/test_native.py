"""What libraries write on standard error below Python is left out, and nothing else."""

from __future__ import annotations

import os
import sys

import pytest

from viewer.native import OPENEXR, unsaid


def test_lines_of_the_library_alone_are_left_out(capfd: pytest.CaptureFixture[str]) -> None:
    with unsaid(OPENEXR):
        os.write(2, b"a.exr: (EXR_ERR_CORRUPT_CHUNK) Unable to decompress\n")
        os.write(2, b"scan4d: something else\n\n")
    os.write(2, b"after\n")
    assert capfd.readouterr().err == "scan4d: something else\nafter\n"


def test_an_error_inside_leaves_standard_error_as_it_was(capfd: pytest.CaptureFixture[str]) -> None:
    def fail() -> None:
        with unsaid(OPENEXR):
            os.write(2, b"kept\n")
            raise ValueError("inside")

    with pytest.raises(ValueError, match="inside"):
        fail()
    print("after", file=sys.stderr)
    assert capfd.readouterr().err == "kept\nafter\n"


def test_it_does_without_a_standard_error() -> None:
    child = os.fork()
    if child == 0:
        os.close(2)
        code = 1
        try:
            with unsaid(OPENEXR):
                code = 0
        finally:
            os._exit(code)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
