"""Range sequences played: 30 poses of two views of 640 x 480 samples, as the window plays them."""

from __future__ import annotations

import time
from collections.abc import Iterator

from experiments.farooq_2013 import pyramids
from experiments.farooq_2013.large_views import MIDDLE
from experiments.suite import row_of
from experiments.tables import Row
from viewer.bench.plan import Group
from viewer.bench.run import LOOK, Bench
from viewer.bench.scenes.viewpoints import pod_camera, sample_near
from viewer.drawing.frame import render_frame
from viewer.drawing.request import Request
from viewer.picture.surface import Surface
from viewer.scan.formats.exr import write_views
from viewer.scan.open import open_scan
from viewer.scan.timeline import Timeline
from viewer.unfinished import temporary_folder

SCENE, POSES = "demo-pair", 30
_SIZE = (960, 640)
_ZOOM = 1.0
_PATIENCE = 1e-3  # seconds between two looks whether a pose is there


def measure_playing(bench: Bench, poses: int = POSES) -> Iterator[Row]:
    """A row for each primitive: frames a second while the poses are read, and once they are in memory.

    Poses are read by the timeline's worker ahead of the picture, brought to the GPU and drawn in full, one
    after the other, none left out. Shaders are compiled before.
    """
    subject = bench.subject(Group(SCENE, (), noise=0.0))
    with temporary_folder() as folder:
        for index in range(poses):
            write_views(folder / f"head{index:02d}.exr", subject.moment(index).pose.views)
        for primitive in pyramids.PRIMITIVES:
            with open_scan(folder) as timeline:
                _play(bench, timeline, primitive, 1)
            with open_scan(folder) as timeline:
                reading, playing = (_play(bench, timeline, primitive, poses) for _ in range(2))
            laps = {"reading": reading, "playing": playing}
            yield row_of(bench, scene=SCENE, poses=poses, primitive=primitive, size=list(_SIZE), **laps)


def _play(bench: Bench, timeline: Timeline, primitive: str, poses: int) -> dict[str, float]:
    """Frames a second of the first poses, and what each took to prepare, ms: `derive_ms` on the CPU."""
    renderer, surface = bench.renderer, Surface(bench.renderer.gpu, _SIZE)
    camera, params = None, pyramids.with_levels(pyramids.MOST_LEVELS, primitive)
    upload, derive = 0.0, 0.0
    start = time.perf_counter()
    for index in range(poses):
        timeline.prefetch(index)
        while (pose := timeline.ready(index)) is None:
            time.sleep(_PATIENCE)
        if camera is None:
            camera = pod_camera(pose.views[0], sample_near(pose.views[0], MIDDLE), _ZOOM, _SIZE)
        render_frame(renderer, Request(pose, camera, pyramids.BACKEND, params, LOOK), surface)
        renderer.gpu.ctx.finish()
        upload, derive = upload + surface.stats.upload_ms, derive + surface.stats.derive_ms
    seconds = time.perf_counter() - start
    surface.release()
    return {"fps": poses / seconds, "upload_ms": upload / poses, "derive_ms": derive / poses}
