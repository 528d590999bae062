"""Grids of clouds in an image: of each a row of numbers, and under it its nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.clouds.density_grid import BLOCK, LAMP_BOX, LAMP_NODES, Grid, box_axes
from ..uw_spectral.mathematics import Operand
from ..uw_spectral.table import Table, discrete_axis
from .data_blocks import write_pixels
from .image_table import ImageTable, Tiles, write_tiles
from .node_mathematics import NODES, Graph
from .texture_atlas import closest, number_image

NAME, LAMPS_NAME = "UW Cloud Grids", "UW Cloud Lamps"
_WIDTH, _HIGH = BLOCK
_ROWS = 1 + _HIGH  # of a grid
# Its own numbers stand at the end of its row: corner, counts, rows.
_OWN = 5
_FIRST = _WIDTH - _OWN
_ROUNDING = 1e-3
# Of what is between nodes and lamps: slices beside and above each other, a lamp in each channel.
_ACROSS = _WIDTH // LAMP_NODES
_LAMP_ROWS = -(-LAMP_NODES // _ACROSS) * LAMP_NODES
_LAMP_TILES = Tiles(LAMP_NODES, LAMP_NODES, _ACROSS)


def new_image(number: int) -> bpy.types.Image:
    """Make the image of so many grids."""
    return number_image(NAME, _WIDTH, number * _ROWS, half=False)


def new_lamp_image(grids: int, lamps: int) -> bpy.types.Image:
    """Make the image of what is between so many grids and so many lamps."""
    return number_image(LAMPS_NAME, _WIDTH, grids * -(-lamps // 3) * _LAMP_ROWS)


def count(image: bpy.types.Image) -> int:
    """Return how many grids there are."""
    return int(image.size[1]) // _ROWS


def row(index: int) -> float:
    """Return the row of the numbers of a grid."""
    return float(index * _ROWS)


def write(
    image: bpy.types.Image, clouds: Sequence[tuple[NDArray[np.float64], Grid | None]]
) -> None:
    """Put grids, and other numbers of their clouds, shape (n, 3), into an image of their number.

    What is there already is not written again.
    """
    out = np.zeros((len(clouds), _ROWS, _WIDTH, 4), np.float32)
    out[..., 3] = 1.0
    for block, (numbers, grid) in zip(out, clouds, strict=True):
        assert grid is not None, "a cloud with a grid"
        assert isinstance(grid.nodes, Table)
        block[0, : len(numbers), :3] = numbers
        own = np.concatenate([np.ravel(x) for x in (grid.corner, grid.counts, grid.rows)])
        block[0, _FIRST:, :3] = own.reshape(_OWN, 3)
        values = grid.nodes.values[..., 0]
        _, ny, nx, _ = values.shape
        write_tiles(block[1:], values, (Tiles(nx, ny, _WIDTH // nx),), margin=0)
    _bring(image, out)


def write_lamps(image: bpy.types.Image, grids: Sequence[Grid | None]) -> None:
    """Put what is between grids and lamps into the image of their numbers."""
    width, height = image.size
    out = np.zeros((len(grids), height // len(grids) // _LAMP_ROWS, _LAMP_ROWS, width, 4))
    for blocks, grid in zip(out, grids, strict=True):
        assert grid is not None, "a cloud with a grid"
        assert isinstance(grid.lamps, Table)
        for number, values in enumerate(grid.lamps.values):
            block, channel = divmod(number, 3)
            write_tiles(blocks[block, ..., channel:], values, (_LAMP_TILES,), margin=0)
    _bring(image, out.astype(np.float32))


def _bring(image: bpy.types.Image, out: NDArray[np.float32]) -> None:
    """Put numbers into an image if it has others."""
    out = out.reshape(-1, _WIDTH, 4)
    before = np.empty_like(out)
    image.pixels.foreach_get(before.ravel())
    if not np.array_equal(before, out):
        write_pixels(image, out)


@dataclass(frozen=True, eq=False)
class _LampNodes:
    """What is between a grid and lamps, of which a texel has three; a :class:`.Lookup`."""

    blocks: ImageTable

    def at(self, **coordinates: Operand) -> Operand:
        lamp = coordinates.pop("lamp")
        # Whole numbers come out of loops as such.
        block = NODES.floor((lamp + 0.5) / 3.0)
        channel, total = lamp - block * 3.0, 0.0
        for number, value in enumerate(self.blocks.at(block=block, **coordinates)):
            own = NODES.less(number - 0.5, channel) * NODES.less(channel, number + 0.5)
            total = own * value + total
        return total


def grid(
    graph: Graph,
    image: bpy.types.Image,
    index: int,
    of_lamps: bpy.types.Image | None = None,
    lamps: int = 0,
) -> Grid:
    """Return a grid in an image of :func:`new_image`; ``of_lamps`` is of :func:`new_lamp_image`."""
    texels = [closest(graph, image, float(_FIRST + i), row(index)) for i in range(_OWN)]
    corner, counts, *rows = (graph.components(x) for x in texels)
    nx, ny, _ = counts
    tiles = (Tiles(nx, ny, NODES.floor(float(_WIDTH) / nx + _ROUNDING)),)
    first = row(index) + 1.0
    nodes = ImageTable(graph, image, box_axes(counts), 0.0, first, tiles, margin=0, numbers=3)
    place = corner, [x for three in rows for x in three], counts
    if of_lamps is None:
        return Grid(*place, nodes)
    blocks = ImageTable(
        graph, of_lamps, (discrete_axis("block", -(-lamps // 3)), *LAMP_BOX),
        0.0, float(index * (of_lamps.size[1] // count(image))),
        (Tiles(rows=float(_LAMP_ROWS)), _LAMP_TILES), margin=0, numbers=3,
    )  # fmt: skip
    return Grid(*place, nodes, _LampNodes(blocks), lamps)
