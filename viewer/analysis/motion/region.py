"""The region of a subject that counts as rigid, as files tell it.

    {"spheres": [[x, y, z, radius], ...]}    what lies within any of them, scan units; one whose radius is
                                             negative removes what lies within it from those before
    {"points": [id, ...]}                    points of the reference frame, by their numbers in its file
    {"landmarks": [name, ...], "radius": r}  what lies within a radius of landmarks of the scan's session

Without "radius", it is a tenth of the radius of the reference frame's bounds. A file may have several of
these: the region is all of them together.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, did_you_mean, shortened, unknown_name
from ...files import parsed_json, read_text, reading
from ...scan.points import PointCloud

Float = NDArray[np.float64]

_MOST_BYTES = 1 << 28
_SHARE = 0.1  # of the radius of the bounds, that a sphere around a landmark has unless it is stated
_KEYS = ("spheres", "points", "landmarks", "radius")
_HINT = (
    'Write {"spheres": [[x, y, z, radius], ...]}, {"points": [id, ...]} or {"landmarks": [name, ...], '
    '"radius": r}'
)


@dataclass(frozen=True, eq=False)
class RigidRegion:
    """A region of the reference frame.

    spheres: (S, 4), middles and radii, scan units; with a negative radius, one removes what lies within it
    from the region of the points and the spheres before. points: (P,), ids. landmarks: names, each the
    middle of a sphere of `radius`, scan units; None: see `radius_in`.
    """

    spheres: Float
    points: NDArray[np.int64]
    landmarks: tuple[str, ...] = ()
    radius: float | None = None

    @classmethod
    def read(cls, path: Path) -> RigidRegion:
        """The region of a file. Raises InputError, which names the file, for whatever is wrong in it."""
        with reading(path, "is not valid JSON", _HINT):
            return cls.from_json(parsed_json(read_text(path, _MOST_BYTES)))

    @classmethod
    def from_json(cls, data: Any) -> RigidRegion:
        """The region of a JSON object. Raises InputError."""
        data = data if isinstance(data, dict) else {}
        for key in data:
            if key not in _KEYS:
                raise unknown_name("entry of a region", key, list(_KEYS))
        if not any(data.get(key) for key in _KEYS[:3]):
            raise InputError("has no region", hint=_HINT)
        names, radius = data.get("landmarks", []), data.get("radius")
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise InputError("'landmarks' is not a list of names", hint=_HINT)
        if radius is not None and not (_is_number(radius) and radius > 0):
            raise InputError("'radius' is not a length above 0", hint="State the radius around the landmarks")
        return cls(_spheres(data.get("spheres", [])), _ids(data.get("points", [])), tuple(names), radius)

    def to_json(self) -> dict[str, Any]:
        """The region as `from_json` reads it."""
        said: dict[str, Any] = {}
        if len(self.spheres):
            said["spheres"] = self.spheres.tolist()
        if len(self.points):
            said["points"] = self.points.tolist()
        if self.landmarks:
            said["landmarks"] = list(self.landmarks)
        if self.radius is not None:
            said["radius"] = self.radius
        return said

    def radius_in(self, cloud: PointCloud) -> float:
        """The radius around landmarks in a cloud: as stated, or a share of the radius of its bounds."""
        return _SHARE * cloud.bounds().radius if self.radius is None else self.radius

    def rows(self, cloud: PointCloud, places: Mapping[str, Float]) -> NDArray[np.int64]:
        """The rows of a cloud that are in the region, increasing. places: (3,) by the names of landmarks.

        Raises InputError where a landmark is not among them, and where the cloud has no such points.
        """
        ids = np.arange(len(cloud)) if cloud.ids is None else cloud.ids
        missing = np.setdiff1d(self.points, ids)
        if len(missing):
            hint = f"It has {len(ids):,} points with numbers from {ids.min()} to {ids.max()}"
            raise InputError(f"the reference frame has no point {missing[0]}", hint=hint)
        is_in = np.isin(ids, self.points)
        for name in self.landmarks:
            if name not in places:
                what = f"the reference frame has no landmark '{shortened(name)}'"
                hint = (
                    f"Place it there in the window, or name one that is there: {', '.join(places) or 'none'}"
                )
                raise InputError(what, hint=did_you_mean(name, places) + hint)
        around = [np.append(places[name], self.radius_in(cloud)) for name in self.landmarks]
        put_in_spheres([*self.spheres, *around], cloud.world(), is_in)
        return np.flatnonzero(is_in)


def put_in_spheres(spheres: Iterable[Float], positions: Float, is_in: NDArray[np.bool_]) -> None:
    """Set for positions (N, 3) whether they are in a region, (N,), by its spheres, (4,) each, in their
    order; see `RigidRegion`."""
    for sphere in spheres:
        is_in[((positions - sphere[:3]) ** 2).sum(axis=1) <= sphere[3] ** 2] = sphere[3] > 0


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and np.isfinite(value)


def _spheres(given: Any) -> Float:
    is_right = isinstance(given, list) and all(
        isinstance(one, list) and len(one) == 4 and all(map(_is_number, one)) and one[3] != 0 for one in given
    )
    if not is_right:
        raise InputError("'spheres' is not a list of [x, y, z, radius]", hint=_HINT)
    return np.array(given, np.float64).reshape(-1, 4)


def _ids(given: Any) -> NDArray[np.int64]:
    is_right = isinstance(given, list) and all(type(one) is int and 0 <= one < 1 << 32 for one in given)
    if not is_right:
        raise InputError("'points' is not a list of numbers of points", hint=_HINT)
    return np.unique(np.array(given, np.int64))
