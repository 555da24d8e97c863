"""The document of a scan: what belongs to it and a user would be sorry to lose, as one frozen value."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Any, TypeVar, get_type_hints
from weakref import WeakKeyDictionary

import numpy as np

from ..backends import backend, backends
from ..camera import Camera
from ..choice.configurations import Configuration
from ..choice.goal import Goal
from ..drawing.request import Request, backend_for, colorable
from ..errors import InputError, shortened
from ..geometry import UP, Vector, up_vector
from ..look import Look
from ..scan.averaging import Averaging
from ..scan.layers import NO_LAYERS, Layers
from ..scan.pose import Life, Pose
from ..scan.units import usable_unit
from .part import Part
from .schema import (
    DAMAGED,
    AverageFrames,
    BackendName,
    CorrectedTexts,
    FrameRate,
    Kind,
    PoseNumber,
    ReadBy,
    Unit,
    Values,
    Word,
    is_object,
    structured,
    unread,
    usable,
)  # fmt: skip

P = TypeVar("P", bound=Part)
_UPRIGHT = 0.999  # cosine between a camera's up and the scan's
Span = Annotated[
    tuple[PoseNumber, PoseNumber],
    Kind("a first and a last frame, in this order", lambda ends: ends[0] <= ends[1]),
]


@dataclass(frozen=True)
class Bookmark:
    """A camera by a name that the user gave it."""

    name: str
    camera: Camera


def _kinds_of_params() -> dict[str, type]:
    return {name: one.params_class for name, one in backends().items()}


def _read_params(data: Any) -> dict[str, Any]:
    return _read_known(data, _kinds_of_params())


def _read_parts(data: Any) -> dict[str, Any]:
    return _read_known(data, Part.kinds)


def _read_known(data: Any, kinds: Mapping[str, type]) -> dict[str, Any]:
    """Values by name, each of its kind; what has a name that is not known here, or cannot be read, stays as
    it is."""
    if not is_object(data):
        raise InputError(f"must be an object with named values, not {shortened(data)}", hint=DAMAGED)
    return {name: _read_or_raw(kinds.get(name), value) for name, value in data.items()}


def _read_or_raw(kind: type | None, value: Any) -> Any:
    try:
        return unread(value) if kind is None else structured(kind, value)
    except InputError:
        return unread(value)


def _is_unreadable(kind: type | None, value: Any) -> bool:
    """Whether a value is what a file said of a kind that is known and cannot be read as that."""
    return kind is not None and not isinstance(value, kind) and _read_or_raw(kind, value) is value


def _read_goal(data: Any) -> Goal | None:
    goal = None if data is None else structured(Goal, data)
    if goal is None or (
        goal.kind in ("time", "error") and 0 < goal.bound < math.inf and usable_unit(goal.unit)
    ):
        return goal
    raise InputError(f"must be a limit of time or error, not {shortened(data)}", hint=DAMAGED)


def _read_configuration(data: Any) -> Configuration | None:
    if data is None:
        return None
    stated = structured(Values, data)
    name, values = (
        structured(BackendName, stated.get("backend")),
        structured(Values, stated.get("values", {})),
    )
    backend(name).params(values)
    return Configuration(name, values)


KeptGoal = Annotated[Goal | None, ReadBy(_read_goal)]


@dataclass(frozen=True)
class Document:
    """Everything that a user has chosen and made for a scan.

    camera: None until a first pose is there to fit it to. pivot: what orbiting turns about, scan units; None:
    the camera's target. It is not made the target, as that would shift or turn the picture; the target moves
    along the view axis to its depth, so that zoom and pan hold on to it too. backend: None for the scan's
    default, which also stands in for one that is not there. params: backend's name -> its `Params`, kept when
    another backend is chosen. goal: what a configuration is chosen for automatically, None where the user
    says which. configuration: chosen for the goal, None until one is; it replaces backend and params,
    which stay. unit: what the user calls the scan's unit of length, None where the scan tells or nobody does.
    shown_unit: of displayed lengths, None for the scan's own. front: degrees that the front of the scan
    is turned about what is up. span: the first and the last frame that playing keeps to, None for all. fps:
    frames a second as the user says, None as the scan does. times_by_names: whether the names of the frames
    tell when they are. average: frames that points are means of at most, 0: frames are drawn as scanned.
    measure_averaged: whether measures use the averaged points too. reading: corrections of how Scan4D reads
    the scan, key -> text, as `--read` takes them. bookmarks: cameras to go back to. parts: name -> what a
    tool keeps (see `Part`); of a tool that is not there, what its file said. unread: fields that are not
    known here or could not be read -> what the file said, which is written again; so is what was made anew
    of params and parts, under names such as "parts.measurements".

    Each change is a new value, which shares with the old one what it does not change; the mappings are never
    changed in place.
    """

    camera: Camera | None = None
    pivot: Vector | None = None
    look: Look = field(default_factory=Look)
    backend: Word | None = None
    params: Annotated[Mapping[str, Any], ReadBy(_read_params)] = field(default_factory=dict)
    goal: KeptGoal = None
    configuration: Annotated[Configuration | None, ReadBy(_read_configuration)] = None
    unit: Unit | None = None
    shown_unit: Unit | None = None
    front: float = 0.0
    span: Span | None = None
    fps: FrameRate | None = None
    times_by_names: bool = False
    average: AverageFrames = 0
    measure_averaged: bool = False
    reading: CorrectedTexts = field(default_factory=dict)
    bookmarks: tuple[Bookmark, ...] = ()
    parts: Annotated[Mapping[str, Any], ReadBy(_read_parts)] = field(default_factory=dict)
    unread: Values = field(default_factory=dict)

    @classmethod
    def from_json(cls, data: Any) -> Document:
        """The document of a JSON object; what cannot be read of it stays unread.

        Raises InputError where it is no object, or nested so deeply that it could not be written again.
        """
        if not is_object(data) or not is_object(data.get("unread", {})):
            raise InputError(f"must be an object with named values, not {shortened(data)}", hint=DAMAGED)
        hints = get_type_hints(cls, include_extras=True)
        stated = {name: value for name, value in data.items() if name != "unread"}
        left = dict(unread(data.get("unread", {})))
        values: dict[str, Any] = {}
        for name, value in {**left, **stated}.items():
            try:
                values[name] = structured(hints[name], value)
                if name not in stated:
                    del left[name]
            except (InputError, KeyError):
                left[name] = unread(value)
                if name == "look":
                    values[name] = usable(Look(), value)
        return cls(**values, unread=left)

    @property
    def averaging(self) -> Averaging:
        """How the timeline averages frames."""
        return Averaging(self.average, self.measure_averaged)

    @property
    def made(self) -> tuple[object, ...]:
        """Things that a user made, beside what was only chosen; some of them may not be readable here."""
        return tuple(filter(None, (self.bookmarks, self.parts, self.unread)))

    @property
    def unreadable(self) -> tuple[str, ...]:
        """The names of what a file said and could not be read here."""
        kinds = {"params": _kinds_of_params(), "parts": Part.kinds}
        raw = [
            f"{field}.{name}"
            for field, known in kinds.items()
            for name, value in getattr(self, field).items()
            if _is_unreadable(known.get(name), value)
        ]
        return (*self.unread, *raw)

    def part(self, kind: type[P]) -> P:
        """The part that a tool keeps, its defaults where it has kept nothing yet, or nothing that can be
        read."""
        found = self.parts.get(kind.part_name)
        if not (found is None or isinstance(found, kind)):
            found = _read_or_raw(kind, found)
        return found if isinstance(found, kind) else kind()

    def with_part(self, part: Part) -> Document:
        """The document in which a tool keeps this; nothing where that is its defaults."""
        others = {name: other for name, other in self.parts.items() if name != part.part_name}
        parts = others if part == type(part)() else {**others, part.part_name: part}
        return replace(self, parts=parts, unread=self._left("parts", part.part_name, type(part)))

    def drawn_by(self, backend: str | None) -> Document:
        """The document that a backend draws, None for the scan's default, however it was chosen before."""
        return replace(self, backend=backend, goal=None, configuration=None)

    def with_params(self, backend: str, params: Any) -> Document:
        """The document with other parameters of a backend."""
        left = self._left("params", backend, type(params))
        return replace(self, params={**self.params, backend: params}, unread=left)

    def _left(self, field: str, name: str, kind: type) -> Mapping[str, Any]:
        """The values that stay unread once a value by name is another one."""
        former = getattr(self, field).get(name)
        if former is None or not _is_unreadable(kind, former):
            return self.unread
        return {**self.unread, f"{field}.{name}": former}

    def with_up(self, up: str) -> Document:
        """The document of a scan whose up axis is stated; a camera that stands upright along another goes."""
        turned = replace(self, look=replace(self.look, up=up))
        if self.camera is None:
            return turned
        above = np.array(self.camera.up)
        is_upright = above @ up_vector(up) >= _UPRIGHT * np.linalg.norm(above)
        return turned if is_upright else replace(turned, camera=None, pivot=None, front=0.0)

    @property
    def renderer_alone(self) -> Document:
        """The document with nothing but how it is drawn: by which renderer, with which parameters, or by one
        that is chosen for its goal."""
        return Document(backend=self.backend, params=self.params, goal=self.goal)

    def for_another(self, usual: Document, up: str = UP) -> Document:
        """The document that a scan begins with which is opened after this one, in the same look as far as
        that suits any scan. usual: what is drawn with in all scans. up: its up axis."""
        look = replace(self.look.of_any_scan, up=up)
        return replace(usual.renderer_alone, look=look)

    @property
    def _automatic(self) -> Configuration | None:
        """The configuration that was chosen, None where the backend is the user's or the scan's."""
        return None if self.goal is None else self.configuration

    def defaults(self, pose: Pose) -> tuple[str, Any]:
        """The backend that draws this pose, by name, and the parameters that it begins with; the pose's
        default if the chosen backend does not exist or cannot draw it. Found once for a pose."""
        return self._resolved(pose)[0]

    def chosen(self, pose: Pose) -> tuple[str, Any]:
        """The backend that draws this pose, by name, and its parameters. Found once for a pose."""
        return self._resolved(pose)[1]

    def _resolved(self, pose: Pose) -> tuple[tuple[str, Any], tuple[str, Any]]:
        """The results of `defaults` and of `chosen`."""
        if pose.life not in self._known:
            defaults = self._find_defaults(pose)
            self._known[pose.life] = defaults, self._find_chosen(*defaults)
        return self._known[pose.life]

    @cached_property
    def _known(self) -> WeakKeyDictionary[Life, tuple[tuple[str, Any], tuple[str, Any]]]:
        return WeakKeyDictionary()

    def _find_defaults(self, pose: Pose) -> tuple[str, Any]:
        own, automatic = backend_for(pose), self._automatic
        wanted = self.backend if automatic is None else automatic.backend
        is_other = wanted != own[0] and wanted in backends() and backends()[wanted].draws(pose)
        return backend_for(pose, wanted) if is_other else own

    def _find_chosen(self, name: str, defaults: Any) -> tuple[str, Any]:
        if self._automatic is not None:
            return self._automatic.backend, self._automatic.params
        params = self.params.get(name, defaults)
        return name, params if isinstance(params, type(defaults)) else usable(defaults, params)

    def request(self, pose: Pose, layers: Layers = NO_LAYERS) -> Request:
        """The picture to draw of a pose, in other colours where nothing has the number that gives them.

        The camera must be set. layers: over the pose.
        """
        assert self.camera is not None
        name, params = self.chosen(pose)
        return colorable(Request(pose, self.camera, name, params, self.look, layers))
