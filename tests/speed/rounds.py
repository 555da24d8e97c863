"""Which frames a window shows as they were chosen, from the first round of playing on. Prints a table.

    python tests/speed/rounds.py [--rounds 3] [--size 1280x720] [--backend voxels] [SCAN]

The window runs under Xvfb, as in the tests, with real keys. At its start nothing is prepared but the frame
at rest. Processors are those that the window and the processes that help it took, on average.
"""

from __future__ import annotations

import os
import time
from itertools import groupby
from pathlib import Path

from played_window import RunningApp, arguments_of, switch_to, window_on

from viewer.app.playing.player import Player


def cpu_seconds(process: int) -> float:
    """Processor time of a process and of those that it has started."""
    ticks = 0
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:  # it has ended meanwhile
                continue
            if process in (int(entry.name), int(fields[1])):
                ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def measure(app: RunningApp, backend: str, player: Player, rounds: int) -> None:
    """Play, and print a row for each round."""
    switch_to(app, backend)
    first = app.state.pictures
    app.screen.do("key", "space")
    start = app.see(is_playing=True).at
    taken = [cpu_seconds(app.process.pid)]
    for number in range(rounds):
        time.sleep(max(0.0, start + (number + 1) * player.duration - time.monotonic()))
        taken.append(cpu_seconds(app.process.pid))
    drawn = app.pictures(first)
    app.screen.do("key", "space")
    for number in range(rounds):
        begin = start + number * player.duration
        states = [state for state in drawn if begin <= state.at < begin + player.duration]
        by_it = {state.frame for state in states if state.backend == backend}
        others = {state.frame for state in states if state.backend != backend}
        shown = len(list(groupby(state.frame for state in states)))
        rate, processors = shown / player.duration, (taken[number + 1] - taken[number]) / player.duration
        frames = f"{len(by_it):4d} of {len(player)} {len(others):7d}"
        print(f"{number + 1:5d} {frames} {rate:7.1f} {processors:10.2f}")


def main() -> None:
    arguments = arguments_of(__doc__)
    arguments.add_argument("--rounds", type=int, default=3)
    arguments.add_argument("--backend", default="voxels")
    options = arguments.parse_args()
    with window_on(options) as (app, player):
        print(f"{options.scan}, {options.backend}, load of the machine {os.getloadavg()[0]:.2f}")
        print("round    shown  others     fps processors")
        measure(app, options.backend, player, options.rounds)


if __name__ == "__main__":
    main()
