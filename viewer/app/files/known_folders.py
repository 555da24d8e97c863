"""The places of this computer that a scan may be found in: the user's folders, and disks."""

from __future__ import annotations

import os
import string
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from imgui_bundle import icons_fontawesome_6 as icons


@dataclass(frozen=True)
class KnownFolder:
    """A folder by the name that users know it by. icon: beside its name."""

    title: str
    icon: str
    folder: Path


def known_folders() -> list[KnownFolder]:
    """Home, desktop, documents and downloads where they are there, then disks. It may wait for a disk."""
    import platformdirs

    own = [
        KnownFolder("Home", icons.ICON_FA_HOUSE, Path(os.path.expanduser("~"))),
        KnownFolder("Desktop", icons.ICON_FA_DISPLAY, platformdirs.user_desktop_path()),
        KnownFolder("Documents", icons.ICON_FA_FILE_LINES, platformdirs.user_documents_path()),
        KnownFolder("Downloads", icons.ICON_FA_DOWNLOAD, platformdirs.user_downloads_path()),
    ]
    disks = [KnownFolder(_disk_title(disk), icons.ICON_FA_HARD_DRIVE, disk) for disk in _disks()]
    there = [known for known in own + disks if os.path.isdir(known.folder)]
    return list({known.folder: known for known in reversed(there)}.values())[::-1]  # the first of each folder


def _disk_title(disk: Path) -> str:
    return "This computer" if str(disk) == "/" else disk.name or str(disk)


def _disks() -> Iterator[Path]:
    """The roots of disks, and what is plugged in."""
    if sys.platform == "win32":
        yield from (Path(f"{letter}:\\") for letter in string.ascii_uppercase)
        return
    yield Path("/")
    user = os.path.basename(os.path.expanduser("~"))
    for mounted in (Path("/Volumes"), Path("/media") / user, Path("/run/media") / user, Path("/mnt")):
        try:
            yield from sorted(mounted.iterdir())
        except OSError:
            continue
