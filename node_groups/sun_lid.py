"""Material of a lid over the scene that gives each medium its own sun, for Cycles.

The sun of the water is a lamp with the refracted direction, and shines everywhere; so does that of
the air. The lid meets only their shadow rays. Their direction tells which sun it is, and their
length how deep the point is that they come from.
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ..uw_spectral.mathematics import dot
from .data_blocks import new_material
from .node_mathematics import NODES

NAME = "UW Sun Lid"
_IN_WATER, _IN_AIR = "sun in water", "sun in air"


def build(height: float) -> bpy.types.Material:
    """Build the material of a lid at a height in m."""
    material, graph, output = new_material(NAME)
    suns = []
    for name in (_IN_WATER, _IN_AIR):
        node = graph.node("ShaderNodeCombineXYZ", name=name, label=name)
        suns.append(graph.components(graph.term(node.outputs[0])))
    geometry = graph.node("ShaderNodeNewGeometry")
    sunlight = graph.components(graph.term(geometry.outputs["Incoming"]))
    length = graph.term(graph.node("ShaderNodeLightPath").outputs["Ray Length"])
    of_water, of_air = (dot(sunlight, sun) for sun in suns)
    is_of_water = NODES.less(of_air, of_water)
    in_air = NODES.less(0.0, height + sunlight[2] * length)
    passes = NODES.select(is_of_water, 1.0 - in_air, in_air)
    colour = graph.vector(passes, passes, passes)
    clear = graph.node("ShaderNodeBsdfTransparent", {"Color": colour})
    graph.assign(clear.outputs[0], output.inputs["Surface"])
    return material


def turn(material: bpy.types.Material, water: Sequence[float], air: Sequence[float]) -> None:
    """Tell the material the directions in which the sunlight travels."""
    for name, direction in ((_IN_WATER, water), (_IN_AIR, air)):
        for socket, component in zip(material.node_tree.nodes[name].inputs, direction, strict=True):
            socket.default_value = float(component)
