"""Where what belongs to a user is kept."""

from __future__ import annotations

from pathlib import Path


def user_folder() -> Path:
    """The folder of this user's settings; it need not be there yet."""
    import platformdirs

    return platformdirs.user_config_path("scan4d", appauthor=False)


def cache_folder() -> Path:
    """The folder of what was found out about this machine for this user; it need not be there yet."""
    import platformdirs

    return platformdirs.user_cache_path("scan4d", appauthor=False)
