"""The picture of the air through a flat surface, as node groups read it."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.surface.reflected_view import ReflectedView
from ..uw_spectral.surface.refracted_view import RefractedView
from ..uw_spectral.transfer.pixel_parts import RefractedRadiance
from .node_mathematics import NODES, Graph, NodeValue
from .realtime_reflected_view import looks
from .value_fields import ValueFields

NAME = "UW Window"
FIELDS = ValueFields(ReflectedView, "window", dict.fromkeys(("eye", "right", "up", "ahead"), 3))
"""Numbers of the picture; all are 0 where there is none."""


def seen_in(
    graph: Graph,
    values: bpy.types.NodeOutputs,
    image: bpy.types.Image,
    place: Sequence[NodeValue],
    w: Sequence[Operand],
    up: Sequence[Operand],
    *,
    index: Operand,
    waves: bool,
) -> RefractedRadiance:
    """Look up what a ray meets in the air.

    Parameters
    ----------
    values : NodeOutputs
        Of the group of all numbers.
    image : Image
        Of :func:`.realtime_reflected_view.new_image`.
    place : three NodeValues
        Where the ray leaves the water, m.
    w, up : three NodeValues
        Its unit direction in the water, and in the air.
    index : NodeValue
        Of the water against air.
    waves : bool
        Whether the surface is not flat.
    """
    view = FIELDS.read(graph, values)
    look, beside = looks(graph, view, image)

    def nearness(h: Operand, v: Operand) -> NodeValue:
        return graph.components(beside(h, v))[0]

    if waves:
        h, v, inside = RefractedView(view, index).found(place, up, nearness, NODES)
    else:
        h, v, inside = view.place(w, NODES)
    covered = graph.components(beside(h, v))[1]
    return RefractedRadiance(look(h, v) * inside, covered * inside)
