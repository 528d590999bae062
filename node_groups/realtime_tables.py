"""Tables of the solved light field as node groups read them: one image, and where in it.

A column of tiles holds three bands; a tile is a slice at one depth, radiance and above it the
irradiance on patches, with a margin of one texel; then come the boundary's image, the factor of
the sun's aureole, angles over depths; of layered water its mean extinction, depths over depths,
and sunlight scattered once, elevations over depths; and a row for each other quantity of the bands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.transfer.depth_scale import DepthScale
from ..uw_spectral.transfer.radiance_table import (
    ANGLES,
    AZIMUTHS,
    ELEVATIONS,
    TILTS,
    TURNS,
    RadianceTable,
    azimuth,
    elevation,
    sun_angle,
    tilt,
)
from ..uw_spectral.transfer.sun_beam import half_angle2
from .node_mathematics import MARK, NODES, Graph, NodeValue
from .texels import closest, texel

NAME = "UW Light"
NEAR, FAR = "Light at the Camera", "Light behind"
IMAGE, MIRRORED = "Boundary", "Mirrored Light"
AUREOLE = "Aureole"
MIRROR, BEHIND_MIRROR, MIRROR_AUREOLE = "Mirror", "Boundary in Mirror", "Aureole in Mirror"
PATCH, FROM_ABOVE = "Light on It", "Light from Above"
EXTINCTION, WITHOUT_PEAK = "Extinction", "Extinction without Peak"
WITHOUT_PEAK_BEHIND, WITHOUT_PEAK_MIRRORED = "Extinction behind", "Mirrored Extinction"
EXTINCTION_OF_SUN, WITHOUT_PEAK_OF_SUN = "Extinction of Sun", "Extinction of Sun without Peak"
ONCE, ONCE_BEHIND, ONCE_MIRRORED = "Once", "Once behind", "Once mirrored"

_MARGIN = 1
_TILE = max(AZIMUTHS, ANGLES) + 2 * _MARGIN
_PATCHES = ELEVATIONS + 2 * _MARGIN  # first row of the irradiance in a tile
_ROW = _PATCHES + TILTS + 2 * _MARGIN
_BEFORE_LAST = 1.001  # slices from the deepest position that has a slice behind it


@dataclass(frozen=True)
class Layout:
    """Rows of the image.

    Parameters
    ----------
    slices : int
        Depths.
    layered : int
        Parts of the phase function of layered water, 0 of other water.
    numbers : int
        Other quantities of the bands.
    """

    slices: int
    layered: int
    numbers: int

    @property
    def boundary(self) -> int:
        """First row of the boundary's image."""
        return self.slices * _ROW

    @property
    def aureole(self) -> int:
        """First row of the aureole."""
        return self.boundary + _PATCHES

    @property
    def extinction(self) -> tuple[int, int]:
        """First rows of the mean extinction, and of that without the forward peak."""
        first = self.aureole + self._of_slices
        return first, first + self._of_slices

    def once(self, part: int) -> int:
        """First row of sunlight scattered once by a part of the phase function."""
        return self.extinction[1] + self._of_slices + part * _PATCHES

    def number(self, index: int) -> int:
        """Row of another quantity of the bands."""
        return (self.once(self.layered) if self.layered else self.extinction[0]) + index

    @property
    def height(self) -> int:
        """Rows in all."""
        return self.number(self.numbers)

    @property
    def _of_slices(self) -> int:
        return self.slices + 2 * _MARGIN

    @classmethod
    def of_table(cls, table: RadianceTable, numbers: int) -> Layout:
        """Return the rows of tables and so many other quantities."""
        parts = 0 if table.layers is None else len(table.layers.components)
        return cls(table.depth_scale.slices, parts, numbers)


