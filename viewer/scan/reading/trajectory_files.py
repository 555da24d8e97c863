"""Small files beside depth pictures that state where the camera stood: one pose a frame, in one file.

| form | written by |
|---|---|
| `odometry.csv`: columns x y z qx qy qz qw, perhaps timestamp and frame | Stray Scanner |
| `metadata.json`, `metadata`: `poses` of qx qy qz qw x y z, `frameTimestamps` or `fps` | Record3D |
| `transforms.json`: `frames` with `transform_matrix` and names of files | nerfstudio |
| `lowres_wide.traj`: a time, a turn and a translation, from the world to the camera | ARKitScenes |
| `traj.txt`, `trajectory.txt`: a matrix of 3 or 4 rows a line | Replica, NICE-SLAM |

Nothing here reads a file.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, shortened
from ...files import parsed_json
from ..contents import StatedCamera
from ..image_poses import IMAGE_AXES, rotation_of
from .camera_files import cameras_of

_NAMES = (
    "odometry.csv", "metadata.json", "metadata", "transforms.json", "traj.txt", "trajectory.txt"
)  # fmt: skip
_SUFFIX = ".traj"
_PLACE, _TURN = ("x", "y", "z"), ("qx", "qy", "qz", "qw")
_TIMES, _FRAMES = ("timestamp", "time", "t"), ("frame", "frame_id", "index")


class CameraTrajectory(NamedTuple):
    """The poses of a camera, a moment each.

    to_world: (N, 4, 4), from the camera in an image's axes. times: (N,) seconds, None: not stated.
    frames: names or numbers of pictures, (N,) each; None: they are in the order of the pictures.
    cameras: (N,) of the colours, None: not stated.
    """

    to_world: NDArray[np.float64]
    times: NDArray[np.float64] | None = None
    frames: tuple[str, ...] | None = None
    cameras: tuple[StatedCamera, ...] | None = None


def trajectory_name(names: Sequence[str]) -> str | None:
    """The name among those of a folder that states a trajectory, None where none does."""
    by_name = {name.lower(): name for name in names}
    found = next((by_name[name] for name in _NAMES if name in by_name), None)
    return found or next((name for name in sorted(names) if name.lower().endswith(_SUFFIX)), None)


def camera_trajectory(name: str, text: str) -> CameraTrajectory | None:
    """The trajectory in the text of a file; None where it holds something else of that name.

    Raises InputError, without the file's name, where it is damaged.
    """
    try:
        if name.lower().startswith(("metadata", "transforms")):
            stored = parsed_json(text) if text.lstrip()[:1] == "{" else None
            return _of_object(stored) if isinstance(stored, dict) else None
        if name.lower().endswith(".csv"):
            return _of_table(text)
        return _of_rows(text, name.lower().endswith(_SUFFIX))
    except (ValueError, KeyError, TypeError, IndexError) as error:
        what = f"is not a list of camera poses: {shortened(str(error))}"
        raise InputError(
            what,
            hint="If you rename the file, Scan4D ignores it, and each view stays in the coordinates of its "
            "camera",
        ) from error


def _of_object(stored: Mapping[str, Any]) -> CameraTrajectory | None:
    if isinstance(stored.get("frames"), list):
        frames = [
            frame for frame in stored["frames"] if isinstance(frame, dict) and "transform_matrix" in frame
        ]
        if not frames:
            return None
        poses = np.array([frame["transform_matrix"] for frame in frames], np.float64).reshape(-1, 4, 4)
        names = tuple(str(frame.get("depth_file_path", frame.get("file_path", ""))) for frame in frames)
        return CameraTrajectory(poses @ IMAGE_AXES, frames=names)
    if not isinstance(stored.get("poses"), list):
        return None
    rows = np.array(stored["poses"], np.float64).reshape(-1, 7)
    times = None
    if isinstance(stored.get("frameTimestamps"), list) and len(stored["frameTimestamps"]) == len(rows):
        times = np.array(stored["frameTimestamps"], np.float64)
    elif isinstance(fps := stored.get("fps"), int | float) and fps > 0:
        times = np.arange(len(rows)) / fps
    cameras = None
    if isinstance(each := stored.get("perFrameIntrinsicCoeffs"), list) and len(each) == len(rows):
        sizes = {name: stored[name] for name in ("w", "h") if name in stored}
        cameras = tuple(
            cameras_of({"K": list(one)[:4], **sizes}, "perFrameIntrinsicCoeffs")[0] for one in each
        )
    return CameraTrajectory(_of_quaternions(rows[:, 4:], rows[:, :4]) @ IMAGE_AXES, times, None, cameras)


def _of_table(text: str) -> CameraTrajectory:
    head, *lines = [line for line in text.splitlines() if line.strip()]
    names = [name.strip().lower() for name in re.split("[,;]", head)]
    words = [[word.strip() for word in re.split("[,;]", line)] for line in lines]

    def columns(wanted: Sequence[str]) -> NDArray[np.float64]:
        places = [names.index(name) for name in wanted]
        return np.array([[row[at] for at in places] for row in words], np.float64).reshape(-1, len(wanted))

    time = next((name for name in _TIMES if name in names), None)
    frame = next((name for name in _FRAMES if name in names), None)
    return CameraTrajectory(
        _of_quaternions(columns(_PLACE), columns(_TURN)),
        None if time is None else columns([time])[:, 0],
        None if frame is None else tuple(row[names.index(frame)] for row in words),
    )


def _of_rows(text: str, is_from_world: bool) -> CameraTrajectory:
    rows = np.array([line.split() for line in text.splitlines() if line.strip()], np.float64)
    if not is_from_world:
        if rows.ndim != 2 or rows.shape[1] not in (12, 16):
            raise ValueError(f"the rows are of shape {rows.shape}, expected 12 or 16 numbers each")
        poses = np.tile(np.eye(4), (len(rows), 1, 1))
        poses.reshape(len(rows), 16)[:, : rows.shape[1]] = rows
        return CameraTrajectory(poses)
    from scipy.spatial.transform import Rotation

    to_camera = np.tile(np.eye(4), (len(rows), 1, 1))
    to_camera[:, :3, :3] = Rotation.from_rotvec(rows[:, 1:4]).as_matrix()
    to_camera[:, :3, 3] = rows[:, 4:7]
    times = rows[:, 0]
    return CameraTrajectory(
        np.asarray(np.linalg.inv(to_camera), np.float64), times, tuple(f"{time:.3f}" for time in times)
    )


def _of_quaternions(places: NDArray[np.float64], turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """The matrices, (N, 4, 4), of translations (N, 3) and quaternions x y z w, (N, 4)."""
    poses = np.tile(np.eye(4), (len(places), 1, 1))
    poses[:, :3, :3] = [rotation_of(turn) for turn in turns] if len(turns) else poses[:, :3, :3]
    poses[:, :3, 3] = places
    return poses


def rows_of_pictures(trajectory: CameraTrajectory, names: Sequence[str]) -> list[int | None]:
    """The row of the trajectory for each picture by its name without suffix; None where it has none.

    Names count first, then the last number of a name, which may be a time; else the order.
    """
    if trajectory.frames is None:
        return [at if at < len(trajectory.to_world) else None for at in range(len(names))]
    stems = [
        re.sub(r"\.(?:png|jpe?g|exr|npy|tiff?)$", "", frame.rpartition("/")[2]) for frame in trajectory.frames
    ]
    by_name = {stem: at for at, stem in reversed([*enumerate(stems)])}
    by_number = {_number(stem): at for at, stem in reversed([*enumerate(stems)])}
    is_time = any("." in stem for stem in stems)

    def row(name: str) -> int | None:
        if name in by_name:
            return by_name[name]
        number = _number(name)
        if is_time and number is not None and number not in by_number:
            return _nearest(number, by_number)
        return by_number.get(number)

    return [row(name) for name in names]


_MOST_APART = 0.02  # s, of the time of a picture to that of a pose


def _nearest(time: float, by_time: Mapping[float | None, int]) -> int | None:
    times = [other for other in by_time if other is not None]
    nearest = min(times, key=lambda other: abs(other - time), default=None)
    return by_time[nearest] if nearest is not None and abs(nearest - time) <= _MOST_APART else None


def _number(name: str) -> float | None:
    """The last number in a name, with decimals; None where it has none."""
    found = re.findall(r"\d+(?:\.\d+)?", name)
    return float(found[-1]) if found else None
