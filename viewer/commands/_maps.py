"""Maps: a value for each point of each frame, in files of their own."""

from __future__ import annotations

from argparse import ArgumentTypeError
from collections.abc import Callable, Iterator, Mapping, MutableMapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import whole_file
from ..scan.pose import Pose
from ..scan.timeline import Timeline
from ..scan.times import frame_in_words
from ._console import progress, warn

Float = NDArray[np.float64]

_FEW = 0.5  # of the points: a warning where fewer have a value


def map_files(folder: Path, timeline: Timeline) -> list[Path]:
    """The file of each frame, counted from 1."""
    return [folder / f"{index + 1:04d}.npz" for index in range(len(timeline))]


def written_maps(
    timeline: Timeline,
    files: Sequence[Path],
    measure: Callable[[Pose], Mapping[str, Float]],
    left_out: MutableMapping[int, str],
) -> Iterator[tuple[int, Mapping[str, Float]]]:
    """Measure each frame and write its values; gives the frame and the values of its points, none where it is
    left out.

    left_out: gets the reason why a frame has no values, an InputError of reading or measuring.
    """
    with progress(len(timeline)) as tick:
        for index, file in enumerate(files):
            if index + 1 < len(timeline):
                timeline.request(index + 1)
            arrays: Mapping[str, Float] = {}
            try:
                pose = timeline.pose(index)
                arrays = measure(pose)
                _save(file, pose, arrays)
            except InputError as error:
                left_out[index], arrays = error.what, {}
                file.unlink(missing_ok=True)  # that of an earlier run
            yield index, arrays
            tick()


def tell_few(shares: Sequence[float], has: str, hint: str = "") -> None:
    """Warn where fewer than half of the points of a frame have a value. shares: of each frame that was
    measured. has: what the points have, in words."""
    few = sum(share < _FEW for share in shares)
    if few:
        warn(f"Fewer than half of the points have {has} in {few} of {len(shares)} frames{hint}")


def tell_left_out(timeline: Timeline, left_out: Mapping[int, str]) -> None:
    """Warn of frames without values."""
    if left_out:
        index, reason = next(iter(left_out.items()))
        share = f"{len(left_out)} of {len(timeline)} frames have no values"
        warn(f"{share}, such as {frame_in_words(index)}: {reason}")


def _save(file: Path, pose: Pose, arrays: Mapping[str, Float]) -> None:
    """Write values (N,) of the points of a pose, as float32 in the order of its file.

    Of range views, these are the values of all pixels. A point that Scan4D has left out has NaN.
    """
    cloud = pose.cloud
    count = sum(view.depth.size for view in pose.views) or len(cloud) + cloud.dropped
    rows = np.arange(len(cloud)) if cloud.ids is None else cloud.ids
    ordered = {name: np.full(count, np.nan, np.float32) for name in arrays}
    for name, values in arrays.items():
        ordered[name][rows] = values
    with whole_file(file) as part, open(part, "wb") as stream:
        np.savez_compressed(stream, allow_pickle=False, **ordered)


def positive_length(text: str) -> float:
    """A length of the command line. Raises ArgumentTypeError."""
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not 0 < value < np.inf:
        raise ArgumentTypeError(f"'{text}' is not a positive length")
    return value
