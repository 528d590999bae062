"""Grids of clouds in an image: of each a row of numbers, and under it its nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.clouds.density_grid import BLOCK, LAMP_NODES, ArrayLampNodes, ArrayNodes, Grid
from ..uw_spectral.mathematics import Operand
from .data_blocks import write_pixels
from .node_mathematics import NODES, Graph, NodeValue
from .texture_atlas import closest, number_image, texel

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


def new_image(number: int) -> bpy.types.Image:
    """Make the image of so many grids."""
    image = number_image(NAME, _WIDTH, number * _ROWS)
    image.use_half_precision = False  # numbers keep their digits
    return image


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
        assert isinstance(grid.nodes, ArrayNodes)
        block[0, : len(numbers), :3] = numbers
        own = np.concatenate([np.ravel(x) for x in (grid.corner, grid.counts, grid.rows)])
        block[0, _FIRST:, :3] = own.reshape(_OWN, 3)
        _lay(block[1:, :, :3], grid.nodes.values)
    _bring(image, out)


def write_lamps(image: bpy.types.Image, grids: Sequence[Grid | None]) -> None:
    """Put what is between grids and lamps into the image of their numbers."""
    width, height = image.size
    out = np.zeros((len(grids), height // len(grids) // _LAMP_ROWS, _LAMP_ROWS, width, 4))
    for blocks, grid in zip(out, grids, strict=True):
        assert grid is not None, "a cloud with a grid"
        assert isinstance(grid.lamps, ArrayLampNodes)
        for number, values in enumerate(grid.lamps.values):
            block, channel = divmod(number, 3)
            _lay(blocks[block, ..., channel : channel + 1], values[..., None])
    _bring(image, out.astype(np.float32))


def _bring(image: bpy.types.Image, out: NDArray[np.float32]) -> None:
    """Put numbers into an image if it has others."""
    out = out.reshape(-1, _WIDTH, 4)
    before = np.empty_like(out)
    image.pixels.foreach_get(before.ravel())
    if not np.array_equal(before, out):
        write_pixels(image, out)


def _lay(block: NDArray[np.floating], values: NDArray[np.float64]) -> None:
    """Lay slices of one height side by side."""
    nx, ny, nz, _ = values.shape
    across = _WIDTH // nx
    for place in range(nz):
        down, beside = divmod(place, across)
        there = block[down * ny : (down + 1) * ny, beside * nx : (beside + 1) * nx]
        there[:] = np.swapaxes(values[:, :, place], 0, 1)


@dataclass(frozen=True, eq=False)
class _Nodes:
    """Of a grid in the image; :class:`.Nodes`."""

    graph: Graph
    image: bpy.types.Image
    first: float
    counts: Sequence[NodeValue]

    def at(self, place: Sequence[Operand]) -> Sequence[Operand]:
        x, y, z = place
        nx, ny, nz = self.counts
        across = NODES.floor(float(_WIDTH) / nx + _ROUNDING)
        below = NODES.minimum(NODES.floor(z), nz - 2.0)
        one, other = (self._slice(x, y, below + beyond, across, nx, ny) for beyond in (0.0, 1.0))
        return self.graph.components(one + (other - one) * (z - below))

    def _slice(
        self, x: Operand, y: Operand, k: Operand, across: Operand, nx: Operand, ny: Operand
    ) -> NodeValue:
        down = NODES.floor((k + 0.5) / across)
        h, v = (k - down * across) * nx + x, down * ny + y + self.first
        width, height = map(float, self.image.size)
        return texel(self.graph, self.image, h, v, width, height)


@dataclass(frozen=True, eq=False)
class _LampNodes:
    """Of a grid in the image of lamps; :class:`.LampNodes`."""

    graph: Graph
    image: bpy.types.Image
    first: float
    lamps: float

    def at(self, lamp: Operand, place: Sequence[Operand]) -> Operand:
        x, y, z = place
        # Whole numbers come out of loops as such.
        block = NODES.floor((lamp + 0.5) / 3.0)
        channel = lamp - block * 3.0
        below = NODES.minimum(NODES.floor(z), LAMP_NODES - 2.0)
        first = NODES.minimum(block, float((self.lamps - 1) // 3)) * float(_LAMP_ROWS) + self.first
        one, other = (self._slice(x, y, below + beyond, first) for beyond in (0.0, 1.0))
        found = self.graph.components(one + (other - one) * (z - below))
        total = 0.0
        for number, value in enumerate(found):
            own = NODES.less(number - 0.5, channel) * NODES.less(channel, number + 0.5)
            total = own * value + total
        return total * NODES.less(lamp, self.lamps - 0.5)

    def _slice(self, x: Operand, y: Operand, k: Operand, first: Operand) -> NodeValue:
        down = NODES.floor((k + 0.5) / float(_ACROSS))
        h = (k - down * float(_ACROSS)) * float(LAMP_NODES) + x
        width, height = map(float, self.image.size)
        return texel(self.graph, self.image, h, down * float(LAMP_NODES) + y + first, width, height)


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
    nodes = _Nodes(graph, image, row(index) + 1.0, counts)
    shining = None
    if of_lamps is not None:
        first = float(index * (of_lamps.size[1] // count(image)))
        shining = _LampNodes(graph, of_lamps, first, float(lamps))
    return Grid(corner, [x for three in rows for x in three], counts, nodes, shining)
