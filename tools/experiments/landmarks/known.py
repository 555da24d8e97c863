"""Scans without shared topology whose landmarks' paths are known, and in which frames these are hidden."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.landmarks.contact import near_contact
from experiments.landmarks.places import PLACES, path_of, truth_places
from experiments.landmarks.resampled import ResampledDemo, ResampledMesh
from viewer.bench.truth.head_mesh import head_mesh
from viewer.bounds import Bounds
from viewer.camera import Camera
from viewer.mesh.reference import trace, visible
from viewer.mesh.triangles import Mesh
from viewer.scan.demo import DemoSource
from viewer.scan.faces import Faces
from viewer.scan.points import PointCloud
from viewer.scan.range_view import merge
from viewer.scan.sources import FrameSource
from viewer.scan.spacing import typical_spacing
from viewer.scan.times import DEFAULT_FPS, frame_in_words
from viewer.simulate.scanner import Faults, around, measured, rig
from viewer.task import checkpoint

SCANNED = (560, 420)  # pixels of a pod: some 95 000 points a frame of two
_FRAMED = 5  # frames that the pods are placed for
_STEEPEST = 80.0  # degrees of incidence that a pod measures
_GRAIN = 0.02  # standard deviation of a pod's colours, of their values
_AT_SURFACE = 0.1  # mm that a position may lie behind the mesh of the exact surface
_ABSENT = 2.0  # spacings to the nearest point, from which on a position that no pod sees is hidden


class KeptFrames:
    """A source of frames that are in memory. clouds: one a frame. times: (T,) seconds."""

    files: tuple[Path, ...] = ()

    def __init__(self, name: str, clouds: Sequence[PointCloud], times: NDArray[np.float64]) -> None:
        self.name = name
        self.unit = None
        self._clouds = clouds
        self._times = times

    def __len__(self) -> int:
        return len(self._clouds)

    def label(self, index: int) -> str:
        """The name of a frame."""
        return frame_in_words(index)

    def times(self) -> NDArray[np.float64]:
        """(T,) seconds."""
        return self._times

    def load(self, index: int) -> PointCloud:
        """The points of a frame."""
        return self._clouds[index]

    def faces(self, index: int) -> Faces:
        """No faces: they would tell what the frames have in common."""
        return Faces.joined([])


@dataclass(frozen=True, eq=False)
class KnownScan:
    """A scan and the truth about N landmarks in its T frames.

    names: of the landmarks. paths: (T, N, 3), where they are. hidden: (T, N), whether the scan lacks the
    surface there. counted: (T, N), whether it has it, so that a tracker can be held to it; where neither, the
    position is at the edge of what the scan has, or parts of the surface touch. spacing: of its points.
    """

    name: str
    source: KeptFrames
    names: tuple[str, ...]
    paths: NDArray[np.float64]
    hidden: NDArray[np.bool_]
    counted: NDArray[np.bool_]
    spacing: float


def scanned_demo(
    scan: str, noises: Sequence[float], frames: Sequence[int] | None = None, *, pods: int = 2, seed: int = 0
) -> list[KnownScan]:
    """The demo or a variant, by its name, as `scan4d simulate` scans it, once for each noise.

    Its positions are `PLACES`. noises: standard deviations of depth, mm. frames: those that are scanned;
    None: all. Steeper than 80 degrees nothing is measured. A position is hidden where no pod's ray reaches it
    and no point is within two spacings; those that no frame has are left out. Colours have a grain of 2 %.
    """
    demo = DemoSource(scan)
    chosen = list(range(len(demo)) if frames is None else frames)
    times = demo.times()[chosen]
    paths = path_of(truth_places(), times, demo.motion)
    framed = [
        demo.load(chosen[i]).whole_bounds() for i in np.linspace(0, len(chosen) - 1, _FRAMED).astype(int)
    ]
    cameras = rig(Bounds.around(framed), around(pods), aspect=SCANNED[0] / SCANNED[1])
    faults = [[Faults(noise=noise, grazing=_STEEPEST)] * pods for noise in noises]
    clouds: list[list[PointCloud]] = [[] for _ in noises]
    seen = np.zeros(paths.shape[:2], bool)
    for row, (index, time) in enumerate(zip(chosen, times, strict=True)):
        checkpoint(row / len(chosen))
        mesh = head_mesh(float(time), demo.motion)
        pictures = [trace(mesh, camera, SCANNED) for camera in cameras]
        for frames_of, those in zip(clouds, faults, strict=True):
            cloud = merge(measured(pictures, cameras, those, seed=seed, frame=index))
            frames_of.append(with_grain(cloud, np.random.default_rng([seed, index, pods])))
        seen[row] = _seen(mesh, paths[row], cameras)
    return [_had(scan, frames_of, times, paths, seen) for frames_of in clouds]


def with_grain(cloud: PointCloud, chance: np.random.Generator) -> PointCloud:
    """A cloud whose colours have the noise of a camera: 2 % of their values, each channel by itself."""
    assert cloud.colors is not None
    colors = cloud.colors.copy()
    noisy = colors[:, :3] * chance.normal(1.0, _GRAIN, (len(colors), 3))
    colors[:, :3] = np.clip(np.rint(noisy), 0, 255)
    return replace(cloud, colors=colors)


def _had(
    name: str,
    clouds: Sequence[PointCloud],
    times: NDArray[np.float64],
    paths: NDArray[np.float64],
    seen: NDArray[np.bool_],
) -> KnownScan:
    """A scan of the positions that it has in any frame. paths: (T, N, 3) of `PLACES`; seen: (T, N), by a
    ray."""
    spacing = typical_spacing(clouds[0])
    absent = _farther(clouds, paths, _ABSENT * spacing)
    hidden, counted = ~seen & absent, seen & ~absent
    had = np.flatnonzero(counted.any(axis=0))
    return KnownScan(
        name=name,
        source=KeptFrames(name, clouds, times),
        names=tuple(PLACES[number] for number in had),
        paths=paths[:, had],
        hidden=hidden[:, had],
        counted=counted[:, had],
        spacing=spacing,
    )


def resampled_demo(
    scan: str, noise: float, frames: Sequence[int] | None = None, *, behind: float = -np.inf, seed: int = 0
) -> KnownScan:
    """The demo or a variant, sampled anew in each frame from all around, see `ResampledDemo`."""
    source = ResampledDemo(scan, noise, seed, behind)
    chosen = list(range(len(source)) if frames is None else frames)
    times = source.demo.times()[chosen]
    clouds = [source.load(index) for index in chosen]
    rest = truth_places()
    there = rest[:, 2] > behind
    paths = path_of(rest[there], times, source.demo.motion)
    names = tuple(name for name, is_there in zip(PLACES, there, strict=True) if is_there)
    return _all_there(KeptFrames(scan, clouds, times), names, paths, typical_spacing(clouds[0]))


def scattered_demo(scan: str, noise: float, landmarks: int, *, behind: float, seed: int = 0) -> KnownScan:
    """The demo or a variant, sampled anew in each frame, with random places of the first one as landmarks.

    behind: see `ResampledDemo`.
    """
    source = ResampledDemo(scan, noise, seed, behind)
    clouds = [source.load(index) for index in range(len(source))]
    paths = source.paths(0, range(len(source)))
    rows = np.random.default_rng(seed).choice(paths.shape[1], landmarks, replace=False)
    names = tuple(f"point {row}" for row in rows)
    kept = KeptFrames(scan, clouds, source.times())
    return _all_there(kept, names, paths[:, rows], typical_spacing(clouds[0]))


def resampled_mesh(
    source: FrameSource, name: str, landmarks: int = 21, *, noise: float = 0.0, seed: int = 0
) -> KnownScan:
    """A sequence of meshes with the same faces, sampled anew, as many points as it has vertices.

    Its landmarks are positions on faces, far from each other. Not counted is what `near_contact` finds.
    """
    anew = ResampledMesh(source, None, noise, seed)
    meshes, clouds = [], []
    for index in range(len(source)):
        checkpoint(index / len(source))
        meshes.append(anew.mesh(index))
        clouds.append(anew.load(index))
    faces = _apart(meshes[0], landmarks, seed)
    corners = np.array([mesh.points.world()[mesh.faces[faces]] for mesh in meshes])  # (T, N, 3, 3)
    weights = np.random.default_rng(seed).dirichlet((1.0, 1.0, 1.0), landmarks)
    paths = (corners * weights[None, :, :, None]).sum(axis=2)
    spacing = typical_spacing(clouds[0])
    times = np.arange(len(clouds)) / DEFAULT_FPS
    names = tuple(f"place {number + 1}" for number in range(landmarks))
    touching = near_contact(meshes, paths, meshes[0].faces[faces, 0], spacing)
    known = _all_there(KeptFrames(name, clouds, times), names, paths, spacing)
    return KnownScan(name, known.source, names, paths, known.hidden, ~touching, spacing)


def shuffled_mesh(source: FrameSource, name: str, landmarks: int = 20, *, seed: int = 0) -> KnownScan:
    """A sequence of meshes of one topology as bare points, in another order in each frame.

    Its landmarks are random vertices. All frames count, those of contact too.
    """
    paths, clouds, chance = [], [], np.random.default_rng(seed)
    for index in range(len(source)):
        checkpoint(index / len(source))
        points = source.load(index)
        assert isinstance(points, PointCloud), "the formats with faces hold points"
        vertices = points.world()
        if not index:
            rows = chance.choice(len(vertices), landmarks, replace=False)
        paths.append(vertices[rows])
        clouds.append(PointCloud.from_arrays(vertices[chance.permutation(len(vertices))]))
    names = tuple(f"vertex {row}" for row in rows)
    times = np.arange(len(clouds)) / DEFAULT_FPS
    return _all_there(KeptFrames(name, clouds, times), names, np.array(paths), typical_spacing(clouds[0]))


def _all_there(
    source: KeptFrames, names: tuple[str, ...], paths: NDArray[np.float64], spacing: float
) -> KnownScan:
    """A scan that nothing is hidden in."""
    there = np.ones(paths.shape[:2], bool)
    return KnownScan(source.name, source, names, paths, ~there, there, spacing)


def _seen(mesh: Mesh, positions: NDArray[np.float64], cameras: Sequence[Camera]) -> NDArray[np.bool_]:
    """Whether the ray of any of the pods reaches positions (N, 3), (N,)."""
    local = positions - mesh.origin
    return np.any([visible(mesh, local, camera, _AT_SURFACE) for camera in cameras], axis=0)


def _farther(clouds: Sequence[PointCloud], paths: NDArray[np.float64], reach: float) -> NDArray[np.bool_]:
    """Whether no point is within reach of positions (T, N, 3), (T, N)."""
    from scipy.spatial import cKDTree

    nearest = [
        cKDTree(cloud.world()).query(positions)[0] for cloud, positions in zip(clouds, paths, strict=True)
    ]
    return np.array(nearest) > reach


def _apart(mesh: Mesh, count: int, seed: int) -> NDArray[np.intp]:
    """Faces far from each other: each is the farthest from those before, among random ones."""
    areas = np.linalg.norm(mesh.areas(), axis=1)
    some = np.random.default_rng(seed).choice(len(areas), 40 * count, p=areas / areas.sum())
    middles = mesh.points.world()[mesh.faces[some]].mean(axis=1)
    chosen, nearest = [0], np.linalg.norm(middles - middles[0], axis=1)
    while len(chosen) < count:
        chosen.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, np.linalg.norm(middles - middles[chosen[-1]], axis=1))
    return some[chosen]
