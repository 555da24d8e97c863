"""List the renderers and their parameters.

The parameters that the window's panel shows at once come first. Parameters for research follow, by group.
--json lists all facts of each parameter.
"""

from __future__ import annotations

import json
from argparse import ArgumentParser, Namespace
from typing import Any

import numpy as np

from ..backends import Backend
from ..backends import backends as all_backends
from ..errors import NoOpenGLError
from ..extensions import package_of
from ..params import Parameter
from ..scan.points import PointCloud
from ..scan.pose import Pose
from . import _drawing as drawing

_NO_POINTS = Pose(0, 0.0, "", PointCloud.from_arrays(np.zeros((0, 3))))


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d backends`."""
    parser.add_argument("--json", action="store_true", help="print a JSON list")


def run(args: Namespace) -> int:
    """Print them."""
    obstacle = _obstacle(args.device)
    if args.json:
        print(json.dumps([declaration(b, obstacle) for b in all_backends().values()], indent=2))
    else:
        print("\n\n".join(_as_text(b) for b in all_backends().values()))
        if obstacle:
            print(f"\nNo renderer is available on this computer: {obstacle}")
    return 0


def declaration(backend: Backend, obstacle: str | None) -> dict[str, Any]:
    """The declaration of a backend as plain values. obstacle: why it is not available."""
    return {
        "name": backend.name,
        "title": backend.title,
        "help": backend.help,
        "package": package_of(type(backend).__module__),
        "needs": list(backend.needs(_NO_POINTS, backend.params())),
        "rows": backend.rows,
        "blends": backend.blends,
        "fills": backend.fills,
        "available": obstacle is None,
        "why_not": obstacle,
        "values": {name: kind.help for name, kind in backend.values.items()},
        "parameters": [_parameter(p) for p in backend.parameters],
    }


def _parameter(parameter: Parameter) -> dict[str, Any]:
    facts = parameter.to_json()
    facts["range"] = [facts.pop("low"), facts.pop("high")]
    return facts


def _obstacle(device: int | None) -> str | None:
    """Why nothing can be drawn on this machine; None where it can."""
    try:
        drawing.renderer(device)
    except NoOpenGLError as error:
        return str(error)
    return None


def _as_text(backend: Backend) -> str:
    """The help of a backend: parameters for everybody, then those for research by group, then its numbers."""
    rows = {p.name: (p.name, _value(p.default), _domain(p), p.help) for p in backend.parameters}
    widths = [max(map(len, column)) for column in list(zip(*rows.values(), strict=True))[:-1]]
    lines, heading = [f"{backend.name}: {backend.help}"], ""
    if package := package_of(type(backend).__module__):
        lines.append(f"  From the package {package}")
    for parameter in sorted(backend.parameters, key=lambda p: not p.basic):
        group = "" if parameter.basic else f"  For research: {parameter.group or 'other'}"
        if group != heading:
            lines.append(heading := group)
        *cells, text = rows[parameter.name]
        lines.append("  ".join(["", *(f"{c:{w}}" for c, w in zip(cells, widths, strict=True)), text]))
    if backend.values:
        width = max(map(len, backend.values))
        lines.append("  Quantities that colours can show (--look color_by=...)")
        lines += [f"  {name:{width}}  {kind.help}" for name, kind in backend.values.items()]
    return "\n".join(lines)


def _value(value: object) -> str:
    return "auto" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def _domain(parameter: Parameter) -> str:
    """Values that a parameter takes: its choices, or its type and range."""
    if parameter.choices:
        return "|".join(parameter.choices)
    unit = f" {parameter.unit}" if parameter.unit else ""
    if parameter.low is None and parameter.high is None:
        return parameter.type.__name__ + unit
    low, high = ("" if limit is None else f"{limit:g}" for limit in (parameter.low, parameter.high))
    return f"{parameter.type.__name__} {low}..{high}{unit}"
