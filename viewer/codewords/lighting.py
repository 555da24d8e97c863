"""Lighting of code words: Phong with a light of one colour, by tables of whole numbers.

Maršík 2010, (2): I = I_0 + k_d[material] I_diffuse + k_s[material] I_specular, for red, green and blue. A
word holds the indices DIFFUSE and SPECULAR, 0 to 127, and MATERIAL. The rule, in steps of linear light, 0 to
4095:

    part(index) = index + (index >> 6)                     0 to 128
    light = min(4095, I_0 + ((k_d part(DIFFUSE) + k_s part(SPECULAR) + 64) >> 7))
    picture = LIGHT_BYTES[light]                           sRGB
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..srgb import LIGHT_STEPS, bytes_from_light, linear_from_bytes
from .words import MATERIALS

LIGHT_BYTES = bytes_from_light(np.arange(LIGHT_STEPS + 1.0))
LIGHT_BYTES.setflags(write=False)
_AT_ONCE = 1 << 14  # colours compared with a palette together


@dataclass(frozen=True, eq=False)
class Materials:
    """Tables of an engine, (M, 3) uint16 each, up to 128 materials: light in steps, 0 to 4095.

    ambient: I_0. diffuse: k_d. specular: k_s. Raises InputError where they are no such tables.
    """

    ambient: NDArray[np.uint16]
    diffuse: NDArray[np.uint16]
    specular: NDArray[np.uint16]

    def __post_init__(self) -> None:
        tables = (self.ambient, self.diffuse, self.specular)
        if len({table.shape for table in tables}) > 1 or self.ambient.shape[1:] != (3,):
            raise InputError("tables of materials must have three columns and equal numbers of rows")
        if not 1 <= len(self.ambient) <= MATERIALS:
            raise InputError(f"a table has {len(self.ambient)} materials, but must have 1 to {MATERIALS}")
        if max(int(table.max()) for table in tables) > LIGHT_STEPS:
            raise InputError(f"a table of materials has more than {LIGHT_STEPS} steps of light")

    def __len__(self) -> int:
        return len(self.ambient)

    @classmethod
    def of_palette(
        cls, colors: NDArray[np.uint8], ambient: float = 0.0, diffuse: float = 1.0, specular: float = 0.0
    ) -> Materials:
        """Materials of colours (M, 3) sRGB under white light, by Phong's shares, 0 to 1; as they are, unlit:
        all diffuse."""
        light = linear_from_bytes(colors) * LIGHT_STEPS

        def steps(values: NDArray[np.float64]) -> NDArray[np.uint16]:
            return np.clip(np.rint(values), 0, LIGHT_STEPS).astype(np.uint16)

        white = np.full_like(light, LIGHT_STEPS)
        return cls(steps(ambient * light), steps(diffuse * light), steps(specular * white))

    def colors(
        self, material: NDArray[np.integer], diffuse: NDArray[np.integer], specular: NDArray[np.integer]
    ) -> NDArray[np.uint8]:
        """Colours, (N, 3) sRGB, of materials (N,) lit by indices (N,) each. Materials that there are not have
        the last one's."""
        material = np.minimum(material, len(self) - 1)
        parts = [(np.asarray(index) + (np.asarray(index) >> 6))[..., None] for index in (diffuse, specular)]
        lit = self.diffuse[material].astype(np.int32) * parts[0]
        lit = lit + self.specular[material].astype(np.int32) * parts[1]
        light = self.ambient[material] + (lit + 64 >> 7)
        return LIGHT_BYTES[np.minimum(light, LIGHT_STEPS)]


def palette_of(colors: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """At most 128 colours, (M, 3), and which of them each of (N, 3 or 4) is shown in, (N,).

    Up to 128 different ones stay as they are; of more, Pillow's median cut takes 128 and assigns each colour
    the nearest of them.
    """
    rgb = np.ascontiguousarray(colors[:, :3])
    packed = rgb.astype(np.uint32) @ np.array([1, 1 << 8, 1 << 16], np.uint32)
    distinct = np.unique(packed)
    if len(distinct) <= MATERIALS:
        palette = (distinct[:, None] >> np.array([0, 8, 16], np.uint32)).astype(np.uint8)
        return _at_least_one(palette), np.searchsorted(distinct, packed).astype(np.uint8)
    from PIL import Image

    picture = Image.fromarray(rgb[None]).quantize(MATERIALS, Image.Quantize.MEDIANCUT, kmeans=1)
    palette = np.array(picture.getpalette(), np.uint8).reshape(-1, 3)
    index = np.asarray(picture).ravel()
    return palette[: int(index.max()) + 1], index


def nearest_colors(palette: NDArray[np.uint8], colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The index, (N,), of the colour of a palette, (M, 3) sRGB, nearest to each of (N, 3) colours."""
    packed = colors.astype(np.uint32) @ np.array([1, 1 << 8, 1 << 16], np.uint32)
    _, first, of_distinct = np.unique(packed, return_index=True, return_inverse=True)
    # |c - p|^2 without |c|^2, which is the same for all p
    entries, distinct = palette.astype(np.int32), colors[first].astype(np.int32)
    squares, nearest = np.square(entries).sum(axis=1), np.empty(len(distinct), np.uint8)
    for start in range(0, len(distinct), _AT_ONCE):
        some = slice(start, start + _AT_ONCE)
        nearest[some] = (squares - 2 * distinct[some] @ entries.T).argmin(axis=1)
    return nearest[of_distinct]


def mapped(values: NDArray[np.floating], low: float, high: float) -> NDArray[np.uint8]:
    """Materials of values (N,) by a colour map's 127 colours from low to high, the last material for those
    that are no number."""
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        t = (values.astype(np.float64) - low) / max(high - low, np.finfo(np.float64).tiny)
    index = np.rint(np.clip(np.nan_to_num(t), 0, 1) * (MATERIALS - 2)).astype(np.uint8)
    index[np.isnan(values)] = MATERIALS - 1
    return index


def map_palette(table: NDArray[np.uint8], missing: tuple[int, ...]) -> NDArray[np.uint8]:
    """Colours for `mapped`, (128, 3): of a colour map's table (256, 3 or 4), and of what is no number."""
    at = np.rint(np.linspace(0, len(table) - 1, MATERIALS - 1)).astype(int)
    return np.concatenate([table[at, :3], np.array([missing[:3]], np.uint8)])


def _at_least_one(palette: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return palette if len(palette) else np.zeros((1, 3), np.uint8)
