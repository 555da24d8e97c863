"""Suites of the benchmark that have a page of their own: what each measures, and what makes its page."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

from ..backends import backends
from .choosing import SCENES as CHOICE_SCENES
from .choosing import measure_choices
from .defaults import SCENES as DEFAULT_SCENES
from .defaults import default_groups
from .measuring import NAME as MEASURING
from .measuring import SCENES as MEASURED_SCENES
from .measuring import measure_distances, write_measuring
from .papers.farooq_2013 import pyramids
from .papers.farooq_2013.farooq import NAME as FAROOQ
from .papers.farooq_2013.farooq import write_farooq
from .papers.farooq_2013.laplacian import NAME as LAPLACIAN
from .papers.farooq_2013.laplacian import write_laplacian
from .papers.farooq_2013.large_views import measure_large_views
from .papers.farooq_2013.playing import measure_playing
from .papers.farooq_2013.splines import PICTURE as SEAM_PICTURE
from .papers.farooq_2013.splines import SCENES as SEAM_SCENES
from .papers.farooq_2013.splines import measure_alone, measure_bands, measure_seams, measure_sizes
from .papers.machado_2014.accuracy import SCENES as VISIBILITY_SCENES
from .papers.machado_2014.accuracy import measure_visibility
from .papers.machado_2014.growth import measure_growth
from .papers.machado_2014.hpr import NAME as HPR
from .papers.machado_2014.hpr import write_hpr
from .papers.machado_2014.pictures import ERROR_PICTURE, GROWTH_PICTURE, SECTOR_PICTURE
from .papers.machado_2014.speed import measure_speeds
from .papers.marsik_2010.codeword import NAME as CODEWORD
from .papers.marsik_2010.codeword import write_codeword
from .papers.marsik_2010.words import SCENES as WORD_SCENES
from .papers.marsik_2010.words import SIZES as WORD_SIZES
from .papers.marsik_2010.words import measure_pixels, measure_tables, measure_times
from .papers.preiner_2012 import auto_splats
from .papers.preiner_2012.fits import measure_fits
from .papers.preiner_2012.preiner import NAME as PREINER
from .papers.preiner_2012.preiner import write_preiner
from .papers.preiner_2012.searches import measure_searches
from .papers.slomp_2014 import octree_sizes, octrees
from .papers.slomp_2014 import surfels as slomp
from .papers.slomp_2014.octree_tables import NAME as OCTREE_TABLES
from .papers.slomp_2014.octree_tables import write_octree_tables
from .papers.slomp_2014.table_two import NAME as TABLE_TWO
from .papers.slomp_2014.table_two import write_table_two
from .plan import Group, plan
from .report.choices import NAME as CHOICE
from .report.choices import write_choices
from .report.defaults_page import NAME as DEFAULTS
from .report.defaults_page import write_defaults
from .report.results import (
    ALONE,
    BAND_TIMES,
    CHOICES,
    DISTANCES,
    FITS,
    GROWTH,
    LARGE_VIEWS,
    OCTREE_SIZES,
    OCTREES,
    PICTURE_SIZES,
    PLAYING,
    SEAMS,
    SEARCHES,
    SPEEDS,
    VISIBILITY,
    WORD_PIXELS,
    WORD_TABLES,
    WORD_TIMES,
    Row,
)
from .report.scene_table import NAME as SCENE_TABLE
from .report.scene_table import write_scene_table
from .run import Bench, BenchSettings
from .scenes import catalog


@dataclass(frozen=True)
class PageSuite:
    """A suite that has a page of its own.

    write_page: makes the page of a folder. page: its name. scenes: which, unless others are named; None: it
    has its own. groups: what is drawn of some scenes; None: no pictures of them. others: what else is
    measured, by the files of its rows, given the bench, and the scenes where it has any. pictures: what these
    write beside, by name. usual: settings unless told otherwise. quick: scenes and views of the quick form,
    where it has one of its own.
    """

    write_page: Callable[[Path], Path]
    page: str
    scenes: Sequence[str] | None = None
    groups: Callable[[BenchSettings, Sequence[str]], list[Group]] | None = None
    others: Mapping[str, Callable[..., Iterator[Row]]] = field(default_factory=dict)
    pictures: Sequence[str] = ()
    usual: BenchSettings = field(default_factory=BenchSettings)
    quick: tuple[Sequence[str], int] | None = None


def _octree_scans(bench: Bench) -> Iterator[Row]:
    """Octrees built and cut, of the scans that are there."""
    missing = catalog.scene_names(bench.settings.data)
    scans = [scan for scan in slomp.scans() if not missing[scan.scene]]
    return octrees.build_and_cut(bench, scans)


def _octree_sizes(bench: Bench) -> Iterator[Row]:
    return map(asdict, octree_sizes.measure(bench.settings.data))


PAGE_SUITES: Mapping[str, PageSuite] = {
    "summary": PageSuite(
        write_scene_table,
        SCENE_TABLE,
        ("bunny", "bunny-bare", "bunny-ramp-bare", "dragon-scans", "bunny-scans", "truedepth-head", "demo"),
        groups=lambda _, scenes: plan(scenes, list(backends()), counts=(), noises=(), swept_scenes=0),
        usual=BenchSettings(size=(960, 640), frames=0),
    ),
    "defaults": PageSuite(
        write_defaults,
        DEFAULTS,
        DEFAULT_SCENES,
        groups=default_groups,
        usual=BenchSettings(size=(384, 256), views=4, frames=0),
    ),
    "measuring": PageSuite(
        write_measuring,
        MEASURING,
        MEASURED_SCENES,
        others={DISTANCES: measure_distances},
        usual=BenchSettings(size=(400, 300), views=8, frames=0),
    ),
    "choice": PageSuite(
        write_choices,
        CHOICE,
        CHOICE_SCENES,
        others={CHOICES: measure_choices},
        usual=BenchSettings(views=10, repeat=2, frames=0, seed=1),  # other views than models are fitted to
        quick=(("torus", "sheets-bare"), 2),
    ),
    "hpr": PageSuite(
        write_hpr,
        HPR,
        VISIBILITY_SCENES,
        others={VISIBILITY: measure_visibility, GROWTH: measure_growth, SPEEDS: measure_speeds},
        pictures=(ERROR_PICTURE, SECTOR_PICTURE, GROWTH_PICTURE),
        usual=BenchSettings(size=(400, 300), views=2, frames=0),
        quick=(VISIBILITY_SCENES[:1], 1),
    ),
    "laplacian": PageSuite(
        write_laplacian,
        LAPLACIAN,
        SEAM_SCENES,
        others={
            SEAMS: measure_seams,
            ALONE: measure_alone,
            PICTURE_SIZES: measure_sizes,
            BAND_TIMES: measure_bands,
        },
        pictures=(SEAM_PICTURE,),
        usual=BenchSettings(size=(640, 480), views=3, frames=0),
        quick=(SEAM_SCENES[:1], 1),
    ),
    "codeword": PageSuite(
        write_codeword,
        CODEWORD,
        WORD_SCENES,
        others={WORD_TIMES: measure_times, WORD_PIXELS: measure_pixels, WORD_TABLES: measure_tables},
        usual=BenchSettings(size=WORD_SIZES[0], views=1, repeat=9, frames=0),
        quick=(WORD_SCENES[:1], 1),
    ),
    "slomp": PageSuite(write_table_two, TABLE_TWO, groups=lambda *_: slomp.groups()),
    "octrees": PageSuite(
        write_octree_tables,
        OCTREE_TABLES,
        groups=lambda *_: octrees.groups(),
        others={OCTREES: _octree_scans, OCTREE_SIZES: _octree_sizes},
        usual=BenchSettings(frames=0),  # how voxels flicker, the scenes tell
    ),
    "farooq": PageSuite(
        write_farooq,
        FAROOQ,
        groups=lambda *_: pyramids.groups(),
        others={LARGE_VIEWS: measure_large_views, PLAYING: measure_playing},
        usual=BenchSettings(size=(640, 480), views=8, frames=0),
    ),
    "preiner": PageSuite(
        write_preiner,
        PREINER,
        groups=lambda *_: auto_splats.groups(),
        others={SEARCHES: measure_searches, FITS: measure_fits},
        usual=BenchSettings(size=auto_splats.SIZE, views=4, frames=3),
    ),
}
