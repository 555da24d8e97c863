from __future__ import annotations

from pathlib import Path

import pytest
from small_scans import FRAMES, cloud_at

from viewer.scan import formats


@pytest.fixture(scope="session")
def scans(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with ball.npz, and five frames in sequence/ and, number 2 damaged, in broken/."""
    folder = tmp_path_factory.mktemp("scans")
    formats.write(folder / "ball.npz", cloud_at(0))
    for name in ("sequence", "broken"):
        (folder / name).mkdir()
        for index in range(FRAMES):
            formats.write(folder / name / f"f{index:02d}.npz", cloud_at(index))
    (folder / "broken" / "f02.npz").write_bytes(b"PK\x03\x04 and then nothing")
    return folder
