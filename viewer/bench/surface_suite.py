"""The suite "surface": how well renderers show the surface of points that are noisy, uneven or few.

Each condition turns the surface of a scene into a scan. The suite compares pictures of the scan with rays
that meet the true surface, in units of the spacing of the points around (`PictureTruth`). `goals` lists the
bounds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..analysis.pick import before_gap, pick
from ..analysis.words import SURE
from ..backends import backend
from ..camera import Camera
from ..drawing.frame import render_frame
from ..drawing.renderer import Renderer
from ..drawing.request import Request
from ..look import Look
from ..mesh.reference import Reference, first_hits, trace
from ..picture.surface import Surface
from ..scan.averaging import Averaging, averaged
from ..scan.estimate import cloud_normals
from ..scan.points import PointCloud
from ..scan.pose import Pose
from . import metrics
from .goals import ESTIMATED, STATIC, STATIC_AVERAGE
from .metrics import Errors
from .scenes import samples
from .scenes.defects import Change, density_ramp, fewer, noisy, without_normals
from .scenes.subjects import Moment, Subject
from .scenes.viewpoints import viewpoints

MODELS = ("igea", "armadillo", "horse")
QUICK_MODELS = ("igea",)
_LOOK = Look(light="head")  # the same for all: what "auto" takes depends on the scan
_FLATTEST = 0.5  # cosine of incidence from which on distances along the normal tell of the surface
_NEIGHBOR = 6  # the ring of nearest neighbours, as `scan.spacing` has it
_STEEPEST = 0.1  # the least cosine that counts for how far depths of one surface lie apart
_OFF = 3.0  # spacings from the truth to a pick that is wrong
_FRAMES = 4  # of a static scan
_AROUND = 240  # points around the ring of the stretched grid
_STRETCH = 5.0
_FRONT = 25.0  # degrees to each side from which a face is seen

Sampling = Callable[[Moment, int, np.random.Generator], PointCloud]


class Amount(NamedTuple):
    """How much is measured. points: points of a scan before any are removed. views: pictures of each scan.
    picks: of each picture. size: (width, height), pixels."""

    points: int = 40_000
    views: int = 2
    picks: int = 100
    size: tuple[int, int] = (720, 480)


QUICK = Amount(points=10_000, views=1, picks=30, size=(360, 240))


@dataclass(frozen=True)
class ScanCondition:
    """A kind of scan. sampling: the points of a moment's surface. changes: what then happens to the points.
    scene: the scene that the condition belongs to; empty: each of the models. noise: standard deviation in
    spacings, along the normals. frames: how many pictures of scans with different noise. average: scans that
    the points of each picture are means of, other ones for each picture; 0: none. front: whether pictures
    show the front alone."""

    name: str
    sampling: Sampling
    changes: tuple[Change, ...] = ()
    scene: str = ""
    noise: float = 0.0
    frames: int = 1
    average: int = 0
    front: bool = False

    def scan(self, moment: Moment, count: int, seed: Sequence[int]) -> tuple[PointCloud, PointCloud]:
        """The scan of a moment, and the same points with their true normals."""
        cloud = self.sampling(moment, count, np.random.default_rng(seed[0]))
        for number, change in enumerate(self.changes):
            if change is not without_normals:
                cloud = change(cloud, np.random.default_rng((seed[0], number)))
        if self.noise:
            cloud = noisy(self.noise)(cloud, np.random.default_rng(tuple(seed)))
        is_bare = without_normals in self.changes
        return without_normals(cloud, np.random.default_rng(0)) if is_bare else cloud, cloud


def _even(moment: Moment, count: int, rng: np.random.Generator) -> PointCloud:
    return replace(samples.on_mesh(moment.mesh, count, int(rng.integers(1 << 30))), radii=None)


def _blue(moment: Moment, count: int, rng: np.random.Generator) -> PointCloud:
    return samples.blue_noise(moment.mesh, count, rng)


def _random(moment: Moment, count: int, rng: np.random.Generator) -> PointCloud:
    return samples.at_random(moment.mesh, count, rng)


def _grid(moment: Moment, count: int, _: np.random.Generator) -> PointCloud:
    around = round(_AROUND * (count / Amount().points) ** 0.5)
    arrays = samples.torus_grid(around, _STRETCH)
    return PointCloud.from_arrays(arrays["positions"], normals=arrays["normals"], origin=moment.truth.origin)


def _own(moment: Moment, count: int, _: np.random.Generator) -> PointCloud:
    return moment.pose.cloud


_BARE = (without_normals,)
NOISES = (0.1, 0.3, 0.6)
CONDITIONS = (
    ScanCondition("even", _even, _BARE),
    ScanCondition("even, with normals", _even),
    ScanCondition("blue noise", _blue, _BARE),
    ScanCondition("random", _random, _BARE),
    ScanCondition("ramp 1:10", _blue, (density_ramp(0.1), *_BARE)),
    ScanCondition("ramp 1:100", _blue, (density_ramp(0.01), *_BARE)),
    ScanCondition("thinned 1:10", _blue, (fewer(0.1), *_BARE)),
    ScanCondition("thinned 1:10, with normals", _blue, (fewer(0.1),)),
    *(ScanCondition(f"noise {noise}", _blue, _BARE, noise=noise) for noise in NOISES),
    ScanCondition("noise 0.3, with normals", _blue, noise=0.3),
    ScanCondition(STATIC, _blue, _BARE, noise=0.1, frames=_FRAMES),
    ScanCondition(STATIC_AVERAGE, _blue, _BARE, noise=0.1, frames=_FRAMES, average=8),
    ScanCondition("stretched grid", _grid, _BARE, scene="torus"),
    ScanCondition("stretched grid, with normals", _grid, scene="torus"),
    ScanCondition("two sheets", _own, _BARE, scene="sheets"),
    ScanCondition("thin legs", _own, _BARE, scene="horse-gallop"),
    ScanCondition("moving body", _own, _BARE, scene="crane"),
    ScanCondition("face", _own, scene="demo", front=True),
)


def steps(names: Sequence[str], models: Sequence[str]) -> int:
    """How many rows the suite has."""
    return sum(
        len(scenes_of(condition, models)) * (len(names) + (without_normals in condition.changes))
        for condition in CONDITIONS
    )


def scenes_of(condition: ScanCondition, models: Sequence[str]) -> Sequence[str]:
    """Names of the scenes of a condition."""
    return (condition.scene,) if condition.scene else models


def measure_condition(
    renderer: Renderer,
    subject: Subject,
    condition: ScanCondition,
    names: Sequence[str],
    amount: Amount,
    seed: int = 0,
) -> Iterator[tuple[str, Errors]]:
    """The errors of each backend, means over the views, and of `ESTIMATED` where the scan is bare. names: of
    backends, drawn with their default parameters. Raises InputError for a scene without such views."""
    moment = subject.moment(0)
    poses = [_pose(condition, moment, amount.points, seed, frame) for frame in range(condition.frames)]
    true = condition.scan(moment, amount.points, (seed, 0))[1]
    cameras = cameras_for(moment, subject.up, condition, amount, seed)
    truths = [PictureTruth.of(moment, camera, amount.size, poses[0].cloud) for camera in cameras]
    if poses[0].cloud.normals is None:
        yield ESTIMATED, estimated_normals(poses[0].cloud, true)
    for name in names:
        by_view: dict[str, list[float]] = {}
        for number, truth in enumerate(truths):
            for error, value in _errors(renderer, name, poses, truth, amount, (seed, number)).items():
                by_view.setdefault(error, []).append(value)
        yield name, {error: metrics.defined_mean(values) for error, values in by_view.items()}


def _pose(condition: ScanCondition, moment: Moment, count: int, seed: int, frame: int) -> Pose:
    """The pose of a picture: a scan of the moment, or the average of scans that no other picture has."""
    scans = max(condition.average, 1)
    frames = range(frame * scans, (frame + 1) * scans)
    poses = [Pose(n, 0.0, condition.name, condition.scan(moment, count, (seed, n))[0]) for n in frames]
    if not condition.average:
        return poses[0]
    return averaged(poses[-1], reversed(poses[:-1]), Averaging(condition.average))


def cameras_for(moment: Moment, up: str, condition: ScanCondition, amount: Amount, seed: int) -> list[Camera]:
    """The cameras of a condition, one for each view. Raises InputError for a scene without such views."""
    if not condition.front:
        return viewpoints(moment.mesh, amount.views, amount.size, up=up, seed=seed)
    aspect = amount.size[0] / amount.size[1]
    turns = np.linspace(-_FRONT, _FRONT, amount.views + 2)[1:-1]
    return [Camera.orbit(moment.truth.bounds, float(turn), 0.0, aspect=aspect, up=up) for turn in turns]


@dataclass(frozen=True, eq=False)
class PictureTruth:
    """The surface that a camera truly sees. spacing: (H, W), distance between the points of the scan around
    each hit, scan units; step: (H, W), how far depths of one surface may lie apart there."""

    moment: Moment
    camera: Camera
    reference: Reference
    spacing: NDArray[np.float64]
    step: NDArray[np.float64]

    @classmethod
    def of(cls, moment: Moment, camera: Camera, size: tuple[int, int], cloud: PointCloud) -> PictureTruth:
        """Trace the picture and find the spacings. cloud: the scan."""
        from scipy.spatial import cKDTree

        reference = trace(moment.truth, camera, size)
        places = reference.positions() + (reference.origin - cloud.origin)
        spacing = np.ones(reference.depth.shape)
        distances = cKDTree(cloud.positions).query(places, k=[_NEIGHBOR], workers=2)[0][:, 0]
        spacing[reference.covered] = distances / np.sqrt(_NEIGHBOR / np.pi)
        slant = np.maximum(reference.incidence(), _STEEPEST)
        depth = np.where(reference.covered, reference.depth, 0.0)
        return cls(
            moment, camera, reference, spacing, np.maximum(spacing, reference.view.footprint(depth) / slant)
        )

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), pixels."""
        height, width = self.reference.depth.shape
        return width, height

    def errors(self, surface: Surface) -> Errors:
        """Coverage, depth and normals of a picture; distances along the true normal in spacings (`bias`,
        `rms`) where the picture shows the right layer, and is not seen along it."""
        true, drawn = self.reference.covered, surface.coverage > 0
        both = drawn & true
        error = surface.depth[both] - self.reference.depth[both]
        facing = self.reference.incidence()[both]
        is_wrong = np.abs(error) > metrics.WRONG_LAYER * self.step[both]
        right = ~is_wrong & (facing >= _FLATTEST)
        off = (error * facing / self.spacing[both])[right]
        found = metrics.coverage(drawn, true)
        through = 100 * float(np.count_nonzero(is_wrong & (error > 0))) / max(int(true.sum()), 1)
        normals = metrics.normals(surface.normal[both], self.reference.normal[both])
        return {
            "open_percent": found["hole_percent"] + through,
            "slit_percent": metrics.slits(drawn, true),
            "wrong_layer_percent": 100 * float(is_wrong.mean()) if is_wrong.size else float("nan"),
            "spill_percent": found["spill_percent"],
            "spill_p95": found["spill_p95"],
            "bias": metrics.defined_mean(off),
            "rms": float(np.sqrt(metrics.defined_mean(off**2))),
            "normal_mean": normals["normal_mean"],
            "normal_p95": normals["normal_p95"],
        }

    def picks(self, surface: Surface, count: int, seed: Sequence[int]) -> Errors:
        """How often ± holds what is truly there along the ray, and how often a pick is far off without a
        warning, percent. A click means a random position in a random pixel of the subject."""
        rng = np.random.default_rng(tuple(seed))
        rows, columns = np.nonzero(self.reference.covered & (surface.level == 0))
        if not len(rows):
            return {}
        chosen = rng.integers(len(rows), size=count)
        pixels = np.stack([columns[chosen], rows[chosen]], axis=1)
        meant = first_hits(self.moment.truth, self.camera, self.size, pixels + rng.uniform(size=pixels.shape))
        held, off, refused = [], [], 0
        for (x, y), place in zip(pixels.tolist(), meant, strict=True):
            picked = pick(surface, x, y, shown=before_gap(surface, x, y), spacing=False)
            if picked is None or not np.isfinite(place).all():
                continue
            if picked.at_outline or picked.covariance is None:
                refused += 1
                continue
            ray = surface.view.along(np.array([x + 0.5, y + 0.5]))
            ray = ray / np.linalg.norm(ray)
            along = float((picked.position - place) @ ray)
            held.append(abs(along) <= SURE * np.sqrt(ray @ picked.covariance @ ray))
            off.append(abs(along) > _OFF * self.step[y, x])
        return {
            "held_percent": 100 * metrics.defined_mean(held),
            "off_percent": 100 * metrics.defined_mean(off),
            "refused_percent": 100 * refused / count,
        }


