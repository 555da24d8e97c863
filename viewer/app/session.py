"""What the user has chosen, as plain data."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from ..camera import Camera
from ..errors import InputError
from ..files import absolute
from ..frame import Request, choose
from ..geometry import Vector
from ..look import Look, drawable
from ..scan.open import DEMO
from ..scan.pose import Pose
from .playing.player import Pace


@dataclass(frozen=True)
class Bookmark:
    """A camera by a name that the user gave it."""

    name: str
    camera: Camera

    @classmethod
    def from_json(cls, data: Any) -> Bookmark:
        """The bookmark of a JSON object as `to_json` gives it; raises InputError."""
        if not isinstance(data, dict) or not isinstance(data.get("name"), str) or "camera" not in data:
            raise InputError("a bookmark is a JSON object with name and camera")
        return cls(data["name"], Camera.from_json(data["camera"]))

    def to_json(self) -> dict[str, Any]:
        """A JSON object."""
        return {"name": self.name, "camera": self.camera.to_json()}


@dataclass(frozen=True)
class Left:
    """How a scan was left: the fields of `Session` that belong to one scan and come back with it."""

    index: int = 0
    camera: Camera | None = None
    unit: str | None = None
    bookmarks: tuple[Bookmark, ...] = ()


def known_as(scan: str) -> str:
    """The name that a scan is remembered by: its path from the root, wherever Scan4D was started."""
    return scan if scan == DEMO else absolute(scan)


@dataclass
class Session:
    """The choices of the user.

    scan: as the user named it. index: the frame. camera: None until a first pose is there to
    fit it to. pivot: what orbiting turns about, scan units; None: the camera's target.
    backend: None for the scan's default. params: backend name -> its `Params`, kept when
    another backend is chosen. pace: how the scan plays.
    unit: what the user calls the scan's unit of length, None where the scan tells or nobody does.
    bookmarks: of the scan.
    places: scan, as `known_as` has it -> how it was left; the one left last at the end.
    """

    scan: str
    index: int = 0
    camera: Camera | None = None
    pivot: Vector | None = None
    backend: str | None = None
    params: dict[str, Any] = field(default_factory=dict)
    look: Look = field(default_factory=Look)
    pace: Pace = field(default_factory=Pace)
    unit: str | None = None
    bookmarks: tuple[Bookmark, ...] = ()
    places: dict[str, Left] = field(default_factory=dict)

    def chosen(self, pose: Pose) -> tuple[str, Any]:
        """The backend that draws this pose, by name, and its parameters."""
        name, defaults = choose(pose.cloud, self.backend)
        return name, self.params.setdefault(name, defaults)

    def request(self, pose: Pose) -> Request:
        """The picture to draw of a pose, in other colours where it lacks the scalar that gives them.

        The camera must be set.
        """
        assert self.camera is not None
        name, params = self.chosen(pose)
        return Request(pose, self.camera, name, params, drawable(self.look, pose.cloud.scalars))

    def turn_to(self, scan: str) -> None:
        """Go to another scan, where it was left."""
        self.leave()
        self.scan, self.pivot = scan, None
        self.find_again()

    def leave(self) -> None:
        """Note how the scan is now, as the one left last."""
        name = known_as(self.scan)
        self.places.pop(name, None)
        self.places[name] = Left(**{of.name: getattr(self, of.name) for of in fields(Left)})

    def find_again(self) -> None:
        """Take up the scan as it was left."""
        left = self.places.get(known_as(self.scan), Left())
        for of in fields(Left):
            setattr(self, of.name, getattr(left, of.name))
