"""Writing MP4 films: when each picture is shown, and the file."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import whole_file

FILM_SUFFIX = ".mp4"
FRAME_RATES = (1.0, 240.0)  # of even films: what players can be expected to show
PICTURE_RATE = 25  # pictures a second where nothing gives their times, and how long a lone one is shown
_LONGEST = 6 * 3600.0  # seconds; longer ones overflow the durations of MP4, and nobody watches them
_TICKS = 60_000  # of time stamps a second; MPEG-4 takes 65,535, and usual frame rates divide it
_SLACK = 0.0005  # seconds that a picture may come late in an even film; recordings round to 0.001
_MPEG4_BIT_RATE = 20_000_000
_BT709, _LIMITED_RANGE = 1, 1  # as video streams code them


@dataclass(frozen=True)
class FilmTimes:
    """The times of a film: each picture is shown from its start until the next one's, the last until `end`.

    end: seconds. fps: pictures a second of an even film, whose picture k is the one shown at k / fps; None:
    the film changes its picture exactly at the starts. Raises InputError where no player shows such a film.
    """

    end: float = 0.0
    fps: float | None = None

    def __post_init__(self) -> None:
        low, high = FRAME_RATES
        if self.fps is not None and not low <= self.fps <= high:
            what = f"a film cannot have {self.fps:g} pictures per second"
            raise InputError(what, "--fps", f"Use {low:g} to {high:g}")
        if self.end > _LONGEST:
            what = f"a film of these frames would last {self.end / 3600:,.1f} hours"
            raise InputError(what, hint=f"Films last at most {_LONGEST / 3600:g} hours. Choose fewer frames")

    @classmethod
    def of(cls, starts: Sequence[float], fps: float | None = None) -> FilmTimes:
        """The times of pictures that start then, seconds; the last one lasts as long as the one before."""
        last = starts[-1] - starts[-2] if len(starts) > 1 else 1 / PICTURE_RATE
        return cls(starts[-1] - starts[0] + last, fps)

    def slot(self, seconds: float) -> int:
        """The number of the first picture of an even film at or after this time; else the nearest tick."""
        if self.fps is None:
            return round(seconds * _TICKS)
        return math.ceil((seconds - _SLACK) * self.fps)

    def ticks(self, slot: int) -> int:
        """The time stamp of a slot, in `1 / _TICKS` seconds."""
        return slot if self.fps is None else round(slot * _TICKS / self.fps)

    def are_shown(self, starts: Sequence[float]) -> list[bool]:
        """Whether the film shows pictures that start then; not those that are gone before its next picture.
        The last one is always shown."""
        slots = [self.slot(start) for start in starts]
        return [*(before < after for before, after in pairwise(slots)), True]


@contextmanager
def film(
    path: Path | str, size: tuple[int, int], times: FilmTimes
) -> Iterator[Callable[[NDArray[np.uint8], float], None]]:
    """A function that appends an image, (H, W, 3 or 4) uint8 sRGB without its alpha, and its start in seconds
    to an MP4, which begins with the first image.

    H.264 where the codec is there, MPEG-4 elsewhere. size: (width, height); odd ones grow by a repeated
    column or row, since video needs even sizes. Raises InputError where the film cannot be written.
    """
    import av

    path, (width, height) = Path(path), size
    try:
        with whole_file(path) as temporary, av.open(str(temporary), "w", format="mp4") as container:
            stream = _video_stream(container, (width + width % 2, height + height % 2))
            writer = _Writer(container, stream, times)
            yield writer.add
            writer.finish()
    except av.FFmpegError as error:
        raise InputError(f"cannot be written: {error.strerror}", path, "Try a smaller --size") from error


class _Writer:
    """Gives each image its time stamps, which it knows when the next image starts."""

    def __init__(self, container: Any, stream: Any, times: FilmTimes) -> None:
        self._container, self._stream, self._times = container, stream, times
        self._origin = 0.0  # seconds: the start of the first image
        self._waiting: Any = None  # the last image,
        self._slot = 0  # and the slot that it starts in
        self._lasts: dict[int, int] = {}  # time stamp -> ticks, of frames inside the encoder

    def add(self, image: NDArray[np.uint8], start: float) -> None:
        """Append an image that is shown from `start` on, seconds."""
        import av

        if self._waiting is None:
            self._origin = start
        slot = self._times.slot(start - self._origin)
        self._write(until=slot)
        rgb = np.ascontiguousarray(
            np.pad(image[..., :3], ((0, image.shape[0] % 2), (0, image.shape[1] % 2), (0, 0)), mode="edge")
        )
        frame = av.VideoFrame.from_ndarray(rgb, format="rgb24")
        # The converter takes BT.601 by default, and players take BT.709.
        self._waiting = frame.reformat(
            format="yuv420p", dst_colorspace=_BT709, dst_color_range=_LIMITED_RANGE
        )
        self._slot = slot

    def finish(self) -> None:
        """Write what waits, and what is still inside the encoder."""
        end = self._times.slot(self._times.end - self._origin)
        least = 1 if self._times.fps else _TICKS // PICTURE_RATE
        self._write(until=end if end > self._slot else self._slot + least)
        self._mux(self._stream.encode(None))

    def _write(self, until: int) -> None:
        """Write the image that waits for its slots up to this one; none where another starts in its slot."""
        if self._waiting is None or until <= self._slot:
            return
        slots = [*range(self._slot, until)] if self._times.fps else [self._slot]
        for slot, after in pairwise([*slots, until]):
            stamp = self._times.ticks(slot)
            self._lasts[stamp] = self._times.ticks(after) - stamp
            self._waiting.pts = stamp
            self._mux(self._stream.encode(self._waiting))

    def _mux(self, packets: Any) -> None:
        for packet in packets:
            if packet.pts is not None:  # the container alone has no duration for the last one
                packet.duration = self._lasts.pop(packet.pts)
            self._container.mux(packet)


def _video_stream(container: Any, size: tuple[int, int]) -> Any:
    import av

    h264 = "libx264" in av.codecs_available
    stream = container.add_stream("libx264" if h264 else "mpeg4", rate=PICTURE_RATE)
    stream.width, stream.height = size
    stream.pix_fmt = "yuv420p"
    if h264:
        # Without B-frames: after these, the file's length would lack the end of the last picture.
        stream.options = {"preset": "veryfast", "crf": "18", "bf": "0"}
    else:
        stream.bit_rate = _MPEG4_BIT_RATE
    coding = stream.codec_context
    stream.time_base = coding.time_base = Fraction(1, _TICKS)
    coding.colorspace = coding.color_primaries = coding.color_trc = _BT709
    coding.color_range = _LIMITED_RANGE
    return stream
