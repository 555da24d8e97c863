"""Code words: encoded and decoded."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from word_scenes import encode_scans, encode_words

from viewer.codewords.words import FIELDS, decode_scans, decode_words, row_spans

values_of_fields = st.fixed_dictionaries(
    {name: st.integers(0, (1 << bits) - 1) for name, (_, bits) in FIELDS.items()}
)


def test_fields_fill_the_word_as_the_paper_has_them() -> None:
    ends = {name: (at, at + bits - 1) for name, (at, bits) in FIELDS.items()}
    assert ends == {
        "mode": (0, 0), "scans": (1, 24), "diffuse": (25, 31), "specular": (32, 38), "material": (39, 45),
        "x": (46, 54), "z": (55, 63),
    }  # fmt: skip


@given(st.lists(values_of_fields, min_size=1, max_size=5))
def test_what_is_encoded_is_decoded(several: list[dict[str, int]]) -> None:
    words = encode_words({name: np.array([values[name] for values in several]) for name in FIELDS})
    for values, word in zip(several, words, strict=True):
        assert int(word) == sum(values[name] << at for name, (at, _) in FIELDS.items())
    decoded = decode_words(words)
    assert [{name: int(decoded[name][k]) for name in FIELDS} for k in range(len(several))] == several


@given(st.integers(0, (1 << 64) - 1))
def test_any_64_bits_are_a_word(word: int) -> None:
    assert int(encode_words(decode_words(np.array([word], np.uint64)))[0]) == word


@given(st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7)), min_size=4, max_size=4))
def test_scans_are_four_rows(spans: list[tuple[int, int]]) -> None:
    scans = encode_scans(spans)
    assert scans < 1 << 24
    assert decode_scans(scans).tolist() == [list(span) for span in spans]
    word = int(encode_words(dict.fromkeys(FIELDS, 0) | {"scans": scans}))
    turned = [(7 - last, 7 - first) for first, last in spans]
    assert row_spans(word) == spans + turned[::-1]
    assert row_spans(word | 1) == spans
