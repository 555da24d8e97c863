"""The inner loops of finding which triangles lie over which places, and of masking pixels whose triangles are
not needed, compiled by numba; see `covering`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, inlined

_EDGE = 1e-6  # of a triangle: how far outside of it a line still meets it, so that none falls between two
_MOST = 1 << 12  # pixels that are exchanged at once
_MARGIN = 1e-4  # of a cell: what lies so close to it belongs to it, too, so that no rounding loses it


class Lists(NamedTuple):
    """Lists of numbers: list n is numbers[first[n] : first[n + 1]]."""

    first: NDArray[np.int64]
    numbers: NDArray[np.uint32]


class TriangleCells(NamedTuple):
    """V points and F triangles of several views. cells: the faces whose boxes touch a cell of space; each
    list is of all cells with one `_hashed` number."""

    points: NDArray[np.float64]  # (V, 3)
    normals: NDArray[np.float32]  # (V, 3), unit length
    within: NDArray[np.float64]  # (V,), how far off triangles may cover a place
    faces: NDArray[np.uint32]  # (F, 3)
    edge: float  # of a cell, scan units
    cells: Lists


@inlined
def _hashed(x: int, y: int, z: int, lists: int) -> int:
    """The number of a cell's list; lists: a power of two."""
    return ((x * 73856093) ^ (y * 19349663) ^ (z * 83492791)) & (lists - 1)


@compiled
def sort_into_cells(triangles: TriangleCells, at: NDArray[np.int64]) -> None:
    """Put each face into the lists of the cells that its box touches, in the order of faces.

    at: (lists,), where the next face of each list goes, counted on. Where `cells` has no numbers, faces are
    only counted.
    """
    points, faces, numbers = triangles.points, triangles.faces, triangles.cells.numbers
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for face in range(len(faces)):
        for axis in range(3):
            a, b, c = points[faces[face, 0], axis], points[faces[face, 1], axis], points[faces[face, 2], axis]
            low[axis] = int(np.floor(min(a, b, c) / triangles.edge - _MARGIN))
            high[axis] = int(np.floor(max(a, b, c) / triangles.edge + _MARGIN))
        for x in range(low[0], high[0] + 1):
            for y in range(low[1], high[1] + 1):
                for z in range(low[2], high[2] + 1):
                    number = _hashed(x, y, z, len(at))
                    if len(numbers) > 0:
                        numbers[at[number]] = face
                    at[number] += 1


@inlined
def _crossing(
    triangles: TriangleCells, face: int, place: NDArray[np.float64], normal: NDArray[np.float64]
) -> float:
    """How far along a normal its line meets a face with normals to the same side; NaN: nowhere."""
    a, b, c = triangles.faces[face, 0], triangles.faces[face, 1], triangles.faces[face, 2]
    points, normals = triangles.points, triangles.normals
    ax, ay, az = points[a, 0], points[a, 1], points[a, 2]
    bx, by, bz = points[b, 0] - ax, points[b, 1] - ay, points[b, 2] - az
    cx, cy, cz = points[c, 0] - ax, points[c, 1] - ay, points[c, 2] - az
    px, py, pz = place[0] - ax, place[1] - ay, place[2] - az
    nx, ny, nz = normal[0], normal[1], normal[2]
    qx, qy, qz = ny * cz - nz * cy, nz * cx - nx * cz, nx * cy - ny * cx
    whole = bx * qx + by * qy + bz * qz
    if not abs(whole) > 0.0:
        return np.nan
    second = (px * qx + py * qy + pz * qz) / whole
    if second < -_EDGE or second > 1.0 + _EDGE:
        return np.nan
    rx, ry, rz = py * bz - pz * by, pz * bx - px * bz, px * by - py * bx
    third = (nx * rx + ny * ry + nz * rz) / whole
    if third < -_EDGE or second + third > 1.0 + _EDGE:
        return np.nan
    side = 0.0
    for axis in range(3):
        side += normal[axis] * (normals[a, axis] + normals[b, axis] + normals[c, axis])
    return (cx * rx + cy * ry + cz * rz) / whole if side > 0.0 else np.nan


