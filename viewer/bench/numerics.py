"""Numerical stability: a scan in another form must still give the same picture.

A row draws a shot and its variant with one backend, and says how far they may be apart.
Where a backend cannot hold a row in principle, its module says so and what it holds instead:
`limits = {name of the row: Limit(share of the pixels, reason)}`, or several where they go by parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..camera import PROJECTIONS, Camera
from ..look import Look
from ..rigid import rotation_about
from .scenes.samples import line, on_torus, wall
from .shots import PointView
from .stability import Row, Tolerance

EXACT = Tolerance(0.0, "the same numbers reach the GPU")
# 2^-17 px is the last bit of a pixel coordinate beyond 128; to view space, the division, the
# scale and the picture's centre each round once or twice.
FLOAT32 = Tolerance(5e-5, "float32 on the GPU: six roundings of a pixel coordinate near 160")

_SHIFT = np.array([1.0, -0.37, 0.61])  # on no power-of-two grid
_QUARTER_TURN = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # about x: +z becomes +y
_UNIT = 38  # pixels of the body's shot


def rows() -> Iterator[Row]:
    """The suite; shots are made when a row is compared."""
    yield from _placed()
    yield from _typed()
    yield from _clipped()
    yield from _zoomed()
    yield from _sized()
    yield from _arranged()
    yield from _spoilt()
    yield from _flipped()


def _rounded(kind: type, at: float, source: str, unit: float = _UNIT) -> Tolerance:
    """The tolerance where coordinates near `at` are rounded to a float type. unit: pixels."""
    return Tolerance(
        FLOAT32.error + unit * float(np.spacing(kind(at))) / 12**0.5,
        f"{kind.__name__} {source} near {at:.0g} units, added to: {FLOAT32.reason}",
    )


def _body(count: int = 12_000) -> PointView:
    """A torus that fills the picture."""
    return PointView(on_torus(count), Camera((2.9, 3.4, 4.0)))


def _sheet() -> PointView:
    """A plane of one colour, seen at a slant: which of its points a pixel shows does not matter."""
    return PointView(wall(60, 40, spacing=0.04), Camera((1.0, 0.5, 3.0)))


def _thread() -> PointView:
    """A line of one colour, unlit."""
    return PointView(line(200, (1.0, 0.5, 0.3)), Camera((1.0, 0.5, 5.0)), look=Look(light="flat"))


def _placed() -> Iterator[Row]:
    for power in range(3, 10):
        move = partial(PointView.moved, shift=10.0**power * _SHIFT)
        yield Row(f"translated by 10^{power}", _body, move, _rounded(np.float64, 10.0**power, "input"))
    for power in (-6, -4, -2, 2, 4, 6):
        yield Row(f"scaled by 10^{power}", _body, partial(PointView.moved, scale=10.0**power), FLOAT32)
    yield Row("fitted, translated by 10^9", _fitted, _fitted_far, _rounded(np.float64, 1e9, "input"))
    yield Row("fitted, scaled by 10^-6", _fitted, lambda s: _fitted(s.moved(scale=1e-6)), FLOAT32)
    yield Row("rotated by a quarter turn", _body, partial(PointView.moved, turn=_QUARTER_TURN), FLOAT32)
    yield Row(
        "rotated by 37 degrees", _body, partial(PointView.moved, turn=_rotation((1, 2, 3), 37)), FLOAT32
    )


def _fitted(shot: PointView | None = None) -> PointView:
    """Points before the camera that a user gets."""
    shot = shot or _body()
    return replace(shot, camera=Camera.orbit(shot.cloud().bounds(), 36, 34, aspect=4 / 3))


def _fitted_far(shot: PointView) -> PointView:
    return _fitted(shot.moved(shift=1e9 * _SHIFT))


def _rotation(axis: tuple[float, float, float], degrees: float) -> NDArray[np.float64]:
    """The rotation about an axis, (3, 3)."""
    return rotation_about(np.radians(degrees) * np.array(axis) / np.linalg.norm(axis))


def _typed() -> Iterator[Row]:
    def at(distance: float) -> Callable[[], PointView]:
        return lambda: _body().moved(shift=distance * _SHIFT)

    def as_type(kind: type) -> Callable[[PointView], PointView]:
        return lambda shot: shot.given(positions=shot.arrays["positions"].astype(kind))

    as_float32, as_float64 = as_type(np.float32), as_type(np.float64)
    yield Row("float32 values as float64", lambda: as_float32(at(100)()), as_float64, EXACT)
    yield Row("float32 input", at(100), as_float32, _rounded(np.float32, 100, "input"))
    # float32 resolves 64 units there: a file of it has a scan of 10^4 units in steps.
    large = _body().moved(shift=1e9 * _SHIFT, scale=1e4)
    yield Row("float32 values, stored as float64, around 10^9", lambda: as_float32(large), as_float64, EXACT)


def _clipped() -> Iterator[Row]:
    def cut() -> PointView:
        shot = _body()
        return replace(shot, camera=replace(shot.camera, near=shot.camera.distance))

    def inside() -> PointView:
        return replace(_body(), camera=Camera((0, 0, 0), (0.6, 0, 0), fov_y=60))

    def cleared(depth: float | None) -> Callable[[PointView], PointView]:
        """Without what lies wholly in front of a depth; None: of the near plane."""

        def clear(shot: PointView) -> PointView:
            limit = shot.camera.clip_range()[0] if depth is None else depth
            return shot.picked(shot.depths() + 1.5 * shot.arrays["radii"] >= limit)

        return clear

    yield Row("the near plane inside the scan", cut, cleared(None), FLOAT32)
    # Seen from the hole of the torus, the nearest point in the picture is 0.6 away.
    yield Row("the eye inside the scan", inside, cleared(0.3), FLOAT32)


def _zoomed() -> Iterator[Row]:
    def detail(power: int) -> Callable[[], PointView]:
        return lambda: _body().moved(shift=0.7 * 10.0**power * _SHIFT)

    def surrounded(shot: PointView, power: int) -> PointView:
        """With a torus 10^power times as large around it, of which no splat reaches the picture."""
        around = PointView(on_torus(5000), shot.camera).moved(scale=10.0**power)
        around = replace(around, camera=shot.camera)
        return shot.joined(around.picked(around.depths() < -2 * around.arrays["radii"]).arrays)

    yield Row(
        "zoomed in to 1/1000 of the scan's width",
        detail(3),
        partial(surrounded, power=3),
        _rounded(np.float32, 700, "offsets"),
    )
    yield Row(
        "zoomed in to a millionth of the scan's width",
        detail(6),
        partial(surrounded, power=6),
        _rounded(np.float32, 2**15 / _UNIT, "float32 offsets from an origin 2^15 pixels away"),
    )

    def splat() -> PointView:
        """A point on a leaning sheet, from so near that its splat fills the picture."""
        leaning = {"normals": np.array([[0.6, 0, 0.8]]), "radii": np.array([4.0])}
        return PointView({**line(1, (0, 0, 0)), **leaning}, Camera((0.0, 0.0, 1.0), fov_y=40))

    for share, power in (("1/1000", 3), ("a millionth", 6)):
        larger = partial(PointView.filled, name="radii", value=10.0**power)
        yield Row(f"zoomed in to {share} of a splat's width", splat, larger, FLOAT32)

    def flat() -> PointView:
        return replace(_body(), camera=_body().camera.projected("orthographic"))

    def telephoto(shot: PointView, power: int) -> PointView:
        """From 10^power times as far, through a lens as narrow as shows the same."""
        camera = shot.camera.at_distance(shot.camera.distance * 10.0**power)
        angle = 2 * np.degrees(np.arctan(shot.camera.view_height / 2 / camera.distance))
        return replace(
            shot, camera=replace(camera, projection="perspective", height=None, fov_y=float(angle))
        )

    # Perspective is below that: x z / distance is 2e-3 px in the mean.
    yield Row("telephoto x10^3", flat, partial(telephoto, power=3), _rounded(np.float32, 6e3, "depths"))
    yield Row(
        "telephoto x10^6",
        flat,
        partial(telephoto, power=6),
        FLOAT32,
    )

    def far(power: int) -> Callable[[], PointView]:
        """A body within one pixel, of one colour, all of which faces the eye."""

        def make() -> PointView:
            body = _body().filled("colors", 0.7)
            return _facing(replace(body, size=(9, 9), camera=body.camera.zoomed(10.0**-power)))

        return make

    def alone(shot: PointView) -> PointView:
        return shot.picked(np.arange(1)).filled("positions", 0.0)

    for power in (6, 9):
        yield Row(f"zoomed out x10^{power}", far(power), alone, FLOAT32)


def _sized() -> Iterator[Row]:
    def window(_: PointView | None, size: tuple[int, int], margin: int) -> PointView:
        """A wall of four points a pixel; the same pixels whatever the margin."""
        width, height = (edge + 2 * margin for edge in size)
        points = wall(2 * size[0] + 12, 2 * size[1] + 12, spacing=0.5, wave=0.3)
        camera = Camera((0.0, 0.0, 5.0), projection="orthographic", height=float(height))
        return PointView(points, camera, (width, height), margin=(margin, margin))

    for size in ((1, 1), (8192, 1)):
        yield Row(
            f"{size[0]}x{size[1]} pixels",
            partial(window, None, size=size, margin=2),
            partial(window, size=size, margin=0),
            # Coordinates up to 4096 resolve 32 times less; points lie 1/4 px from the borders.
            Tolerance(FLOAT32.error * 32, "float32 pixel coordinates near 4096"),
        )


def _arranged() -> Iterator[Row]:
    def copied(order: Callable[[NDArray, int], NDArray]) -> Callable[[PointView], PointView]:
        return lambda shot: shot.picked(order(np.arange(len(shot)), 1000))

    def few() -> PointView:
        """Splats that leave no gaps, and reach so few tiles that these have room for a thousand of each."""
        shot = PointView(wall(10, 8, spacing=0.25, wave=0.3), Camera((1.0, 0.5, 5.0)))
        return shot.filled("radii", 0.21)

    def bare() -> PointView:
        """The same spacing everywhere: whatever is looked at to estimate it."""
        return PointView(wall(20, 15, spacing=0.12), Camera((1.0, 0.5, 5.0))).given(radii=None)

    # Sums of a thousand copies exceed the 24 bits of float32, which is what a rasteriser adds.
    yield Row("each point 1000 times in a row", few, copied(np.repeat), EXACT, summed=FLOAT32)
    yield Row("the list of points 1000 times", few, copied(np.tile), EXACT, summed=FLOAT32)
    # Lists of tiles overflow here, and some points hide others.
    yield Row("a body, each point 1000 times", partial(_body, 300), copied(np.repeat), FLOAT32)
    yield Row("each point 1000 times, without radii", bare, copied(np.repeat), FLOAT32)

    def at_one_place() -> PointView:
        return _thread().picked(np.arange(1)).filled("positions", 0.0).filled("radii", 0.3)

    yield Row("one point x1000", at_one_place, copied(np.tile), EXACT)

    def spread(shot: PointView) -> PointView:
        """With eight points behind the eye that span a volume."""
        corners = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], np.float64)
        behind = shot.picked(np.arange(8)).given(positions=2 * np.array(shot.camera.eye) + corners)
        return shot.joined(behind.arrays)

    yield Row("coplanar points", _slanted, spread, FLOAT32)
    yield Row("coplanar points without normals", _slanted, lambda s: s.given(normals=None), FLOAT32)
    yield Row("collinear points", _thread, spread, FLOAT32)
    yield Row(
        "collinear points without normals",
        lambda: _facing(_thread()),
        lambda shot: shot.given(normals=None),
        FLOAT32,
    )

    def end_on(projection: str) -> Callable[[], PointView]:
        def make() -> PointView:
            shot = PointView(line(50, (0, 0, 1)), Camera(projection=projection))
            return replace(shot, camera=shot.camera.fit(shot.cloud().bounds(), 4 / 3))

        return make

    def nearest(shot: PointView) -> PointView:
        return shot.picked(shot.depths().argsort()[:1])

    for projection in PROJECTIONS:
        yield Row(
            f"collinear points, viewed along their line, {projection}", end_on(projection), nearest, FLOAT32
        )

    def with_outlier(shot: PointView) -> PointView:
        outlier = shot.picked(np.arange(1)).given(positions=1e6 * _SHIFT[None])
        return _fitted(outlier.joined(shot.arrays))

    yield Row("an outlier at a million times the scan's width", _fitted, with_outlier, FLOAT32)


def _slanted() -> PointView:
    return _sheet().moved(turn=_rotation((1, 2, 3), 37))


def _facing(shot: PointView) -> PointView:
    """Points with normals that face the eye."""
    normals = np.array(shot.camera.eye) - shot.arrays["positions"]
    return shot.given(normals=normals / np.linalg.norm(normals, axis=1, keepdims=True))


def _spoilt() -> Iterator[Row]:
    yield Row("normals parallel to the y axis", _sheet, partial(PointView.moved, turn=_QUARTER_TURN), FLOAT32)

    def about_y(shot: PointView, angle: float) -> PointView:
        turn = 2.4 * np.arange(len(shot))
        aside = np.stack([np.cos(turn), np.zeros(len(shot)), np.sin(turn)], axis=1)
        return shot.given(normals=shot.arrays["normals"] + angle * aside)

    # 1e-4 is where a template that has a special case at y changes over.
    for power in (-7, -4):
        yield Row(
            f"normals that deviate from the y axis by 10^{power} rad",
            lambda: _sheet().moved(turn=_QUARTER_TURN),
            partial(about_y, angle=10.0**power),
            Tolerance(
                FLOAT32.error + 5 * 10.0**power, ("a splat of 5 px, tilted by as much as the normals deviate")
            ),
        )

    def matt() -> PointView:
        return _facing(replace(_body(), look=Look(light="head", specular=0)))

    for name, value in (("zero-length", 0.0), ("NaN", np.nan)):
        yield Row(
            f"{name} normals",
            matt,
            partial(PointView.filled, name="normals", value=value),
            # 2 px aside, 228 px from the eye: cos 0.009 is 0.006 levels less.
            Tolerance(
                1e-4,
                "one of the pictures turns normals towards the camera per point, and the other per pixel",
            ),
        )

    def closed() -> PointView:
        """A sheet beyond the picture's edges: closed whatever the radii, if there is one."""
        return replace(_sheet(), arrays=wall(100, 80, spacing=0.04))

    for name, value in (("zero", 0.0), ("negative", -1.0), ("NaN", np.nan)):
        yield Row(f"{name} radii", closed, partial(PointView.filled, name="radii", value=value), FLOAT32)


def _flipped() -> Iterator[Row]:
    """Points that are flipped at spheres far larger than the scan, from outside and inside."""

    def inside() -> PointView:
        return replace(_body(), camera=Camera((0, 0, 0), (0.6, 0, 0), fov_y=60))

    for where, shot in (("around", _body), ("inside", inside)):
        for power in (2, 4, 6, 8):
            yield Row(
                f"a sphere of 10^{power} times the size, {where}",
                shot,
                partial(PointView.moved, scale=10.0 ** (-6 if power % 4 else 6)),
                FLOAT32,
                setting={"mode": "hull", "radius": 10.0**power},
            )
