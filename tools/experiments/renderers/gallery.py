"""The pictures of docs/gallery.md, made by the commands that the page shows."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import tempfile
from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path

from experiments.script import Failed, Script
from experiments.suite import DOCS
from experiments.tables import Row
from viewer.cli import main as scan4d


def pictures(_: Namespace) -> Iterator[Row]:
    """Run the commands in a temporary folder, and move the pictures into docs/pictures/."""
    text = (DOCS / "gallery.md").read_text(encoding="utf-8").replace("\\\n", " ")
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for command in re.findall(r"^scan4d .*$", text, re.M):
            if code := scan4d(shlex.split(command)[1:]):
                raise Failed(f"{command} ended with {code}")
        for picture in sorted(Path(folder).glob("gallery-*.png")):
            shutil.move(picture, DOCS / "pictures" / picture.name)
            yield {"picture": picture.name}


EXPERIMENT = Script([pictures])
