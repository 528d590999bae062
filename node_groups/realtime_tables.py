"""Tables of the solved light field as node groups read them: one image, and where in it.

A column of tiles holds three bands; a tile is a slice at one depth, radiance and above it the
irradiance on patches, with a margin of one texel; then come the boundary's image, the factor of
the sun's aureole, angles over depths, and a row for each other quantity of the bands.

An ordinary image texture filters more where coordinates jump from pixel to pixel, and so
draws lines where slices change. An environment texture in equirectangular projection never
does: it is asked for the direction that is mapped to a place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.transfer.radiance_table import (
    ANGLES,
    AZIMUTHS,
    DEPTHS,
    ELEVATIONS,
    TILTS,
    TURNS,
    DepthScale,
    RadianceTable,
    azimuth,
    elevation,
    sun_angle,
    tilt,
)
from ..uw_spectral.transfer.sun_beam import half_angle2
from .node_mathematics import MARK, NODES, Graph, NodeValue

NAME = "UW Light"
NEAR, FAR = "Light at the Camera", "Light behind"
IMAGE, MIRRORED = "Boundary", "Mirrored Light"
AUREOLE = "Aureole"
PATCH, FROM_ABOVE = "Light on It", "Light from Above"

_MARGIN = 1
_TILE = max(AZIMUTHS, ANGLES) + 2 * _MARGIN
_PATCHES = ELEVATIONS + 2 * _MARGIN  # first row of the irradiance in a tile
_ROW = _PATCHES + TILTS + 2 * _MARGIN
_BOUNDARY = DEPTHS * _ROW  # first row of the boundary's image
_AUREOLE = _BOUNDARY + _PATCHES  # first row of the aureole
_HEIGHT = _AUREOLE + DEPTHS + 2 * _MARGIN
_LAST = DEPTHS - 1.001  # the deepest position that has a slice behind it


def new_image(triples: int, numbers: int) -> bpy.types.Image:
    """Make the image of so many triples of bands and quantities of them."""
    image = bpy.data.images.new(
        NAME, _TILE * triples, _HEIGHT + numbers, alpha=True, float_buffer=True, is_data=True
    )
    image.alpha_mode = "CHANNEL_PACKED"
    image.use_half_precision = False  # the rows of numbers keep their digits
    image[MARK] = True
    return image


def write_table(
    image: bpy.types.Image, table: RadianceTable, numbers: Sequence[NDArray[np.float32]]
) -> None:
    """Put the tables of the bands, and their numbers, into an image of their size."""
    image.pixels.foreach_set(np.ravel(pixels(table, numbers)))
    image.update()
    # A file that is saved now opens with these pixels, without the extension.
    image.pack()


def pixels(table: RadianceTable, numbers: Sequence[NDArray[np.float32]]) -> NDArray[np.float32]:
    """Return the texels, shape (rows, columns, 4); the first row is the lowest.

    Parameters
    ----------
    table : RadianceTable
        Of n bands.
    numbers : sequence of array
        Other quantities of full triples of bands.
    """
    triples = -(-len(table.scale) // 3)
    out = np.ones((_HEIGHT + len(numbers), triples, _TILE, 4), dtype=np.float32)

    def put(values: NDArray[np.float64], row: int) -> None:
        """Lay a slice of all bands, shape (n, height, width), with its margin."""
        values = np.pad(values, ((0, 3 * triples - len(values)), *[(_MARGIN, _MARGIN)] * 2), "edge")
        height, width = values.shape[1:]
        texels = np.moveaxis(values.reshape(triples, 3, height, width), (2, 0, 3, 1), (0, 1, 2, 3))
        out[row : row + height, :, :width, :3] = texels

    for index in range(DEPTHS):
        put(table.radiance[:, index], index * _ROW)
        put(table.irradiance[:, index], index * _ROW + _PATCHES)
    put(table.image, _BOUNDARY)
    put(table.aureole, _AUREOLE)
    for row, values in enumerate(numbers):
        out[_HEIGHT + row, :, :, :3] = np.reshape(values, (triples, 1, 3))
    return out.reshape(len(out), -1, 4)


@dataclass(frozen=True, eq=False)
class Tables:
    """Look-ups of one triple in a node tree.

    Parameters
    ----------
    graph : Graph
        The tree.
    image : Image
        Of :func:`new_image`.
    triples : int
        Of bands.
    index : NodeValue
        The triple, from 0.
    numbers : sequence of str
        Names of the other quantities, in the order of their rows.
    depth_scale : DepthScale
        Of node values.
    sun : three NodeValue
        Direction the sunlight travels to.
    """

    graph: Graph
    image: bpy.types.Image
    triples: int
    index: NodeValue
    numbers: Sequence[str]
    depth_scale: DepthScale
    sun: Sequence[NodeValue]

    def number(self, name: str) -> NodeValue:
        """Look up another quantity of the bands."""
        width, height = self.image.size
        texture = self.graph.node("ShaderNodeTexImage", image=self.image, interpolation="Closest")
        across = self.index * (_TILE / width) + 0.5 / width
        up = (_HEIGHT + self.numbers.index(name) + 0.5) / height
        self.graph.assign(self.graph.vector(across, up, 0.0), texture.inputs["Vector"])
        return self.graph.term(texture.outputs["Color"])

    def near_and_far(
        self, y_o: NodeValue, y_e: NodeValue, w: Sequence[NodeValue]
    ) -> dict[str, NodeValue]:
        """Look up scattered light along w at two depths, the boundary ahead, and the aureole."""
        h, v = self._direction(w)
        return {
            NEAR: self._between_slices(y_o, h, v),
            FAR: self._between_slices(y_e, h, v),
            IMAGE: self._texel(h, _BOUNDARY + v),
            AUREOLE: self._aureole(y_o, w),
        }

    def to_boundary(
        self,
        y_o: NodeValue,
        w: Sequence[NodeValue],
        mirrored: Sequence[NodeValue] | None,
    ) -> dict[str, NodeValue]:
        """Look up scattered light along w, the aureole, and what the surface mirrors of it."""
        near = self._between_slices(y_o, *self._direction(w))
        found = {NEAR: near, AUREOLE: self._aureole(y_o, w)}
        if mirrored is not None:
            found[MIRRORED] = self._texel(*self._direction(mirrored))
        return found

    def on_patch(
        self, y: NodeValue, normal: Sequence[NodeValue], *, from_above: bool
    ) -> dict[str, NodeValue]:
        """Look up the irradiance on a patch, and that of a level one that faces up."""
        h = _MARGIN + azimuth(normal, self.sun, TURNS, NODES)
        v = _PATCHES + _MARGIN + tilt(normal[2], NODES)
        found = {PATCH: self._between_slices(y, h, v)}
        if from_above:
            top = _PATCHES + _MARGIN + TILTS - 1.0
            found[FROM_ABOVE] = self._between_slices(y, float(_MARGIN), top)
        return found

    def _direction(self, w: Sequence[NodeValue]) -> tuple[NodeValue, NodeValue]:
        h = _MARGIN + azimuth(w, self.sun, AZIMUTHS, NODES)
        return h, _MARGIN + elevation(w[2], NODES)

    def _aureole(self, y_o: NodeValue, w: Sequence[NodeValue]) -> NodeValue:
        h = _MARGIN + sun_angle(half_angle2(w, self.sun, NODES), NODES)
        return self._texel(h, _AUREOLE + _MARGIN + self.depth_scale.slice(y_o, NODES))

    def _between_slices(
        self, y: NodeValue, h: NodeValue | float, v: NodeValue | float
    ) -> NodeValue:
        """Look up a place of the tiles at a depth."""
        z = NODES.minimum(self.depth_scale.slice(y, NODES), _LAST)
        above = self.graph.operation("FLOOR", (z,))
        row, share = v + _ROW * above, z - above
        one, other = self._texel(h, row), self._texel(h, row + _ROW)
        return one + share * (other - one)

    def _texel(self, h: NodeValue | float, v: NodeValue) -> NodeValue:
        """Look up a texel of the triple's tiles, counted from their corner."""
        width, height = self.image.size
        around = (h + 0.5) * (-2.0 * math.pi / width) + math.pi
        around = around - self.index * (2.0 * math.pi / self.triples)
        up = (v + 0.5) * (math.pi / height) - math.pi / 2
        where = self.graph.vector(
            self.graph.operation("COSINE", (around,)),
            self.graph.operation("SINE", (around,)),
            self.graph.operation("TANGENT", (up,)),
        )
        texture = self.graph.node("ShaderNodeTexEnvironment", image=self.image)
        texture.projection, texture.interpolation = "EQUIRECTANGULAR", "Linear"
        self.graph.assign(where, texture.inputs["Vector"])
        return self.graph.term(texture.outputs["Color"])
