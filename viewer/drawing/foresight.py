"""Facts about the points of poses that are drawn soon, found in the background (`Backend.foresee`)."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Future
from weakref import WeakKeyDictionary

from ..scan.points import PointCloud
from ..task import Task, in_background
from .request import Request

_AT_ONCE = 2  # clouds


class Foresight:
    """Finds the facts that pictures read but do not wait for, such as the noise of points.

    running: what threads are finding.
    """

    def __init__(self) -> None:
        self._begun: WeakKeyDictionary[PointCloud, set[object]] = WeakKeyDictionary()
        self.running: list[Future[None]] = []

    def begin(self, requests: Iterable[Request]) -> None:
        """Begin with the first of these pictures whose facts are missing, a few at a time.

        A picture whose range views have not been merged is left out.
        """
        self.running = [future for future in self.running if not future.done()]
        for request in requests:
            if len(self.running) >= _AT_ONCE:
                return
            if request.pose.is_merged and not request.draws_samples:
                self._begin(request, request.pose.cloud)

    def _begin(self, request: Request, cloud: PointCloud) -> None:
        pose, backend, params = request.pose, request.backend, request.params

        def find() -> None:
            pose.drawn_bounds()
            backend.foresee(cloud, params)

        begun = self._begun.setdefault(cloud, set())
        if (backend, params) not in begun:
            begun.add((backend, params))
            self.running.append(in_background(Task("Estimating noise"), find))
