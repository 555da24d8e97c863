"""What a user sees first of each scan: the window with its defaults, nothing pressed, as one picture.

python tests/app/contact_sheet.py OUT.png [SCAN ...] [--size 1280x800] [--scale 1.5]

Without scans: one of each kind in the data folder. Each window is also kept by itself, in a folder beside
the picture.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from PIL import Image, ImageDraw
from virtual_screen import ROOT, Screen, running_app, virtual_screen

from viewer.scan.formats import known_suffixes

CELL = (640, 400)  # pixels of each window in the sheet
LABEL = 14
COLUMNS = 3
OF_DATA = (
    "models/*",
    "sequences/*",
    "range/*",
    "range/open3d_rgbd/*",
    "range/terrain/*",
    "odd/pcd/bun0.pcd",
    "odd/pcd/milk_color.pcd",
    "odd/pcd/room_scan1.pcd",
    "odd/pcd/stereo_left.pcd",
    "odd/las/autzen_trim.laz",
    "odd/pts_ptx_txt/autzen.pts",
    "odd/ply/trimesh_fuze_ascii.ply",
    "odd/ply/truedepth_raw_frame-045.ply",
)


def scans_of_data() -> list[Path]:
    """One scan of each kind in the data folder."""
    data = Path(os.environ.get("SCAN4D_DATA") or ROOT.parent / "shared" / "data")
    found = [path for pattern in OF_DATA for path in sorted(data.glob(pattern))]
    return [path for path in found if path.is_dir() or path.suffix in known_suffixes()]


def first_view(screen: Screen, scan: Path) -> Image.Image:
    """The window on a scan, as somebody sees it who has never started it before."""
    with tempfile.TemporaryDirectory() as folder, running_app(screen, Path(folder), scan) as app:
        app.settle()
        return Image.fromarray(screen.picture())


def sheet(views: Sequence[tuple[str, Image.Image]]) -> Image.Image:
    """The windows side by side, each below its name."""
    width, height = CELL[0], CELL[1] + LABEL
    rows = -(-len(views) // COLUMNS)
    picture = Image.new("RGB", (width * min(COLUMNS, len(views)), height * rows))
    draw = ImageDraw.Draw(picture)
    for number, (name, view) in enumerate(views):
        left, top = number % COLUMNS * width, number // COLUMNS * height
        draw.text((left + 4, top + 1), name, fill="white")
        picture.paste(view.resize(CELL, Image.Resampling.LANCZOS), (left, top + LABEL))
    return picture


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("picture", type=Path)
    parser.add_argument("scans", type=Path, nargs="*")
    parser.add_argument("--size", default="1280x800")
    parser.add_argument("--scale", type=float, default=1.0)
    asked = parser.parse_args()
    width, height = (int(edge) for edge in asked.size.split("x"))
    apart = asked.picture.with_suffix("")
    apart.mkdir(parents=True, exist_ok=True)
    views: list[tuple[str, Image.Image]] = []
    with (
        tempfile.TemporaryDirectory() as folder,
        virtual_screen(Path(folder), (width, height), asked.scale) as screen,
    ):
        for scan in asked.scans or scans_of_data():
            try:
                views.append((scan.name, first_view(screen, scan.resolve())))
            except (AssertionError, subprocess.SubprocessError) as error:
                print(f"{scan}: {error}", flush=True)
                continue
            views[-1][1].save(apart / f"{len(views):02} {scan.name}.png")
            sheet(views).save(asked.picture)
            print(scan, flush=True)


if __name__ == "__main__":
    main()
