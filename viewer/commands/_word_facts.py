"""What `scan4d info` prints about a file of code words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..codewords.files import WordFile
from ..codewords.words import FIELDS, decode_words
from ._facts import extent, named_lines


def stream_facts(path: str) -> dict[str, Any]:
    """Facts of a file of code words and of the words of its first picture, as plain values. Depths in scan
    units, times in seconds. Raises InputError."""
    file = WordFile(path)
    stream = file.read(0)
    fields = decode_words(stream.words)
    return {
        "name": Path(path).name,
        "pictures": len(file),
        "keys": file.keys,
        "times": None if file.times is None else {"first": file.times[0], "last": file.times[-1]},
        "file_bytes": file.nbytes,
        "size": list(stream.picture_size),
        "samples": stream.samples**2,
        "strips": stream.strips,
        "words": len(stream),
        "tiles": int(fields["mode"].sum()),
        "elements": len(np.unique(stream.ids)),
        "bytes": stream.nbytes,
        "projection": "perspective" if stream.perspective else "orthographic",
        "depth": {"nearest": stream.near, "farthest": stream.far, "error": stream.depth_error()},
        "finer": stream.finer is not None,
        "materials": len(stream.materials),
        "background": list(stream.background),
        "fields": {name: extent(values) for name, values in fields.items()},
    }


def stream_as_text(facts: dict[str, Any]) -> str:
    """The facts as lines of a name and a value."""
    depth = facts["depth"]
    text = "in 2^24 steps" if facts["finer"] else f"accurate to {depth['error']:.3g}"
    rows = [
        ("code words", facts["name"]),
        *_sequence_lines(facts),
        ("picture", "{} x {} pixels".format(*facts["size"])),
        ("samples", f"{facts['samples']} a pixel"),
        ("strips", f"{facts['strips']}"),
        (
            "words",
            f"{facts['words']:,} for {facts['elements']:,} discs; {facts['tiles']:,} of the words are tiles",
        ),
        ("projection", facts["projection"]),
        ("depth", f"{depth['nearest']:g} to {depth['farthest']:g}, {text}"),
        ("materials", f"{facts['materials']}"),
        ("background", ", ".join(map(str, facts["background"]))),
        ("memory", f"{facts['bytes'] / 1e6:.1f} MB"),
    ]
    for name, span in facts["fields"].items():
        shown = "none" if span is None else "{:g} to {:g}".format(*span)
        rows.append((name, f"{FIELDS[name][1]} bits, {shown}"))
    return named_lines(rows)


def _sequence_lines(facts: dict[str, Any]) -> list[tuple[str, str]]:
    """Lines about the pictures of a file of several."""
    if facts["times"] is None:
        return []
    per_picture = facts["file_bytes"] / facts["pictures"]
    return [
        ("pictures", f"{facts['pictures']}, {facts['keys']} of them key pictures"),
        ("times", "{first:g} to {last:g} s".format(**facts["times"])),
        ("file", f"{facts['file_bytes'] / 1e6:.2f} MB, {per_picture:,.0f} bytes a picture"),
    ]
