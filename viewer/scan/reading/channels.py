"""Decides which channel of a picture with many, such as an EXR, is depth.

Renderers call it `Z`, by itself or at the end of a layer's name. Blender's File Output calls it `Depth.V`.
Other programs call it `depth`, or write nothing but one channel `Y` or `R`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from ...errors import InputError
from .corrections import NOTHING_CORRECTED, Corrections
from .record import Decision

KEY = "depth-channel"
EXPECTED = "Depth is expected in a channel called Z, depth or Depth.V, or in the only channel, Y or R"

_NAMES = ("depth", "d", "zdepth", "distance", "depth_z")  # of a channel, in lower case, beside Z
_LAYERS = ("depth", "zdepth", "z")  # of a layer whose only number a pixel is depth, in lower case
_VALUES = ("v", "y", "z", "d", "r")  # what that number is called, in lower case
_ALONE = ("y", "r", "v", "l", "z")  # what the only channel of depth is called, in lower case
_WITHOUT_DEPTH = ("a", "alpha", "mask")  # beside a channel that counts as the only one, in lower case


class DepthChannel(NamedTuple):
    """The name of the channel that is depth, and the decision."""

    name: str
    decision: Decision


def decide(names: Sequence[str], corrections: Corrections = NOTHING_CORRECTED) -> DepthChannel | None:
    """The channel among these that is depth, None where none is.

    names: of all channels, with their layers before dots; those that come first win. Raises InputError where
    the user names a channel that is not there.
    """
    if KEY in corrections:
        stated = corrections[KEY]
        if stated not in names:
            raise InputError(f"the file has no channel {stated}", hint=f"Its channels: {', '.join(names)}")
        return DepthChannel(stated, Decision(KEY, stated, "user", "--read"))
    found = depth_channels(names)
    if found:
        return DepthChannel(found[0], Decision(KEY, found[0], "file", found[0]))
    others = [name for name in names if _word(name) not in _WITHOUT_DEPTH]
    if len(others) == 1 and _word(others[0]) in _ALONE:
        why = f"Scan4D reads depth from the only channel, {others[0]}"
        return DepthChannel(others[0], Decision(KEY, others[0], "assumed", why=why, changes_numbers=True))
    return None


def depth_channels(names: Sequence[str]) -> list[str]:
    """The channels among these whose names say that they are depth, the surest first."""
    there = set(names)
    # Beside an X, Z is of a direction or a position.
    by_name = [name for name in names if _last(name) == "Z" and f"{name[:-1]}X" not in there]
    by_name += [name for name in names if _word(name) in _NAMES]
    by_layer = [
        name
        for value in _VALUES
        for name in names
        if _word(name) == value and _layer(name) in _LAYERS and name not in by_name
    ]
    return list(dict.fromkeys([*by_name, *_first_of_layers(by_layer)]))


def _first_of_layers(names: Iterable[str]) -> list[str]:
    """One name a layer: depth that is stored three times is the same."""
    by_layer: dict[str, str] = {}
    for name in names:
        by_layer.setdefault(name.rpartition(".")[0], name)
    return list(by_layer.values())


def _last(name: str) -> str:
    return name.rpartition(".")[2]


def _word(name: str) -> str:
    return _last(name).lower()


def _layer(name: str) -> str:
    """The innermost layer of a channel, in lower case; "" where it has none."""
    return name.rpartition(".")[0].rpartition(".")[2].lower()
