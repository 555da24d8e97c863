"""The kinds of measures, found by folder: a module for a kind, or for a few of one family.

A module has

    KINDS               its `MeasureKind`s

Names that begin with an underscore are no modules of kinds. No list of kinds exists anywhere else: the
panel, the command line, series over time and the table in the docs are made of what is declared here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from ....errors import InputError, unknown_name
from ....extensions import load_modules
from ....mesh.geodesic import Line
from .. import Measure, Quantity
from ..surface import Found, PoseSurface, Refused

Options = Mapping[str, str]
OfPoints = Callable[[NDArray[np.float64], Options], NDArray[np.float64]]
LinesOf = Callable[[NDArray[np.float64], Options], Sequence[Line]]
OnSurface = Callable[[PoseSurface, NDArray[np.float64], Options], Found | Refused]


@dataclass(frozen=True)
class MeasureKind:
    """A kind of measure.

    name: that files and commands know it by. title: that users read. about: what of its landmarks it is.
    quantity: of its values. least: number of landmarks at least. most: at most; None: any number.
    compute: `OfPoints` takes positions (T, K, 3) and gives values (T,), NaN where they tell none; `OnSurface`
    takes the surface of one pose and positions (K, 3), and gives a value or the reason why there is none.
    needs_surface: which of both it is. choices: the values that each option may have, the first where it is
    not stated. lines: of a kind that needs no surface, takes positions (K, 3) and gives the lines to draw,
    each (P, 3).
    """

    name: str
    title: str
    about: str
    quantity: Quantity
    least: int
    most: int | None
    compute: OfPoints | OnSurface
    needs_surface: bool = False
    choices: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    lines: LinesOf | None = None


@cache
def measure_kinds() -> Mapping[str, MeasureKind]:
    """All kinds by name."""
    found: dict[str, MeasureKind] = {}

    def add(_: str, module: ModuleType) -> None:
        if taken := found.keys() & {kind.name for kind in module.KINDS}:
            raise InputError(
                f"a kind of measure '{min(taken)}' exists already",
                hint="Give the new kind of measure another name",
            )
        found.update((kind.name, kind) for kind in module.KINDS)

    load_modules("measures", __name__, __path__, add)
    return found


def kind_of(measure: Measure) -> MeasureKind:
    """The kind of a measure. Raises InputError where there is none of that name, or its landmarks or
    options do not fit it."""
    kinds = measure_kinds()
    if measure.kind not in kinds:
        raise unknown_name("kind of measure", measure.kind, kinds)
    kind, count = kinds[measure.kind], len(measure.landmarks)
    if count < kind.least or (kind.most is not None and count > kind.most):
        wanted = f"{kind.least}" if kind.least == kind.most else f"{kind.least} or more"
        if kind.most not in (None, kind.least):
            wanted = f"{kind.least} to {kind.most}"
        raise InputError(
            f"the measure takes {wanted} landmarks, not {count}",
            f"{kind.title} '{measure.name}'",
            kind.about,
        )
    for name, value in measure.options.items():
        if name not in kind.choices:
            raise unknown_name(f"option of '{kind.name}'", name, kind.choices)
        if value not in kind.choices[name]:
            raise unknown_name(f"value of '{name}'", value, kind.choices[name])
    return kind
