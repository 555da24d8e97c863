"""Which channel of a picture is depth."""

from __future__ import annotations

import pytest

from viewer.errors import InputError
from viewer.scan.reading.channels import decide, depth_channels
from viewer.scan.reading.corrections import Corrections


@pytest.mark.parametrize(
    ("names", "depth", "source"),
    [
        ("R G B A Z", "Z", "file"),
        ("View.Combined.R View.Depth.Z View.Normal.X View.Normal.Y View.Normal.Z", "View.Depth.Z", "file"),
        ("N.X N.Y N.Z", None, ""),
        ("X Y Z", None, ""),
        ("Depth.V Image.R Image.G Image.B Image.A", "Depth.V", "file"),
        ("R G B depth", "depth", "file"),
        ("Depth", "Depth", "file"),
        ("D", "D", "file"),
        ("Depth.R Depth.G Depth.B Image.R Image.G Image.B", "Depth.R", "file"),
        ("Y", "Y", "assumed"),
        ("R A", "R", "assumed"),
        ("G", None, ""),
        ("R G B", None, ""),
        ("Y RY BY", None, ""),
        ("A", None, ""),
    ],
)
def test_the_channel_of_depth(names: str, depth: str | None, source: str) -> None:
    found = decide(names.split())
    assert (found and found.name) == depth
    if found is not None:
        assert found.decision.source == source
        assert found.decision.is_marked == (source == "assumed")


def test_the_user_chooses() -> None:
    corrections = Corrections.parse({"depth-channel": "far.Z"})
    found = decide(["Z", "far.Z"], corrections)
    assert found is not None
    assert (found.name, found.decision.source) == ("far.Z", "user")
    with pytest.raises(InputError, match=r"no channel far\.Z. Its channels: R, Z"):
        decide(["R", "Z"], corrections)


def test_other_depths_are_known() -> None:
    assert depth_channels(["Z", "far.Z", "Depth.V", "Depth.Y"]) == ["Z", "far.Z", "Depth.V"]
