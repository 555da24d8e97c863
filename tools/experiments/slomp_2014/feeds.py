"""Table II of Slomp 2014, then and now: surfels by each feed, in two passes, enlarged."""

from __future__ import annotations

from experiments.slomp_2014.scans import FEED, PAPER, by_feed, feed_tables, scans
from experiments.suite import Suite, pictures
from experiments.tables import Machines
from viewer.backends import backend
from viewer.backends.surfels import AS_PRINTED
from viewer.bench.plan import Contender, Group
from viewer.bench.run import BenchSettings
from viewer.splatting.amplify import FEEDS

BACKEND = "surfels"
# As theirs: two passes, twice the splat in the second, back faces left out. One radius for all: others are in
# a buffer of their own, which the feed of uniform buffers does not bring.
_METHOD = {"passes": "two", "enlarge": 2.0, "cull_back": True, "radius": "uniform", "surface": "nearest"}


def groups() -> list[Group]:
    """A group for each scan of Table II, and for the demo: the backend's feeds, and the passes as printed."""
    printed = {**_METHOD, "passes": AS_PRINTED}
    own = [Contender(BACKEND, backend(BACKEND).params({**printed, FEED: feed}), FEED) for feed in FEEDS]
    return [by_feed(scan, BACKEND, _METHOD, own) for scan in scans()]


EXPERIMENT = Suite(
    page="table-two.md",
    parts={"rows": pictures(params={FEED: "feed", "passes": "passes"}, sweeps=[FEED])},
    tables=[
        *feed_tables("surfels_ms", lambda scan: scan.title, {AS_PRINTED: "as printed"}),
        Machines(BACKEND, PAPER),
    ],
    groups=lambda *_: groups(),
    own=BACKEND,
    usual=BenchSettings(),
)
