"""Lamps of the suns of Cycles, and the lid over the scene that gives each medium its own.

A lamp brings an irradiance per band on a plane normal to its rays. The sun of the water is one with
the refracted direction, and shines everywhere; so does that of the air. The lid meets only their
shadow rays. Their direction tells which sun it is, and their length how deep the point is that they
come from.
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ..uw_spectral.mathematics import dot
from . import attributes
from .data_blocks import new_emission, new_material
from .node_mathematics import NODES

NAME, LID_NAME = "UW Sun", "UW Sun Lid"
_IN_WATER, _IN_AIR = "sun in water", "sun in air"


def build(
    angular_diameter: float, irradiance: str = attributes.SUN_IRRADIANCE, gain: float = 1.0
) -> bpy.types.SunLight:
    """Build the lamp of a sun whose disc is seen under a diameter in radians.

    It brings the attribute ``irradiance`` times ``gain`` on a plane across its light.
    """
    light = bpy.data.lights.new(NAME, "SUN")
    light.energy = 1.0
    light.angle = angular_diameter
    _, emission = new_emission(light, irradiance)
    emission.inputs["Strength"].default_value = gain
    return light


def build_lid(height: float) -> bpy.types.Material:
    """Build the material of a lid at a height in m."""
    material, graph, output = new_material(LID_NAME)
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


def turn_lid(material: bpy.types.Material, water: Sequence[float], air: Sequence[float]) -> None:
    """Tell the material the directions in which the sunlight travels."""
    for name, direction in ((_IN_WATER, water), (_IN_AIR, air)):
        for socket, component in zip(material.node_tree.nodes[name].inputs, direction, strict=True):
            socket.default_value = float(component)
