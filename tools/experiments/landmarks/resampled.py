"""Sequences whose frames are sampled anew, each at other positions on the subject: no two share a point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewer.bench.scenes.samples import on_mesh
from viewer.bench.scenes.subjects import smooth
from viewer.mesh.triangles import Mesh
from viewer.scan.demo import DemoSource, colors, head
from viewer.scan.demo.asset import rest_points
from viewer.scan.demo.motion import move, turn
from viewer.scan.demo.solids import Rows, Solid, projected
from viewer.scan.faces import Faces
from viewer.scan.points import PointCloud
from viewer.scan.sources import FrameSource

_KEPT = 0.9  # of the points: which, is chance, so that no number says which point it is
_STRAY = 1.0  # how far points are strewn from those that are shipped, in spacings
_NEWTON_STEPS = 2  # that bring them back to the surface, to 1e-4 mm


class _Anew:
    """A source of frames that are another source's subject, and have no points in common.

    noise: standard deviation of points along the normal, scan units. seed: of all chance.
    """

    files: tuple[Path, ...] = ()

    def __init__(self, source: FrameSource, noise: float, seed: int) -> None:
        self.name = f"{source.name}, sampled anew"
        self.unit = source.unit
        self.noise = noise
        self._source = source
        self._seed = seed

    def __len__(self) -> int:
        return len(self._source)

    def label(self, index: int) -> str:
        """The name of a frame."""
        return self._source.label(index)

    def times(self) -> NDArray[np.float64] | None:
        """(T,) seconds."""
        return self._source.times()

    def faces(self, index: int) -> Faces:
        """No faces: they would tell what the frames have in common."""
        return Faces.joined([])

    def _chance(self, index: int) -> np.random.Generator:
        return np.random.default_rng([self._seed, index])

    def _off(self, normals: NDArray, chance: np.random.Generator) -> NDArray[np.float64]:
        """How far noise moves points of unit normals (N, 3)."""
        return normals * chance.normal(0.0, self.noise, (len(normals), 1))


class ResampledDemo(_Anew):
    """The demo or a variant of it by its name, about 78 000 points a frame, with colours and without normals.

    Each frame has positions of its own on the exact surface, and a grain of 1 % in their colours. behind: mm;
    what is farther back at rest is left out, which saves time; half of the points are before 30. count: of
    the points before anything is left out, None: 78 000. frames: how many, as the motion repeats; None: of
    one period.
    """

    def __init__(
        self,
        scan: str,
        noise: float = 0.0,
        seed: int = 0,
        behind: float = -np.inf,
        *,
        count: int | None = None,
        frames: int | None = None,
    ) -> None:
        demo = DemoSource(scan)
        super().__init__(demo, noise, seed)
        self.demo = demo
        self._behind, self._count = behind, count
        self._frames = len(demo) if frames is None else frames

    def __len__(self) -> int:
        return self._frames

    def times(self) -> NDArray[np.float64]:
        """(T,) seconds."""
        return np.arange(self._frames) / self.demo.fps

    def load(self, index: int) -> PointCloud:
        """Sample one frame."""
        chance = self._chance(index)
        rest_positions, normals, count = self._rest(chance)
        albedo = colors.albedo(rest_positions, normals, count)
        positions, turned = self._moved(rest_positions, normals, count, index)
        return PointCloud.from_arrays(
            positions + self._off(turned, chance),
            colors=np.rint(255 * albedo).astype(np.uint8),
            origin=np.zeros(3),
            precise=False,
        )

    def paths(self, index: int, frames: Sequence[int]) -> NDArray[np.float64]:
        """Where the points of a frame are in some frames, without noise, (F, N, 3)."""
        rest_positions, normals, count = self._rest(self._chance(index))
        return np.array([self._moved(rest_positions, normals, count, frame)[0] for frame in frames])

    def _rest(self, chance: np.random.Generator) -> tuple[Rows, Rows, int]:
        """The positions (3, N) and normals of the points of a frame at rest, and how many are of the skin."""
        rest = rest_points()
        if self._count is None:
            chosen = np.flatnonzero(chance.random(len(rest.radii)) < _KEPT)
        else:  # some more than once: each time it is strewn elsewhere
            chosen = np.sort(chance.integers(len(rest.radii), size=self._count))
        chosen = chosen[rest.positions[2, chosen] > self._behind]
        skin = chosen < rest.skin
        parts = [
            _strewn(solid, chosen[rows], chance) for solid, rows in ((head.skin, skin), (head.eyes, ~skin))
        ]
        rest_positions, normals = (np.concatenate(rows, axis=1) for rows in zip(*parts, strict=True))
        return rest_positions, normals, int(skin.sum())

    def _moved(
        self, rest: Rows, normals: Rows, count: int, index: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The positions and normals, both (N, 3), in a frame, of those at rest; `count` are of the skin."""
        time, motion = float(self.times()[index]), self.demo.motion
        moved, turned, _ = move(rest[:, :count], normals[:, :count], time, motion)
        eyes, eye_normals = turn(rest[:, count:], normals[:, count:], time, motion)
        return (
            np.concatenate([moved, eyes], axis=1).T,
            np.concatenate([turned, eye_normals], axis=1).T,
        )


class ResampledMesh(_Anew):
    """A sequence of meshes of the same faces, so many points a frame spread over the faces by area.

    count: of the points; None: as many as vertices. They have colours where the meshes have them, no normals.
    """

    def __init__(
        self, source: FrameSource, count: int | None = None, noise: float = 0.0, seed: int = 0
    ) -> None:
        super().__init__(source, noise, seed)
        self._count = count

    def mesh(self, index: int) -> Mesh:
        """The mesh of a frame. Raises InputError where it is none."""
        points = self._source.load(index)
        assert isinstance(points, PointCloud), "the formats with faces hold points"
        return smooth(Mesh(points, self._source.faces(index).triangles()))

    def load(self, index: int) -> PointCloud:
        """Sample one frame."""
        mesh, chance = self.mesh(index), self._chance(index)
        cloud = on_mesh(mesh, self._count or len(mesh.points), int(chance.integers(1 << 31)))
        assert cloud.normals is not None
        moved = cloud.displaced(self._off(cloud.normals, chance))
        return replace(moved, normals=None, radii=None, topology=None)


def _strewn(solid: Solid, chosen: NDArray[np.intp], chance: np.random.Generator) -> tuple[Rows, Rows]:
    """Places (3, N) and normals (3, N) of a solid, each at random around one of the shipped points."""
    rest = rest_points()
    if not len(chosen):
        return np.empty((3, 0)), np.empty((3, 0))
    near = rest.positions[:, chosen]
    away = chance.uniform(-_STRAY, _STRAY, near.shape).astype(np.float32) * rest.radii[chosen]
    normals = rest.normals[:, chosen]
    away -= normals * (normals * away).sum(axis=0)
    return projected(solid, near + away, _NEWTON_STEPS)
