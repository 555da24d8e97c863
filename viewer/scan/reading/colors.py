"""The scale of colours: whether full brightness is 1, 255 or 65535, by one rule for all formats.

The scale concerns a whole sequence, since a dark frame of 16-bit colours looks like one of 8 bit. The rule
therefore says whether one frame is enough to be certain.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..points import strided
from .corrections import NOTHING_CORRECTED, Corrections
from .record import Decision
from .sequence import Decided

KEY = "colors"
SCALES = (1, 255, 65535)
NONE = "none"  # the correction that leaves the colours out
_LITTLE_MORE = 2.0  # floats up to here may be colours of 0..1 that exceed it, as sharpened ones do
_MOSTLY = 0.5  # share of values with a fraction, by which such colours differ from whole numbers


class ColorEvidence(NamedTuple):
    """Evidence from the colours of one frame about their scale.

    kind: numpy's code of their type, such as "u2". top: the largest finite value. fractions: the share of
    values that are no whole numbers, 0..1; 0 where the type or `top` makes it irrelevant.
    """

    kind: str
    top: float
    fractions: float = 0.0


class ColorScale(NamedTuple):
    """The value of full brightness, and whether one frame is enough to know it."""

    full: int
    is_certain: bool


def evidence_of(colors: NDArray) -> ColorEvidence:
    """Evidence from colours (N, C) about their scale."""
    kind = colors.dtype.str[1:]
    if colors.dtype.itemsize == 1:
        return ColorEvidence(kind, 255.0)
    top = colors.max(initial=0)
    if colors.dtype.kind == "f" and not np.isfinite(top):
        top = colors.max(initial=0, where=np.isfinite(colors))
    if colors.dtype.kind != "f" or top > 255:
        return ColorEvidence(kind, float(top))
    sample = strided(colors)
    return ColorEvidence(kind, float(top), float(np.mean(sample != np.rint(sample))) if sample.size else 0.0)


def scale_of(evidence: ColorEvidence) -> ColorScale:
    """The scale that one frame tells.

    Whole numbers of 16 bit or more that stay within 255 may be 8-bit colours or those of a dark frame, and so
    may whole numbers below 255 in floats, as text has them. Floats of 0 and 1 alone may be of either range.
    None of these is certain.
    """
    kind, top, fractions = evidence
    if kind[0] == "b":
        return ColorScale(1, True)
    if kind[0] != "f":
        return ColorScale(65535 if top > 255 else 255, kind[1:] == "1" or top > 255)
    if top > 255:
        return ColorScale(65535, True)
    if top > _LITTLE_MORE or (top > 1 and fractions <= _MOSTLY):
        return ColorScale(255, fractions > 0 or top == 255)
    return ColorScale(1, fractions > 0)


def scale_of_all(evidence: Sequence[ColorEvidence]) -> ColorScale:
    """The scale that several frames tell together: that of the brightest certain one, else of the first."""
    scales = [scale_of(each) for each in evidence]
    certain = [scale for scale in scales if scale.is_certain]
    return max(certain) if certain else scales[0]


def contradicts(evidence: ColorEvidence, full: int) -> bool:
    """Whether the colours of a frame are certainly of a larger scale than that of the sequence."""
    own = scale_of(evidence)
    return own.is_certain and own.full > full


def settled_scale(colors: NDArray, decided: Decided, others: Callable[[], Iterable[NDArray]] = tuple) -> int:
    """The scale of the colours (N, C) of a frame: that of its scan, which the first frame settles.

    others: reads the colours of some other frames, for when those of the first are not enough.
    """
    evidence = evidence_of(colors)

    def settle() -> Decision:
        is_enough = KEY in decided.corrections or scale_of(evidence).is_certain
        more = [] if is_enough else [evidence_of(each) for each in others()]
        return decide([evidence, *more], decided.corrections)

    full: int = decided.settle(KEY, settle).value
    if contradicts(evidence, full):
        decided.contradict(
            KEY, f"the colours of this frame reach {evidence.top:g}, but the scale of the scan ends at {full}"
        )
    return full


def opaque_if_unseen(rgba: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Colours (N, 4); opaque where the alpha of all is 0, as programs write that know no alpha."""
    if not len(rgba) or rgba[:, 3].any():
        return rgba
    opaque = rgba.copy()
    opaque[:, 3] = 255
    return opaque


def decide(evidence: Sequence[ColorEvidence], corrections: Corrections = NOTHING_CORRECTED) -> Decision:
    """The scale of the colours of a scan, from one frame or several; null where it has none.

    Raises InputError where the user states the scale of colours that are not there.
    """
    if (stated := corrections.get(KEY)) is not None:
        if stated != NONE and not evidence:
            raise InputError(
                "contains no colours, so --read colors has no effect", hint="Leave out --read colors"
            )
        return Decision(KEY, stated if stated == NONE else int(stated), "user", "--read")
    if not evidence:
        return Decision(KEY, None, "file")
    scale = scale_of_all(evidence)
    top = max(each.top for each in evidence)
    if scale.is_certain:
        return Decision(
            KEY,
            scale.full,
            "file",
            why="" if evidence[0].kind[1:] == "1" else f"The largest colour value is {top:g}",
        )
    others = [str(other) for other in SCALES if other != scale.full and other >= top]
    why = f"The largest colour value is {top:g}, but the scale may be larger"
    return Decision(KEY, scale.full, "assumed", why=why, alternatives=(*others, NONE))
