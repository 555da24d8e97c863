"""Renderer backends: one file or package each, found by scanning this folder.

A backend answers one question: which surface does each pixel see? Its module has

    a docstring          the first line appears in the panel and says what the backend draws
    TITLE                its name in the panel
    GOOD_FOR             a few words on when to choose it, such as "Range images; fills holes"
    Params               a frozen dataclass of parameters (see viewer/params.py)
    needs(pose, params) -> names of what the pose must have. "normals" and "radii": Scan4D estimates them if
                         the scan lacks them. "views": the pose must have range views. ("views",) alone means
                         that rows are samples of the views and that no point is read
    draw(gpu_pose, frame, surface) -> bool
                         runs on the GL thread; writes `surface.depths`, `surface.rows` and the channels of
                         its own (`Surface.own`). True if a later call would refine the picture

A backend that prepares data for a pose also has

    derive(pose, params) -> arrays      CPU only, on any thread
    upload(gpu, arrays) -> derived      GL thread; `derived.nbytes` and `derived.release()`

`draw` gets the result as `frame.derived`. A window runs `derive` in a process of its own. With
DERIVES_ON_THREAD = True it runs on a thread, which starts sooner; use it for code that releases the
interpreter's lock. With DERIVED_BY_CAMERA = True the call is derive(pose, params, view), once for each view;
the last few results are kept.

Optional declarations:

    ROWS                 what a row of its pictures stands for: one of `ROWS`, "points" by default
    BLENDS               True: a pixel may show a blend of several points
    KEEPS                True: in motion, a picture of a share of the points adds those of the last picture
    FILLS                True: it may fill pixels that no point covers
    FINDS_NORMALS        True: it writes normals of its own, so that a look needs no normals of the pose
    VALUES               numbers that it computes for its rows, for looks to colour by:
                         name -> `ValueKind`; see `Surface.wanted`
    suits(pose) -> Suited   how well it works as the default for a scan; None if it does not
    offers(pose) -> several   sets of parameter values that draw the scan without preparation. The automatic
                         choice for a time or an error (viewer/choice) picks one of these sets
    KEPT                 parameter -> why its default stays although a benchmark finds a better value
    LIMITS               row of the stability suite (viewer/bench/numerics.py) -> `Limit`, or several

A module whose name begins with an underscore is no backend. No list of backends exists anywhere else.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any, NamedTuple, Protocol

from ..errors import InputError, unknown_name
from ..gpu.context import Gpu
from ..gpu.kept import Before
from ..gpu.pose import GpuPose
from ..gpu.surface import Surface
from ..look import COLOR_BY, ValueKind
from ..params import Parameter, describe, param, parse
from ..scan.pose import Pose
from ..view import View

ROWS = ("points", "octants", "samples")
SHARES = (0.5, 0.25, 0.1)  # levels of detail that the automatic choice may take
_MANY = 200_000  # least number of points of a scan for these levels
CHANGES = ("pose", "camera", "parameters", "size", "values")  # what can differ from the last picture


class Suited(NamedTuple):
    """How well a backend works as the default for a scan. rank: Scan4D takes the backend of the highest rank.
    params: values that replace its defaults, by name."""

    rank: int
    params: Mapping[str, object] = {}


@dataclass(frozen=True)
class Limit:
    """A looser bound for a row of the stability suite, where the algorithm cannot keep the suite's own bound.

    pixels: the share of the pixels that may differ by more than the suite's coarse steps. reason: why the
    algorithm cannot do better; the same words for the same principle. when: parameter -> the values for which
    the limit applies; empty: all values.
    """

    pixels: float
    reason: str
    when: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)

    def applies(self, params: object) -> bool:
        """Whether the limit applies to these parameters of the backend."""
        return all(getattr(params, name) in values for name, values in self.when.items())


# Reasons of limits that several backends have.
AROUND_ALL = (
    "octants divide the upright cube around all points, sectors the directions to them: other or turned "
    "points give other octants and sectors"
)
NO_SPACING = (
    "points are drawn as large as their spacing, which is unknown for one point or a line seen end on"
)
NO_DETAIL = "octants and sectors divide the whole scan: a tiny detail lies within few of them"


def share_param(default: float | None = 1.0, auto: str = "", group: str = "") -> Any:
    """The parameter `share` of a backend: a coarser level of detail. `FrameView.share` is this share times
    that of a preview. auto: the meaning of None, in words."""
    return param(
        default,
        "Share of the points to draw, chosen evenly and enlarged to match. A smaller share is faster and "
        "coarser" + (f"; auto: {auto}" if auto else ""),
        type=float,
        low=1e-3,
        high=1.0,
        title="Level of detail",
        group=group,
    )


def with_levels(pose: Pose, *offered: dict[str, object]) -> tuple[dict[str, object], ...]:
    """The offered values, each with all points and, for a large scan, with shares of the points."""
    levels = SHARES if pose.count >= _MANY else ()
    return (*offered, *({**values, "share": share} for values in offered for share in levels))


class Derived(Protocol):
    """Data on the GPU that a backend prepared for a pose."""

    nbytes: int

    def release(self) -> None:
        """Delete it."""


@dataclass(frozen=True, eq=False)
class FrameView:
    """Order for one frame, as a backend gets it: a view, its own parameters, and its derived data.

    share: share of the points to draw, less than 1 while the picture moves and all points take too long.
    A backend that leaves points out returns True and counts them (`Points.of` does). A fast backend may draw
    all points. budget_ms: time after which a backend draws something coarser, if it can, and returns True;
    None: no limit. changed: the members of `CHANGES` that differ from the last call for this surface; all of
    them in the first call and after a failed one. "values" stands for the results of `Surface.row_values` and
    `Surface.resolve`. moving: whether other pictures follow at once. A backend that then draws something
    simpler sets `surface.stats.simplified`; it is called again at rest. before: the last picture of this pose
    with these parameters; a moving picture of a share may draw its points again (gpu/kept.py).
    """

    view: View
    params: Any
    derived: Any = None
    share: float = 1.0
    budget_ms: float | None = None
    changed: frozenset[str] = frozenset(CHANGES)
    moving: bool = False
    before: Before | None = None


@dataclass(frozen=True, eq=False)
class Backend:
    """One backend module, or an object with the same names, by its declarations."""

    name: str
    module: Any

    def __str__(self) -> str:
        return self.name

    @property
    def title(self) -> str:
        """The name in the panel."""
        return self.module.TITLE

    @property
    def good_for(self) -> str:
        """A few words on when to choose it."""
        return self.module.GOOD_FOR

    @property
    def help(self) -> str:
        """One line on what it draws."""
        return (self.module.__doc__ or "").splitlines()[0]

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters as declared."""
        return describe(self.module.Params)

    @property
    def rows(self) -> str:
        """Meaning of a row of the backend's pictures: one of `ROWS`."""
        return getattr(self.module, "ROWS", "points")

    @property
    def blends(self) -> bool:
        """Whether a pixel may show a blend of several points."""
        return getattr(self.module, "BLENDS", False)

    @property
    def keeps(self) -> bool:
        """Whether a moving picture of a share of the points also draws those of the last picture."""
        return getattr(self.module, "KEEPS", False)

    @property
    def fills(self) -> bool:
        """Whether the backend may fill pixels that no point covers."""
        return getattr(self.module, "FILLS", False)

    @property
    def finds_normals(self) -> bool:
        """Whether its pictures have normals of their own, whatever the pose has."""
        return getattr(self.module, "FINDS_NORMALS", False)

    @property
    def values(self) -> Mapping[str, ValueKind]:
        """Numbers that the backend computes for its rows, by name."""
        return getattr(self.module, "VALUES", {})

    def suits(self, pose: Pose) -> Suited | None:
        """How well it works as the default for a scan; None if it does not."""
        return self.module.suits(pose) if hasattr(self.module, "suits") else None

    def offers(self, pose: Pose) -> tuple[Mapping[str, object], ...]:
        """Sets of parameter values that the automatic choice for a time or an error may take."""
        return self.module.offers(pose) if hasattr(self.module, "offers") else ()

    @property
    def limits(self) -> Mapping[str, tuple[Limit, ...]]:
        """Limits of the backend in the stability suite, by the suite's rows."""
        declared = getattr(self.module, "LIMITS", {})
        return {
            row: (found,) if isinstance(found, Limit) else tuple(found) for row, found in declared.items()
        }

    @property
    def kept(self) -> Mapping[str, str]:
        """Why a default stays although another value beats it on some scene, by parameter."""
        return getattr(self.module, "KEPT", {})

    def params(self, values: Mapping[str, object] | None = None) -> Any:
        """Make its parameters, with these values in place of defaults; raises InputError."""
        return parse(self.module.Params, values or {}, f"parameter of '{self.name}'")

    def needs(self, pose: Pose, params: Any) -> tuple[str, ...]:
        """Names of what it needs of this pose: "normals", "radii", "views"."""
        return self.module.needs(pose, params)

    def draws(self, pose: Pose) -> bool:
        """Whether it draws this pose, and does not need range views that are none of it."""
        return bool(pose.views) or "views" not in self.needs(pose, self.params())

    def draws_samples(self, pose: Pose, params: Any) -> bool:
        """Whether it draws this pose from samples of its range views alone: nothing is read of its points."""
        return set(self.needs(pose, params)) == {"views"}

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Draw; True if a later call would refine the picture."""
        return self.module.draw(pose, frame, surface)

    @property
    def derive(self) -> Callable[..., Any] | None:
        """The backend's derive function, None where it prepares nothing."""
        return getattr(self.module, "derive", None)

    @property
    def derives_on_thread(self) -> bool:
        """Whether a thread does for `derive`, or it needs a process of its own."""
        return getattr(self.module, "DERIVES_ON_THREAD", False)

    @property
    def derived_by_camera(self) -> bool:
        """Whether what it derives is of one view, which `derive` then gets too."""
        return getattr(self.module, "DERIVED_BY_CAMERA", False)

    def upload(self, gpu: Gpu, arrays: Any) -> Derived:
        """Put what `derive` gave on the GPU."""
        return self.module.upload(gpu, arrays)

    def derive_key(self, params: Any) -> tuple[Any, ...]:
        """The parameter values that what it derives depends on."""
        return tuple(getattr(params, p.name) for p in self.parameters if p.affects == "derive")


@cache
def backends() -> dict[str, Backend]:
    """All backends by name, in alphabetical order."""
    names = sorted(m.name for m in pkgutil.iter_modules(__path__) if not m.name.startswith("_"))
    return {name: Backend(name, importlib.import_module(f"{__name__}.{name}")) for name in names}


def backend(name: str) -> Backend:
    """The backend of this name; raises InputError that lists the known ones."""
    if name not in backends():
        raise unknown_name("backend", name, list(backends()))
    return backends()[name]


def missing_source(
    name: str, drawn_by: Backend, scalars: Collection[str], where: object = None
) -> InputError:
    """The error for a number to colour by that neither a scan with these scalars nor the backend has; it
    tells which backend does, or lists what there is."""
    finders = [one.name for one in backends().values() if name in one.values]
    if finders:
        what = f"'{name}' is not found by the backend {drawn_by}, but by {' and '.join(finders)}"
        return InputError(what, where, f"Use --backend {finders[0]}")
    error = unknown_name("colour source", name, [*COLOR_BY, *scalars, *drawn_by.values])
    return InputError(error.what, where, error.hint)
