"""Lamps' scattered light as node groups look it up: an image with a place for each profile.

A place holds tiles, with a margin of one texel: side by side the azimuths, above each other the
distances of the source; over them, side by side, the terms of what patches get.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.lamps.lamp_harmonics import ROWS
from ..uw_spectral.lamps.multiple_scattering import LampField
from ..uw_spectral.lamps.profile import LampProfile
from ..uw_spectral.lamps.scattered_irradiance import TERMS
from ..uw_spectral.lamps.scattered_source import AZIMUTHS, BENDS, TURNS
from .data_blocks import write_pixels
from .node_mathematics import NODES, Graph, NodeValue
from .texture_atlas import number_image, texel

_NAME = "UW Lamp Sources"
_MARGIN = 1
_ACROSS, _UP = BENDS + 2 * _MARGIN, TURNS + 2 * _MARGIN
_TERM = TURNS + 2 * _MARGIN
_ARRIVING = ROWS * _UP  # first row of what patches get
_WIDTH, _HEIGHT = AZIMUTHS * _ACROSS, _ARRIVING + ROWS + 2 * _MARGIN
_BESIDE = 8  # places in a row
_WRITTEN = "uw_written"  # custom property of the image: what is in it


def new_image(places: int) -> bpy.types.Image:
    """Make the image of so many profiles."""
    rows = -(-places // _BESIDE)
    image = number_image(_NAME, _WIDTH * min(places, _BESIDE), _HEIGHT * rows)
    image.use_half_precision = False
    return image


def write(
    image: bpy.types.Image,
    in_water: LampField,
    on_surfaces: LampField,
    profiles: Sequence[LampProfile],
) -> None:
    """Put the scattered light of lamps, in three bands, into an image of :func:`new_image`.

    It has places for at least as many profiles; what is there already is not written again.
    """
    places = [(in_water.source(one).values, on_surfaces.arriving(one).values) for one in profiles]
    key = hashlib.sha256(b"".join(np.ascontiguousarray(x).data for x in sum(places, ())))
    if image.get(_WRITTEN) == key.hexdigest():
        return
    width, height = image.size
    out = np.zeros((height, width, 4), np.float32)
    out[..., 3] = 1.0
    for place, (source, arriving) in enumerate(places):
        row, column = divmod(place, _BESIDE)
        at = out[_HEIGHT * row :, _WIDTH * column :]
        # Azimuths are beside each other, as terms are.
        for first, table in ((0, source), (_ARRIVING, np.moveaxis(arriving, 2, 0)[None])):
            tiles = _tiles(table)
            at[first : first + len(tiles), : tiles.shape[1], :3] = tiles
    write_pixels(image, out)
    image[_WRITTEN] = key.hexdigest()


def _tiles(table: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lay tables of shape (down, across, rows, columns, 3) out, each with a margin."""
    margin = (_MARGIN, _MARGIN)
    padded = np.pad(table, ((0, 0), (0, 0), margin, margin, (0, 0)), mode="edge")
    down, across, rows, columns, count = padded.shape
    return np.moveaxis(padded, 1, 2).reshape(down * rows, across * columns, count)


@dataclass(frozen=True, eq=False)
class _InImage:
    """A profile's place in the image."""

    graph: Graph
    image: bpy.types.Image
    place: NodeValue
    scale: NodeValue

    def _corner(self) -> tuple[NodeValue, NodeValue]:
        above = self.graph.operation("FLOOR", (self.place * (1.0 / _BESIDE),))
        beside = self.place - above * float(_BESIDE)
        return beside * float(_WIDTH) + float(_MARGIN), above * float(_HEIGHT) + float(_MARGIN)

    def _texel(self, h: NodeValue, v: NodeValue) -> NodeValue:
        return texel(self.graph, self.image, h, v, *self.image.size)


class ImageArriving(_InImage):
    """What patches get of a lamp, in the image; an :class:`.Arriving`."""

    def at(self, row: NodeValue, turn: NodeValue) -> list[NodeValue]:
        """Look it up."""
        beside, above = self._corner()
        h, v = beside + turn, above + row + float(_ARRIVING)
        return [self._texel(h + float(_TERM * term), v) for term in range(TERMS)]


class ImageSource(_InImage):
    """The source of a lamp in the image; a :class:`.Source`."""

    def at(self, row: NodeValue, azimuth: NodeValue, turn: NodeValue, bend: NodeValue) -> NodeValue:
        """Look it up: tiles are linear, between four of them it is done here."""
        up, along_rows = self._held(row, ROWS)
        across, along_azimuths = self._held(azimuth, AZIMUTHS)
        beside, above = self._corner()
        h, v = beside + across * float(_ACROSS) + bend, above + up * float(_UP) + turn
        found = []
        for height in (v, v + float(_UP)):
            near, far = (self._texel(place, height) for place in (h, h + float(_ACROSS)))
            found.append(near + (far - near) * along_azimuths)
        low, high = found
        return low + (high - low) * along_rows

    def _held(self, place: NodeValue, count: int) -> tuple[NodeValue, NodeValue]:
        """Return the tile below a place, and how far it is on to the next."""
        held = NODES.minimum(place, count - 1.001)
        low = self.graph.operation("FLOOR", (held,))
        return low, place - low
