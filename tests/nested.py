"""A pytest of its own, in another process, that knows nothing of the one that starts it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

_PYTEST = ("-m", "pytest")
_INDEPENDENT = {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}


def run_pytest(
    *options: str, cwd: Path, paths: Sequence[Path] = (), start: Sequence[str] = _PYTEST
) -> subprocess.CompletedProcess[str]:
    """Run pytest with these options, without the plugins that happen to be installed.

    paths: in front of PYTHONPATH. start: what Python runs, for another beginning than `-m pytest`.
    """
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    path = os.pathsep.join([*map(str, paths), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**inherited, "PYTHONPATH": path, **_INDEPENDENT}
    command = [sys.executable, *start, "-p", "no:cacheprovider", *options]
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True)
