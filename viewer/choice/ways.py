"""Ways of drawing a scan, from which one is chosen: what backends offer, at several resolutions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from ..backends import backend, backends
from ..scan.pose import Pose

SCALES = (1.0, 0.71, 0.5, 0.35)  # of width and height


@dataclass(frozen=True)
class DrawingWay:
    """A backend, values in place of its defaults, and the scale of width and height that it draws at."""

    backend: str
    values: Mapping[str, object] = field(default_factory=dict)
    scale: float = 1.0

    @property
    def key(self) -> str:
        """Name in models, which hold at every scale: 'surfels passes=one'."""
        return " ".join([self.backend, *(f"{name}={value}" for name, value in sorted(self.values.items()))])

    @property
    def params(self) -> Any:
        """The backend's parameters."""
        return backend(self.backend).params(self.values)


def ways(pose: Pose, scales: tuple[float, ...] = SCALES) -> Iterator[DrawingWay]:
    """Every way of drawing a pose for which nothing has to be prepared."""
    for name, one in backends().items():
        for values in one.offers(pose):
            for scale in scales:
                yield DrawingWay(name, values, scale)
