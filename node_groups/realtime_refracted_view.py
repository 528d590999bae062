"""The picture of the air through a flat surface, as node groups read it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import override

import bpy

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.surface.reflected_view import ReflectedView
from ..uw_spectral.surface.refracted_view import RefractedView
from ..uw_spectral.transfer.pixel_parts import RefractedRadiance
from .node_mathematics import NODES, Graph, NodeValue
from .realtime_reflected_view import looks, new_image
from .realtime_values import CAMERA, MIRRORED_FRACTION, MIRRORED_SUN, OF_AIR, THROUGH
from .shape import Shape, TermShape
from .value_fields import ValueFields

NAME, PART = "UW Window", "uw_window"
FIELDS = ValueFields(ReflectedView, "window", dict.fromkeys(("eye", "right", "up", "ahead"), 3))
"""Numbers of the picture; all are 0 where there is none."""


class WindowShape(TermShape):
    """A picture shows the objects in the air that are seen through the surface."""

    channels = OF_AIR
    singles = (THROUGH, *CAMERA, MIRRORED_FRACTION, MIRRORED_SUN, *FIELDS.names)

    @override
    def parts(self, shape: Shape) -> dict[str, bpy.types.ID]:
        return {PART: new_image(NAME)}


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
    """Look up what a ray that leaves the water at a place, m, meets in the air.

    The image is of :func:`.realtime_reflected_view.new_image`; ``w`` and ``up`` are its unit
    directions in the water and in the air, ``index`` is the water's against air, and ``waves`` is
    whether the surface is not flat.
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
