"""Configurations that may draw a scan: what backends offer, at several resolutions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from ..backends import backend, backends
from ..scan.pose import Pose

_SHARE = "share"  # the parameter that is the level of detail
SCALES = (1.0, 0.71, 0.5, 0.35)  # of width and height


@dataclass(frozen=True)
class Configuration:
    """A backend, values in place of its defaults, and the scale of width and height that it draws at."""

    backend: str
    values: Mapping[str, object] = field(default_factory=dict)
    scale: float = 1.0

    @property
    def key(self) -> str:
        """Name in models, which hold at every scale and level of detail: 'surfels passes=two'."""
        values = [f"{name}={value}" for name, value in sorted(self.values.items()) if name != _SHARE]
        return " ".join([self.backend, *values])

    @property
    def share(self) -> float:
        """The share of the points that it draws."""
        return float(self.values.get(_SHARE, 1.0))  # type: ignore[arg-type]

    @property
    def params(self) -> Any:
        """The backend's parameters."""
        return backend(self.backend).params(self.values)


def configurations(pose: Pose, scales: tuple[float, ...] = SCALES) -> Iterator[Configuration]:
    """Every configuration for a pose for which nothing has to be prepared."""
    for name, one in backends().items():
        for values in one.offers(pose):
            for scale in scales:
                yield Configuration(name, values, scale)
