"""Which rows a preview takes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from viewer.drawing.renderer import Renderer
from viewer.picture.sample import Sample, is_sampled

ROWS = np.arange(1 << 16, dtype=np.uint32)
SHARES = [1, 0.84, 0.5, 0.25, 0.1, 0.01]


@pytest.mark.parametrize("share", SHARES)
def test_a_sample_has_its_share_of_the_rows_everywhere(share: float) -> None:
    taken = is_sampled(ROWS, share)
    assert taken.mean() == pytest.approx(share, abs=1e-4)
    per_run = taken.reshape(-1, 1024).sum(axis=1)
    assert (np.abs(per_run - 1024 * share) < 1).all(), "1024 rows in a run have their share to within a row"


def test_one_of_each_eight_rows_in_no_pattern() -> None:
    """Rows of an image must not become columns."""
    place = np.flatnonzero(is_sampled(ROWS, 1 / 8))
    np.testing.assert_array_equal(place // 8, np.arange(len(place)))
    counts = np.bincount(place % 8, minlength=8) / len(place)
    np.testing.assert_allclose(counts, 1 / 8, atol=0.01)


def test_larger_samples_hold_smaller_ones() -> None:
    for more, fewer in pairwise(SHARES):
        assert not (is_sampled(ROWS, fewer) & ~is_sampled(ROWS, more)).any()


def test_poses_of_any_count_share_one_ascending_list(renderer: Renderer) -> None:
    sample = Sample(renderer.gpu)
    for share in (0.3, 0.6):
        for count in (5000, 5100, 100, 3_000_000, 1):
            texels, taken = sample.take(share, count)
            rows = np.frombuffer(texels.buffer.read(), np.uint32)[:taken]
            np.testing.assert_array_equal(
                rows, np.flatnonzero(is_sampled(np.arange(count, dtype=np.uint32), share))
            )
    texels, _ = sample.take(0.6, 2_000_000)
    assert sample.take(0.6, 7)[0] is texels, "no new list for fewer points"


def test_a_share_that_no_row_falls_into(renderer: Renderer) -> None:
    sample = Sample(renderer.gpu)
    assert sample.take(1e-12, 1000)[1] == 0
    assert sample.take(1.0, 1000)[1] == 1000
