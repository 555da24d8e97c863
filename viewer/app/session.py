"""What the window shows, as plain data: enough to draw the same picture again."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

from ..camera import Camera
from ..frame import Request, choose
from ..look import Look
from ..scan.pose import Pose

FORMAT = 1  # of the JSON below


@dataclass
class Session:
    """The choices of the user.

    scan: as the user named it. index: the frame. camera: None until a first pose is there to
    fit it to. backend: None for the scan's default. params: backend name -> its `Params`,
    kept when another backend is chosen. places: scan -> (index, camera) where it was left.
    """

    scan: str
    index: int = 0
    camera: Camera | None = None
    backend: str | None = None
    params: dict[str, Any] = field(default_factory=dict)
    look: Look = field(default_factory=Look)
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
        self.scan = scan
        self.index, self.camera = self.places.get(scan, (0, None))


def describe(request: Request, scan: str, size: tuple[int, int]) -> dict[str, Any]:
    """The JSON object of a picture: all that is needed to draw it again. size: pixels."""
    return {
        "format": FORMAT,
        "scan": scan,
        "pose": request.pose.index,
        "time": request.pose.time,
        "size": list(size),
        "camera": request.camera.to_json(),
        "backend": request.backend,
        "params": asdict(request.params),
        "look": asdict(request.look),
    }
