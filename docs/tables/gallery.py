"""Make the pictures of docs/gallery.md from the commands that the page shows.

python docs/tables/gallery.py
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import tempfile
from pathlib import Path

from pictures import DOCS

from viewer.cli import main as scan4d

PAGE = DOCS / "gallery.md"


def commands(text: str) -> list[list[str]]:
    """The words of each command of the page, after `scan4d`."""
    lines = re.findall(r"^scan4d .*$", text.replace("\\\n", " "), re.M)
    return [shlex.split(line)[1:] for line in lines]


def main() -> None:
    """Run the commands in a temporary folder, and move the pictures into docs/pictures/."""
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for words in commands(PAGE.read_text(encoding="utf-8")):
            if code := scan4d(words):
                raise SystemExit(code)
        for picture in Path(folder).glob("gallery-*.png"):
            shutil.move(picture, DOCS / "pictures" / picture.name)


if __name__ == "__main__":
    main()
