"""Tiles: splats without quads. Each tile of the picture has a list of the discs that reach it.

No atomics on pixels: a tile's pixels keep the nearest disc in registers, so that the order of the lists
does not matter. Splats that are too large for lists go through the rasteriser, in either pass, and tiles
go on from what that found or added up; where any is large, all tiles are worked on.

Where the nearest alone is wanted and a list would be too long, as in a scan that is near and far at once,
discs of a few pixels are sent to these, by atomics, and the others listed.

What faces away comes second: first the discs that face the eye are listed and shown, then those of the
others that some tile they reach lets through, going by the farthest depth it shows. Of a closed surface
that leaves the outline alone. A second pass goes over both lists.

The CPU reads how long the lists are, to size them, and whether any splat is large. It waits for that after
each counting. On graphics cards, once a picture was as usual, it reads all numbers at the end of the next
picture, see `without_wait`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ..gpu.context import Gpu
from ..picture.surface import Surface
from .amplify import Points, amplify
from .lists import ALL, AWAY, DISC_BITS, DISC_BYTES, TOWARDS, ListPurpose, TileLists
from .splats import FRAGMENT, SURFEL, Splats, bind_visible

_MOST_PIXELS = (1 << 16) - 1  # along an edge of the picture: what cells.glsl's words have bits for
_LARGE_COST = 200  # entries of lists that a large disc, which is rasterised, takes as long as
DEPTH, LIMIT = 1, 2  # what is kept of each tile: FARTHEST of show.comp
_SHOWN = {"FOUND": 0, "FARTHEST": 0, "FILL": 0, "LARGE": 0, "AWAY": 0}
FALLBACK = "gs"  # what feeds the rasteriser where tiles do not do


def without_wait(points: Points, surface: Surface, draw: Callable[[], bool]) -> bool:
    """Return what `draw` does, which fills the surface's lists once, and perhaps once more with what faces
    away.

    Where the lists of the last picture allow it, the CPU does not wait for the new ones. It reads what they
    counted when all is drawn, and draws anew, with waits, where that was not as expected.
    """
    lists, skipped = surface.cached(TileLists), dict(surface.stats.skipped)
    lists.waits = bool(_unfit(points, surface)) or not lists.foresees(points)
    try:
        drawn = draw()
        if lists.waits or lists.held():
            return drawn
        lists.waits = True
        surface.restart()
        surface.stats.skipped.update(skipped)
        return draw()
    finally:
        lists.waits = True


def splat(points: Points, surface: Surface, splats: Splats) -> None:
    """The nearest disc at each pixel: what `amplify` draws, up to rounding."""
    if not without_wait(points, surface, lambda: splat_first(points, surface, splats, DEPTH)):
        amplify(points, surface, FALLBACK, SURFEL, FRAGMENT, splats)


def splat_first(points: Points, surface: Surface, splats: Splats, farthest: int) -> bool:
    """The nearest disc at each pixel, by tiles; False where the rasteriser has to do it all.

    First come those that face the eye, then those of the others that the first do not hide: of a closed
    surface next to none. farthest: as in `show`; where it is LIMIT, it is told in any case.
    """
    lists = tile_lists(points, surface, splats, ALL if splats.cull_back else TOWARDS, sends=True)
    if lists is None:
        return False
    away = lists.away > 0
    farthest = farthest if away or farthest == LIMIT else 0
    show_all(points, surface, lists, splats, farthest)
    if not away:
        surface.stats.skipped["second lists"] = "all drawn splats face the viewer"
        return True
    if not fill_away(points, surface, lists, splats):
        return False
    show(points, surface, lists, splats, found=True, farthest=farthest if farthest == LIMIT else 0, away=True)
    return True


def fill_away(
    points: Points, surface: Surface, lists: TileLists, splats: Splats, blends: bool = False
) -> bool:
    """List what faces away; False where the rasteriser has to do it all. blends: whether all lists are gone
    over next, to blend what they hold."""
    fits = lists.fill(points, surface, splats, AWAY, ListPurpose(both=blends, looks=blends))
    if not fits:
        surface.stats.skipped["tiles"] = (
            f"the lists have {lists.length:,} entries, so all splats are rasterised"
        )
    return fits


def tile_lists(
    points: Points,
    surface: Surface,
    splats: Splats,
    side: int = ALL,
    sends: bool = False,
    looks: bool = False,
    numbered: bool = False,
) -> TileLists | None:
    """The surface's lists, filled; None where the rasteriser has to do it all, or does it sooner.

    sends: where they are too long, discs of a few pixels are in none, but on the surface, which nothing else
    is on then. looks, numbered: as in `TileLists.fill`.
    """
    reason = _unfit(points, surface)
    if not reason:
        lists = surface.cached(TileLists)
        fits = lists.fill(points, surface, splats, side, ListPurpose(looks=looks, numbered=numbered))
        if sends and not fits:
            surface.clear()
            fits = lists.fill(points, surface, splats, side, ListPurpose(sends=True))
        if not fits:
            reason = f"the lists are too long ({lists.length:,} entries)"
        elif not lists.away and lists.large * _LARGE_COST > lists.length + lists.sent:
            reason = f"{lists.large:,} large splats"
    if reason:
        surface.stats.skipped["tiles"] = f"{reason}, so all splats are rasterised"
        return None
    if lists.large:
        surface.stats.skipped["large splats in tiles"] = f"{lists.large:,} rasterised"
    else:
        surface.stats.skipped["splat"] = "no splat is large"
    if lists.sent:
        surface.stats.skipped["lists of small splats"] = f"{lists.sent:,} drawn without a list"
        lists.take_sent(points, surface, splats)
    return lists


def show_all(
    points: Points, surface: Surface, lists: TileLists, splats: Splats, farthest: int = 0
) -> Points | None:
    """The nearest disc at each pixel of those listed and of the large ones, which it returns; None where
    there are none. farthest: as in `show`."""
    large = lists.large_points(points) if lists.large else None
    show_with(points, large, surface, lists, splats, farthest)
    return large


def show_with(
    points: Points,
    large: Points | None,
    surface: Surface,
    lists: TileLists,
    splats: Splats,
    farthest: int = 0,
) -> None:
    """The nearest disc at each pixel of those listed and of large ones, which are rasterised. farthest: as in
    `show`."""
    if large is not None:
        amplify(large, surface, FALLBACK, SURFEL, FRAGMENT, splats, over=lists.sent > 0)
    show(points, surface, lists, splats, found=large is not None or lists.sent > 0, farthest=farthest)


def show(
    points: Points,
    surface: Surface,
    lists: TileLists,
    splats: Splats,
    found: bool = False,
    farthest: int = 0,
    away: bool = False,
) -> None:
    """The nearest listed disc at each pixel.

    found: over what the surface holds already. farthest: what fillings that follow go by: DEPTH, what a tile
    shows; LIMIT, how far behind that splats still count. away: of those that face away.
    """
    if not found:
        surface.clear()
    defines: dict[str, object] = {
        **_SHOWN, "FOUND": int(found), "FARTHEST": farthest, "AWAY": int(away),
    }  # fmt: skip
    if farthest == LIMIT:
        defines |= {**points.defines, "LOCAL": int(splats.layer > 0)}
        run("show", surface, lists, defines, points, splats)
    else:
        run("show", surface, lists, defines, splats=splats)


def run(
    name: str,
    surface: Surface,
    lists: TileLists,
    defines: Mapping[str, object],
    first: Points | None = None,
    splats: Splats | None = None,
    work: str = "work",
) -> None:
    """Run surfels/tiles/NAME.comp on the tiles that have lists. first: the points of the first pass, where it
    reads their radii, and splats: how they were drawn. work: on which tiles, as `TileLists.run` has them."""
    gpu = surface.gpu
    layout = {"TILES": lists.grid.tiles, "PERSPECTIVE": int(surface.view.perspective)}
    with gpu.timers.measure(name):
        given = {**defines, **layout, **lists.defines}
        program = gpu.compute(f"surfels/tiles/{name}.comp", given, params=splats)
        if first is not None:
            bind_visible(first, program)
        surface.bind_storage()
        lists.run(program, work)


def show_smaller(surface: Surface, lists: TileLists, splats: Splats) -> None:
    """Show the tiles again in which a pixel shows a disc that does not reach it any more, now that some have
    become smaller. `Texture.DISCS` is bound to the number of each row's."""
    lists.start_again()
    run("again", surface, lists, {"AWAY": 0})
    run("show", surface, lists, _SHOWN, splats=splats, work="again")


def most_listed(gpu: Gpu) -> int:
    """How many discs software drivers list at once with room for each to be in several lists: of more, a
    coarser picture takes a part of the time that the rasteriser does."""
    return min(gpu.max_storage_bytes // DISC_BYTES, 1 << DISC_BITS) // 2


def _unfit(points: Points, surface: Surface) -> str:
    """Why such a pose or picture has no lists; empty where it has."""
    if max(surface.size) > _MOST_PIXELS:
        return f"the picture has more than {_MOST_PIXELS} pixels along an edge"
    most = min(surface.gpu.max_storage_bytes // DISC_BYTES, 1 << DISC_BITS)
    return f"more than {most:,} points" if points.count > most else ""
