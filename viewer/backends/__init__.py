"""Renderer backends: a file or package each in this folder, or in another package (viewer/extensions.py).

A backend answers one question: which surface does each pixel see? Its module holds one subclass of
`Backend`. The module's docstring says what the backend does; the panel shows its first line.
Names that begin with an underscore are no backends. No other list of backends exists.
"""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cache
from types import MappingProxyType, ModuleType
from typing import Any, NamedTuple, Protocol

from ..errors import InputError, unknown_name
from ..extensions import load_modules
from ..gpu.context import Gpu
from ..gpu.pose import GpuPose
from ..look import COLOR_BY, ValueKind
from ..params import Parameter, describe, param, parse
from ..picture.frame_view import CHANGES as CHANGES
from ..picture.frame_view import FrameView
from ..picture.surface import Surface
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..view import View

ROWS = ("points", "octants", "samples")
SHARES = (0.5, 0.25, 0.1)  # levels of detail that the automatic choice may take
_MANY = 200_000  # least number of points of a scan for these levels


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
AT_EDGES = (
    "each pixel takes its values from one cell or splat; at the edge between two, or at the end of one, "
    "rounding decides which that is"
)
AROUND_ALL = (
    "octants divide the upright cube around all points, and sectors divide all directions to points: "
    "adding or turning points changes both"
)
NO_SPACING = (
    "the size of a drawn point is the spacing of the points, which is unknown for a single point, or if "
    "the view looks along a line of points"
)
NO_DETAIL = (
    "octants and sectors divide the whole scan, so a tiny detail lies in only a few octants or sectors"
)


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

    @property
    def nbytes(self) -> int:
        """Bytes that it holds."""

    def release(self) -> None:
        """Delete it."""


class Derives(Enum):
    """The process that runs a backend's `derive` for a window, which does not wait."""

    NEVER = "never"  # the backend prepares nothing
    IN_PROCESS = "in a process"  # several poses at once
    ON_THREAD = "on a thread"  # done sooner; for work that releases the interpreter's lock


class Backend(ABC):
    """Base class of backends.

    A subclass gives `title`, `params_class` and `draw`. Everything else has a default.
    name: how commands and files call it, the module's name.
    """

    title: str  # its name in the panel
    good_for: str = ""  # what a user chooses it for, in a few words: "Draws range images and fills holes"
    params_class: type[Any]  # frozen dataclass of parameters, see viewer/params.py
    rows: str = "points"  # what a row of its pictures stands for: one of `ROWS`
    blends: bool = False  # a pixel may show several points
    fills: bool = False  # it may fill pixels that no point gave
    draws_with: tuple[str, ...] = ()  # arrays that it reads beside its needs, where the pose has them
    finds_normals: bool = False  # it writes its own normals, so looks need none of the pose
    takes_parts: bool = False  # it draws poses in runs of points that a driver takes, see `GpuPose.parts`
    accumulates: bool = False  # moving pictures of a share of the points continue the one before
    derives: Derives = Derives.NEVER  # where `derive` runs
    derived_by_camera: bool = False  # `derive` runs for each view; the last few results are kept
    # Numbers that it finds for the rows that it draws, for looks to colour by; see `Surface.wanted`.
    values: Mapping[str, ValueKind] = MappingProxyType({})
    # Row of the stability suite (viewer/bench/numerics.py) -> what holds in place of the row's own bound.
    limits: Mapping[str, Limit | tuple[Limit, ...]] = MappingProxyType({})
    # Parameter -> why its default stays although a benchmark finds a value that beats it.
    default_reasons: Mapping[str, str] = MappingProxyType({})

    def __init__(self, name: str) -> None:
        self.name = name

    def __str__(self) -> str:
        return self.name

    @abstractmethod
    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Write `surface.depths` and `surface.rows`, and its own channels (`Surface.own`), on the GL thread.

        Returns True if a later call would refine the picture.
        """

    def needs(self, pose: Pose, params: Any) -> tuple[str, ...]:
        """Names of what the pose must have; by default nothing but positions.

        "normals" and "radii" of points are estimated where the pose lacks them. "views": range views,
        without which the backend cannot draw; where it names these alone, its rows are samples.
        """
        return ()

    def suits(self, pose: Pose) -> Suited | None:
        """How well it does as the default for a scan; None, the default: it is never chosen."""
        return None

    def offers(self, pose: Pose) -> tuple[Mapping[str, object], ...]:
        """Parameter values, by name, with each of which it draws the scan with nothing prepared.

        The automatic choice (viewer/choice) takes one of them; by default there are none.
        """
        return ()

    def derive(self, pose: Pose, params: Any, view: View | None) -> Any:
        """Arrays that it prepares for a pose, on the CPU, on any thread; see `derives`.

        view: None unless `derived_by_camera`.
        """
        raise NotImplementedError

    def upload(self, gpu: Gpu, arrays: Any) -> Derived:
        """Put what `derive` gave on the GPU, for `draw` to find as `frame.derived`; on the GL thread."""
        raise NotImplementedError

    def foresee(self, cloud: PointCloud, params: Any) -> None:
        """Find the facts about a pose's points (`PointCloud.remember`) that pictures read but need not wait
        for, before pictures are due; on any thread. By default, there are none."""
        return

    def awaits_facts(self, params: Any) -> bool:
        """Whether pictures do wait for the facts that `foresee` finds, so that the window never computes them
        itself."""
        return False

    @property
    def about(self) -> str:
        """The docstring of its module: what it does, and from which paper."""
        return sys.modules[type(self).__module__].__doc__ or ""

    @property
    def help(self) -> str:
        """One line on what it does."""
        return self.about.strip().splitlines()[0]

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters as declared."""
        return describe(self.params_class)

    def params(self, values: Mapping[str, object] | None = None) -> Any:
        """Make its parameters, with these values in place of defaults; raises InputError."""
        return parse(self.params_class, values or {}, f"parameter of '{self.name}'")

    def limits_of(self, row: str) -> tuple[Limit, ...]:
        """The limits that it declares for a row of the stability suite."""
        found = self.limits.get(row, ())
        return (found,) if isinstance(found, Limit) else found

    def draws(self, pose: Pose) -> bool:
        """Whether it can draw this pose: it does not need range views that the pose lacks."""
        return bool(pose.views) or "views" not in self.needs(pose, self.params())

    def draws_samples(self, pose: Pose, params: Any) -> bool:
        """Whether it draws this pose from samples of its range views alone, and reads no points."""
        return set(self.needs(pose, params)) == {"views"}

    def derive_key(self, params: Any) -> tuple[Any, ...] | None:
        """The parameter values that what it derives depends on; None if it derives nothing with them."""
        return tuple(getattr(params, p.name) for p in self.parameters if p.affects == "derive")


