"""Normals, radii and pictures of splats against models whose surface is known, as Preiner 2012 shows them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from experiments.preiner_2012 import fits, preiner
from experiments.preiner_2012.searches import BACKEND, K

from viewer.backends import backend
from viewer.bench.plan import Contender, Group
from viewer.bench.run import Bench, BenchSettings
from viewer.bench.scenes import catalog

if TYPE_CHECKING:
    from viewer.drawing.renderer import Renderer

pytestmark = [pytest.mark.backend("auto_splats"), pytest.mark.slow]

# Degrees that half of the normals are within. Planes through 10 of all points of the armadillo, of which this
# is a quarter of the published one, are 3.9 off.
MEDIANS = {"armadillo": 4.2, "igea": 1.0, "dragon": 3.0}
MOST = 3.0  # of planes that go through as few points as noise allows


@pytest.mark.parametrize("scene", MEDIANS)
def test_normals_are_right_and_stay(scene: str, data_dir: Path) -> None:
    moment = catalog.subject(scene, data_dir).moment(0)
    settings = BenchSettings(size=preiner.SIZE, views=2)
    found = fits.fit_errors(moment.pose.cloud, moment.mesh, settings, {"k": K, "adaptive": False})
    inside = found["found_inside"]
    assert inside["median"] < MEDIANS[scene]
    assert inside["p95"] < 20
    assert inside["median"] < found["open3d_inside"]["median"] + 1
    assert inside["p95"] < found["open3d_inside"]["p95"] + 1
    assert found["turned"] < 0.5
    assert found["grown"] < 0.01
    adaptive = fits.fit_errors(moment.pose.cloud, moment.mesh, settings, {"k": K, "adaptive": True})
    assert adaptive["found_inside"]["median"] < MOST
    assert adaptive["found_inside"]["p95"] < 20


# Planes through 10 of all points of the dragon have 1.50 there.
LACKS = pytest.mark.xfail(reason="1.52 in place of 1.5", strict=True)


@pytest.mark.parametrize("scene", ["armadillo", "igea", pytest.param("dragon", marks=LACKS)])
def test_normals_at_silhouettes_are_about_as_right_as_inside(scene: str, data_dir: Path) -> None:
    moment = catalog.subject(scene, data_dir).moment(0)
    settings = BenchSettings(size=preiner.SIZE, views=2)
    found = fits.fit_errors(moment.pose.cloud, moment.mesh, settings, {"k": K, "adaptive": False})
    assert found["found_band"]["p95"] < 1.5 * found["found_inside"]["p95"]


@pytest.mark.parametrize("scene", ["bunny", "armadillo", "igea", "dragon"])
def test_pictures_are_as_good_as_those_of_precomputed_planes(
    scene: str, renderer: Renderer, data_dir: Path
) -> None:
    bench = Bench(renderer, BenchSettings(size=preiner.SIZE, views=2, repeat=1, frames=0, data=data_dir))
    group = next(group for group in preiner.groups() if group.scene == scene)
    kept = tuple(each for each in group.contenders if not each.sweep)
    errors = {row["backend"]: row["errors"] for row in bench.measure(replace(group, contenders=kept))}
    assert not bench.notes
    drawn = errors[BACKEND]
    assert drawn["hole_percent"] < 0.2
    assert drawn["psnr"] > 30
    assert drawn["psnr"] > errors[preiner.PRECOMPUTED]["psnr"] - 1


def test_culling_and_refinement_keep_the_picture(renderer: Renderer, data_dir: Path) -> None:
    """Of a scene where five to six surfaces lie behind each other."""
    bench = Bench(renderer, BenchSettings(size=(880, 450), views=2, repeat=1, frames=0, data=data_dir))
    drawn = [
        Contender(BACKEND, backend(BACKEND).params({"cull": cull, "refine": refine}))
        for cull in (False, True)
        for refine in (False, True)
    ]
    plain, refined, culled, both = (row["errors"] for row in bench.measure(Group(preiner.DEEP, tuple(drawn))))
    assert both["psnr"] > refined["psnr"] - 0.1
    assert culled["psnr"] > plain["psnr"] - 0.1
    assert refined["spill_percent"] < plain["spill_percent"]
