"""Node group of what lies above the water and cannot be seen from within it."""

from __future__ import annotations

import bpy

from ..uw_spectral.surface.refraction import is_in_window
from .group_sockets import OpenGroup
from .node_mathematics import NODES
from .realtime_air import AirShape
from .realtime_rays import drawn_place, eye_place, straight_direction
from .realtime_refracted_view import WindowShape
from .realtime_values import IN_AIR, INDEX, THROUGH
from .realtime_waves import WaveImages, WaveTables, numbers_of
from .shape import Shape

NAME = "UW Above the Water"
_UNDER = 1e-4  # m
_OVERLAP = 0.1  # m, so that both pictures of an object at the surface meet without a gap


def build(
    values: bpy.types.ShaderNodeTree, shape: Shape, images: WaveImages | None
) -> bpy.types.ShaderNodeTree:
    """Build the group; its output is 1 for what is not seen, unless it throws a shadow.

    An eye above the water is the mirror image of one in it, whose rays begin at the surface, unless
    the camera may be in the air, which sees all. Where the air has a picture of its own, that shows
    all above the water and nothing else.
    """
    group = OpenGroup(NAME)
    graph = group.graph
    number = numbers_of(graph, values)
    index = number(INDEX)
    w, (x, y, z) = straight_direction(graph), drawn_place(graph)
    z = z if images is None else z - WaveTables(graph, images, number).level(x, y)
    dry = NODES.less(-_UNDER, z)
    out_of_window = 1.0 - is_in_window(w[2], index, NODES)
    seen = 1.0 - graph.term(graph.node("ShaderNodeLightPath").outputs["Is Shadow Ray"])
    if WindowShape in shape:
        through = number(THROUGH)
        unlike = NODES.maximum(NODES.less(z, -_OVERLAP), out_of_window)
        hidden = NODES.select(through, unlike, dry) * seen
    elif AirShape in shape:
        hidden = (1.0 - number(IN_AIR)) * dry * out_of_window * seen
    else:
        mirrored = NODES.less(0.0, eye_place(graph)[2])
        hidden = dry * NODES.maximum(mirrored, out_of_window) * seen
    return group.finished({"Hidden": hidden})
