"""Renderer backends: one file or package each, found by scanning this folder.

A backend answers one question: which surface does each pixel see? Its module has

    a docstring          the first line says in the panel what it is
    TITLE                its name in the panel
    GOOD_FOR             what to choose it for, in a few words, such as "Range images; fills holes"
    Params               a frozen dataclass of parameters (see viewer/params.py)
    needs(pose, params) -> what the pose must have: "normals" and "radii" of its points are estimated where
                         they are missing; "views": range views, without which it cannot be drawn;
                         where it names these alone, rows are samples of them and no point is read
    draw(gpu_pose, frame, surface) -> bool
                         on the GL thread: write `surface.depths` and `surface.rows`, and what it has of its
                         own (`Surface.own`); True if a later call would refine the picture

and, where it prepares something for a pose,

    derive(pose, params) -> arrays      CPU only, on any thread
    upload(gpu, arrays) -> derived      GL thread; `derived.nbytes` and `derived.release()`

which `draw` then finds as `frame.derived`. A window runs `derive` in a process of its own, or, with
DERIVES_ON_THREAD = True, on a thread, which is sooner done: for what lets go of the interpreter's lock.
With DERIVED_BY_CAMERA = True it is derive(pose, params, view), and made for each view: the last few are kept.

It may declare

    ROWS                 what a row of its pictures stands for: one of `ROWS`, "points" where it says nothing
    BLENDS               True: what a pixel shows may be of several points
    KEEPS                True: moving pictures of a share of the points draw again what the one before showed
    FILLS                True: pixels may be filled that no point gave
    FINDS_NORMALS        True: it writes normals of its own, so that looks need none of the pose
    VALUES               numbers that it finds for the rows that it draws, for looks to colour by:
                         name -> `ValueKind`; see `Surface.wanted`
    suits(pose) -> Suited   how well it does as the default for a scan; None where it does not
    offers(pose) -> several   values in place of its defaults, by name, with each of which it draws the scan
                         from what is stored, nothing being prepared: what is chosen automatically for a time
                         or an error (viewer/choice) is one of these
    KEPT                 parameter -> why its default stays where a benchmark finds a value that beats it
    LIMITS               row of the stability suite (viewer/bench/numerics.py) -> `Limit`, or several

Names that begin with an underscore are no backends. No list of backends exists anywhere else.
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
SHARES = (0.5, 0.25, 0.1)  # levels of detail that are chosen automatically
_MANY = 200_000  # points of a scan, from which on they are
CHANGES = ("pose", "camera", "parameters", "size", "values")  # of one picture against the one before


class Suited(NamedTuple):
    """How well a backend does as the default for a scan. rank: against others, the highest is taken. params:
    the values in place of its defaults with which it does, by name."""

    rank: int
    params: Mapping[str, object] = {}


@dataclass(frozen=True)
class Limit:
    """Looser bound of a row of the stability suite whose own cannot be held in principle.

    pixels: the share of the pixels that may be apart by more than the suite's coarse steps. reason: why
    finer ones cannot be held; the same words for the same principle. when: parameters -> the values of them
    with which it cannot be held; empty: any.
    """

    pixels: float
    reason: str
    when: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)

    def applies(self, params: object) -> bool:
        """Whether it does with these parameters of the backend."""
        return all(getattr(params, name) in values for name, values in self.when.items())


# Reasons of limits that several backends have.
AROUND_ALL = (
    "octants and sectors divide the cube or the directions around all points, upright: with others, or "
    "turned ones, points lie in other ones"
)
NO_SPACING = (
    "points are drawn as large as they lie apart, which a line of them end on, or one alone, does not tell"
)
NO_DETAIL = "what is divided is the whole scan: a detail, tiny beside it, is within few of the parts"


def share_param(default: float | None = 1.0, auto: str = "", group: str = "") -> Any:
    """The parameter `share` of a backend: a coarser level of detail. Whatever draws it finds the share in
    `FrameView.share`, with that of a preview. auto: what None stands for."""
    return param(
        default,
        "Share of the points that are drawn, evenly chosen and larger to match; less is faster and coarser"
        + (f"; auto: {auto}" if auto else ""),
        type=float,
        low=1e-3,
        high=1.0,
        title="Level of detail",
        group=group,
    )


def with_levels(pose: Pose, *offered: dict[str, object]) -> tuple[dict[str, object], ...]:
    """The values that a backend offers, each with all points and, of a scan of many, with shares of them."""
    levels = SHARES if pose.count >= _MANY else ()
    return (*offered, *({**values, "share": share} for values in offered for share in levels))


class Derived(Protocol):
    """Data that a backend prepared for a pose and put on the GPU."""

    nbytes: int

    def release(self) -> None:
        """Delete it."""


@dataclass(frozen=True, eq=False)
class FrameView:
    """Order for a frame, as a backend gets it: a view, its own parameters, and what it derived.

    share: of the points that need to be drawn, less than 1 while the picture moves and all would
    take too long. A backend that leaves some out says that a later call would refine the picture,
    and counts them (`Points.of` does); one that is fast enough may draw all. budget_ms: after which a
    backend that can draw something coarser does, and says that a later call would refine it; None: never.
    changed: what of `CHANGES` is another than in the call before for this surface; all in the first one, and
    after one that failed. "values": what `row_values` and `resolve` of the Surface give, by look and layers.
    before: the picture before of the same pose with the same parameters, whose points a moving picture may
    draw again where it draws a share; see gpu/kept.py. moving: whether other pictures will follow at once; a
    backend that then draws more simply says so by `surface.stats.simplified`, and is called again at
    rest.
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
        """Words on what to choose it for."""
        return self.module.GOOD_FOR

    @property
    def help(self) -> str:
        """One line on what it does."""
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
        """Whether what a pixel shows may be of several points."""
        return getattr(self.module, "BLENDS", False)

    @property
    def keeps(self) -> bool:
        """Whether moving pictures of a share of the points draw again what the one before showed."""
        return getattr(self.module, "KEEPS", False)

    @property
    def fills(self) -> bool:
        """Whether pixels may be filled that no point gave."""
        return getattr(self.module, "FILLS", False)

    @property
    def finds_normals(self) -> bool:
        """Whether its pictures have normals of their own, whatever the pose has."""
        return getattr(self.module, "FINDS_NORMALS", False)

    @property
    def values(self) -> Mapping[str, ValueKind]:
        """Numbers that it finds for the rows that it draws, by name."""
        return getattr(self.module, "VALUES", {})

    def suits(self, pose: Pose) -> Suited | None:
        """How well it does as the default for a scan, None where it does not."""
        return self.module.suits(pose) if hasattr(self.module, "suits") else None

    def offers(self, pose: Pose) -> tuple[Mapping[str, object], ...]:
        """Values in place of its defaults, each a way to draw a scan that may be chosen for time or error."""
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
        """Why defaults stay that another value beats on some scene, by parameter."""
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
