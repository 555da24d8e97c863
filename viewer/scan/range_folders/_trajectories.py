"""Where the camera stood at each depth picture, as one file of the folder states it for all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..image_poses import from_camera_to_world
from ..reading.trajectory_files import CameraTrajectory, camera_trajectory, rows_of_pictures, trajectory_name
from ._partners import DepthPicture
from ._texts import text_of


@dataclass(frozen=True)
class FoundTrajectory:
    """A trajectory and its file."""

    file: Path
    trajectory: CameraTrajectory


def trajectory_of_folder(folder: Path, names: Sequence[str]) -> FoundTrajectory | None:
    """The trajectory that a file of the folder states, None where none does. Raises InputError where the file
    is damaged."""
    name = trajectory_name(names)
    if name is None or not (folder / name).is_file():
        return None
    try:
        found = camera_trajectory(name, text_of(folder / name))
    except InputError as error:
        raise InputError(error.what, folder / name, error.hint) from error
    return None if found is None else FoundTrajectory(folder / name, found)


@dataclass(frozen=True)
class PlacedPictures:
    """Depth pictures with the rows of a trajectory that are theirs, None where there is none."""

    found: FoundTrajectory
    pictures: Sequence[DepthPicture]
    rows: list[int | None]

    @classmethod
    def of(cls, found: FoundTrajectory, pictures: Sequence[DepthPicture]) -> PlacedPictures:
        """Find the rows of the pictures."""
        stems = [picture.depth.stem for picture in pictures]
        return cls(found, pictures, rows_of_pictures(found.trajectory, stems))

    def pose(self, index: int) -> NDArray[np.float64]:
        """The world_to_camera of a picture. Raises InputError where it has none."""
        if (row := self.rows[index]) is None:
            raise InputError(f"has no pose in {self.found.file.name}", self.pictures[index].depth)
        return from_camera_to_world(self.found.trajectory.to_world[row])

    @property
    def times(self) -> NDArray[np.float64] | None:
        """Seconds from the first picture on, (T,); None where they are not stated for all, or do not
        increase."""
        stated = self.found.trajectory.times
        if stated is None or None in self.rows:
            return None
        times = stated[[row for row in self.rows if row is not None]]
        return times - times[0] if (np.diff(times) > 0).all() else None

    def with_cameras(self) -> Sequence[DepthPicture]:
        """The pictures with their own cameras, where the file states one for each."""
        stated = self.found.trajectory.cameras
        if stated is None:
            return self.pictures
        cameras = [
            () if row is None else (replace(stated[row], where=self.found.file.name),) for row in self.rows
        ]
        return [replace(one, stated=camera) for one, camera in zip(self.pictures, cameras, strict=True)]
