"""What the user has chosen, as plain data."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..camera import Camera
from ..frame import Request, choose
from ..geometry import Vector
from ..look import Look
from ..scan.pose import Pose
from .player import Pace


@dataclass
class Session:
    """The choices of the user.

    scan: as the user named it. index: the frame. camera: None until a first pose is there to
    fit it to. pivot: what orbiting turns about, scan units; None: the camera's target.
    backend: None for the scan's default. params: backend name -> its `Params`, kept when
    another backend is chosen. pace: how the scan plays. places: scan -> (index, camera) where it was left.
    """

    scan: str
    index: int = 0
    camera: Camera | None = None
    pivot: Vector | None = None
    backend: str | None = None
    params: dict[str, Any] = field(default_factory=dict)
    look: Look = field(default_factory=Look)
    pace: Pace = field(default_factory=Pace)
    places: dict[str, tuple[int, Camera | None]] = field(default_factory=dict)

    def chosen(self, pose: Pose) -> tuple[str, Any]:
        """The backend that draws this pose, by name, and its parameters."""
        name, defaults = choose(pose.cloud, self.backend)
        return name, self.params.setdefault(name, defaults)

    def request(self, pose: Pose) -> Request:
        """The picture to draw of a pose. The camera must be set."""
        assert self.camera is not None
        name, params = self.chosen(pose)
        return Request(pose, self.camera, name, params, self.look)

    def turn_to(self, scan: str) -> None:
        """Go to another scan, where it was left."""
        self.places[self.scan] = self.index, self.camera
        self.scan, self.pivot = scan, None
        self.index, self.camera = self.places.get(scan, (0, None))
