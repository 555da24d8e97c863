"""The embedded demo scan: a moving head whose surface and normals are known exactly.

`head` is the subject at rest as an implicit surface, `motion` bends and turns it as `variants` schedule,
`tools/demo_head.py` made the points that `asset` ships, and `source` plays them.
"""

from .source import DemoSource

__all__ = ["DemoSource"]