def _errors(
    renderer: Renderer,
    name: str,
    poses: Sequence[Pose],
    truth: PictureTruth,
    amount: Amount,
    seed: Sequence[int],
) -> Errors:
    """The errors of one view of a scan; of several scans of one subject, also how much pictures differ."""
    drawn_by = backend(name)
    params = drawn_by.params()
    surface = Surface(renderer.gpu, amount.size)
    errors: Errors = {}
    frames: list[tuple[NDArray, NDArray, NDArray]] = []
    for number, pose in enumerate(poses):
        while render_frame(renderer, Request(pose, truth.camera, drawn_by, params, _LOOK), surface):
            pass
        if number == 0:
            errors = truth.errors(surface) | truth.picks(surface, amount.picks, seed)
        if len(poses) > 1:
            frames.append((surface.depth, surface.normal, surface.image()[..., :3].astype(np.float64)))
    surface.release()
    return errors | (_wander(frames, truth) if frames else {})


def _wander(frames: Sequence[tuple[NDArray, NDArray, NDArray]], truth: PictureTruth) -> Errors:
    """How much a pixel changes from scan to scan where all show the right layer: standard deviation of depth
    along the normal, in spacings; mean angle to the mean normal, degrees; mean change of shading between
    two scans, levels of 255."""
    depths = np.stack([depth for depth, _, _ in frames])
    true = np.where(truth.reference.covered, truth.reference.depth, np.nan)
    right = (np.abs(depths - true) <= metrics.WRONG_LAYER * truth.step).all(axis=0)
    right &= truth.reference.incidence() >= _FLATTEST
    facing, spacing = truth.reference.incidence()[right], truth.spacing[right]
    normals = np.stack([normal[right] for _, normal, _ in frames])
    images = np.stack([image[right] for _, _, image in frames])
    mean = normals.mean(axis=0)
    angles = metrics.angles_between(normals, np.broadcast_to(mean, normals.shape))
    return {
        "wander_depth": metrics.defined_mean(depths[:, right].std(axis=0, ddof=1) * facing / spacing),
        "wander_normal": metrics.defined_mean(angles),
        "wander_shading": metrics.defined_mean(np.abs(np.diff(images, axis=0))),
    }


def estimated_normals(bare: PointCloud, true: PointCloud) -> Errors:
    """Errors of the normals that Scan4D estimates of a bare scan, against those of the true surface at the
    points: angles in degrees, sign ignored, and how many points to the wrong side, percent."""
    assert true.normals is not None
    estimated = cloud_normals(bare)
    found = metrics.normals(estimated, true.normals)
    angles = metrics.angles_between(estimated, true.normals)
    return {
        "normal_mean": found["normal_mean"],
        "normal_p95": found["normal_p95"],
        "flipped_percent": 100 * metrics.defined_mean(angles[np.isfinite(angles)] > 90),
    }
