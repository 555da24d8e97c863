"""What may be set of tracking."""

from __future__ import annotations

from dataclasses import dataclass

from ...errors import InputError


@dataclass(frozen=True)
class TrackingSettings:
    """How landmarks are tracked where a scan does not tell which points are the same.

    Radii are shares of the scan's size, and at least so many spacings of its points: far, of the region
    that finds a landmark again; wide, of the patch that is followed; fine, of the one that follows what
    bends. bound: how far the ways there and back, or from either side, may be apart, scan units; None: two
    and a half spacings. least_kept: the share of the wide patch that has to be matched. Raises InputError
    for what is no number above 0.
    """

    far: tuple[float, float] = (0.3, 20.0)
    wide: tuple[float, float] = (0.1, 9.0)
    fine: tuple[float, float] = (0.05, 5.0)
    bound: float | None = None
    least_kept: float = 0.4

    def __post_init__(self) -> None:
        numbers = (
            *self.far,
            *self.wide,
            *self.fine,
            self.least_kept,
            1.0 if self.bound is None else self.bound,
        )
        if not all(0 < number < float("inf") for number in numbers):
            raise InputError("the radii and limits of tracking must be above 0")

    def bound_at(self, spacing: float) -> float:
        """The bound of a scan with this spacing, scan units."""
        return 2.5 * spacing if self.bound is None else self.bound
