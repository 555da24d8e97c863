"""Values of measures of surfaces, kept from one opening of a scan to the next.

A file has the values of a measure at the places of its landmarks in all frames. Its name is a hash of these,
so that the same scan finds it wherever it lies. Each value has the hash of the surface that it was found on:
a frame whose points have changed is measured again. The folder is in Scan4D's cache, and bounded.
"""

from __future__ import annotations

import json
import os
from contextlib import suppress
from hashlib import blake2b
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...extensions import package_of
from ...files import parsed_json, read_text, whole_file
from ...folders import cache_folder, forget_oldest
from . import Measure
from .kinds import measure_kinds
from .regions import Refused
from .surface import Found

VERSION = 3  # of how measures are found: raise it where any value changes
_MOST_BYTES = 48 * 2**20  # of a file; of more frames nothing is kept
_MOST_IN_ALL = 256 * 2**20


class KeptValues:
    """The values of a measure that were found before, and those that are found now.

    positions: (T, K, 3), of its landmarks in all frames.
    """

    def __init__(self, measure: Measure, positions: NDArray[np.float64]) -> None:
        version = [VERSION, package_of(measure_kinds()[measure.kind].compute.__module__)]
        options = sorted(measure.options.items())
        definition = json.dumps([version, measure.kind, options, positions.shape])
        name = blake2b(definition.encode() + positions.tobytes(), digest_size=16).hexdigest()
        self.path = measures_folder() / f"{name}.json"
        self._values = self._read()
        self._is_new = False

    def _read(self) -> dict[str, Any]:
        try:
            values = parsed_json(read_text(self.path, _MOST_BYTES))
            os.utime(self.path)
        except (OSError, ValueError):  # not there, or damaged: everything is found again
            return {}
        return values if isinstance(values, dict) else {}

    def get(self, frame: int, surface: str) -> Found | Refused | None:
        """The value that was found in a frame on the surface of this hash; None where there is none."""
        held: Any = self._values.get(str(frame))
        try:
            if held["surface"] != surface:
                return None
            if "reason" in held:
                return Refused(str(held["reason"]), tuple(map(int, held["landmarks"])))
            gradient, *lines = (
                np.array(rows, np.float64).reshape(-1, 3) for rows in (held["gradient"], *held["lines"])
            )
            value, deviation, share = (float(held[name]) for name in ("value", "deviation", "share"))
        except (TypeError, KeyError, ValueError):
            return None
        return Found(value, gradient, deviation, tuple(lines), share)

    def put(self, frame: int, surface: str, found: Found | Refused) -> None:
        """Keep what was found in a frame on the surface of a hash."""
        held: dict[str, Any] = {"surface": surface}
        if isinstance(found, Refused):
            held |= {"reason": found.reason, "landmarks": found.landmarks}
        else:
            held |= {"value": found.value, "deviation": found.deviation, "share": found.share}
            held |= {"gradient": found.gradient.tolist(), "lines": [line.tolist() for line in found.lines]}
        self._values[str(frame)] = held
        self._is_new = True

    def save(self) -> None:
        """Write what is new. Where that cannot be, it is found again next time."""
        if not self._is_new:
            return
        text = json.dumps(self._values)
        if len(text) > _MOST_BYTES:
            return
        with suppress(InputError), whole_file(self.path) as temporary:
            temporary.write_text(text, encoding="utf-8")
        self._is_new = False
        forget_oldest(self.path.parent, _MOST_IN_ALL)


def measures_folder() -> Path:
    """The folder of kept values; it need not be there yet."""
    return cache_folder() / "measures"