@compiled
def find_covers(
    triangles: TriangleCells,
    hosts: NDArray[np.int64],
    shares: NDArray[np.float64],
    places: NDArray[np.uint32],
    covers: NDArray[np.uint32],
) -> int:
    """Find the faces that cover places of the faces `hosts`, (H,): pairs of places (N,), counted from 0, and
    faces, covers (N,). Returns how many pairs there are, even if N is less.

    shares: (M, 3), those of the corners in the places of a host.
    """
    edge, lists = triangles.edge, len(triangles.cells.first) - 1
    place, normal = np.empty(3), np.empty(3)
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    found = 0
    for number in range(len(hosts) * len(shares)):
        host, share = hosts[number // len(shares)], shares[number % len(shares)]
        within, length = 0.0, 0.0
        for axis in range(3):
            place[axis] = normal[axis] = 0.0
            for corner in range(3):
                point = triangles.faces[host, corner]
                place[axis] += share[corner] * triangles.points[point, axis]
                normal[axis] += share[corner] * triangles.normals[point, axis]
            within += share[axis] * triangles.within[triangles.faces[host, axis]]
            length += normal[axis] * normal[axis]
        if not length > 0.0:
            continue
        along = 0
        for axis in range(3):
            normal[axis] /= np.sqrt(length)
            if abs(normal[axis]) > abs(normal[along]):
                along = axis
        span = within * abs(normal[along])
        last = int(np.floor((place[along] + span) / edge + _MARGIN))
        for slab in range(int(np.floor((place[along] - span) / edge - _MARGIN)), last + 1):
            enter = min(max((slab * edge - place[along]) / normal[along], -within), within)
            leave = min(max(((slab + 1) * edge - place[along]) / normal[along], -within), within)
            for axis in range(3):
                one, other = place[axis] + enter * normal[axis], place[axis] + leave * normal[axis]
                low[axis] = int(np.floor(min(one, other) / edge - _MARGIN))
                high[axis] = int(np.floor(max(one, other) / edge + _MARGIN))
            low[along] = high[along] = slab
            for x in range(low[0], high[0] + 1):
                for y in range(low[1], high[1] + 1):
                    for z in range(low[2], high[2] + 1):
                        row, previous = _hashed(x, y, z, lists), -1
                        for n in range(triangles.cells.first[row], triangles.cells.first[row + 1]):
                            face = int(triangles.cells.numbers[n])
                            if face == previous:  # two of its cells share the list
                                continue
                            previous = face
                            far = _crossing(triangles, face, place, normal)
                            # Several cells have the face; the one that has the crossing counts it.
                            if (
                                abs(far) <= within
                                and int(np.floor((place[0] + far * normal[0]) / edge)) == x
                                and int(np.floor((place[1] + far * normal[1]) / edge)) == y
                                and int(np.floor((place[2] + far * normal[2]) / edge)) == z
                            ):
                                if found < len(places):
                                    places[found], covers[found] = number, face
                                found += 1
    return found


@compiled
def fill_lists(
    lists: Lists, at: NDArray[np.int64], keys: NDArray[np.uint32], numbers: NDArray[np.uint32]
) -> None:
    """Put numbers (N,) into the lists of their keys (N,). at: where the next one of each goes, counted on."""
    for key, number in zip(keys, numbers):  # noqa: B905 (numba knows no strict)
        lists.numbers[at[key]] = number
        at[key] += 1


@compiled
def count_views(
    covers: Lists,
    faces: NDArray[np.int64],
    view: NDArray[np.int64],
    latest: NDArray[np.int32],
    times: NDArray[np.int32],
) -> None:
    """Count how many views have one of these faces over each of P places. faces: (N,), view after view.

    covers: for each of F faces, its places. view: (F,). latest: (P,), -1, and times: (P,), 0, counted on.
    """
    for face in faces:
        for n in range(covers.first[face], covers.first[face + 1]):
            place = covers.numbers[n]
            if latest[place] != view[face]:
                latest[place] = view[face]
                times[place] += 1


class Masking(NamedTuple):
    """The F triangles between V pixels, which masks show or hide, and the P places that they cover.

    A triangle is shown where its corners are kept and the pixel whose place it takes, if any, is masked."""

    faces: NDArray[np.uint32]  # (F, 3)
    instead_of: NDArray[np.int64]  # (F,), the pixel whose place a face takes, -1: none
    corner_of: Lists  # for each pixel, the faces that it is a corner of
    replaced_by: Lists  # for each pixel, the faces that take its place once it is masked
    covers: Lists  # for each face, the places that it lies over
    covered_by: Lists  # for each place, the faces over it
    patches: NDArray[np.float64]  # (P,), the area of each place, scan units squared
    shown_over: NDArray[np.int32]  # (P,), how many shown faces each place has over it
    shown: NDArray[np.bool_]  # (F,)
    kept: NDArray[np.bool_]  # (V,), the pixels


@inlined
def _counted(masking: Masking, face: int, change: int) -> tuple[float, bool]:
    """Count a face on or off over its places: the area that this adds to what lies over each other, and
    whether a place has no face left."""
    covers, shown_over, area, opened = masking.covers, masking.shown_over, 0.0, False
    for n in range(covers.first[face], covers.first[face + 1]):
        place = covers.numbers[n]
        if max(shown_over[place], shown_over[place] + change) > 1:
            area += change * masking.patches[place]
        shown_over[place] += change
        opened = opened or shown_over[place] == 0
    return area, opened


@compiled
def count_shown(masking: Masking) -> None:
    """Count the shown faces over their places."""
    for face in range(len(masking.faces)):
        if masking.shown[face]:
            _counted(masking, face, 1)


@compiled
def _keep(masking: Masking, pixel: int, kept: bool) -> tuple[float, bool]:
    """Keep a pixel, or mask it: the area that this adds to what lies over each other, and whether a place
    loses its last face. The faces that come are counted before those that go."""
    masking.kept[pixel] = kept
    area, opened = 0.0, False
    for change in (1, -1):
        for lists in (masking.corner_of, masking.replaced_by):
            for n in range(lists.first[pixel], lists.first[pixel + 1]):
                face = lists.numbers[n]
                a, b, c = masking.faces[face, 0], masking.faces[face, 1], masking.faces[face, 2]
                wanted = masking.kept[a] and masking.kept[b] and masking.kept[c]
                if wanted and masking.instead_of[face] >= 0:
                    wanted = not masking.kept[masking.instead_of[face]]
                if wanted == (change > 0) and masking.shown[face] != wanted:
                    masking.shown[face] = wanted
                    added, opens = _counted(masking, face, change)
                    area += added
                    opened = opened or (opens and change < 0)
    return area, opened


@compiled
def mask_unneeded(masking: Masking, order: NDArray[np.int64]) -> None:
    """Mask pixels, one after another, that leave a shown face over every place that has one now."""
    for pixel in order:
        if _keep(masking, pixel, False)[1]:
            _keep(masking, pixel, True)


class Exchanged(NamedTuple):
    """Numbers and flags of V pixels, which decide what is exchanged."""

    weights: NDArray[np.float64]  # (V,): the lowest are masked first
    fixed: NDArray[np.bool_]  # (V,), pixels that are never masked
    good: NDArray[np.bool_]  # (V,), masked pixels that may be kept
    tried: NDArray[np.bool_]  # (V,), pixels near the middle of a block; none is the middle of another one


@compiled
def _around(
    masking: Masking, block: NDArray[np.int64], rings: int, good: NDArray[np.bool_], found: NDArray[np.bool_]
) -> tuple[int, int]:
    """Find the good masked pixels of a view up to so many pixels from block[0]: the length of the block with
    these, and with those half as far away. found: (V,), marks them."""
    found[block[0]] = True
    start, count, inner = 0, 1, 1
    for ring in range(rings):
        end = count
        if ring <= rings // 2:
            inner = end
        for number in range(start, end):
            pixel = block[number]
            for n in range(masking.corner_of.first[pixel], masking.corner_of.first[pixel + 1]):
                for corner in masking.faces[masking.corner_of.numbers[n]]:
                    other = np.int64(corner)
                    if count < len(block) and good[other] and not (masking.kept[other] or found[other]):
                        found[other] = True
                        block[count] = other
                        count += 1
        start = end
    return count, inner


@compiled
def _beneath(
    masking: Masking,
    block: NDArray[np.int64],
    fixed: NDArray[np.bool_],
    found: NDArray[np.bool_],
    pixels: NDArray[np.int64],
) -> int:
    """Find the kept pixels whose shown faces lie over places of a block's, and that are neither fixed nor
    found: how many there are. pixels: (N,), gets them. found: (V,), marks them."""
    count = 0
    for pixel in block:
        for n in range(masking.corner_of.first[pixel], masking.corner_of.first[pixel + 1]):
            face = masking.corner_of.numbers[n]
            if not masking.shown[face]:
                continue
            for k in range(masking.covers.first[face], masking.covers.first[face + 1]):
                place = masking.covers.numbers[k]
                if masking.shown_over[place] < 2:
                    continue
                for j in range(masking.covered_by.first[place], masking.covered_by.first[place + 1]):
                    over = masking.covered_by.numbers[j]
                    if not masking.shown[over]:
                        continue
                    for corner in masking.faces[over]:
                        other = np.int64(corner)
                        if count < len(pixels) and not (fixed[other] or found[other]):
                            found[other] = True
                            pixels[count] = other
                            count += 1
    return count


@compiled
def exchange(
    masking: Masking,
    order: NDArray[np.int64],
    rings: int,
    pixels: Exchanged,
    least: float,
) -> None:
    """Keep masked pixels, one after another, each with those up to so many rings around it, and mask those
    beneath, the lowest weights first; if then an area of `least` less lies over each other, and no place has
    lost its last face. Else all stays."""
    weights, fixed, good, tried = pixels
    found, changed = np.zeros(len(masking.kept), np.bool_), np.empty(3 * _MOST, np.int64)
    block, under = np.empty(_MOST, np.int64), np.empty(_MOST, np.int64)
    for pixel in order:
        if masking.kept[pixel] or tried[pixel]:
            continue
        block[0] = pixel
        count, inner = _around(masking, block, rings, good, found)
        area, opened = 0.0, False
        tried[block[:inner]] = True
        changed[:count] = block[:count]
        for one in block[:count]:
            added, opens = _keep(masking, one, True)
            area += added
            opened = opened or opens
        beneath = under[: _beneath(masking, block[:count], fixed, found, under)]
        found[block[:count]] = False
        found[beneath] = False
        total = count
        for one in np.concatenate((beneath[np.argsort(weights[beneath])], block[:count][::-1])):
            if opened:
                break
            added, opens = _keep(masking, one, False)
            if opens:
                _keep(masking, one, True)
            else:
                area += added
                changed[total] = one
                total += 1
        if opened or area > -least:
            for one in changed[:total][::-1]:
                _keep(masking, one, not masking.kept[one])
