"""The hold of a landmark on a body: it and the patches around it go along, and bend as the body does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .body import BodyPose, DeformableBody, Grip
from .registration import Placement, placed_points

if TYPE_CHECKING:
    from .patch_kernels import SurfacePatch

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Hold:
    """A landmark that a body carries from a frame on.

    begun: its placement in that frame, from where it was set. pose: of the body there.
    """

    body: DeformableBody
    begun: Placement
    grip: Grip
    pose: BodyPose

    @classmethod
    def at(cls, body: DeformableBody, begun: Placement) -> Hold:
        """The hold on a body as it is now, of a landmark as it is placed now."""
        return cls(body, begun, body.gripped(begun.position), body.pose)

    def carried(self) -> Placement:
        """The placement to which the body has carried the landmark."""
        position, turn = self.body.carried(self.grip)
        return Placement(position, turn @ self.begun.turn)

    def slip(self) -> float:
        """How far the body there has been from where it was after a step to a frame and back, scan units."""
        return float(self.grip.weights @ self.body.slips[self.grip.nodes])

    def gripped(self, patch: SurfacePatch) -> Grip:
        """The grip of the points of a patch of the key's frame, where they were when the hold began."""
        return self.body.gripped(placed_points(patch, self.begun))

    def bent(self, patch: SurfacePatch, grip: Grip) -> SurfacePatch:
        """A patch of the key's frame, gripped then, as the body bends it now."""
        carried = self.carried()
        positions, turns = self.body.carried(grip)
        axes = patch.axes @ carried.turn.T
        return _moved(
            patch, (positions - carried.position) @ axes.T, axes @ turns @ self.begun.turn @ patch.axes.T
        )

    def unbent(self, patch: SurfacePatch, turn: Float) -> SurfacePatch:
        """A patch of the frame that the body is in now, as it was in the key's frame.

        turn: (3, 3), from the key's frame to this one.
        """
        still = Placement(patch.center)
        grip = self.body.gripped(placed_points(patch, still))
        (positions, turns), (middle, _) = (
            self.body.carried(each, self.pose) for each in (grip, self.body.gripped(patch.center))
        )
        axes = patch.axes @ turn @ self.begun.turn.T
        return _moved(patch, (positions - middle) @ axes.T, axes @ turns @ patch.axes.T)


def _moved(patch: SurfacePatch, local: Float, turns: Float) -> SurfacePatch:
    """A patch with its points at other positions (n, 3) along its axes, and turned, (n, 3, 3)."""
    return patch._replace(
        local=np.ascontiguousarray(local),
        normals=np.einsum("nij,nj->ni", turns, patch.normals),
        gradients=np.einsum("nij,ncj->nci", turns, patch.gradients),
    )
