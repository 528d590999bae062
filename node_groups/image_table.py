"""Tables in images: where their tiles lie, how they are written, and their look-up in a node tree.

The last two axes of a table, or its last one, are the rows and columns of a tile; along each of
those before them tiles lie in order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ..uw_spectral.table import Axis
from .node_mathematics import NODES, Graph
from .texture_atlas import texel

MARGIN = 1
"""Texels around a tile that repeat its outermost ones."""


@dataclass(frozen=True)
class Tiles:
    """Texels from a tile of an axis to the next: beside it, above it, or in lines of so many."""

    columns: Operand = 0.0
    rows: Operand = 0.0
    across: Operand | None = None

    def corner(self, number: Operand, m: Mathematics = NUMPY) -> tuple[Operand, Operand]:
        """Return the column and the row of a tile, from the first one."""
        if self.across is None:
            return number * self.columns, number * self.rows
        # Numbers come out of loops nearly whole.
        line = m.floor((number + 0.5) * (1.0 / self.across))
        return (number - line * self.across) * self.columns, line * self.rows


def write_tiles(
    out: NDArray[np.floating],
    values: NDArray[np.floating],
    tiles: Sequence[Tiles] = (),
    margin: int = MARGIN,
) -> None:
    """Lay a table of up to four numbers an entry into texels, from the lowest left one on."""
    sides = (margin, margin)
    for numbers in np.ndindex(values.shape[: len(tiles)]):
        corners = [each.corner(number) for each, number in zip(tiles, numbers, strict=True)]
        column, row = (int(sum(x)) for x in zip((0, 0), *corners, strict=True))
        tile = np.pad(values[numbers], (sides, sides, (0, 0)), mode="edge")
        rows, columns, count = tile.shape
        out[row : row + rows, column : column + columns, :count] = tile


@dataclass(frozen=True, eq=False)
class ImageTable:
    """A table in an image; a :class:`.Lookup`."""

    graph: Graph
    image: bpy.types.Image
    axes: tuple[Axis, ...]
    #: Lower left texel, margin included.
    column: Operand = 0.0
    row: Operand = 0.0
    tiles: tuple[Tiles, ...] = ()
    margin: int = MARGIN
    numbers: int | None = None  #: Entries are so many numbers, and no channels.
    size: tuple[Operand, Operand] | None = None  #: Of an image that has no fixed one.
    alpha: bool = False  #: Entries are :class:`.Texel`.

    def at(self, **coordinates: Operand) -> Operand:
        """Return what :class:`.Lookup` says."""
        for axis in self.axes:
            if axis.name not in coordinates:
                every = map(float, range(axis.count))
                return [self.at(**coordinates, **{axis.name: number}) for number in every]
        places = [axis.place(coordinates[axis.name], NODES) for axis in self.axes]
        before = list(zip(self.axes, self.tiles, places, strict=False))
        v, h = (0.0, *places[len(before) :])[-2:]
        margin = float(self.margin)
        found = self._mixed(before, h + (self.column + margin), v + (self.row + margin))
        if self.numbers is None:
            return found
        parts = self.graph.components(found)[: self.numbers]
        return parts[0] if self.numbers == 1 else parts

    def _mixed(
        self, before: Sequence[tuple[Axis, Tiles, Operand]], column: Operand, row: Operand
    ) -> Operand:
        """Mix the tiles about places along the first axes, each at a place inside."""
        if not before:
            size, rows = self.size or self.image.size, len(self.axes) > len(self.tiles) + 1
            return texel(
                self.graph, self.image, column, row, *size, whole_row=not rows, alpha=self.alpha
            )
        (axis, tiles, place), *rest = before
        if axis.discrete:
            right, up = tiles.corner(place, NODES)
            return self._mixed(rest, column + right, row + up)
        low = NODES.minimum(NODES.floor(place), axis.count - 2.0)
        one, other = (
            self._mixed(rest, column + right, row + up)
            for right, up in (tiles.corner(number, NODES) for number in (low, low + 1.0))
        )
        return one + (other - one) * (place - low)
