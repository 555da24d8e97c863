"""Plays and scrubs a sequence larger than the cache for so many seconds. Prints memory as it goes.

    python tests/speed/endurance.py [SECONDS]

Ends with an error where memory went beyond its budget or grew, or the log tells of something wrong.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "app"))
from endurance import CACHE_MB, FRAMES, POINTS, endure, own_megabytes, playing_app, problems, trouble


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 600.0
    sizes: list[int] = []
    with tempfile.TemporaryDirectory() as folder, playing_app(Path(folder)) as app:
        print(f"{FRAMES} frames of {POINTS:,} points, cache of {CACHE_MB} MB")
        before = own_megabytes(app)
        print(f"{'s':>6} {'own memory, MB':>15} {'pictures':>9}")
        for now, megabytes in endure(app, seconds):
            sizes.append(megabytes)
            print(f"{now:6.0f} {megabytes:15} {app.state.pictures:9}", flush=True)
        lines = trouble(app)
    print(
        f"{before} MB before, then {min(sizes)} to {max(sizes)} MB; {len(lines)} lines of trouble in the log"
    )
    if wrong := [*problems(before, sizes), *lines[:20]]:
        sys.exit("\n".join(wrong))


if __name__ == "__main__":
    main()
