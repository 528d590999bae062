"""What things in view block and carry of light scattered forward, as node groups read it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import bpy
import numpy as np

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.shade.carried_light import CarriedLight
from ..uw_spectral.shade.view_map import SIZE, ViewMap
from ..uw_spectral.transfer.channel_pixel import Around
from .node_mathematics import NODES, Graph, NodeValue
from .texels import number_image, texel

NAME = "UW Cover"
_FIELDS = tuple(field.name for field in fields(ViewMap))
_SINGLE = {"per_unit"}
_TILES = 2  # what is blocked, and what comes from beside


def _names_of(field: str) -> list[str]:
    if field in _SINGLE:
        return [f"view {field}"]
    return [f"view {field} {i}" for i in "xyz"]


NUMBERS = tuple(name for field in _FIELDS for name in _names_of(field))
"""Names of the numbers of a view."""


def numbers(view: ViewMap) -> dict[str, float]:
    """Return the numbers of a view by their names."""
    values = [x for field in _FIELDS for x in np.ravel(getattr(view, field)).tolist()]
    return dict(zip(NUMBERS, values, strict=True))


def new_image() -> bpy.types.Image:
    """Make an image of a view in which nothing is."""
    return number_image(NAME, SIZE, _TILES * SIZE)


def write_cover(image: bpy.types.Image, carried: CarriedLight) -> None:
    """Put what things in view do into the image."""
    out = np.ones((_TILES, SIZE, SIZE, 4), np.float32)
    for tile, values in zip(out, (carried.blocked, carried.beside), strict=True):
        tile[..., :3] = np.moveaxis(values, 0, 2)
    image.pixels.foreach_set(np.ravel(out))
    image.update()


def around(
    graph: Graph,
    values: bpy.types.NodeOutputs,
    image: bpy.types.Image,
    point: Sequence[NodeValue],
) -> Around:
    """Look up what things about a point do.

    Parameters
    ----------
    graph : Graph
    values : NodeOutputs
        Of the group of all numbers.
    image : Image
        Of :func:`new_image`.
    point : three NodeValues
        m.
    """
    parts: dict[str, Operand] = {}
    for field in _FIELDS:
        terms = [graph.term(values[name]) for name in _names_of(field)]
        parts[field] = terms[0] if field in _SINGLE else terms
    h, v = ViewMap(**parts).place(point, NODES)
    rows = float(_TILES * SIZE)
    blocked, beside = (
        texel(graph, image, h, v + float(tile * SIZE), float(SIZE), rows) for tile in range(_TILES)
    )
    return Around(blocked, beside)
