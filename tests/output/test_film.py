"""A film shows its pictures at their times: the tests read the time stamps of the decoded file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from written import film, film_times

from viewer.errors import InputError
from viewer.output.film import FilmTimes
from viewer.output.film import film as write_film

SECONDS = [0.0, 0.033, 0.066323, 0.166323]
WITHIN = 1e-4  # seconds: more than a tick of the time stamps


def moving_bar(frames: int, size: tuple[int, int]) -> list[NDArray[np.uint8]]:
    images = np.full((frames, size[1], size[0], 4), (26, 28, 32, 255), np.uint8)
    for index, image in enumerate(images):
        image[:, 8 * index : 8 * index + 8] = (200, 60, 40, 255)
    return list(images)


def write(path: Path, starts: Sequence[float], times: FilmTimes, size: tuple[int, int] = (96, 64)) -> None:
    with write_film(path, size, times) as add:
        for image, start in zip(moving_bar(len(starts), size), starts, strict=True):
            add(image, start)


def shown(path: Path) -> list[int]:
    """Which bar each picture of a film shows."""
    images = film(path)[0]
    return [int(image[32, :, 0].argmax()) // 8 for image in images]


def without_h264(monkeypatch: pytest.MonkeyPatch) -> None:
    import av

    monkeypatch.setattr(av, "codecs_available", av.codecs_available - {"libx264"})


@pytest.mark.parametrize("size", [(96, 64), (95, 64), (96, 63), (95, 63)])
def test_a_film_plays_back_its_images(size: tuple[int, int], tmp_path: Path) -> None:
    images = moving_bar(7, size)
    write(tmp_path / "a.mp4", [number / 12.5 for number in range(7)], FilmTimes(7 / 12.5), size)
    frames, rate = film(tmp_path / "a.mp4")
    assert (len(frames), rate) == (7, 12.5)
    width, height = size[0] + size[0] % 2, size[1] + size[1] % 2
    for frame, image in zip(frames, images, strict=True):
        assert frame.shape == (height, width, 3)
        # Away from edges, which half-size chroma blurs, colours survive within a few levels.
        error = np.abs(frame[: size[1], : size[0]].astype(int) - image[..., :3])
        assert np.median(error) <= 2
        assert np.quantile(error, 0.8) <= 6
    assert np.abs(frames[0][20, 3].astype(int) - (200, 60, 40)).max() <= 8


@pytest.mark.parametrize("has_h264", [True, False])
def test_pictures_change_at_their_times(
    has_h264: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not has_h264:
        without_h264(monkeypatch)
    write(tmp_path / "a.mp4", SECONDS, FilmTimes.of(SECONDS))
    stamps, length = film_times(tmp_path / "a.mp4")
    assert stamps == pytest.approx(SECONDS, abs=WITHIN)
    assert length == pytest.approx(2 * SECONDS[-1] - SECONDS[-2], abs=WITHIN), "the last as the one before"
    assert shown(tmp_path / "a.mp4") == [0, 1, 2, 3]


@pytest.mark.parametrize("first", [0.0, 1000.0])
def test_the_first_picture_begins_the_film(first: float, tmp_path: Path) -> None:
    starts = [first + 0.5, first + 0.6]
    write(tmp_path / "a.mp4", starts, FilmTimes(first + 0.8))
    stamps, length = film_times(tmp_path / "a.mp4")
    assert stamps == pytest.approx([0, 0.1], abs=WITHIN)
    assert length == pytest.approx(0.3, abs=WITHIN)


@pytest.mark.parametrize(
    ("starts", "end", "fps", "pictures"),
    [
        ([0.0], 0.0, 25, [0]),
        ([0.0, 0.52, 1.5], 2.0, 4, [0, 0, 0, 1, 1, 1, 2, 2]),
        ([0.0, 0.04, 0.08, 0.12], 0.16, 25, [0, 1, 2, 3]),
        ([0.0, 0.1, 0.12, 0.2], 0.3, 10, [0, 1, 3]),  # one that came and went in between is left out
        ([0.0, 0.1, 0.21], 0.21, 10, [0, 1, 1, 2]),  # the last one is always shown
        ([0.0, 0.001, 0.333, 0.667], 1.0, 3, [0, 2, 3]),  # rounded stamps fall on thirds
        ([0.0, 1 / 29.97], 2 / 29.97, 29.97, [0, 1]),
    ],
)
def test_an_even_film_shows_what_is_shown_then(
    starts: list[float], end: float, fps: float, pictures: list[int], tmp_path: Path
) -> None:
    times = FilmTimes(end, fps)
    write(tmp_path / "a.mp4", starts, times)
    assert film_times(tmp_path / "a.mp4")[0] == pytest.approx(np.arange(len(pictures)) / fps, abs=WITHIN)
    assert film(tmp_path / "a.mp4")[1] == pytest.approx(fps, rel=1e-3)
    assert shown(tmp_path / "a.mp4") == pictures
    assert np.flatnonzero(times.are_shown(starts)).tolist() == sorted(set(pictures))


def test_a_lone_picture_is_shown_for_a_moment(tmp_path: Path) -> None:
    write(tmp_path / "a.mp4", [0.0], FilmTimes())
    assert film_times(tmp_path / "a.mp4") == ([0.0], pytest.approx(0.04, abs=WITHIN))


def test_pictures_nearer_than_time_stamps_give_way_to_later_ones(tmp_path: Path) -> None:
    write(tmp_path / "a.mp4", [0, 1e-6, 2e-6, 1], FilmTimes(2))
    assert film_times(tmp_path / "a.mp4") == (pytest.approx([0, 1]), pytest.approx(2))
    assert shown(tmp_path / "a.mp4") == [2, 3]


@pytest.mark.parametrize(
    ("end", "fps", "words"), [(1.0, 0.01, "0.01"), (1.0, 10_000, "10000"), (86_400.0, None, "24.0 hours")]
)
def test_a_film_that_no_player_shows_is_refused(end: float, fps: float | None, words: str) -> None:
    with pytest.raises(InputError, match=words):
        FilmTimes(end, fps)


def test_a_film_needs_no_h264(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import av

    without_h264(monkeypatch)
    write(tmp_path / "a.mp4", [0, 0.04, 0.08], FilmTimes(0.12), (95, 63))
    with av.open(str(tmp_path / "a.mp4")) as container:
        assert container.streams.video[0].codec_context.name == "mpeg4"
    assert len(film(tmp_path / "a.mp4")[0]) == 3


def test_a_film_that_fails_leaves_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    path.write_bytes(b"old")
    with pytest.raises(KeyboardInterrupt), write_film(path, (32, 32), FilmTimes()) as add:  # noqa: PT012
        add(moving_bar(1, (32, 32))[0], 0.0)
        raise KeyboardInterrupt
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_film_too_large_for_its_codec_is_one_message(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    with pytest.raises(InputError, match="--size"), write_film(path, (20000, 16), FilmTimes()) as add:
        add(np.zeros((16, 20000, 4), np.uint8), 0.0)
    assert list(tmp_path.iterdir()) == []