@cache
def backends() -> dict[str, Backend]:
    """All backends by name, in alphabetical order."""
    found: dict[str, Backend] = {}

    def add(name: str, module: ModuleType) -> None:
        found[name] = _checked(_class_of(module), name)

    load_modules("backends", __name__, __path__, add)
    return dict(sorted(found.items()))


def _class_of(module: ModuleType) -> type[Backend]:
    """The backend that a module holds. Raises InputError where it does not define exactly one."""
    classes = [
        one for one in vars(module).values()
        if isinstance(one, type) and issubclass(one, Backend) and one.__module__ == module.__name__
    ]  # fmt: skip
    if len(classes) != 1:
        what = f"{module.__name__} defines {len(classes)} subclasses of Backend"
        raise InputError(what, hint="Define exactly one subclass of Backend in this module")
    return classes[0]


def _checked(kind: type[Backend], name: str) -> Backend:
    """A backend of this class. Raises InputError where its declarations are not usable."""
    missing = [each for each in ("title", "params_class") if not hasattr(kind, each)]
    if missing := missing + sorted(kind.__abstractmethods__):
        raise InputError(f"{kind.__qualname__} does not define {' and '.join(missing)}", hint="Define it")
    params = kind.params_class
    declared = getattr(params, "__dataclass_params__", None)
    if not (isinstance(params, type) and declared is not None and declared.frozen):
        raise InputError(
            f"params_class of {kind.__qualname__} is not a frozen dataclass",
            hint="Declare it with @dataclass(frozen=True)",
        )
    try:
        describe(params)
    except Exception as error:
        raise InputError(f"{error}", hint="Correct the declaration of its parameters") from error
    one = kind(name)
    if not one.about.strip():
        raise InputError(
            f"{kind.__module__} has no docstring", hint="Say in the docstring what the backend draws"
        )
    return one


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
        what = f"the backend {drawn_by} does not compute '{name}', but {' and '.join(finders)} can"
        return InputError(what, where, f"Use --backend {finders[0]}")
    error = unknown_name("colour source", name, [*COLOR_BY, *scalars, *drawn_by.values])
    return InputError(error.what, where, error.hint)
