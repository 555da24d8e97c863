"""Candidates of small scans on the GPU, and what the plain twins read of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.gpu.constants import NOTHING
from viewer.gpu.pose import GpuPose
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.view import View
from viewer.visibility.candidates import Candidates
from viewer.visibility.sectors import Sectors

STEPS = 3


@dataclass(frozen=True, eq=False)
class Scene:
    """A begun picture, and the candidates of its eye."""

    surface: Surface
    pose: GpuPose
    candidates: Candidates

    @classmethod
    def of(
        cls,
        renderer: Renderer,
        cloud: PointCloud,
        camera: Camera,
        edge: int,
        size: tuple[int, int] = (80, 60),
    ) -> Scene:
        surface, pose = Surface(renderer.gpu, size), GpuPose(renderer.gpu, Pose(0, 0.0, "", cloud))
        bounds, eye = cloud.bounds(), np.array(camera.eye)
        surface.start(pose, View.of(camera, size, pose.origin, bounds))
        sectors = Sectors.around(bounds.center, 1.01 * bounds.radius, eye, pose.origin).divided(edge)
        candidates = Candidates(renderer.gpu, sectors, len(cloud))
        candidates.find(pose.array("positions"), sectors.weighted(1e4), STEPS)
        return cls(surface, pose, candidates)

    @property
    def rows(self) -> NDArray[np.uint32]:
        """The row of each sector, NOTHING where none."""
        buffer = self.candidates.rows.buffer
        return np.frombuffer(buffer.read(), np.uint32, self.candidates.sectors.count)

    @property
    def positions(self) -> NDArray[np.float64]:
        """(N, 3), relative to the pose's origin."""
        return self.pose.cloud.positions.astype(np.float64)

    def beside(self, sectors: NDArray[np.uint32], step: tuple[int, int]) -> NDArray[np.uint32]:
        """The rows of the sectors one step beside others."""
        neighbors = self.candidates.sectors.neighbors(sectors, step)
        there = neighbors != NOTHING
        return np.where(there, self.rows[np.where(there, neighbors, 0)], NOTHING).astype(np.uint32)

    def faces(self) -> set[tuple[int, ...]]:
        """Corners, ascending, of the triangles between candidates: of each 2 x 2 sectors those between three
        that differ; of the two ways to divide four the one along the shorter diagonal."""
        every = np.arange(self.candidates.sectors.count, dtype=np.uint32)
        found: set[tuple[int, ...]] = set()
        for x, y in ((1, 1), (-1, 1), (1, -1), (-1, -1)):
            quads = zip(
                self.rows, self.beside(every, (x, 0)), self.beside(every, (0, y)), self.beside(every, (x, y)),
                strict=True,
            )  # fmt: skip
            for a, b, c, d in set(quads):
                corners = {a, b, c, d} - {NOTHING}
                if a == NOTHING or len(corners) < 3:
                    continue
                if len(corners) == 3:
                    found.add(tuple(sorted(int(row) for row in corners)))
                    continue
                split = self._apart(b, c) < self._apart(a, d)
                for triangle in ((a, b, c), (b, c, d)) if split else ((a, b, d), (a, c, d)):
                    found.add(tuple(sorted(int(row) for row in triangle)))
        return found

    def _apart(self, a: int, b: int) -> float:
        return float(np.linalg.norm((self.positions[a] - self.positions[b]).astype(np.float32)))
