"""How exactly Scan4D finds the asymmetry of a face: smiles of one side, and repeated scans."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from experiments.landmarks.resampled import ResampledDemo
from experiments.script import Script
from experiments.tables import Row
from viewer.analysis.asymmetry.asymmetry_map import asymmetry_map
from viewer.analysis.asymmetry.mid_plane import MirroredPose
from viewer.analysis.landmarks.mirroring import MirrorPlane
from viewer.scan.demo import head
from viewer.scan.demo.motion import MOUTH_CORNER, PERIOD, Bend, HeadMotion, Peak, move
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

Float = NDArray[np.float64]

SMILES = 0.0, 0.5, 1.8, 4.0  # mm, of one corner of the mouth
NOISES = 0.0, 0.1  # mm
SCANS = 10  # of each subject, turned by up to
TURN = 15.0  # degrees about each axis
SUBJECTS = 0.0, 0.5, 1.0, 1.5, 2.0, 3.0  # mm
REACH = 20.0  # mm
DENSE = 300_000  # points of the head that stand for the exact surface
BEHIND = -25.0  # mm
CHEEKS = (40.0, -35.0, 45.0)  # mm: a sphere on either side, away from folds: x, y and radius
MIDDLE = MirrorPlane(np.array([1.0, 0.0, 0.0]), 0.0, np.nan)
_CORNER = np.array([[28.0], [-54.0], [80.0]])
_FRAME = 32  # at the peak of the smile


def smiles(_: Namespace) -> Iterator[Row]:
    """Errors of the mid-plane and of the RMS, for the whole face and for its cheeks."""
    for amount in SMILES:
        dense = _face(amount, 0.0, 9, DENSE)
        truth = asymmetry_map(_pose(dense), MIDDLE, REACH).values
        for noise in NOISES:
            angle, offset, whole, cheeks = np.mean(
                [_measured(amount, noise, seed) for seed in range(3)], axis=0
            )
            yield {
                "smile": f"{amount} mm",
                "noise": f"{noise} mm",
                "error of the normal": f"{angle:.2g}°",
                "of the place": f"{offset:.2g} mm",
                "RMS of the cheeks": f"{cheeks:.3f} mm",
                "truth of the cheeks": f"{_rms(truth[_in_cheeks(dense)]):.3f} mm",
                "RMS of the face": f"{whole:.3f} mm",
                "truth of the face": f"{_rms(truth):.3f} mm",
            }


def rescans(_: Namespace) -> Iterator[Row]:
    """Ten scans of each of some subjects, in other poses, with other points and noise of 0.1 mm."""
    found = np.array(
        [[_measured(amount, NOISES[-1], 100 * number + scan)[2:] for scan in range(SCANS)]
         for number, amount in enumerate(SUBJECTS)]
    )  # fmt: skip
    for column, name in enumerate(("face", "cheeks")):
        values = found[:, :, column]
        within = values.var(axis=1, ddof=1).mean()
        between = SCANS * values.mean(axis=1).var(ddof=1)
        yield {
            "region": name,
            "standard deviation of scans, at most": f"{values.std(axis=1, ddof=1).max():.4f} mm",
            "ICC(1,1)": f"{(between - within) / (between + (SCANS - 1) * within):.4f}",
        }


def _measured(amount: float, noise: float, seed: int) -> Float:
    """Errors of the mid-plane, degrees and mm, and the RMS of the face and of its cheeks, mm."""
    points = _face(amount, noise, seed)
    turn = Rotation.from_rotvec(np.radians(np.random.default_rng(seed).uniform(-TURN, TURN, 3))).as_matrix()
    pose = _pose(points @ turn.T)
    plane, left, middle = MirroredPose(pose).mid_plane(turn[:, 0]).plane, turn[:, 0], points.mean(axis=0)
    found = asymmetry_map(pose, plane, REACH)
    cheeks = found._replace(values=found.values[_in_cheeks(points)])
    angle = np.degrees(np.arccos(min(1.0, float(plane.normal @ left))))
    offset = abs(plane.normal @ (turn @ middle) - plane.offset - middle[0])
    return np.array([angle, offset, found.rms, cheeks.rms])


def _face(amount: float, noise: float, seed: int, count: int | None = None) -> Float:
    """Points (N, 3) of the face without hair, which is not symmetric. amount: mm, that a corner moves."""
    source = ResampledDemo("demo:smile:1", noise, seed, BEHIND, count=count)
    source.demo.motion = _smile(amount / _moved(1e-3) * 1e-3)
    points = source.load(_FRAME).world()
    return points[
        (head.hair_region(np.abs(points[:, 0]), points[:, 1], points[:, 2]) > 0) & (points[:, 2] > BEHIND)
    ]


def _smile(angle: float) -> HeadMotion:
    return HeadMotion((Bend(MOUTH_CORNER, (Peak(angle, 0.5, 3.0),), (1.0, 0.0)),))


def _moved(angle: float) -> float:
    """How far a smile moves the corner of the mouth, mm."""
    moved, _, _ = move(_CORNER, np.array([[0.0], [0.0], [1.0]]), PERIOD / 2, _smile(angle))
    return float(np.linalg.norm(moved - _CORNER))


def _in_cheeks(points: Float) -> NDArray[np.bool_]:
    x, y, radius = CHEEKS
    near = np.hypot(np.abs(points[:, 0]) - x, points[:, 1] - y) < radius / 2
    return near & (points[:, 2] > 0)


def _pose(points: Float) -> Pose:
    return Pose.of(0, 0.0, "face", PointCloud.from_arrays(points))


def _rms(values: Float) -> float:
    return float(np.sqrt(np.nanmean(np.square(values))))


EXPERIMENT = Script([smiles, rescans], page="how-it-works/asymmetry.md")
