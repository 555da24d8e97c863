"""Subjects as a virtual scanner sees them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...bounds import Bounds
from ...camera import Camera
from ...scan.pose import Pose
from ...simulate.scanner import Faults, around, capture, rig
from .defects import SIGMAS
from .subjects import Moment, Subject

_SIZE = (640, 480)  # of a range image
_FRAMED = 5  # moments that the pods are placed for


def simulated(subject: Subject, name: str, pods: int, noise: float, seed: int = 0) -> Subject:
    """The range views that pods measure of a subject, a moment each.

    pods: how many, placed as `around` says. noise: standard deviation of depth in footprints, what a pod's
    pixel covers at the subject's distance. The truth stays the same; the tolerance is four standard
    deviations of the noise.
    """
    cameras = rig(_framed(subject), around(pods), aspect=_SIZE[0] / _SIZE[1], up=subject.up)
    deviations = [noise * _footprint(camera) for camera in cameras]
    faults = [Faults(noise=deviation) for deviation in deviations]

    def load(index: int) -> Moment:
        moment = subject.moment(index)
        views = capture(moment.truth, cameras, _SIZE, faults, seed=seed, frame=index)
        pose = Pose.of(index, moment.pose.time, moment.pose.label, views)
        return replace(moment, pose=pose)

    tolerance = SIGMAS * max(deviations) or None
    return replace(subject, name=name, load=load, noise=noise, tolerance=tolerance)


def _framed(subject: Subject) -> Bounds:
    """The box around a few moments of a subject."""
    indices = sorted(set(np.linspace(0, subject.moments - 1, _FRAMED).astype(int)))
    boxes = [subject.moment(int(index)).truth.bounds for index in indices]
    return Bounds.around(boxes)


def _footprint(pod: Camera) -> float:
    """Width of a pixel at the subject's distance, scan units."""
    return pod.view_height / _SIZE[1]
