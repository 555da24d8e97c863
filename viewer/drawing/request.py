"""What a picture shows: a pose, a camera, a renderer with its parameters, a look, and layers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

from ..backends import Backend, backends
from ..backends import backend as find_backend
from ..camera import Camera
from ..gpu.pose import drawn_bounds
from ..look import Look, drawable
from ..scan.layers import NO_LAYERS, Layers
from ..scan.pose import Pose
from ..view import View, origin_near

FALLBACK = "points"


class Chosen(NamedTuple):
    """A backend and the parameters that it draws with."""

    backend: Backend
    params: Any


@dataclass(frozen=True, eq=False)
class Request:
    """Order for a picture. backend: a name, or one that is not in the folder of backends; None
    for the default of the scan (see `backend_for`).

    params: the backend's own `Params`; None for its defaults. layers: over the pose.
    """

    pose: Pose
    camera: Camera
    backend: str | Backend | None = None
    params: Any = None
    look: Look = field(default_factory=Look)
    layers: Layers = NO_LAYERS

    @cached_property
    def chosen(self) -> Chosen:
        """The backend and its parameters, found once. Raises InputError for a name that is unknown."""
        if isinstance(self.backend, Backend):
            backend, params = self.backend, self.backend.params()
        else:
            name, params = backend_for(self.pose, self.backend)
            backend = find_backend(name)
        return Chosen(backend, params if self.params is None else self.params)


def backend_for(
    pose: Pose, name: str | None = None, values: Mapping[str, object] | None = None
) -> tuple[str, Any]:
    """(backend name, its parameters) for a scan: what the user named, the rest by default.

    name: None takes the backend that says it suits the pose best, as it was read: a default never waits for
    an estimate. values: parameters by name. Raises InputError for unknown names.
    """
    if name is not None:
        return name, find_backend(name).params(values)
    suited = [(one, found) for one in backends().values() if (found := one.suits(pose)) is not None]
    best, (_, params) = max(suited, key=lambda each: each[1].rank)
    return best.name, best.params({**params, **(values or {})})


def fallback(request: Request) -> Request:
    """Request for plain points that touch, of which nothing is prepared: drawn while the other picture is."""
    points = find_backend(FALLBACK)
    suited = points.suits(request.pose)
    params = points.params(suited.params if suited else None)
    plain = colorable(replace(request, backend=FALLBACK, params=params))
    return replace(plain, look=_unlit(plain.look))


def colorable(request: Request) -> Request:
    """The request with other colours where neither its pose nor its backend has the number that gives
    them."""
    names = request.layers.names(request.pose.overview.scalars)
    look = drawable(request.look, names, request.chosen.backend.values)
    return request if look is request.look else replace(request, look=look)


def view_of(request: Request, size: tuple[int, int]) -> View:
    """The view that a request shows its pose by, in a picture of this size, pixels."""
    pose, camera, place = request.pose, request.camera, request.layers.world_from_pose
    origin = origin_near(camera, size, pose.origin, place)
    bounds = drawn_bounds(pose, camera)
    return View.of(camera, size, origin, bounds, place).straightened(bounds)


def _unlit(look: Look) -> Look:
    """The look without what needs normals, for as long as they are being estimated."""
    color_by = "auto" if look.color_by == "normal" else look.color_by
    return replace(look, light="auto", color_by=color_by)
