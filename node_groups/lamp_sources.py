"""Sources of lamps' scattered light as node groups look them up: an image with a place for each.

A place holds tiles, with a margin of one texel: side by side the azimuths, above each other the
distances. Lamps of one profile share a place.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.lamps.lamp_harmonics import ROWS
from ..uw_spectral.lamps.scattered_source import AZIMUTHS, BENDS, TURNS, SourceTable
from .node_mathematics import NODES, Graph, NodeValue
from .texels import number_image, texel

_NAME = "UW Lamp Sources"
_MARGIN = 1
_ACROSS, _UP = BENDS + 2 * _MARGIN, TURNS + 2 * _MARGIN
_WIDTH, _HEIGHT = AZIMUTHS * _ACROSS, ROWS * _UP
_BESIDE = 8  # places in a row
_WRITTEN = "uw_written"  # custom property of the image: what is in it


def new_image(places: int) -> bpy.types.Image:
    """Make the image of so many profiles."""
    rows = -(-places // _BESIDE)
    image = number_image(_NAME, _WIDTH * min(places, _BESIDE), _HEIGHT * rows)
    image.use_half_precision = False
    return image


def write(image: bpy.types.Image, sources: Sequence[SourceTable]) -> None:
    """Put sources into an image, unless it has them.

    Parameters
    ----------
    image : Image
        Of :func:`new_image`.
    sources : sequence of SourceTable
        Of three bands; no more than the image has places.
    """
    tables = [source.values.astype(np.float32) for source in sources]
    key = hashlib.sha256(b"".join(table.tobytes() for table in tables)).hexdigest()
    if image.get(_WRITTEN) == key:
        return
    width, height = image.size
    out = np.zeros((height, width, 4), np.float32)
    out[..., 3] = 1.0
    for place, table in enumerate(tables):
        row, column = divmod(place, _BESIDE)
        at = out[_HEIGHT * row :, _WIDTH * column :]
        at[:_HEIGHT, :_WIDTH, :3] = _tiles(table)
    image.pixels.foreach_set(np.ravel(out))
    image.update()
    image[_WRITTEN] = key


def _tiles(table: NDArray[np.float32]) -> NDArray[np.float32]:
    margin = (_MARGIN, _MARGIN)
    padded = np.pad(table, ((0, 0), (0, 0), margin, margin, (0, 0)), mode="edge")
    return np.moveaxis(padded, 1, 2).reshape(_HEIGHT, _WIDTH, 3)


@dataclass(frozen=True, eq=False)
class ImageSource:
    """The source of a lamp in the image; a :class:`.Source`.

    Attributes
    ----------
    graph : Graph
    image : Image
    place : NodeValue
    scale : NodeValue
    """

    graph: Graph
    image: bpy.types.Image
    place: NodeValue
    scale: NodeValue

    def at(self, row: NodeValue, azimuth: NodeValue, turn: NodeValue, bend: NodeValue) -> NodeValue:
        """Look it up: tiles are linear, between four of them it is done here."""
        up, along_rows = self._held(row, ROWS)
        across, along_azimuths = self._held(azimuth, AZIMUTHS)
        above = self.graph.operation("FLOOR", (self.place * (1.0 / _BESIDE),))
        beside = (self.place - above * float(_BESIDE)) * float(_WIDTH)
        h = beside + across * float(_ACROSS) + bend + float(_MARGIN)
        v = above * float(_HEIGHT) + up * float(_UP) + turn + float(_MARGIN)
        found = []
        for height in (v, v + float(_UP)):
            near, far = (
                texel(self.graph, self.image, place, height, *self.image.size)
                for place in (h, h + float(_ACROSS))
            )
            found.append(near + (far - near) * along_azimuths)
        low, high = found
        return low + (high - low) * along_rows

    def _held(self, place: NodeValue, count: int) -> tuple[NodeValue, NodeValue]:
        """Return the tile below a place, and how far it is on to the next."""
        held = NODES.minimum(place, count - 1.001)
        low = self.graph.operation("FLOOR", (held,))
        return low, place - low
