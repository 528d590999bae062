"""The channel tables as node groups read them: one image, and where in it.

Every tile of the image is a table of two dimensions with a margin of one texel. From below: a row
of tiles for each depth (light scattered, light scattered once ahead, irradiance on patches); the
tables of depth and distance, one above the other; and those of one dimension, which are as wide.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.transfer.channel_tables import (
    ALONG,
    ALONG_SUNLIGHT,
    LENGTHS,
    RATES,
    ChannelTables,
    LengthScale,
)
from ..uw_spectral.transfer.depth_scale import DepthScale
from ..uw_spectral.transfer.radiance_table import ANGLES, AZIMUTHS, ELEVATIONS, TILTS, TURNS
from .data_blocks import write_pixels
from .node_mathematics import NODES, Graph, NodeValue
from .shape import Shape
from .texture_atlas import number_image, texel

NAME, PART = "UW Light", "uw_table"
_LARGEST = 1e30
_MARGIN = 1
_SIDES = 2 * _MARGIN
_ACROSS = AZIMUTHS + _SIDES
_PATCHES = 2 * _ACROSS  # first column of the irradiance
_WIDTH = max(_PATCHES + TURNS + _SIDES, LENGTHS + _SIDES, ANGLES + _SIDES)
_ROW = max(ELEVATIONS, TILTS) + _SIDES
_BEFORE_LAST = 1.001  # slices from the deepest position that has a slice behind it
_COLOURS = 3
_ALONG = 1 + _SIDES  # rows of a table of one dimension


@dataclass(frozen=True)
class Layout:
    """Rows of the image."""

    slices: int  #: Depths.
    columns: int  #: Colours: red, green, blue and measured ones.
    parts: int  #: Of the phase function.
    layered: bool  #: The water differs with depth.
    waves: bool
    emissions: int = 0  #: That are no colour.

    @classmethod
    def of(cls, light: ChannelTables) -> Layout:
        """Return the rows of the channel tables."""
        columns, parts = len(light.sunlit), len(light.components)
        waves = bool(len(light.caustics))
        emissions = len(light.glowing) - _COLOURS
        return cls(light.depth_scale.slices, columns, parts, light.layered, waves, emissions)

    @property
    def deep(self) -> int:
        """Rows of a table of depths."""
        return self.slices + _SIDES

    def row(self, name: str, index: int = 0) -> int:
        """First row of a table of the light, or of one of its parts."""
        first = 0
        for own, count, height in self._tables():
            if own == name:
                return first + index * height
            first += count * height
        raise KeyError(name)

    def _tables(self) -> Iterator[tuple[str, int, int]]:
        """Names of tables, from the lowest row up, how many of each, and their rows."""
        yield "scattered", self.slices, _ROW
        yield "dimmed", 3, self.deep
        yield "peaked", 3, self.deep
        yield "matte", 3 * self.columns, self.deep
        yield "sunlit", self.columns, self.deep
        yield "caustics", self.waves * self.columns, self.deep
        yield "glowing", _COLOURS + self.emissions, self.deep
        yield "aureole", 1, self.deep
        yield "image", 1, ELEVATIONS + _SIDES
        yield "on path", self.layered * self.parts, ELEVATIONS + _SIDES
        for name, count in ALONG.items():
            yield name, count, _ALONG
        for name in () if self.layered else ALONG_SUNLIGHT:
            yield name, self.parts, _ALONG
        yield "", 0, 0

    @property
    def height(self) -> int:
        """Rows in all."""
        return self.row("")


def layout_of(shape: Shape) -> Layout:
    """Return the layout of the tables of a shape."""
    return Layout(
        shape.slices, _COLOURS + shape.measured, len(shape.components), shape.layered,
        any(term.caustics for term in shape.terms), sum(term.emissions for term in shape.terms),
    )  # fmt: skip


def exciting_layout(shape: Shape) -> Layout:
    """Return that of the light that excites other light."""
    return replace(layout_of(shape), columns=_COLOURS, emissions=0)


def new_image(layout: Layout) -> bpy.types.Image:
    """Make the image, dark."""
    image = number_image(NAME, _WIDTH, layout.height)
    image.use_half_precision = False
    return image


def write_light(image: bpy.types.Image, light: ChannelTables) -> None:
    """Put the channel tables into an image of its size."""
    write_pixels(image, pixels(light))


def pixels(light: ChannelTables) -> NDArray[np.float32]:
    """Return the texels, shape (rows, columns, 4); the first row is the lowest."""
    layout = Layout.of(light)
    out = np.ones((layout.height, _WIDTH, 4), np.float32)

    def put(table: NDArray[np.float64], row: int, column: int = 0, *, every: int = 0) -> None:
        """Lay tables (3, ..., height, width) one above the other, ``every`` so many rows."""
        shape = table.shape[-2:]
        tiles = np.moveaxis(table.reshape(3, -1, *shape), 0, -1)
        sides = (_MARGIN, _MARGIN)
        padded = np.pad(tiles, ((0, 0), sides, sides, (0, 0)), mode="edge")
        height, width = padded.shape[1:3]
        for place, tile in enumerate(padded):
            first = row + place * (every or height)
            # What grows beyond is multiplied with what has vanished by then; infinite, that
            # would be no number.
            out[first : first + height, column : column + width, :3] = tile.clip(
                -_LARGEST, _LARGEST
            )

    put(light.scattered, 0, every=_ROW)
    put(light.beyond, 0, _ACROSS, every=_ROW)
    put(light.irradiance, 0, _PATCHES, every=_ROW)
    put(np.moveaxis(light.dimmed, 1, 0), layout.row("dimmed"))
    put(np.moveaxis(light.peaked, 1, 0), layout.row("peaked"))
    # Of a colour all three kinds of light follow each other.
    put(np.moveaxis(np.swapaxes(light.matte, 0, 1), 2, 0), layout.row("matte"))
    put(np.moveaxis(light.sunlit, 1, 0), layout.row("sunlit"))
    if layout.waves:
        put(np.moveaxis(light.caustics, 1, 0), layout.row("caustics"))
    put(np.moveaxis(light.glowing, 1, 0), layout.row("glowing"))
    put(light.aureole, layout.row("aureole"))
    put(light.image, layout.row("image"))
    if light.layered:
        put(np.moveaxis(light.single, 1, 0), layout.row("on path"))
    for name in (*ALONG, *(() if light.layered else ALONG_SUNLIGHT)):
        table = getattr(light, name)
        table = table.reshape(-1, *table.shape[-2:])
        put(np.moveaxis(table, 1, 0)[..., None, :], layout.row(name))
    return out


@dataclass(frozen=True, eq=False)
class ImageTables:
    """Look-ups in a node tree, with scales of node values; see :class:`.pixel_parts.Tables`."""

    graph: Graph
    image: bpy.types.Image
    layout: Layout
    depth_scale: DepthScale
    lengths: LengthScale

    def split(self, channels: NodeValue) -> Sequence[NodeValue]:
        """Return the three channels."""
        return self.graph.components(channels)

    def scattered(self, y: Operand, h: Operand, v: Operand) -> NodeValue:
        """Look up M over its unit."""
        return self._between_slices(y, h, v, 0)

    def beyond(self, y: Operand, h: Operand, v: Operand) -> NodeValue:
        """Look up sunlight that is scattered once ahead, over the same unit."""
        return self._between_slices(y, h, v, _ACROSS)

    def irradiance(self, y: Operand, h: Operand, v: Operand) -> NodeValue:
        """Look up the irradiance on a patch over the same unit."""
        return self._between_slices(y, h, v, _PATCHES)

    def image_at(self, h: Operand, v: Operand) -> NodeValue:
        """Look up the radiance of the boundary that is ahead."""
        return self._texel(h, v, self.layout.row("image"))

    def image_transmittance(self, up: Operand, P: Operand) -> NodeValue:
        """Look up the fraction of that which is left, looking up (1) or down (0)."""
        row = float(self.layout.row("image_transmittance", 1)) - up * float(_ALONG)
        return self._texel(self._place(P), 0.0, row)

    def aureole(self, y: Operand, t: Operand) -> NodeValue:
        """Look up the factor of the sun's aureole."""
        return self._texel(t, self._slice(y), self.layout.row("aureole"))

    def dimmed(self, y: Operand, P: Operand) -> list[NodeValue]:
        """Look up what is left of light, per channel of it."""
        return [self._deep(self.layout.row("dimmed"), y, P, j) for j in range(3)]

    def peaked(self, y: Operand, P: Operand) -> list[NodeValue]:
        """Look up the same with the forward peak."""
        return [self._deep(self.layout.row("peaked"), y, P, j) for j in range(3)]

    def matte(self, y: Operand, P: Operand, k: Operand) -> list[NodeValue]:
        """Look up what is left of what a colour reflects, per channel of the light."""
        return [self._deep(self.layout.row("matte"), y, P, k * 3.0 + float(j)) for j in range(3)]

    def sunlit(self, y: Operand, P: Operand, k: Operand) -> NodeValue:
        """Look up what is left of sunlight on a colour."""
        return self._deep(self.layout.row("sunlit"), y, P, k)

    def caustics(self, y: Operand, P: Operand, k: Operand) -> NodeValue:
        """Look up what waves add to that."""
        return self._deep(self.layout.row("caustics"), y, P, k)

    def glowing(self, y: Operand, P: Operand, k: int) -> NodeValue:
        """Look up what is left of light of colour k."""
        return self._deep(self.layout.row("glowing"), y, P, float(k))

    def occlusion_matrix(self, kind: int, y: Operand) -> list[NodeValue]:
        """Look up what the spectrum of the occlusion makes of light, per channel of it."""
        rows = (self.layout.row("occlusion_matrix", 3 * kind + j) for j in range(3))
        return [self._texel(self._slice(y), 0.0, row) for row in rows]

    def rate(self, name: str, y: Operand) -> NodeValue:
        """Look up one of the rates at a depth."""
        return self._texel(self._slice(y), 0.0, self.layout.row("rates", RATES.index(name)))

    def along(self, name: str, index: int | None, P: Operand) -> NodeValue:
        """Look up a table over distance."""
        return self._texel(self._place(P), 0.0, self.layout.row(name, index or 0))

    def single_on_path(self, part: int, v: Operand, P: Operand) -> NodeValue:
        """Look up layered water's sunlight scattered once."""
        return self._texel(self._place(P), v, self.layout.row("on path", part))

    def _slice(self, y: Operand) -> Operand:
        return self.depth_scale.slice(y, NODES)

    def _place(self, P: Operand) -> Operand:
        return self.lengths.place(P, NODES)

    def _deep(self, first: int, y: Operand, P: Operand, tile: Operand) -> NodeValue:
        row = float(first) + tile * float(self.layout.deep)
        return self._texel(self._place(P), self._slice(y), row)

    def _between_slices(self, y: Operand, h: Operand, v: Operand, column: int) -> NodeValue:
        """Look up a place of the tiles of depths."""
        z = NODES.minimum(self._slice(y), self.layout.slices - _BEFORE_LAST)
        above = NODES.floor(z)
        fraction, row = z - above, float(_ROW) * above
        one, other = (self._texel(h, v, row + below, column) for below in (0.0, float(_ROW)))
        return one + fraction * (other - one)

    def _texel(self, h: Operand, v: Operand, row: Operand, column: int = 0) -> NodeValue:
        """Look up a place of a tile, from the middle of its first texel inside the margin."""
        width, height = self.image.size
        h, v = h + float(_MARGIN + column), v + row + float(_MARGIN)
        return texel(self.graph, self.image, h, v, width, height)
