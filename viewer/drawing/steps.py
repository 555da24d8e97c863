"""The work that a picture needs before it: merging range views, estimates, and a backend's derived data."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..backends import Derives
from ..errors import InputError
from ..gpu.pose import GpuPose
from ..look import wants_normals
from ..scan.estimate import Estimates, estimate
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..scan.spacing import spacings
from ..view import View
from .jobs import DerivedKey, Preparation, Stage
from .request import Request
from .residents import Resident


def next_step(resident: Resident, request: Request, view: View | None) -> Preparation | None:
    """The next work for a picture of this request; None if nothing is missing.

    view: None leaves out what is derived for one view alone. Raises InputError if the backend needs range
    views that the pose lacks.
    """
    gpu_pose = resident.gpu_pose
    if not (gpu_pose.pose.is_merged or request.draws_samples):
        return Preparation(
            Stage.MERGE, _merge, "Merging range views", _merge, lambda: (gpu_pose,), lambda _: None, True
        )
    if missing := _missing(gpu_pose, request):
        name = f"Estimating {' and '.join(missing)}"
        args = lambda: (_bare(resident.with_estimates(())), missing)  # noqa: E731

        def take(found: Estimates) -> None:
            gpu_pose.add_estimates(found.arrays)
            gpu_pose.pose.scan.note_sides(found.sides)

        return Preparation(Stage.ESTIMATE, missing, name, estimate, args, take)
    if _awaits_facts(resident, request):
        return _foresee(resident, request)
    key = derived_key(request, view)
    return None if key is None or key in resident.derived else _derive(resident, request, key, view)


def derived_key(request: Request, view: View | None) -> DerivedKey | None:
    """Key of what the backend derives for this picture; None where it derives nothing, or for a view that is
    not given."""
    backend, params = request.backend, request.params
    what = None if backend.derives is Derives.NEVER else backend.derive_key(params)
    if what is None or (backend.derived_by_camera and view is None):
        return None
    seen = view.key if backend.derived_by_camera and view is not None else None
    return DerivedKey((backend.name, *what), seen)


def _derive(resident: Resident, request: Request, key: DerivedKey, view: View | None) -> Preparation:
    gpu_pose, backend, params = resident.gpu_pose, request.backend, request.params

    def args() -> tuple[Any, ...]:
        pose = gpu_pose.pose if request.draws_samples else resident.with_estimates(request.needs)
        return pose, params, view if backend.derived_by_camera else None

    def take(result: Any) -> None:
        with gpu_pose.preparing("upload"):
            resident.store(key, backend.upload(gpu_pose.gpu, result))

    stage = Stage.DERIVE if key.view is None else Stage.DERIVE_VIEW
    on_thread = backend.derives is Derives.ON_THREAD
    return Preparation(stage, key, f"Preparing {backend.title}", backend.derive, args, take, on_thread)


def _awaits_facts(resident: Resident, request: Request) -> bool:
    backend, params = request.backend, request.params
    if not backend.awaits_facts(params) or (backend, params) in resident.foreseen:
        return False
    return not (resident.gpu_pose.is_split or request.draws_samples)


def _foresee(resident: Resident, request: Request) -> Preparation:
    backend, params = request.backend, request.params

    def args() -> tuple[Any, ...]:
        return resident.gpu_pose.stored, params

    def take(_: None) -> None:
        resident.foreseen.add((backend, params))

    name = f"Preparing {backend.title}"
    return Preparation(Stage.FORESEE, (backend, params), name, backend.foresee, args, take, on_thread=True)


def _merge(pose: GpuPose) -> bool:
    """Merge the points of range views, and find what drawing asks of them."""
    spacings(pose.stored)
    return True


def _missing(pose: GpuPose, request: Request) -> tuple[str, ...]:
    """Attributes of the points to estimate. Looks at no point if the backend draws samples."""
    backend, wanted = request.backend, set(request.needs)
    if "views" in wanted and not pose.views:
        raise InputError(
            f"{backend.title} draws only range views, but this scan has none", hint="Choose another renderer"
        )
    has_own = backend.finds_normals or request.draws_samples
    if wants_normals(request.look) and not has_own:
        wanted.add("normals")
    wanted.discard("views")
    return tuple(sorted(name for name in wanted if getattr(pose.cloud, name) is None and len(pose.cloud)))


def _bare(pose: Pose) -> Pose:
    """The pose with nothing but what estimates read, since it may go to another process."""
    bare = pose.with_cloud(_bare_cloud(pose.cloud))
    if isinstance(bare.points, PointCloud):
        return bare
    views = tuple(replace(view, color=None, confidence=None) for view in pose.views)
    return replace(bare, points=replace(bare.points, views=views))


def _bare_cloud(cloud: PointCloud) -> PointCloud:
    return PointCloud(
        cloud.positions, cloud.origin, ids=cloud.ids, viewpoint=cloud.viewpoint, orientation=cloud.orientation
    )
