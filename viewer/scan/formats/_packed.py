"""A limit to what a small file may unpack to."""

from __future__ import annotations

from pathlib import Path

from ...errors import InputError

_FREE_BYTES = 16 << 20  # a file may always unpack to this many bytes


def check_unpacked_size(path: Path, unpacked: int, most_ratio: int, hint: str | None = None) -> None:
    """Raise InputError, before anything is allocated, where a file declares far more bytes than it holds.

    unpacked: the bytes that it declares. most_ratio: how many times its size they may be, beyond 16 MiB.
    """
    held = path.stat().st_size
    if unpacked > _FREE_BYTES + most_ratio * held:
        raise InputError(f"{held} bytes would unpack to {unpacked}", hint=hint)
