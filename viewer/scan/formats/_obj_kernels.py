"""The loop over rows of plain numbers in an OBJ file, compiled by numba."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled

_POWERS = 10.0 ** np.arange(23)  # exact in float64
_EXACT = np.uint64(1 << 53)  # whole numbers below are exact in float64
_DIGITS = 18  # that uint64 holds for sure


@compiled
def parse_rows(
    data: NDArray[np.uint8],
    starts: NDArray[np.int64],
    ends: NDArray[np.int64],
    is_whole: bool,
    table: NDArray[np.float64],
    left: NDArray[np.int64],
) -> tuple[int, int]:
    """Parse rows of numbers into a table, each correctly rounded. Returns how many rows, up to the first odd
    one, and how many words are left to the caller.

    data: (B,). starts, ends: (N,), the first byte of each row, and that behind it. is_whole: whether a row
    with more words than the table has columns is odd. table: (N, C); NaN where a word is left. left: (N * C,
    2), gets first byte and end of the words that need more than float64 arithmetic, or are no numbers.
    """
    hard = 0
    for row in range(len(starts)):
        at, end = starts[row], ends[row]
        for column in range(table.shape[1]):
            while at < end and data[at] <= 32:
                at += 1
            if at == end:
                return row, hard
            first = at
            is_negative = data[at] == 45
            if data[at] == 45 or data[at] == 43:
                at += 1
            mantissa, digits, behind, has_point, is_plain = np.uint64(0), 0, 0, False, True
            seen = 0
            while at < end and data[at] > 32:
                byte = data[at]
                if 48 <= byte <= 57:
                    mantissa = mantissa * np.uint64(10) + np.uint64(byte - 48)
                    seen += 1
                    digits += int(mantissa > np.uint64(0))
                    behind += int(has_point)
                elif byte == 46 and not has_point:
                    has_point = True
                else:
                    is_plain = False
                    break
                at += 1
                if digits > _DIGITS:
                    is_plain = False
                    break
            exponent = np.int64(0)
            if not is_plain and seen and (data[at] == 101 or data[at] == 69) and digits <= _DIGITS:  # e, E
                at += 1
                falls = at < end and data[at] == 45
                if at < end and (data[at] == 45 or data[at] == 43):
                    at += 1
                begun = at
                while at < end and 48 <= data[at] <= 57 and at < begun + 4:
                    exponent = exponent * 10 + np.int64(data[at]) - 48
                    at += 1
                is_plain = at > begun and (at == end or data[at] <= 32)
                exponent = -exponent if falls else exponent
            power = exponent - behind
            if is_plain and seen and mantissa < _EXACT and -22 <= power <= 22:
                value = np.float64(mantissa)
                value = value * _POWERS[power] if power >= 0 else value / _POWERS[-power]
                table[row, column] = -value if is_negative else value
                continue
            while at < end and data[at] > 32:
                at += 1
            table[row, column] = np.nan
            left[hard, 0], left[hard, 1] = first, at
            hard += 1
        if is_whole:
            while at < end and data[at] <= 32:
                at += 1
            if at < end:
                return row, hard
    return len(starts), hard
