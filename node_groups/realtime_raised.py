"""Where a view ray meets the moving surface, if that has heights."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import override

import bpy

from ..uw_spectral.surface.raised_waves import surface_ahead
from .group_sockets import FLOAT, VECTOR, OpenGroup
from .loops import iterated
from .node_mathematics import NODES, PART_SIZE, Graph, NodeValue
from .pixel_term import Triple
from .realtime_values import IN_AIR
from .realtime_water import PixelWater, in_group
from .realtime_waves import (
    FAR_PART,
    WAVES_FAR_HALF_CELL,
    WAVES_FAR_PER_METRE,
    WAVES_HIGHEST,
    WaveImages,
    WaveTables,
    images_in,
    new_image,
    numbers_of,
)
from .shape import Shape, TermShape

_HEIGHT_NAME, _CROSSING_NAME = "UW Surface Height", "UW Surface Crossing"
_X, _Y, _HEIGHT = "X", "Y", "Height"
_START, _DIRECTION, _FOUND, _DISTANCE = "Start", "Direction", "Found", "Distance"


class RaisedShape(TermShape):
    """Waves have heights."""

    singles = WAVES_FAR_PER_METRE, WAVES_FAR_HALF_CELL, WAVES_HIGHEST

    @override
    def parts(self, shape: Shape) -> dict[str, bpy.types.ID]:
        return {FAR_PART: new_image(FAR_PART)}

    @override
    def depth_of_eye(self, water: PixelWater, eye: Triple, w: Triple, y_o: NodeValue) -> NodeValue:
        graph, values = water.graph, water.sources.values
        waves = images_in(water.sources.parts)
        assert waves is not None, "only waves have heights"
        found, away = crossing(graph, values, waves, eye, w, in_air=False)
        risen = found * NODES.less(0.0, w[2])
        if IN_AIR in graph.shared(values):
            # Rays from the air begin at the surface.
            risen = risen * (1.0 - graph.term(graph.shared(values)[IN_AIR]))
        return NODES.select(risen, NODES.maximum(away * w[2], 0.0), y_o)


def crossing(
    graph: Graph,
    values: bpy.types.ShaderNodeTree,
    images: WaveImages,
    start: Sequence[NodeValue],
    w: Sequence[NodeValue],
    *,
    in_air: bool,
    first: float = 0.0,
) -> tuple[NodeValue, NodeValue]:
    """Whether a ray from ``start`` along ``w`` meets the surface, 0 or 1, and at what distance, m.

    ``in_air`` is whether it begins in the air; it looks from the distance ``first`` on, m.
    """
    group = _build_crossing(values, images, in_air=in_air, first=first)
    found = in_group(graph, group, {_START: graph.vector(*start), _DIRECTION: graph.vector(*w)})
    return found[_FOUND], found[_DISTANCE]


def _build_crossing(
    values: bpy.types.ShaderNodeTree, images: WaveImages, *, in_air: bool, first: float
) -> bpy.types.ShaderNodeTree:
    ends: dict[str, str] = dict.fromkeys((_START, _DIRECTION), VECTOR)
    group = OpenGroup(_CROSSING_NAME, ends, part_size=PART_SIZE)
    graph = group.graph
    start, w = (graph.components(group.given[name]) for name in ends)
    height = _build_height(values, images)

    def elevation(x: NodeValue, y: NodeValue) -> NodeValue:
        return in_group(graph, height, {_X: x, _Y: y})[_HEIGHT]

    highest = graph.term(graph.shared(values)[WAVES_HIGHEST])
    side = 1.0 if in_air else -1.0
    iterate = functools.partial(iterated, graph)
    found, distance = surface_ahead(start, w, elevation, highest, side, first, NODES, iterate)
    return group.finished({_FOUND: found, _DISTANCE: distance})


def _build_height(values: bpy.types.ShaderNodeTree, images: WaveImages) -> bpy.types.ShaderNodeTree:
    group = OpenGroup(_HEIGHT_NAME, dict.fromkeys((_X, _Y), FLOAT))
    graph = group.graph
    place = group.given[_X], group.given[_Y]
    surface = WaveTables(graph, images, numbers_of(graph, values)).raised(*place)
    return group.finished({_HEIGHT: graph.components(surface)[2]})
