"""Lamps' scattered light as node groups look it up: an image with a place for each profile.

A place holds tiles, with a margin of one texel: side by side the azimuths, above each other the
distances of the source; over them, side by side, the terms of what patches get.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence

import bpy
import numpy as np

from ..uw_spectral.lamps.lamp_harmonics import ROWS
from ..uw_spectral.lamps.multiple_scattering import LampField
from ..uw_spectral.lamps.profile import LampProfile
from ..uw_spectral.lamps.scattered_irradiance import arriving_axes
from ..uw_spectral.lamps.scattered_source import AZIMUTHS, BENDS, TURNS, source_axes
from ..uw_spectral.table import Lookup, Table
from .data_blocks import write_pixels
from .image_table import MARGIN, ImageTable, Tiles, write_tiles
from .node_mathematics import NODES, Graph, NodeValue
from .texture_atlas import number_image

_NAME = "UW Lamp Sources"
_ACROSS, _UP = BENDS + 2 * MARGIN, TURNS + 2 * MARGIN
_SOURCE = Tiles(rows=_UP), Tiles(columns=_ACROSS)
_TERMS = (Tiles(columns=_UP),)
_ARRIVING = ROWS * _UP  # first row of what patches get
_WIDTH, _HEIGHT = AZIMUTHS * _ACROSS, _ARRIVING + ROWS + 2 * MARGIN
_BESIDE = 8  # places in a row
_PLACES = Tiles(_WIDTH, _HEIGHT, _BESIDE)
_WRITTEN = "uw_written"  # custom property of the image: what is in it


def new_image(places: int) -> bpy.types.Image:
    """Make the image of so many profiles."""
    rows = -(-places // _BESIDE)
    return number_image(_NAME, _WIDTH * min(places, _BESIDE), _HEIGHT * rows, half=False)


def write(
    image: bpy.types.Image,
    in_water: LampField,
    on_surfaces: LampField,
    profiles: Sequence[LampProfile],
    own: Mapping[int, Lookup],
) -> None:
    """Put the scattered light of lamps, in three bands, into an image of :func:`new_image`.

    It has places for at least as many profiles; ``own`` are sources of others. What is there
    already is not written again.
    """
    places = [(in_water.source(one).values, on_surfaces.arriving(one).values) for one in profiles]
    sources = {place: x.values for place, x in own.items() if isinstance(x, Table)}
    every = *sum(places, ()), *sources.values()
    key = hashlib.sha256(b"".join(np.ascontiguousarray(x).data for x in every))
    if image.get(_WRITTEN) == key.hexdigest():
        return
    width, height = image.size
    out = np.zeros((height, width, 4), np.float32)
    out[..., 3] = 1.0
    for place, (source, arriving) in enumerate(places):
        column, row = (int(x) for x in _PLACES.corner(place))
        at = out[row:, column:]
        write_tiles(at, source, _SOURCE)
        write_tiles(at[_ARRIVING:], arriving, _TERMS)
    for place, source in sources.items():
        column, row = (int(x) for x in _PLACES.corner(place))
        write_tiles(out[row:, column:], source, _SOURCE)
    write_pixels(image, out)
    image[_WRITTEN] = key.hexdigest()


def source(graph: Graph, image: bpy.types.Image, place: NodeValue, scale: NodeValue) -> ImageTable:
    """Return the source of the lamp of a place in the image."""
    corner = _PLACES.corner(place, NODES)
    return ImageTable(graph, image, source_axes(scale), *corner, _SOURCE)


def arriving(
    graph: Graph, image: bpy.types.Image, place: NodeValue, scale: NodeValue
) -> ImageTable:
    """Return what patches get of the lamp of a place in the image."""
    column, row = _PLACES.corner(place, NODES)
    first = row + float(_ARRIVING)
    return ImageTable(graph, image, arriving_axes(scale), column, first, _TERMS)
