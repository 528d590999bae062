"""Grids of clouds in an image: of each a row of numbers, and under it its nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.clouds.density_grid import BLOCK, ArrayNodes, Grid
from ..uw_spectral.mathematics import Operand
from .node_mathematics import NODES, Graph, NodeValue
from .texels import closest, number_image, texel

NAME = "UW Cloud Grids"
_WIDTH, _HIGH = BLOCK
_ROWS = 1 + _HIGH  # of a grid
# Its own numbers stand at the end of its row: corner, counts, rows.
_OWN = 5
_FIRST = _WIDTH - _OWN
_ROUNDING = 1e-3


def new_image(number: int) -> bpy.types.Image:
    """Make the image of so many grids."""
    image = number_image(NAME, _WIDTH, number * _ROWS)
    image.use_half_precision = False  # numbers keep their digits
    return image


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
    before = np.empty(out.size, np.float32)
    image.pixels.foreach_get(before)
    if not np.array_equal(before, np.ravel(out)):
        image.pixels.foreach_set(np.ravel(out))
        image.update()


def _lay(block: NDArray[np.float32], values: NDArray[np.float64]) -> None:
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


def grid(graph: Graph, image: bpy.types.Image, index: int) -> Grid:
    """Return a grid in a node tree."""
    texels = [closest(graph, image, float(_FIRST + i), row(index)) for i in range(_OWN)]
    corner, counts, *rows = (graph.components(x) for x in texels)
    nodes = _Nodes(graph, image, row(index) + 1.0, counts)
    return Grid(corner, [x for three in rows for x in three], counts, nodes)
