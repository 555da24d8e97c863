"""What Slomp 2014 measured of surfels, and the same here: by each feed, in two passes, enlarged.

The paper's scans were never published. Sequences of today stand in for them, with exactly as many points
a pose (Table I); size, coverage and method are the paper's (VII).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from ....backends import backend
from ....resources import resource_path
from ....splatting.amplify import FEEDS
from ...baselines import FLOOR
from ...plan import Contender, Group
from . import literal

BACKEND, FEED = "surfels", "instancing"  # the parameter is called alike wherever there are feeds
# As theirs: two passes, twice the splat in the second, back faces left out. One radius for all: others are in
# a buffer of their own, which the feed of uniform buffers does not bring.
_METHOD = {"passes": "two", "enlarge": 2.0, "cull_back": True, "radius": "uniform"}
_STAND_INS = {
    "baseball": "crane",
    "basketball": "owlii",
    "kick": "crane",
    "soccer (juggle)": "owlii",
    "soccer (shoot)": "horse-gallop",
}


@dataclass(frozen=True)
class Scan:
    """A scan of the table. name: the paper's, empty for ours. scene: what is drawn here.

    points: a pose; None: as many as the scene has.
    """

    name: str
    scene: str
    points: int | None


@cache
def paper() -> dict[str, Any]:
    """Tables I to IV and the machine, as assets/slomp-2014.json has them."""
    return json.loads(resource_path("assets", "slomp-2014.json").read_text(encoding="utf-8"))


def scans() -> list[Scan]:
    """The paper's five, in the order of its tables, and the demo."""
    datasets = paper()["datasets"]
    theirs = (Scan(name, _STAND_INS[name], datasets[name]["points"]) for name in datasets)
    return [*theirs, Scan("", "demo", None)]


def feeds(name: str) -> list[str]:
    """Every feed that a backend has, in the order of their declaration."""
    (declared,) = (parameter for parameter in backend(name).parameters if parameter.name == FEED)
    return [feed for feed in declared.choices if feed != "auto"]


def by_feed(scan: Scan, name: str, method: Mapping[str, Any], beside: Sequence[Contender] = ()) -> Group:
    """All feeds of a backend, which take turns on a scan, and plain GL_POINTS as everywhere; timed alone.

    method: the backend's other parameters. beside: what else takes turns with them.
    """
    params = (backend(name).params({**method, FEED: feed}) for feed in feeds(name))
    drawn = (Contender(FLOOR), *(Contender(name, each, FEED) for each in params), *beside)
    return Group(scan.scene, drawn, count=scan.points, sweep=FEED, judged=False)


def groups() -> list[Group]:
    """A group for each scan of Table II, and for the demo: the backend's feeds, the paper's own splats."""
    paper_feeds = [Contender(literal.NAME, literal.PaperParams(feed), FEED) for feed in FEEDS]
    return [by_feed(scan, BACKEND, _METHOD, paper_feeds) for scan in scans()]
