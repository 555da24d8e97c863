"""Faces between the candidates of neighboring sectors (Machado e Silva 2014, 4.4)."""

from __future__ import annotations

from functools import partial

from ...gpu import gl
from ...gpu.bindings import Storage, Texture
from ...gpu.compact import IndexList
from ...gpu.constants import GROUP, NOTHING
from ...gpu.context import Fill, Gpu, Program
from ...gpu.pose import GpuPose
from ...gpu.scatter import Visits, take_items, take_keys
from ...picture.surface import Surface
from ...visibility.candidates import Candidates
from .splats import SectorSplats

_LARGE = 1 << 12  # pixels around a face from which on many invocations draw it
_BEHIND = "0x80000000u"  # added to a depth's bits
_LANES = 4 * GROUP  # so many, so that none has more than 65,535 pixels


class FaceLists:
    """The quads of sectors that have faces in a picture, and which points are corners of any."""

    def __init__(self, gpu: Gpu, _: tuple[int, int]) -> None:
        self._gpu = gpu
        self.small, self.large = IndexList(gpu, 1), IndexList(gpu, 1, _LANES)
        self.joined = _flags(gpu, 1)

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU: 8 a sector and 4 a point."""
        return self.small.nbytes + self.large.nbytes + self.joined.buffer.size

    def reserve(self, quads: int, points: int) -> None:
        """Make room for so many, and no flag set."""
        if self.small.capacity != quads:
            self._gpu.discard(self.small, self.large)
            self.small, self.large = IndexList(self._gpu, quads), IndexList(self._gpu, quads, _LANES)
        if self.joined.buffer.size != 4 * points:
            self._gpu.discard(self.joined)
            self.joined = _flags(self._gpu, points)
        self._gpu.clear(self.joined.buffer, 0)
        self.small.clear()
        self.large.clear()

    def release(self) -> None:
        """Delete everything."""
        self._gpu.discard(self.small, self.large, self.joined)


def _flags(gpu: Gpu, count: int) -> gl.BufferTexture:
    return gl.BufferTexture(gpu.buffer(reserve=4 * count), gl.R32UI)


def draw_faces(
    pose: GpuPose,
    surface: Surface,
    candidates: Candidates,
    visible: gl.BufferTexture,
    splats: SectorSplats,
    longest: float,
) -> None:
    """Draw the faces between candidates, and visible points as a pixel where they are in none, or where these
    show nothing.

    visible: R32UI, a texel a row, 0 where a point is not. splats: of the candidates, for normals and
    spacings. longest: edges longer than so many times the distance to the neighbors, at that of their ends
    where it is less, are of no surface: faces that have one are left out. Rows are those of the nearest
    corners; colours, normals and values lie between those of all three.
    """
    gpu, sectors, count = surface.gpu, candidates.sectors, len(pose.cloud)
    lists = surface.cached(FaceLists)
    lists.reserve(_quads(candidates), max(count, 1))
    first_point = 8 * sectors.count

    def bind(program: Program) -> None:
        candidates.rows.bind(Texture.CANDIDATES)
        visible.bind(Texture.VISIBLE)
        candidates.homes.bind(Texture.HOMES)
        pose.array("positions").bind(Texture.POSITIONS)
        splats["spacings"].bind(Texture.SPACINGS)
        splats["splats"].bind(Texture.SPLATS)
        lists.joined.bind(Texture.JOINED)
        for name, value in (("longest", longest), ("first_point", first_point)):
            if name in program:
                gpu.set(program, **{name: value})

    def bind_listed(listed: IndexList, program: Program) -> None:
        bind(program)
        listed.texels.bind(Texture.LISTED)

    defines = {"LARGE": _LARGE, "BEHIND_FACES": _BEHIND, **candidates.defines}
    with gpu.timers.measure("faces"):
        program = gpu.compute("hpr/list_faces.comp", {"LANES": _LANES, **defines}, params=sectors)
        bind(program)
        lists.small.bind()
        lists.large.bind(Storage.NEXT_LIST, Storage.NEXT_DISPATCH)
        lists.joined.buffer.bind_to_storage_buffer(Storage.JOINED)
        gpu.dispatch(program, sectors.count)
    drawn = [Visits("hpr/corners.glsl", count, bind, defines)]
    for listed in (lists.small, lists.large):
        given = {"LANES": listed.each, **defines}
        drawn.append(Visits("hpr/face_pixels.glsl", 0, partial(bind_listed, listed), given, sectors, listed))
    # The depth lies behind all that is behind faces.
    gpu.fill(*(Fill(texels.buffer, NOTHING) for texels in (surface.depths, surface.rows)))
    for visits in drawn:
        take_keys(gpu, visits, surface.depths)
    for visits in drawn:
        take_items(gpu, visits, surface.depths, surface.rows)
    with gpu.timers.measure("resolve"):
        channels = _bind_channels(pose, surface)
        program = gpu.compute("hpr/resolve_faces.comp", {**channels, **defines}, params=sectors)
        bind(program)
        surface.bind_storage()
        gpu.dispatch(program, surface.size[0] * surface.size[1])


def _bind_channels(pose: GpuPose, surface: Surface) -> dict[str, object]:
    """Bind what is mixed between corners and where it goes; the macros that say so."""
    surface.bind_own("normal")
    colors, values = pose.find("colors"), surface.row_values
    if colors is not None:
        colors.bind(Texture.COLORS)
        surface.bind_own("color")
    if values is not None:
        values.bind(Texture.VALUES)
        surface.bind_own("value")
    return {"HAS_COLORS": int(colors is not None), "HAS_VALUES": int(values is not None)}


def _quads(candidates: Candidates) -> int:
    """How many quads there may be: one for each sector, and those across the edges of a cube."""
    return candidates.sectors.count + 12 * candidates.sectors.edge
