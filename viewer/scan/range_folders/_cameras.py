"""The camera of a folder's depth pictures: finds the files that state it, and asks the decider."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from ...errors import InputError
from ..contents import StatedCamera
from ..reading.camera import CameraSources, DepthCamera, Size, corrected_camera, decide_camera
from ..reading.camera_files import FOLDERS, camera_names, must_state_a_camera, stated_cameras
from ..reading.corrections import Corrections
from ..reading.sequence import Decided
from ._texts import text_of


@dataclass(frozen=True)
class FolderCamera:
    """The camera of the depth pictures of a folder. Scan4D decides it for each size of picture.

    files: that state it, the used one among them.
    """

    sources: CameraSources
    files: tuple[Path, ...] = ()

    @property
    def unit(self) -> str:
        """The unit of length, perhaps any text."""
        return self.sources.unit

    @property
    def is_stated(self) -> bool:
        """Whether a file or the user states it."""
        return bool(self.sources.stated) or self.sources.corrected is not None

    @cached_property
    def _sizes(self) -> dict[Size, None]:
        """The sizes of the pictures so far, the first one first."""
        return {}

    def of_picture(
        self,
        size: Size,
        decided: Decided,
        *,
        is_whole: bool = True,
        of_color: Size | None = None,
        own: Sequence[StatedCamera] = (),
    ) -> DepthCamera:
        """The camera of a picture; the decisions go into the record.

        own: the cameras that a file of this picture alone states. Raises InputError.
        """
        sources = replace(self.sources, stated=(*own, *self.sources.stated)) if own else self.sources
        found = decide_camera(sources, size, is_whole=is_whole, of_color=of_color)
        decided.note(*found.decisions)
        first = next(iter({**self._sizes, size: None}))
        self._sizes.setdefault(size)
        if first != size:
            shown = "has {} x {} pixels, but the first picture has {} x {}".format(*size, *first)
            decided.contradict("camera", f"its depth picture {shown}")
        return found.camera


def camera_of_folder(
    folder: Path, names: Sequence[str], corrections: Corrections, only_own: bool = False, **known: object
) -> FolderCamera:
    """The camera that files of a folder state.

    names: of all that is in the folder. only_own: whether files of common names, such as info.txt, count as
    something else. known: more of `CameraSources`. Raises InputError where a file whose name promises a
    camera is damaged.
    """
    stated: list[StatedCamera] = []
    files: list[Path] = []
    for path in _files(folder, names):
        must = must_state_a_camera(path.name)
        if only_own and not must:
            continue
        try:
            stated += stated_cameras(path.name, text_of(path))
        except InputError as error:
            if must:
                raise InputError(error.what, path, error.hint) from error
            continue  # it is of something else
        files.append(path)
    sources = CameraSources(stated=tuple(stated), **known)  # type: ignore[arg-type]
    return FolderCamera(with_corrections(sources, corrections, folder), tuple(files))


def with_corrections(sources: CameraSources, corrections: Corrections, folder: Path) -> CameraSources:
    """The sources with what the user says. Raises InputError where the file that the user names is none."""
    camera = corrections.get("camera")
    if isinstance(camera, str):
        path = folder / camera if (folder / camera).is_file() else Path(camera)
        try:
            corrected: StatedCamera | None = stated_cameras(path.name, text_of(path))[0]
        except InputError as error:
            raise InputError(error.what, path, error.hint) from error
    else:
        corrected = None if camera is None else corrected_camera(camera)
    return replace(sources, corrected=corrected, depth_scale=corrections.get("depth-scale"))


def _files(folder: Path, names: Sequence[str]) -> list[Path]:
    """The files that may state the camera, the better one first, in the folder and in those for them."""
    found = [folder / name for name in camera_names(names)]
    for inner in (name for name in names if name.lower() in FOLDERS):
        try:
            found += [folder / inner / name for name in camera_names(os.listdir(folder / inner))]
        except OSError:  # it is no folder
            continue
    return [path for path in found if path.is_file()]
