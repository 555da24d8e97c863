"""Hints for files that Scan4D does not read: what they are, and what turns them into what it reads."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

_CLOUDCOMPARE = "Convert it into PLY with CloudCompare"
_MESHLAB = "Convert it into PLY or OBJ with MeshLab or Blender"
_PARAVIEW = "Convert it into PLY with ParaView"
_VOLUMES = (
    "The file contains a volume, but no points. Create a surface in 3D Slicer, and save this surface as PLY"
)
_RECORDING = "The file contains a recording. Export its depth pictures and camera into a folder with"
_ARCHIVE = "The file is an archive. Unpack it, and open the folder"
_SPLATS = "The file contains packed Gaussian splats. Convert it into PLY with SuperSplat"

_DEPTH = "Scan4D reads depth from 16-bit PNG files with a camera.json beside them"
_DICOM_AT, _DICOM = 128, b"DICM"  # the mark of DICOM files, which often have no suffix
_LOOKED_AT = 4  # files without a suffix
_PICTURES = {".png", ".jpg", ".jpeg", ".bmp"}

_HINTS = {
    ".e57": ("E57", "Convert it with 'pdal translate FILE.e57 FILE.ply', or with CloudCompare"),
    ".bpf": ("BPF", "Convert it with 'pdal translate FILE.bpf FILE.ply'"),
    ".ptx": ("PTX", "Convert it with 'pdal translate FILE.ptx FILE.ply', or with CloudCompare"),
    **dict.fromkeys((".fls", ".lsproj", ".fws"), ("FARO scans", _CLOUDCOMPARE)),
    **dict.fromkeys((".rcp", ".rcs"), ("ReCap projects", 
        "In ReCap, export E57 or PTS, then convert that file"
    )),
    **dict.fromkeys((".zfs", ".zfprj", ".ptg"), ("this scanner's format", _CLOUDCOMPARE)),
    ".bin": ("BIN", 
        "If the file is from CloudCompare, save it there as PLY. If it is from COLMAP, convert it with "
        "'colmap model_converter'"
    ),
    **dict.fromkeys(
        (".stl", ".off", ".3mf", ".3ds", ".dae", ".fbx", ".wrl", ".x3d"), ("this mesh format", _MESHLAB)
    ),
    **dict.fromkeys((".glb", ".gltf"), ("glTF", _MESHLAB)),
    **dict.fromkeys((".usd", ".usda", ".usdc", ".usdz"), ("USD", "Export PLY or OBJ with Blender")),
    ".abc": ("Alembic", "Export each frame as PLY or OBJ with Blender"),
    ".blend": ("Blender's files", "Export PLY or OBJ with Blender"),
    ".drc": ("Draco", "Convert it with 'draco_decoder -i FILE.drc -o FILE.ply'"),
    **dict.fromkeys((".vtk", ".vtp", ".vtu", ".vti", ".pvd", ".vtm"), ("VTK", _PARAVIEW)),
    **dict.fromkeys((".bag",), ("bags", f"{_RECORDING} 'rs-convert' (RealSense) or ROS")),
    **dict.fromkeys((".db3", ".mcap"), ("bags", f"{_RECORDING} ROS")),
    ".mkv": ("MKV", f"{_RECORDING} Open3D's 'azure_kinect_mkv_reader.py'"),
    ".r3d": ("R3D", "The file is a zip archive of Record3D. In Record3D, export PLY, or EXR with RGB-D"),
    ".oni": ("ONI", f"{_RECORDING} OpenNI"),
    ".svo2": ("recordings of ZED", f"{_RECORDING} the ZED SDK"),
    **dict.fromkeys((".dcm", ".dicom", ".ima"), ("DICOM", _VOLUMES)),
    **dict.fromkeys((".nii", ".nrrd", ".nhdr", ".mha", ".mhd"), ("this image format", _VOLUMES)),
    **dict.fromkeys((".splat", ".ksplat", ".spz", ".sog"), ("this format of splats", _SPLATS)),
    **dict.fromkeys((".zip", ".gz", ".7z", ".rar", ".tar", ".tgz", ".bz2", ".xz"), ("archives", _ARCHIVE)),
    **dict.fromkeys((".xlsx", ".xls", ".ods"), ("spreadsheets", "Save the sheet as CSV")),
    **dict.fromkeys((".mat", ".h5", ".hdf5", ".pkl", ".pt"), ("this array format", "Save the arrays as NPZ")),
    **dict.fromkeys((".mp4", ".mov", ".avi"), ("films", 
        "A film contains no depth. Open the files of the scan instead"
    )),
    **dict.fromkeys(
        (".png", ".jpg", ".jpeg", ".bmp"),
        ("a picture alone", 
            "Open the folder that contains the picture: depth pictures need the camera file in this folder"
        ),
    ),
    **dict.fromkeys((".c3d", ".trc"), ("marker recordings", 
        "Open a scan, then import these landmarks in the window"
    )),
}  # fmt: skip


def hint_for(suffix: str, known: Iterable[str]) -> str:
    """Say what to do with a file whose suffix, in lower case, Scan4D does not read. known: those that it
    reads."""
    if suffix in _HINTS:
        what, advice = _HINTS[suffix]
        return f"Scan4D does not read {what}. {advice}"
    return f"Known: {', '.join(known)}"


class Foreign(NamedTuple):
    """Files that Scan4D does not read. what: how many there are of which kind. hint: what to do with them."""

    what: str
    hint: str


def foreign_files(files: Iterable[Path]) -> Foreign | None:
    """The most frequent kind of files with a hint, by suffix, or by the mark of DICOM; None for none."""
    visible = [file for file in files if not file.name.startswith((".", "~")) and file.is_file()]
    counts = Counter(suffix for file in visible if (suffix := hinted_suffix(file.name)) in _HINTS)
    bare = [file for file in visible if not file.suffix or file.suffix[1:].isdecimal()]
    if not counts and any(map(_is_dicom, bare[:_LOOKED_AT])):
        counts[".dcm"] = len(bare)
    if not counts:
        return None
    suffix, count = counts.most_common(1)[0]
    kind = "DICOM" if suffix == ".dcm" else suffix
    hint = _DEPTH if suffix in _PICTURES else hint_for(suffix, ())
    return Foreign(f"{count} {kind} file{'s' * (count > 1)}", hint)


def hinted_suffix(name: str) -> str:
    """The suffix in lower case that tells what a file is: ".nii" of "head.nii.gz"."""
    path = Path(name.lower())
    inner = Path(path.stem).suffix
    return inner if path.suffix == ".gz" and inner in _HINTS else path.suffix


def _is_dicom(file: Path) -> bool:
    with suppress(OSError), file.open("rb") as stream:
        return stream.read(_DICOM_AT + len(_DICOM))[_DICOM_AT:] == _DICOM
    return False


def hinted_suffixes() -> list[str]:
    """The suffixes that have a hint of their own, sorted."""
    return sorted(_HINTS)
