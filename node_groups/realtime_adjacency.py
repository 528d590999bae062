"""What objects in view block and carry of light scattered forward, as node groups read it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import override

import bpy
import numpy as np

from ..uw_spectral.occlusion.adjacency import Adjacency
from ..uw_spectral.occlusion.view_map import SIZE, ViewMap
from ..uw_spectral.transfer.pixel_parts import Around
from .data_blocks import write_pixels
from .node_mathematics import NODES, Graph, NodeValue
from .pixel_term import Pixel, TermPixel
from .shape import Shape, TermShape
from .texture_atlas import number_image, texel
from .value_fields import ValueFields

NAME, PART = "UW Cover", "uw_cover"
FIELDS = ValueFields(ViewMap, "view", dict.fromkeys(("centre", "right", "up", "ahead"), 3))
"""Numbers of a view."""
_TILES = 3  # what is blocked, what of it has the pixel's light, and what comes from beside


class AdjacencyShape(TermShape):
    """It is known which part of the view objects fill."""

    singles = FIELDS.names

    @override
    def parts(self, shape: Shape) -> dict[str, bpy.types.ID]:
        return {PART: number_image(NAME, SIZE, _TILES * SIZE)}

    @override
    def in_pixel(self, pixel: Pixel) -> TermPixel | None:
        if pixel.given is None:
            return None
        found, image = TermPixel(), pixel.sources.parts[PART]
        found.around = around(pixel.graph, pixel.water.values.outputs, image, pixel.point)
        return found


def write_adjacency(image: bpy.types.Image, adjacency: Adjacency) -> None:
    """Put what objects in view do into the image."""
    out = np.ones((_TILES, SIZE, SIZE, 4), np.float32)
    for tile, values in zip(out, (adjacency.blocked, adjacency.own, adjacency.beside), strict=True):
        tile[..., :3] = np.moveaxis(values, 0, 2)
    write_pixels(image, out.reshape(-1, SIZE, 4))


def around(
    graph: Graph, values: bpy.types.NodeOutputs, image: bpy.types.Image, point: Sequence[NodeValue]
) -> Around:
    """Look up what objects about a point, m, do, in an image of the shape's.

    ``values`` are the outputs of the group of all numbers.
    """
    h, v = FIELDS.read(graph, values).place(point, NODES)
    rows = float(_TILES * SIZE)
    blocked, own, beside = (
        texel(graph, image, h, v + float(tile * SIZE), float(SIZE), rows) for tile in range(_TILES)
    )
    return Around(blocked, own, beside)
