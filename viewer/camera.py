"""The camera: float64, right-handed, looks down -z in view space. Plain geometry, no GL."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from numbers import Real
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from .bounds import Bounds
from .errors import InputError, shortened, unknown_name
from .files import parsed_json, read_text, reading, save_json
from .geometry import Vector, front_vector, up_vector, vector

PROJECTIONS = ("perspective", "orthographic")
_FIT_MARGIN = 1.04
_STEEPEST = 89.5  # elevation in degrees that orbiting reaches
_LARGEST, _SMALLEST = 1e24, 1e-24  # lengths whose squares, sums and ratios stay finite
_SMALLEST_SUBJECT = 1e-18  # whose distances float32 can square
_NARROWEST, _WIDEST = 1e-6, 170.0  # fields of view that a picture can be drawn with, degrees
_MOST_BYTES = 2**20  # of a file; ours have some 300


class Lens(TypedDict, total=False):
    """Fields of a `Camera` that say how it projects."""

    projection: str
    fov_y: float


@dataclass(frozen=True)
class Camera:
    """A camera: position, direction and projection of a picture.

    eye, target, up: scan units (up: any length). fov_y: degrees, 1e-6 to 170; in a wider view a pixel shows
    nearly half of all directions. height: scan units from the bottom to the top of the picture (orthographic
    only). near, far: scan units along the view axis; None: fitted (see `clip_range`).
    """

    eye: Vector = (0.0, 0.0, 1.0)
    target: Vector = (0.0, 0.0, 0.0)
    up: Vector = (0.0, 1.0, 0.0)
    projection: str = "perspective"
    fov_y: float = 30.0
    height: float | None = None
    near: float | None = None
    far: float | None = None

    def __post_init__(self) -> None:
        for name in ("eye", "target", "up"):
            object.__setattr__(self, name, _three_numbers(name, getattr(self, name)))
        if self.projection not in PROJECTIONS:
            raise unknown_name("projection", shortened(self.projection), PROJECTIONS)
        fov_y = _number(self.fov_y)
        if fov_y is None or not _NARROWEST <= fov_y <= _WIDEST:
            what = f"the camera's fov_y is {shortened(self.fov_y)}"
            raise InputError(f"{what}, but must be {_NARROWEST:g} to {_WIDEST:g} degrees")
        object.__setattr__(self, "fov_y", fov_y)
        for name in ("height", "near", "far"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _length(name, getattr(self, name)))
        if self.near is not None and self.far is not None and self.near >= self.far:
            raise InputError("the camera's near plane is not in front of its far plane")
        if self.distance < _SMALLEST:
            raise InputError("the camera's eye and target are the same point")
        if math.hypot(*self.up) < _SMALLEST:
            raise InputError("the camera's up has no direction")

    # --- making one -------------------------------------------------------------------

    @classmethod
    def orbit(
        cls,
        bounds: Bounds,
        azimuth: float = 0.0,
        elevation: float = 0.0,
        distance: float | None = None,
        *,
        aspect: float = 1.0,
        up: str = "+y",
        **lens: Unpack[Lens],
    ) -> Camera:
        """A camera that circles the centre of `bounds`.

        azimuth: degrees; 0 looks from the front (+z for up +y), positive moves the eye towards +x. elevation:
        degrees, positive is above. distance: scan units; None: as near as possible with all bounds in view at
        this aspect (width / height). lens: fov_y and projection, else those of any camera.
        """
        bounds = _with_extent(bounds)
        above = np.array(up_vector(up), float)
        front = np.array(front_vector(up), float)
        right = np.cross(above, front)
        a, e = math.radians(azimuth), math.radians(elevation)
        direction = (
            math.cos(e) * (math.cos(a) * front + math.sin(a) * right) + math.sin(e) * above
        )  # from the target to the eye
        # At the poles the view axis is parallel to up: keep the picture's up continuous there.
        screen_up = math.cos(e) * above - math.sin(e) * (math.cos(a) * front + math.sin(a) * right)
        camera = cls(
            eye=vector(bounds.center + direction * bounds.radius),
            target=vector(bounds.center),
            up=vector(screen_up if abs(math.cos(e)) < 1e-6 else above),
            **lens,
        )
        camera = camera.fit(bounds, aspect)
        return camera if distance is None else camera.at_distance(distance)

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Camera:
        """The camera of a JSON object as `to_json` gives it; raises InputError."""
        if not isinstance(data, dict):
            raise InputError("a camera must be a JSON object")
        known = list(cls.__dataclass_fields__)
        for name in data:
            if name not in known:
                raise unknown_name("camera field", name, known)
        return cls(**data)

    @classmethod
    def load(cls, path: str | Path) -> Camera:
        """Read a camera's JSON file; raises InputError naming the file."""
        with reading(path, "is not JSON"):
            return cls.from_json(parsed_json(read_text(path, _MOST_BYTES)))

    def to_json(self) -> dict[str, Any]:
        """A JSON object with every field, vectors as lists."""
        return {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(self).items()}

    def save(self, path: str | Path) -> None:
        """Write `to_json` as a file. Raises InputError where it cannot be written."""
        save_json(path, self.to_json())

    # --- reading it -------------------------------------------------------------------

    @property
    def distance(self) -> float:
        """Distance from eye to target, scan units."""
        return math.dist(self.eye, self.target)

    @property
    def view_height(self) -> float:
        """Scan units from the bottom to the top of the picture, at the target's depth."""
        if self.projection == "orthographic" and self.height is not None:
            return self.height
        return 2 * self.distance * math.tan(math.radians(self.fov_y) / 2)

    def rotation(self) -> NDArray[np.float64]:
        """World to view rotation, (3, 3): its rows are the picture's right, up and backward axes."""
        # A view turns this for each picture, and numpy takes several times as long for three numbers.
        (ex, ey, ez), (tx, ty, tz) = self.eye, self.target
        back = ex - tx, ey - ty, ez - tz
        back = _divided(back, _norm(back))
        right = _across(self.up, back)
        length = _norm(right)
        if length <= 1e-12 * math.hypot(*self.up):
            # Up is parallel to the view axis: any right will do; take the most orthogonal axis.
            right = _across(np.eye(3)[np.abs(back).argmin()].tolist(), back)
            length = _norm(right)
        right = _divided(right, length)
        return np.array([right, _across(back, right), back])

    def place_in_picture(self, point: Vector) -> tuple[float, float] | None:
        """Position of a point in the picture, right of and above its centre, in picture heights; None behind
        the eye."""
        right, up = self.places_in_picture(np.array([point], np.float64))[0].tolist()
        return None if math.isnan(right) else (right, up)

    def places_in_picture(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Positions of points (N, 3) in the picture, (N, 2), as in `place_in_picture`; NaN behind the eye."""
        right, up, _ = self.rotation() @ (points - self.eye).T
        return np.stack([right, up], axis=1) / self.heights_at(points)[:, None]

    def heights_at(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Scan units from the bottom to the top of the picture at the depths of points (N, 3), (N,); NaN
        behind the eye."""
        back = (points - self.eye) @ self.rotation()[2]
        height = np.where(back < 0, self.view_height, np.nan)
        return height * -back / self.distance if self.projection == "perspective" else height

    def clip_range(self) -> tuple[float, float]:
        """(near, far) along the view axis, scan units. Nothing outside is drawn.

        A missing near is a thousandth of the distance to the target, a missing far infinite.
        """
        near = self.near if self.near is not None else 1e-3 * self.distance
        return near, math.inf if self.far is None else self.far

    def reach(self, bounds: Bounds) -> float:
        """A depth beyond everything near the bounds, scan units.

        An orthographic depth buffer is scaled to it.
        """
        return 2 * (self.distance + math.dist(self.target, bounds.center) + 4 * bounds.radius)

    # --- moving it --------------------------------------------------------------------

    def fit(self, bounds: Bounds, aspect: float = 1.0) -> Camera:
        """Move along the view axis, as near as possible with the whole box of `bounds` in view and a small
        margin."""
        bounds = _with_extent(bounds)
        x, y, z = self.rotation() @ (bounds.corners() - bounds.center).T
        tangent = math.tan(math.radians(self.fov_y) / 2) / _FIT_MARGIN
        # Each corner must lie within the picture's edges: |y| <= tangent * (distance - z).
        reach = np.maximum(np.abs(y), np.abs(x) / aspect)
        if not reach.any():  # a line seen end on: as much room as seen from the side
            reach = np.full_like(reach, bounds.radius)
        distance = float((z + reach / tangent).max())
        height = 2 * _FIT_MARGIN * float(reach.max()) if self.projection == "orthographic" else self.height
        eye = vector(bounds.center + self.rotation()[2] * distance)
        return replace(self, eye=eye, target=vector(bounds.center), height=height)

    def framing(self, points: NDArray[np.float64], aspect: float = 1.0) -> Camera:
        """Move sideways and along the view axis, as near as possible with all points in view and a small
        margin.

        It comes nearer than `fit` if the points do not fill their box, such as those of one depth camera.
        points: (N, 3) scan units, at least one. The target is at their median depth.
        """
        bounds = Bounds(points.min(axis=0), points.max(axis=0))
        if _with_extent(bounds) is not bounds:
            return self.fit(bounds, aspect)
        axes = self.rotation()
        x, y, z = axes @ (points - bounds.center).T
        up = math.tan(math.radians(self.fov_y) / 2) / _FIT_MARGIN
        perspective = self.projection == "perspective"
        # The planes through the picture's edges: eye + distance * slope is beyond all points on both sides.
        places, distances = [], []
        for across, slope in ((x, up * aspect), (y, up)):
            lean = z * slope if perspective else 0.0
            high, low = float((across + lean).max()), float((lean - across).max())
            places.append((high - low) / 2)
            distances.append((high + low) / 2 / slope)
        distance, middle = max(distances), float(np.median(z))
        height = 2 * _FIT_MARGIN * up * distance if not perspective else self.height
        target = bounds.center + np.array([*places, middle]) @ axes
        away = distance - middle if perspective else distance + float(z.max()) - middle
        return replace(self, eye=vector(target + axes[2] * away), target=vector(target), height=height)

    def at_distance(self, distance: float) -> Camera:
        """Move to another distance from the target (scan units), in the same direction."""
        if not (math.isfinite(distance) and distance > 0):
            raise InputError(f"a camera's distance must be positive, not {distance}")
        eye = np.array(self.target) + self.rotation()[2] * distance
        height = self.height and self.height * distance / self.distance
        return replace(self, eye=vector(eye), height=height)

    def orbited(self, azimuth: float, elevation: float, about: Vector | None = None) -> Camera:
        """Turn about the target: azimuth about up, then elevation, in degrees.

        about: another point to turn about, scan units; it stays at its position in the picture. Elevation
        stops short of the poles, so that the picture never flips.
        """
        up = np.array(self.up) / np.linalg.norm(self.up)
        arm = np.subtract(self.eye, self.target)
        turned = _rotate(arm, up, math.radians(azimuth))
        now = math.degrees(math.asin(np.clip(turned @ up / np.linalg.norm(turned), -1, 1)))
        limit = max(_STEEPEST, abs(now))
        step = float(np.clip(now + elevation, -limit, limit)) - now
        axis = np.cross(up, turned)
        length = np.linalg.norm(axis)
        axis = axis / length if length > 1e-9 * np.linalg.norm(arm) else np.zeros(3)

        def turn(v: NDArray[np.float64]) -> NDArray[np.float64]:
            v = _rotate(v, up, math.radians(azimuth))
            return _rotate(v, axis, -math.radians(step)) if axis.any() else v

        center = np.array(self.target if about is None else about)
        target = center + turn(self.target - center)
        return replace(self, eye=vector(target + turn(arm)), target=vector(target))

    def panned(self, right: float, up: float) -> Camera:
        """Move with its target along the picture's axes, in heights of the picture."""
        axes = self.rotation()
        shift = (axes[0] * right + axes[1] * up) * self.view_height
        eye, target = np.array(self.eye) + shift, np.array(self.target) + shift
        return replace(self, eye=vector(eye), target=vector(target))

    def moved(self, by: NDArray[np.float64]) -> Camera:
        """Move with its target along the world's axes. by: (3,) scan units."""
        return replace(self, eye=vector(np.add(self.eye, by)), target=vector(np.add(self.target, by)))

    def zoomed(self, factor: float) -> Camera:
        """Zoom: nearer for factor > 1, farther for factor < 1. The surface at the target scales by the
        factor."""
        return self.at_distance(self.distance / factor)

    def approached(self, point: Vector, factor: float) -> Camera:
        """Approach a point, for factor > 1. It stays at its position in the picture."""
        about = np.array(point)
        eye, target = (about + (np.array(p) - about) / factor for p in (self.eye, self.target))
        return replace(
            self, eye=vector(eye), target=vector(target), height=self.height and self.height / factor
        )

    def projected(self, projection: str) -> Camera:
        """Change the projection. The surface at the target keeps its size."""
        camera = replace(self, projection=projection, height=self.view_height)
        if projection == "orthographic":
            return camera
        return camera.at_distance(self.view_height / (2 * math.tan(math.radians(self.fov_y) / 2)))

    def focused(self, point: Vector) -> Camera:
        """Move the target along the view axis to the depth of a point; the picture stays.

        Unchanged where the point is not in front of the eye.
        """
        back = self.rotation()[2]
        depth = float(np.subtract(self.eye, point) @ back)
        target = vector(np.array(self.eye) - back * depth)
        if depth <= 0 or target == self.eye:  # the latter far from the origin, by rounding
            return self
        height = self.view_height if self.projection == "orthographic" else self.height
        return replace(self, target=target, height=height)

    def centered(self, point: Vector) -> Camera:
        """Move sideways until the point is in the middle, at the same direction and scale at its depth.

        Unchanged where the point is not in front of the eye.
        """
        camera = self.focused(point)
        back = self.rotation()[2]
        shift = np.subtract(point, camera.target)
        if float(np.subtract(self.eye, point) @ back) <= 0:
            return self
        return replace(camera, eye=vector(camera.eye + shift), target=point)


def _with_extent(bounds: Bounds) -> Bounds:
    """The bounds, with room around what is a single point, or as good as one."""
    away = float(np.abs(bounds.center).max())
    if bounds.radius > max(_SMALLEST_SUBJECT, 1e-14 * away):
        return bounds
    return bounds.grown(max(1e-6 * away, 0.5))


def _number(value: Any) -> float | None:
    """A finite number as float; None for all else."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return None
    try:
        return float(value) if math.isfinite(value) else None
    except OverflowError:  # of hundreds of digits
        return None


def _three_numbers(name: str, values: Any) -> Vector:
    numbers = [_number(v) for v in values] if isinstance(values, (tuple, list, np.ndarray)) else []
    found = [n for n in numbers if n is not None and abs(n) <= _LARGEST]
    if len(found) != 3 or len(numbers) != 3:
        raise InputError(
            f"the camera's {name} is {shortened(values)}, expected three finite numbers up to {_LARGEST:g}"
        )
    return found[0], found[1], found[2]


def _length(name: str, value: Any) -> float:
    number = _number(value)
    if number is None or not _SMALLEST <= number <= _LARGEST:
        what = f"the camera's {name} is {shortened(value)}, expected a positive number"
        raise InputError(f"{what}, {_SMALLEST:g} to {_LARGEST:g}")
    return number


def _rotate(v: NDArray[np.float64], axis: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """Rodrigues' rotation of v about a unit axis, angle in radians."""
    cos, sin = math.cos(angle), math.sin(angle)
    return v * cos + np.cross(axis, v) * sin + axis * (axis @ v) * (1 - cos)


def _norm(v: Vector) -> float:
    """The length, to the bit that of np.linalg.norm."""
    numbers = np.array(v)
    return math.sqrt(numbers.dot(numbers))


def _divided(v: Vector, length: float) -> Vector:
    x, y, z = v
    return x / length, y / length, z / length


def _across(a: Vector, b: Vector) -> Vector:
    """The cross product."""
    (ax, ay, az), (bx, by, bz) = a, b
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
