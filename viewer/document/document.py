"""The document of a scan: what belongs to it and a user would be sorry to lose, as one frozen value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from ..camera import Camera
from ..frame import Request, choose
from ..geometry import Vector
from ..look import Look, drawable
from ..scan.pose import Pose
from .part import Part

P = TypeVar("P", bound=Part)


@dataclass(frozen=True)
class Bookmark:
    """A camera by a name that the user gave it."""

    name: str
    camera: Camera


@dataclass(frozen=True)
class Document:
    """What a user has chosen and made for a scan.

    camera: None until a first pose is there to fit it to. pivot: what orbiting turns about, scan units;
    None: the camera's target. backend: None for the scan's default. params: backend's name -> its `Params`,
    kept when another backend is chosen. unit: what the user calls the scan's unit of length, None where the
    scan tells or nobody does. bookmarks: cameras to go back to. parts: name -> what a tool keeps (see
    `Part`); of a tool that is not there, what its file said.

    Each change is a new value, which shares with the old one what it does not change; the mappings are never
    changed in place.
    """

    camera: Camera | None = None
    pivot: Vector | None = None
    look: Look = field(default_factory=Look)
    backend: str | None = None
    params: Mapping[str, Any] = field(default_factory=dict)
    unit: str | None = None
    bookmarks: tuple[Bookmark, ...] = ()
    parts: Mapping[str, Any] = field(default_factory=dict)

    def part(self, kind: type[P]) -> P:
        """What a tool keeps, its defaults where it has kept nothing yet."""
        found = self.parts.get(kind.part_name)
        return found if isinstance(found, kind) else kind()

    def with_part(self, part: Part) -> Document:
        """The document in which a tool keeps this; nothing where that is its defaults."""
        others = {name: other for name, other in self.parts.items() if name != part.part_name}
        return replace(self, parts=others if part == type(part)() else {**others, part.part_name: part})

    def with_params(self, backend: str, params: Any) -> Document:
        """The document with other parameters of a backend."""
        return replace(self, params={**self.params, backend: params})

    def for_another(self) -> Document:
        """The document that a scan begins with which is opened after this one: drawn alike, all else anew."""
        return Document(look=self.look, backend=self.backend, params=self.params)

    def defaults(self, pose: Pose) -> tuple[str, Any]:
        """The backend that draws this pose, by name, and the parameters that it begins with."""
        name, defaults = choose(pose)
        return (name, defaults) if self.backend in (None, name) else choose(pose, self.backend)

    def chosen(self, pose: Pose) -> tuple[str, Any]:
        """The backend that draws this pose, by name, and its parameters."""
        name, defaults = self.defaults(pose)
        return name, self.params.get(name, defaults)

    def request(self, pose: Pose) -> Request:
        """The picture to draw of a pose, in other colours where it lacks the scalar that gives them.

        The camera must be set.
        """
        assert self.camera is not None
        name, params = self.chosen(pose)
        return Request(pose, self.camera, name, params, drawable(self.look, pose.cloud.scalars))
