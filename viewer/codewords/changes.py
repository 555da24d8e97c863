"""Differences between the code words of two pictures: what changed, and nothing else.

A group is the words of one point that begin in one line. A difference lists which groups of the picture
before stay as they are, a bit for each, and holds the words of all other groups of the new picture.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .stream import WordStream


class WordChange(NamedTuple):
    """The change from one picture to another. kept: (groups,) bool, of the picture before. added: the words
    of the other groups, with all else that the new picture has beside its words."""

    kept: NDArray[np.bool_]
    added: WordStream


class _Groups(NamedTuple):
    """The groups of a stream in order. keys: (G,) int64, line and id, ascending. starts: (G + 1,) of their
    words. of_word: (N,) the group of each word."""

    keys: NDArray[np.int64]
    starts: NDArray[np.int64]
    of_word: NDArray[np.int64]


def word_change(before: WordStream, after: WordStream) -> WordChange | None:
    """The change from the first picture to the second; None where they are divided differently."""
    if not _are_alike(before, after):
        return None
    old, new = _groups(before), _groups(after)
    # Of each new group, the old one with its line and id, which has as many words.
    at = np.minimum(np.searchsorted(old.keys, new.keys), max(len(old.keys) - 1, 0))
    if not len(old.keys):
        return WordChange(np.zeros(0, bool), after)
    may_stay = (old.keys[at] == new.keys) & (np.diff(old.starts)[at] == np.diff(new.starts))
    words = np.flatnonzero(may_stay[new.of_word])
    group = new.of_word[words]
    partner = old.starts[at[group]] + words - new.starts[group]
    is_other = before.words[partner] != after.words[words]
    if after.finer is not None and before.finer is not None:
        is_other |= (before.finer[partner] != after.finer[words]).any(axis=1)
    may_stay[group[is_other]] = False
    kept = np.zeros(len(old.keys), bool)
    kept[at[may_stay]] = True
    return WordChange(kept, _with_words(after, ~may_stay[new.of_word]))


def changed_stream(before: WordStream, change: WordChange) -> WordStream:
    """The picture that a difference makes of the one before. Raises InputError where they do not belong
    together."""
    old, added = _groups(before), change.added
    if not _are_alike(before, added) or len(change.kept) != len(old.keys):
        raise InputError("has a difference to another picture", hint="Write the file again")
    stays = change.kept[old.of_word]
    keys = np.concatenate([old.keys[old.of_word[stays]], _keys(added)])
    order = np.argsort(keys, kind="stable")

    def merged(of: NDArray, more: NDArray) -> NDArray:
        return np.concatenate([of[stays], more])[order]

    lines = np.searchsorted(keys[order] >> 32, np.arange(len(added.line_starts)))
    finer = None
    if before.finer is not None and added.finer is not None:
        finer = merged(before.finer, added.finer)
    return replace(
        added, line_starts=lines.astype(np.int64), words=merged(before.words, added.words),
        ids=merged(before.ids, added.ids), finer=finer,
    )  # fmt: skip


def group_count(stream: WordStream) -> int:
    """How many groups a stream has."""
    return len(_groups(stream).keys)


def _are_alike(one: WordStream, other: WordStream) -> bool:
    """Whether two pictures are divided into lines alike, and have the same arrays."""
    divided = one.size == other.size and one.stride == other.stride
    return divided and (one.finer is None, one.shift, one.samples) == (
        other.finer is None,
        other.shift,
        other.samples,
    )


def _keys(stream: WordStream) -> NDArray[np.int64]:
    """Line and id of each word, (N,), ascending."""
    lines = np.repeat(np.arange(len(stream.line_starts) - 1), np.diff(stream.line_starts))
    return lines << 32 | stream.ids


def _groups(stream: WordStream) -> _Groups:
    keys, first, of_word = np.unique(_keys(stream), return_index=True, return_inverse=True)
    return _Groups(keys, np.append(first, len(stream)), of_word)


def _with_words(stream: WordStream, chosen: NDArray[np.bool_]) -> WordStream:
    """The stream with some of its words alone, (N,)."""
    before = np.concatenate([[0], np.cumsum(chosen)])
    return replace(
        stream, line_starts=before[stream.line_starts], words=stream.words[chosen], ids=stream.ids[chosen],
        finer=None if stream.finer is None else stream.finer[chosen],
    )  # fmt: skip
