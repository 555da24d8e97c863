"""What a picture shows: a pose, a camera, a backend with its parameters, a look, and layers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

from ..backends import Backend, backends
from ..backends import backend as find_backend
from ..camera import Camera
from ..look import Look, drawable, is_lit
from ..scan.layers import NO_LAYERS, Layers
from ..scan.pose import Life, Pose
from ..view import View, origin_near

FALLBACK = "points"
_defaults: WeakKeyDictionary[Life, tuple[str, Mapping[str, object]]] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False, init=False)
class Request:
    """Order for a picture. Backend and parameters are resolved when it is made, and only then.

    params: the backend's own `Params`. layers: over the pose.
    """

    pose: Pose
    camera: Camera
    backend: Backend
    params: Any
    look: Look
    layers: Layers

    def __init__(
        self,
        pose: Pose,
        camera: Camera,
        backend: str | Backend | None = None,
        params: Any = None,
        look: Look | None = None,
        layers: Layers = NO_LAYERS,
    ) -> None:
        """backend: its name, or one that is not in the folder of backends; None for the default of the scan
        (see `backend_for`). params: None for the defaults. Raises InputError for an unknown name."""
        if backend is None:
            backend, default = backend_for(pose)
            params = default if params is None else params
        found = backend if isinstance(backend, Backend) else find_backend(backend)
        params = found.params() if params is None else params
        values = (pose, camera, found, params, look or Look(), layers)
        for name, value in zip(self.__dataclass_fields__, values, strict=True):
            object.__setattr__(self, name, value)

    def seen_by(self, camera: Camera) -> Request:
        """The request for the same picture from another camera."""
        return Request(self.pose, camera, self.backend, self.params, self.look, self.layers)

    @cached_property
    def needs(self) -> tuple[str, ...]:
        """Names of what the backend needs of the pose, see `Backend.needs`; asked for once."""
        return self.backend.needs(self.pose, self.params)

    @property
    def reads(self) -> tuple[str, ...]:
        """Names of what its picture reads of a pose that has it: what the backend needs, what else
        it draws with, and what the look shows of points."""
        if self.backend.rows != "points" or self.draws_samples:
            return self.needs
        look, names = self.look, [*self.needs, *self.backend.draws_with]
        if look.color_by in ("auto", "level", "own"):
            names.append("colors")
        if is_lit(look) and not self.backend.finds_normals:
            names.append("normals")
        if look.color_by == "id":
            names.append("ids")
        return tuple(dict.fromkeys(names))

    @property
    def draws_samples(self) -> bool:
        """Whether the backend draws samples of range views alone, and reads no points."""
        return set(self.needs) == {"views"}


def backend_for(
    pose: Pose, name: str | None = None, values: Mapping[str, object] | None = None
) -> tuple[str, Any]:
    """(backend name, its parameters) for a scan: what the user named, the rest by default.

    name: None takes the backend that suits the pose best, as it was read: a default never waits for an
    estimate. It is found once for a pose. values: parameters by name. Raises InputError for unknown names.
    """
    if name is not None:
        return name, find_backend(name).params(values)
    if pose.life not in _defaults:
        suited = [(one, found) for one in backends().values() if (found := one.suits(pose)) is not None]
        best, (_, params) = max(suited, key=lambda each: each[1].rank)
        _defaults[pose.life] = best.name, params
    name, params = _defaults[pose.life]
    return name, find_backend(name).params({**params, **(values or {})})


def fallback(request: Request) -> Request:
    """Request for plain points that touch: drawn, without preparation, until the other picture is ready."""
    points = find_backend(FALLBACK)
    suited = points.suits(request.pose)
    params = points.params(suited.params if suited else None)
    plain = colorable(replace(request, backend=points, params=params))
    return replace(plain, look=_unlit(plain.look))


def colorable(request: Request) -> Request:
    """The request with other colours if neither its pose nor its backend has the number that gives them."""
    names = request.layers.names(request.pose.overview.scalars)
    look = drawable(request.look, names, request.backend.values)
    return request if look is request.look else replace(request, look=look)


def view_of(request: Request, size: tuple[int, int]) -> View:
    """The view that a request shows its pose by, in a picture of this size, pixels."""
    pose, camera, motion = request.pose, request.camera, request.layers.world_from_pose
    origin = origin_near(camera, size, pose.origin, motion)
    bounds = pose.drawn_bounds(camera)
    return View.of(camera, size, origin, bounds, motion).straightened(bounds)


def _unlit(look: Look) -> Look:
    """The look without what needs normals, as long as they are being estimated."""
    color_by = "auto" if look.color_by == "normal" else look.color_by
    return replace(look, light="auto", color_by=color_by)
