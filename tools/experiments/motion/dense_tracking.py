"""How exactly Scan4D follows every point, for what it costs. It takes half an hour."""

from __future__ import annotations

import multiprocessing
import os
import time
from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from experiments.landmarks.resampled import ResampledDemo, ResampledMesh
from experiments.motion.methods import coherent_point_drift, open3d_icp
from experiments.script import Script
from experiments.tables import Row
from viewer.analysis.motion.dense import DensePoints, PointState
from viewer.analysis.motion.followed_points import FollowedPoints
from viewer.rigid import STILL
from viewer.scan.open import find_source
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.timeline import Timeline

Float = NDArray[np.float64]

NOISE = 0.1  # mm
BEHIND = -25.0  # mm: what is farther back is left out
FACES = "demo:smile:1", "demo:sway:1", "demo:cough:1"
SEQUENCES = "crane_175", "horse_gallop_48"
LONGEST = 48  # frames of a sequence that are followed
COMPARED = 34  # frame of `demo:smile`, in which the cheek is lifted most
DRIFTING = 1500  # points of each frame for coherent point drift, which takes time and memory for their square


@dataclass(frozen=True, eq=False)
class KnownPoints:
    """Clouds, and where the points of the first one are in each, (F, N, 3)."""

    clouds: Sequence[PointCloud]
    paths: Float

    @classmethod
    def face(cls, scan: str, frames: Sequence[int]) -> KnownPoints:
        """A variant of the demo, sampled anew in each frame."""
        source = ResampledDemo(scan, NOISE, 1, BEHIND)
        return cls([source.load(frame) for frame in frames], source.paths(frames[0], frames))

    @classmethod
    def shuffled(cls, meshes: ResampledMesh) -> KnownPoints:
        """The vertices of a sequence of meshes, in another order in each frame."""
        chance = np.random.default_rng(0)
        paths = np.array([meshes.mesh(frame).points.world() for frame in range(_count(meshes))])
        orders = [np.arange(paths.shape[1]), *(chance.permutation(paths.shape[1]) for _ in paths[1:])]
        clouds = [PointCloud.from_arrays(points[order]) for points, order in zip(paths, orders, strict=True)]
        return cls(clouds, paths)

    @classmethod
    def resampled(cls, meshes: ResampledMesh) -> KnownPoints:
        """A sequence of meshes, sampled anew in each frame; in the first one at random."""
        chance, first = np.random.default_rng(0), meshes.mesh(0)
        areas = np.linalg.norm(first.areas(), axis=1)
        chosen = first.faces[chance.choice(len(areas), len(first.points), p=areas / areas.sum())]
        shares = chance.dirichlet((1.0, 1.0, 1.0), len(chosen))
        corners = (meshes.mesh(frame).points.world()[chosen] for frame in range(_count(meshes)))
        paths = np.array([(shares[..., None] * each).sum(axis=1) for each in corners])
        return cls([PointCloud.from_arrays(paths[0]), *map(meshes.load, range(1, len(paths)))], paths)


def _followed(known: KnownPoints, what: str, unit: str) -> Row:
    """A row of errors of all frames but the first. unit: of lengths, a spacing where it is empty."""
    points = DensePoints(Pose.of(0, 0.0, "", known.clouds[0]))
    size = 1.0 if unit else points.surface.spacing
    earlier = beside = points.at_rest
    before, taken = points.surface, 0.0
    errors, within, states = [], [], []
    for cloud, path in zip(known.clouds[1:], known.paths[1:], strict=True):
        start = time.process_time()
        now = points.surface_of(Pose.of(0, 0.0, "", cloud))
        found = points.follow(now, before, beside, earlier)
        taken += time.process_time() - start
        earlier, beside, before = beside, found, now
        away = np.linalg.norm(found.displacement - (path - known.paths[0]), axis=1)
        seen = found.state == PointState.SEEN
        errors.append(away[seen] / size)
        within.append(away[seen] <= 2 * found.sigma[seen])
        states.append(np.bincount(found.state, minlength=3) / len(seen))
    each = np.concatenate(errors)
    gaps = 1 - np.mean(states, axis=0)[PointState.SEEN]
    return {
        "scan": what,
        "points": f"{len(points.points):,}",
        "median": f"{np.median(each):.2g} {unit or 'spacings'}",
        "95 %": f"{np.quantile(each, 0.95):.2g} {unit or 'spacings'}",
        "median of the last frame": f"{np.median(errors[-1]):.2g} {unit or 'spacings'}",
        "within 2 sigma": _percent(np.concatenate(within).mean()),
        "gaps": f"{100 * gaps:.1f} %",
        "s a frame": f"{taken / len(states):.2f}",
    }


