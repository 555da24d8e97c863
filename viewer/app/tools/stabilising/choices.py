"""What the user chooses about stabilising, which is the scan's."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ....analysis.motion.region import RigidRegion
from ....document.part import Part
from ....params import param
from .._painting import Sphere, painted_region

FOUND, PAINTED, LANDMARKS = "found", "painted", "landmarks"
REGION_WORDS = {FOUND: "Found by Scan4D", PAINTED: "Painted", LANDMARKS: "Around landmarks"}


@dataclass(frozen=True)
class Stabilising(Part, name="stabilising"):
    """is_shown: whether the scan is shown stabilised, not as recorded. reference: the frame that motions
    begin in. region: how the region that counts as rigid is chosen. spheres: that were painted in the
    reference frame, see `RigidRegion`. landmarks: names, each the middle of a sphere of `radius`, scan units.
    """

    is_shown: bool = False
    reference: int = 0
    region: str = FOUND
    spheres: tuple[Sphere, ...] = ()
    landmarks: tuple[str, ...] = ()
    radius: float = 0.0

    @property
    def words(self) -> str:
        """The region in words, without names of landmarks."""
        painted = sum(sphere[3] > 0 for sphere in self.spheres)
        count = {PAINTED: painted, LANDMARKS: len(self.landmarks)}.get(self.region, 0)
        what = {PAINTED: "painted spheres", LANDMARKS: f"landmarks, {self.radius:g} around each"}
        return f"{count} {what[self.region]}" if self.region in what else "found by Scan4D"

    @property
    def is_empty(self) -> bool:
        """Whether the region has yet to be chosen."""
        return (self.region == PAINTED and not self.spheres) or (
            self.region == LANDMARKS and not (self.landmarks and self.radius > 0)
        )

    def changed(self, **changes: Any) -> Stabilising:
        """The choices with some others."""
        return replace(self, **changes)

    @property
    def of_motions(self) -> Stabilising:
        """The choices that motions depend on; others have their defaults."""
        chosen = Stabilising(reference=self.reference, region=self.region)
        if self.region == PAINTED:
            return replace(chosen, spheres=self.spheres)
        if self.region == LANDMARKS:
            return replace(chosen, landmarks=self.landmarks, radius=self.radius)
        return chosen

    @property
    def rigid(self) -> RigidRegion | None:
        """The region that the user has chosen; None: Scan4D finds it."""
        if self.region == PAINTED:
            return painted_region(self.spheres)
        if self.region == LANDMARKS:
            return RigidRegion(np.empty((0, 4)), np.empty(0, np.int64), self.landmarks, self.radius)
        return None


@dataclass(frozen=True)
class Settings:
    """Choices that come back at the next start, whatever the scan."""

    rotations: bool = param(
        True, "Plot rotations about the axes of the subject", title="Rotations", basic=True
    )
    translations: bool = param(
        True, "Plot how far the middle of the region moves along the axes", title="Translations", basic=True
    )
    residual: bool = param(
        True, "Plot how far the region is off in each frame (root mean square)", title="Residual", basic=True
    )
