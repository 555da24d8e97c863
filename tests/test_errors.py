"""What the system refuses, in words."""

from __future__ import annotations

import errno
import os

import numpy as np
import pytest

from viewer.errors import explained


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.ENOSPC, "disk is full"),
        (errno.EACCES, "permission denied"),
        (errno.EROFS, "read-only"),
        (errno.EISDIR, "is a folder"),
        (errno.ENAMETOOLONG, "too long"),
    ],
)
def test_each_cause_has_its_own_hint(number: int, words: str) -> None:
    what, hint = explained(OSError(number, os.strerror(number), "a.png"))
    assert words in what
    assert hint


def test_another_cause_has_the_systems_words_and_the_callers_hint() -> None:
    assert explained(OSError(errno.EDOM, "odd"), "Try again") == ("odd", "Try again")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no disk that is always full")
def test_numpy_is_cut_short_where_the_disk_is_full() -> None:
    with open("/dev/full", "wb") as stream, pytest.raises(OSError, match="requested") as error:
        np.zeros(100_000).tofile(stream)
    assert explained(error.value)[0] == "the disk is full"
