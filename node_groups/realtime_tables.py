"""The channel tables as node groups read them: one image, and where in it.

Every tile of the image is a table of two dimensions with a margin of one texel. From below: a row
of tiles for each depth (light scattered, light scattered once ahead, irradiance on patches); the
tables of depth and distance, one above the other; and those of one dimension, which are as wide.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.table import Axis
from ..uw_spectral.transfer.channel_tables import (
    COLOURS,
    LENGTHS,
    ChannelTables,
    LengthScale,
    TableSizes,
)
from ..uw_spectral.transfer.depth_scale import DepthScale
from ..uw_spectral.transfer.radiance_table import AZIMUTHS, ELEVATIONS, TILTS, TURNS
from .data_blocks import write_pixels
from .image_table import MARGIN, ImageTable, Tiles, write_tiles
from .node_mathematics import Graph, NodeValue
from .shape import Shape
from .texture_atlas import number_image

NAME, PART = "UW Light", "uw_table"
_LARGEST = 1e30
_SIDES = 2 * MARGIN
_ACROSS = AZIMUTHS + _SIDES
_WIDTH = max(2 * _ACROSS + TURNS, LENGTHS) + _SIDES
_ROW = max(ELEVATIONS, TILTS) + _SIDES
# First columns of what lies beside each other.
_BESIDE = {"scattered": 0, "beyond": _ACROSS, "irradiance": 2 * _ACROSS}
Corner = tuple[int, int, tuple[Tiles, ...]]
"""Column and row of the first tile of a table, and where the others are."""


def _corners(axes: dict[str, tuple[Axis, ...]]) -> tuple[dict[str, Corner], int]:
    """Return where tables with axes lie, and the rows of all."""
    tiles = (Tiles(rows=_ROW),)
    found: dict[str, Corner] = {name: (column, 0, tiles) for name, column in _BESIDE.items()}
    first = int(axes["scattered"][0].count) * _ROW
    for name, own in axes.items():
        if name in _BESIDE:
            continue
        numbers = [axis.count for axis in own if axis.discrete]
        rows = (own[-2].count if len(own) > len(numbers) + 1 else 1) + _SIDES
        steps = [rows * int(np.prod(numbers[place + 1 :])) for place in range(len(numbers))]
        found[name] = 0, first, tuple(Tiles(rows=float(step)) for step in steps)
        first += rows * int(np.prod(numbers))
    return found, first


def sizes_of(shape: Shape) -> TableSizes:
    """Return the sizes of the tables of a shape."""
    return TableSizes(
        shape.slices, COLOURS + shape.measured, len(shape.components), shape.layered,
        any(term.caustics for term in shape.terms), sum(term.emissions for term in shape.terms),
        max((term.skies for term in shape.terms), default=1),
    )  # fmt: skip


def exciting_sizes(shape: Shape) -> TableSizes:
    """Return those of the light that excites other light."""
    return replace(sizes_of(shape), colours=COLOURS, emissions=0)


def new_image(sizes: TableSizes) -> bpy.types.Image:
    """Make the image, dark."""
    return number_image(NAME, _WIDTH, _corners(sizes.axes())[1], half=False)


def write_light(image: bpy.types.Image, light: ChannelTables) -> None:
    """Put the channel tables into an image of its size."""
    write_pixels(image, pixels(light))


def pixels(light: ChannelTables) -> NDArray[np.float32]:
    """Return the texels, shape (rows, columns, 4); the first row is the lowest."""
    corners, rows = _corners(light.sizes.axes())
    out = np.ones((rows, _WIDTH, 4), np.float32)
    for name, (column, row, tiles) in corners.items():
        table = light.table(name)
        # What grows beyond is multiplied with what has vanished by then; infinite, that would be
        # no number.
        values = table.values.clip(-_LARGEST, _LARGEST)
        if len(table.axes) == len(tiles) + 1:
            values = values[..., None, :, :]
        write_tiles(out[row:, column:], values, tiles)
    return out


@dataclass(frozen=True, eq=False)
class ImageTables:
    """Look-ups in a node tree, with scales of node values; see :class:`.pixel_parts.Tables`."""

    graph: Graph
    image: bpy.types.Image
    sizes: TableSizes
    depth_scale: DepthScale
    lengths: LengthScale

    def split(self, channels: NodeValue) -> tuple[NodeValue, ...]:
        """Return the three channels."""
        return self.graph.components(channels)

    def at(self, name: str, **coordinates: Operand) -> Operand:
        """Look up one of the tables."""
        column, row, tiles = self._corners[name]
        axes = self._axes[name]
        corner = float(column), float(row)
        return ImageTable(self.graph, self.image, axes, *corner, tiles).at(**coordinates)

    @functools.cached_property
    def _axes(self) -> dict[str, tuple[Axis, ...]]:
        return self.sizes.axes(self.depth_scale.slice, self.lengths.place)

    @functools.cached_property
    def _corners(self) -> dict[str, Corner]:
        return _corners(self._axes)[0]