def faces(_: Namespace) -> Iterator[Row]:
    """Errors on faces, whose motion returns to rest after 64 frames."""
    for scan in FACES:
        yield _followed(KnownPoints.face(scan, range(64)), f"`{scan.removesuffix(':1')}`", "mm")


def there_and_back(_: Namespace) -> Iterator[Row]:
    """Errors in a motion that goes there and the same way back."""
    frames = [*range(32), *range(31, -1, -1)]
    yield _followed(KnownPoints.face(FACES[0], frames), "`demo:smile`, there and back", "mm")


def sequences(options: Namespace) -> Iterator[Row]:
    """Errors on whole bodies, without their topology."""
    for name in SEQUENCES:
        meshes = ResampledMesh(find_source(options.data / "sequences" / name))
        yield _followed(KnownPoints.shuffled(meshes), f"{name}, the same points in another order", "")
        yield _followed(KnownPoints.resampled(meshes), f"{name}, other points in each frame", "")


def first_colors(_: Namespace) -> Iterator[Row]:
    """Processor time from the click to the first colours, in a new process that loads all it needs."""
    with TemporaryDirectory() as folder, multiprocessing.get_context("spawn").Pool(1) as pool:
        yield from pool.apply(_until_first_colors, (folder,))


def _until_first_colors(cache: str) -> list[Row]:
    """What the window finds after the click, without its drawing. cache: an empty folder."""
    os.environ["XDG_CACHE_HOME"] = cache
    source = ResampledDemo(FACES[0], NOISE, 1)
    rows: list[Row] = []
    with Timeline(source, source.times(), "mm") as timeline:
        poses = [timeline.pose(frame) for frame in range(2)]
        start = time.process_time()

        def until(step: str) -> None:
            taken = f"{time.process_time() - start:.2f} s"
            rows.append({"until": step, "points": f"{len(poses[0].cloud):,}", "processor time": taken})

        points = FollowedPoints(timeline, 0, {})
        frames = points.find()
        next(frames)
        until("reference frame is read")
        next(frames)
        until("first frame beside it is followed")
        name, near = "point displacement", points.rows_nearest(poses[1])
        points.of_pose(name, 1, near, lambda _: STILL)
        points.largest(name, 1, lambda _: STILL)
        until("its colours and their range are known")
    return rows


def dense_methods(_: Namespace) -> Iterator[Row]:
    """Errors and times of Scan4D and of other methods, from rest to one frame of `demo:smile`."""
    known = KnownPoints.face(FACES[0], [0, COMPARED])
    row = _followed(known, "", "mm")
    yield {
        "method": "Scan4D",
        **{name: row[name] for name in ("points", "median", "95 %")},
        "time": row["s a frame"],
    }
    chance = np.random.default_rng(0)
    rest, there = (cloud.world() for cloud in known.clouds)
    right = known.paths[1] - known.paths[0]
    some = chance.choice(len(rest), DRIFTING, replace=False)
    targets = there[chance.choice(len(there), DRIFTING, replace=False)]
    methods: dict[str, tuple[NDArray[np.integer], Callable[[Float], Float]]] = {
        "coherent point drift": (some, lambda points: coherent_point_drift(points, targets)),
        "open3d ICP, point to plane, rigid": (
            np.arange(len(rest)),
            lambda points: open3d_icp(points, is_robust=False)(there, STILL).points(points),
        ),
    }
    for name, (rows, method) in methods.items():
        start = time.process_time()
        away = np.linalg.norm(method(rest[rows]) - rest[rows] - right[rows], axis=1)
        taken = time.process_time() - start
        yield {
            "method": name,
            "points": f"{len(rows):,}",
            "median": f"{np.median(away):.2g} mm",
            "95 %": f"{np.quantile(away, 0.95):.2g} mm",
            "time": f"{taken:.2f}",
        }


def _count(meshes: ResampledMesh) -> int:
    return min(LONGEST, len(meshes))


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


EXPERIMENT = Script(
    [faces, there_and_back, sequences, first_colors, dense_methods],
    {"data": None},
    page="how-it-works/dense-tracking.md",
)
