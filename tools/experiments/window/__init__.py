"""What the window takes and how long it freezes: it runs under Xvfb, with real keys, as in tests/app."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tests" / "app"))