def new_image(triples: int, layout: Layout) -> bpy.types.Image:
    """Make the image of so many triples of bands."""
    size = _TILE * triples, layout.height
    image = bpy.data.images.new(NAME, *size, alpha=True, float_buffer=True, is_data=True)
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
    n, layers, layout = len(table.scale), table.layers, Layout.of_table(table, len(numbers))
    triples = -(-n // 3)
    out = np.ones((layout.height, triples, _TILE, 4), dtype=np.float32)
    bands = np.minimum(np.arange(3 * triples), n - 1)

    def put(values: NDArray[np.float64], rows: NDArray[np.float32]) -> None:
        """Lay slices of all bands, (n, s, height, width), into rows (s, ≥ height + 2, ...)."""
        slices, height, width = values.shape[1:]
        texels = values[bands].reshape(triples, 3, slices, height, width)
        inside = slice(_MARGIN, _MARGIN + height)
        across = slice(_MARGIN, _MARGIN + width)
        rows[:, inside, :, across, :3] = np.transpose(texels, (2, 3, 0, 4, 1))
        for axis, end in ((1, height), (3, width)):
            lines = np.moveaxis(rows, axis, 0)
            lines[0], lines[_MARGIN + end] = lines[_MARGIN], lines[end]

    def at(row: int) -> NDArray[np.float32]:
        return out[None, row:]

    slices = out[: layout.boundary].reshape(layout.slices, _ROW, triples, _TILE, 4)
    put(table.radiance, slices)
    put(table.irradiance, slices[:, _PATCHES:])
    put(table.image[:, None], at(layout.boundary))
    put(table.aureole[:, None], at(layout.aureole))
    if layers is not None:
        for row, extinction in zip(layout.extinction, layers.extinction, strict=True):
            put(extinction[:, None], at(row))
        for part, once in enumerate(layers.once):
            put(np.swapaxes(once, 1, 2)[:, None], at(layout.once(part)))
    for index, values in enumerate(numbers):
        out[layout.number(index), :, :, :3] = np.reshape(values, (triples, 1, 3))
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
    layered : int
        Parts of the phase function of layered water, 0 of other water.
    """

    graph: Graph
    image: bpy.types.Image
    triples: int
    index: NodeValue
    numbers: Sequence[str]
    depth_scale: DepthScale
    sun: Sequence[NodeValue]
    layered: int = 0

    @property
    def _layout(self) -> Layout:
        return Layout(self.depth_scale.slices, self.layered, len(self.numbers))

    def number(self, name: str) -> NodeValue:
        """Look up another quantity of the bands."""
        row = self._layout.number(self.numbers.index(name))
        return closest(self.graph, self.image, self.index * float(_TILE), row)

    def near_and_far(
        self, y_o: NodeValue, y_e: NodeValue, w: Sequence[NodeValue]
    ) -> dict[str, NodeValue]:
        """Look up scattered light along w at two depths, the boundary ahead, and the aureole."""
        h, v = self._direction(w)
        found = {
            NEAR: self._between_slices(y_o, h, v),
            FAR: self._between_slices(y_e, h, v),
            IMAGE: self._texel(h, self._layout.boundary + v),
            AUREOLE: self._aureole(y_o, w),
        }
        if self.layered:
            found |= self._extinction(y_o, y_e)
            found |= self._once(ONCE, y_o, w) | self._once(ONCE_BEHIND, y_e, w)
            found[WITHOUT_PEAK_BEHIND] = self._mean(y_e, self._boundary(w), without_peak=True)
        return found

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
        if self.layered:
            found |= self._extinction(y_o, self._boundary(w)) | self._once(ONCE, y_o, w)
        if self.layered and mirrored is not None:
            end = self._boundary(mirrored)
            found |= self._once(ONCE_MIRRORED, None, mirrored)
            found[WITHOUT_PEAK_MIRRORED] = self._mean(None, end, without_peak=True)
        return found

    def in_mirror(self, y: NodeValue, r: Sequence[NodeValue]) -> dict[str, NodeValue]:
        """Look up what a thing at depth y mirrors: what comes to it along r."""
        h, v = self._direction(r)
        return {
            MIRROR: self._between_slices(y, h, v),
            BEHIND_MIRROR: self._texel(h, self._layout.boundary + v),
            MIRROR_AUREOLE: self._aureole(y, r),
        }

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
        if self.layered:
            found[EXTINCTION_OF_SUN] = self._mean(None, y, without_peak=False)
            found[WITHOUT_PEAK_OF_SUN] = self._mean(None, y, without_peak=True)
        return found

    def _boundary(self, w: Sequence[NodeValue]) -> NodeValue:
        """Depth of the boundary ahead; without a floor, of the last slice."""
        return NODES.less(w[2], 0.0) * self.depth_scale.deepest

    def _extinction(self, y: NodeValue, z: NodeValue) -> dict[str, NodeValue]:
        return {
            EXTINCTION: self._mean(y, z, without_peak=False),
            WITHOUT_PEAK: self._mean(y, z, without_peak=True),
        }

    def _slice(self, y: NodeValue | None) -> NodeValue | float:
        """Position of a depth, or of the surface, among the slices."""
        return 0.0 if y is None else self.depth_scale.slice(y, NODES)

    def _mean(self, y: NodeValue | None, z: NodeValue, *, without_peak: bool) -> NodeValue:
        """Look up the mean extinction between two depths, the first one None at the surface."""
        h, v = (_MARGIN + self._slice(depth) for depth in (y, z))
        return self._texel(h, self._layout.extinction[without_peak] + v)

    def _once(self, name: str, y: NodeValue | None, w: Sequence[NodeValue]) -> dict[str, NodeValue]:
        """Look up sunlight scattered once at depth y along w, per part of the phase function."""
        h = _MARGIN + self._slice(y)
        v = _MARGIN + elevation(w[2], NODES)
        rows = [self._layout.once(part) for part in range(self.layered)]
        return {f"{name} {i}": self._texel(h, row + v) for i, row in enumerate(rows)}

    def _direction(self, w: Sequence[NodeValue]) -> tuple[NodeValue, NodeValue]:
        h = _MARGIN + azimuth(w, self.sun, AZIMUTHS, NODES)
        return h, _MARGIN + elevation(w[2], NODES)

    def _aureole(self, y_o: NodeValue, w: Sequence[NodeValue]) -> NodeValue:
        h = _MARGIN + sun_angle(half_angle2(w, self.sun, NODES), NODES)
        return self._texel(h, self._layout.aureole + _MARGIN + self._slice(y_o))

    def _between_slices(
        self, y: NodeValue, h: NodeValue | float, v: NodeValue | float
    ) -> NodeValue:
        """Look up a place of the tiles at a depth."""
        z = NODES.minimum(self.depth_scale.slice(y, NODES), self.depth_scale.slices - _BEFORE_LAST)
        above = self.graph.operation("FLOOR", (z,))
        row, share = v + _ROW * above, z - above
        one, other = self._texel(h, row), self._texel(h, row + _ROW)
        return one + share * (other - one)

    def _texel(self, h: NodeValue | float, v: NodeValue | float) -> NodeValue:
        """Look up a texel of the triple's tiles, counted from their corner."""
        width, height = self.image.size
        return texel(self.graph, self.image, h + self.index * float(_TILE), v, width, height)
