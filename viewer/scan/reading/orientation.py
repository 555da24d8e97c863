"""On which side of the surface the normals that Scan4D estimates point: towards the scanner, else outwards.

If the file does not state where the scanner stood, the side is an assumption. The record says how sure it is
once Scan4D has estimated normals.
"""

from __future__ import annotations

from dataclasses import replace

from ..points import ORIENTATIONS, PointCloud
from ..sides import FoundSides
from .record import Decision
from .sequence import Decided

KEY = "orientation"
AUTO, VIEWPOINT = "auto", "viewpoint"
_DOUBTFUL = 0.01  # of the points: wrong sides are then likely enough for a mark
_METHODS = {
    "quick": "from links between neighbours",
    "fine": "from links between neighbours and winding numbers",
}


def note_orientation(cloud: PointCloud, decided: Decided) -> PointCloud:
    """The cloud with the orientation of estimated normals that the user states. The record has it if the
    cloud has no normals."""
    if cloud.normals is not None:
        return cloud
    stated = decided.corrections.decision(KEY)
    decided.note(stated or _of_cloud(cloud))
    return cloud if stated is None else replace(cloud, orientation=stated.value)


def _of_cloud(cloud: PointCloud) -> Decision:
    if cloud.viewpoint is not None:
        return Decision(KEY, VIEWPOINT, "file", why="Estimated normals point towards the scanner")
    others = tuple(text for text in ORIENTATIONS if text != AUTO)
    return Decision(KEY, AUTO, "assumed", why="Estimated normals point outwards", alternatives=others)


def complete(decided: Decided, found: FoundSides) -> None:
    """Put into the record how Scan4D found the sides of normals that it has estimated."""
    now = decided.reading[KEY]
    if now.value is None:
        return
    why = f"Scan4D finds the sides of normals {_METHODS[found.method]}"
    doubt = f"{found.doubtful:.1%} of the points are doubtful"
    decided.replace(
        replace(
            now,
            value=now.value if now.source == "user" else found.method,
            why=f"{why}; {doubt}",
            changes_numbers=now.source == "assumed" and found.doubtful >= _DOUBTFUL,
        )
    )
