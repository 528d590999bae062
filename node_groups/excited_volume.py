"""Material of a volume of Cycles that emits what lamps excite in the water about it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.lamps.excited_power import ExcitedPower
from ..uw_spectral.lamps.lamp import Lamp
from ..uw_spectral.mathematics import Operand
from ..uw_spectral.table import Axis, Lookup, Table
from . import attributes
from .data_blocks import new_material, vector_of_view_layer, write_pixels
from .image_table import MARGIN, Tiles, write_tiles
from .node_mathematics import NODES, Graph, NodeValue
from .texture_atlas import number_image
from .water_volume import volume_coefficients

NAME = "UW Excited Water"


@dataclass(frozen=True, eq=False)
class _Filtered:
    """A table in an image, the first of three axes in tiles above one another.

    Cycles filters images with all digits, in one node: :class:`.ImageTable` takes several times as
    long there.
    """

    graph: Graph
    image: bpy.types.Image
    axes: Sequence[Axis]
    first: NodeValue | float = 0.0  #: Row that it begins at.
    numbers: int = 0  #: Entries are so many numbers; else channels.

    def at(self, **coordinates: Operand) -> Operand:
        """Return what :class:`.Lookup` says."""
        *before, row, column = (axis.place(coordinates[axis.name], NODES) for axis in self.axes)
        if before:
            low = NODES.minimum(NODES.floor(before[0]), self.axes[0].count - 2.0)
            height = float(self.axes[1].count + 2 * MARGIN)
            found = self._filtered(row + low * height, column)
            other = self._filtered(row + (low * height + height), column)
            found = found + (other - found) * (before[0] - low)
        else:
            found = self._filtered(row, column)
        if not self.numbers:
            return found
        parts = self.graph.components(found)
        return parts[0] if self.numbers == 1 else parts

    def _filtered(self, row: Operand, column: Operand) -> NodeValue:
        columns, rows = self.image.size
        x = (column + (MARGIN + 0.5)) * (1.0 / columns)
        y = (row + (self.first + (MARGIN + 0.5))) * (1.0 / rows)
        node = self.graph.inner_node("ShaderNodeTexImage", image=self.image, extension="EXTEND")
        self.graph.assign(self.graph.vector(x, y, 0.0), node.inputs["Vector"])
        return self.graph.term(node.outputs["Color"])


def build(
    lamps: Sequence[tuple[Lamp, ExcitedPower]], passes: Sequence[tuple[int, ...]]
) -> bpy.types.Material:
    """Build the material, of lamps with their tables as arrays of all n bands."""
    material, graph, output = new_material(NAME)
    geometry = graph.node("ShaderNodeNewGeometry").outputs
    place, onward = (
        graph.components(graph.term(geometry[name])) for name in ("Position", "Incoming")
    )
    tile = graph.components(vector_of_view_layer(graph, attributes.EXCITED_TILE))[0]
    light: Operand = 0.0
    for lamp, power in lamps:
        assert isinstance(power.table, Table)
        emitted = ExcitedPower(_of_passes(graph, power.table, passes, tile))
        shadowed = replace(lamp, shadow=_map(graph, lamp.shadow), soft=_map(graph, lamp.soft))
        light = emitted.radiance(shadowed, place, onward, NODES) + light
    channels = zip(graph.components(light), attributes.EXCITED_CHANNELS, strict=True)
    chosen = sum((part * vector_of_view_layer(graph, name) for part, name in channels), 0.0)
    node = volume_coefficients(graph)
    graph.assign(chosen, node.inputs["Emission Coefficients"])
    graph.assign(node.outputs[0], output.inputs["Volume"])
    return material


def values(passes: Sequence[tuple[int, ...]]) -> dict[str, NDArray[np.float64]]:
    """Return where the bands are in the images, by view-layer property."""
    count = sum(map(len, passes))
    tiles, channels = np.zeros(count), np.zeros((3, count))
    for tile, bands in enumerate(passes):
        tiles[list(bands)] = tile
        channels[range(len(bands)), list(bands)] = 1.0
    return {
        attributes.EXCITED_TILE: tiles,
        **dict(zip(attributes.EXCITED_CHANNELS, channels, strict=True)),
    }


def _of_passes(
    graph: Graph, table: Table, passes: Sequence[tuple[int, ...]], tile: NodeValue
) -> _Filtered:
    """Put a table of two axes into an image, the bands of each pass into a tile."""
    filled = [[*bands, *[bands[-1]] * (3 - len(bands))] for bands in passes]
    rows = table.values.shape[0] + 2 * MARGIN
    image = _image(np.moveaxis(table.values[..., filled], 2, 0), (Tiles(rows=rows),))
    return _Filtered(graph, image, table.axes, tile * float(rows))


def _map(graph: Graph, table: Lookup | None) -> _Filtered | None:
    """Put a map of a lamp's shadow into an image."""
    if not isinstance(table, Table):
        return None
    values = table.values
    if table.axes[-1].discrete:  # entries by number are those of a texel
        values = values[..., 0]
    axes = [axis for axis in table.axes if not axis.discrete]
    tiles = (Tiles(rows=values.shape[-3] + 2 * MARGIN),) * (values.ndim - 3)
    return _Filtered(graph, _image(values, tiles), axes, numbers=values.shape[-1])


def _image(values: NDArray[np.floating], tiles: Sequence[Tiles] = ()) -> bpy.types.Image:
    rows, columns = (side + 2 * MARGIN for side in values.shape[-3:-1])
    pixels = np.zeros((rows * math.prod(values.shape[:-3]), columns, 4), np.float32)
    write_tiles(pixels, values, tiles)
    return write_pixels(number_image(NAME, columns, len(pixels)), pixels)
