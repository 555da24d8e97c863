"""What readers return: what a file says, before anybody decides what it means.

The modules of `viewer/scan/reading/` decide. `reading/cloud.py` then makes a `PointCloud` or a `RangeView`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from .faces import Faces
from .range_view import DepthKind
from .texture import TexturedMesh


class Deferred:
    """An array that is made when numpy asks for it, once.

    dtype: of its values as they are read. width: how many a point has.
    """

    def __init__(self, make: Callable[[], NDArray], dtype: np.dtype, width: int = 1) -> None:
        self._make = make
        self.dtype = dtype
        self.size = dtype.itemsize * width  # bytes of a point

    def __array__(self, dtype: object = None, copy: object = None) -> NDArray:
        return self._make()


Column = NDArray | Deferred


class ArrayInFile(Protocol):
    """An array whose header is read and whose values are not."""

    @property
    def name(self) -> str: ...

    @property
    def shape(self) -> tuple[int, ...]: ...

    @property
    def dtype(self) -> np.dtype: ...

    def read(self, frame: int | None = None) -> NDArray:
        """The whole array, or one entry along its first axis. Raises InputError."""

    def first(self, count: int) -> NDArray:
        """The first entries along the first axis; `read` still works then. Raises InputError."""

    def memory(self, frame: int | None = None) -> int:
        """Bytes that `read` takes."""

    def reshaped(self, shape: tuple[int, ...]) -> Self:
        """Return the same values in another shape, which has the same axes but for those of length 1."""

    def with_last(self, axis: int) -> Self:
        """Return the same values with an axis, the second or third one from the end, moved to the end."""


@dataclass(frozen=True, kw_only=True)
class StatedCamera:
    """A pinhole camera as a file states it, in pixels; the centre of the first pixel is at (0, 0).

    distortion:    4, 5 or 8 coefficients as OpenCV has them, see `viewer/scan/lens.py`; none: ()
    kind:          of depth, as `RangeView` has it; None: not stated
    width, height: of the pictures that it is for; None: not stated
    depth_scale:   steps of a stored depth in one `unit`; None: not stated
    unit:          of depth, as stated, perhaps any text; None: not stated
    where:         the name of the file, or of the field, that states it
    is_color:      whether it is the camera of the colours
    """

    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()
    kind: DepthKind | None = None
    width: int | None = None
    height: int | None = None
    depth_scale: float | None = None
    unit: str | None = None
    where: str = ""
    is_color: bool = False


@dataclass(frozen=True, kw_only=True)
class Stated:
    """Facts that a file states about itself; None where it is silent.

    unit:      of length, perhaps any text
    axes:      an anatomical space or an up axis, as the file words it
    rate:      frames a second
    times:     (T,) seconds
    color_max: the largest value of a colour: 1, 255 or 65535
    no_data:   the value that means "not measured"
    viewpoint: (4, 4), world_from_sensor
    origin:    (3,) float64, to be added to all positions
    camera:    of its pictures
    grid:      (height, width) of an organised cloud
    promised:  how many points its header promises
    """

    unit: str | None = None
    axes: str | None = None
    rate: float | None = None
    times: NDArray[np.float64] | None = None
    color_max: float | None = None
    no_data: float | None = None
    viewpoint: NDArray[np.float64] | None = None
    origin: NDArray[np.float64] | None = None
    camera: StatedCamera | None = None
    grid: tuple[int, int] | None = None
    promised: int | None = None


@dataclass(frozen=True)
class TextHead:
    """The first lines of a text file. encoding: as Python names it. lines: at most 40, without line ends."""

    encoding: str
    lines: tuple[str, ...]


@dataclass(frozen=True)
class Material:
    """A material of a mesh.

    color:      diffuse, 0..1; None where the file states none
    image:      the picture of its colours, which is not read yet; None where it has none
    scale, offset: of positions in the picture: u and v are multiplied, then moved
    is_clamped: whether the picture's edge goes on beyond it; else the picture repeats
    """

    color: tuple[float, float, float] | None = None
    image: Path | None = None
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)
    is_clamped: bool = False


@dataclass(frozen=True, kw_only=True)
class TextureContents:
    """The texture of a mesh as the file names it.

    mesh:      its faces; frames with the same faces share one
    materials: of the groups of faces, in their order
    is_named:  False where the file names no picture, and one beside it has its name
    """

    mesh: TexturedMesh
    materials: tuple[Material, ...]
    is_named: bool = True


@dataclass(kw_only=True)
class PointContents:
    """One moment of points as the file has it.

    columns:  name -> (N,), of the file's type and in its order; emptied as they are used, so that few are
              held in memory together
    is_named: False where the file names no columns; they are called column_1, column_2 and so on
    has_roles: whether the columns are called by the roles that the user states
    arrays:   NPY and NPZ: array by name, of which only the header is read
    stated:   what the file states about itself
    remarks:  comments, and other lines of the header
    faces:    reads the faces between the points, in pieces; None where there are none
    topology: name of the faces, see `PointCloud`; None where there are none
    texture:  of the faces
    head:     text files: the first lines
    held:     bytes of the file in memory, for the admission of what is made of it; None: not packed
    """

    columns: dict[str, NDArray] = field(default_factory=dict)
    is_named: bool = True
    has_roles: bool = False
    arrays: Mapping[str, ArrayInFile] = field(default_factory=dict)
    stated: Stated = field(default_factory=Stated)
    remarks: tuple[str, ...] = ()
    faces: Callable[[], Iterator[Faces]] | None = None
    topology: str | None = None
    texture: TextureContents | None = None
    head: TextHead | None = None
    held: int | None = None


@dataclass(kw_only=True)
class PictureContents:
    """One range image as the file has it.

    depth:      (H, W) of any real type, as stored
    channels:   the names of the file's channels
    color:      (H, W, 3) of any type, or None
    mask:       (H, W) of any type, above 0 where the depth is to be used; or None
    confidence: (H, W) of any type, or None
    kind:       "z", "range" or "height", as `RangeView` has them; None: the file does not say
    world_to_camera: (4, 4) float64; None: the file does not say
    name:       of the view
    stated:     what the file states; `stated.camera` is its camera
    """

    depth: Column
    channels: tuple[str, ...] = ()
    color: Column | None = None
    mask: Column | None = None
    confidence: Column | None = None
    kind: str | None = None
    world_to_camera: NDArray[np.float64] | None = None
    name: str = ""
    stated: Stated = field(default_factory=Stated)
    remarks: tuple[str, ...] = ()
