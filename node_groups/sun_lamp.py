"""Lamp of the sun: irradiance per band on a plane normal to the in-water rays."""

from __future__ import annotations

import bpy

from . import attributes
from .node_mathematics import NODES, Graph

NAME = "UW Sun"


def build(
    angular_diameter: float,
    irradiance: str = attributes.SUN_IRRADIANCE,
    gain_in_water: float = 1.0,
) -> bpy.types.SunLight:
    """Build the lamp.

    Parameters
    ----------
    angular_diameter : float
        Diameter of the sun's disc as it is seen, radians.
    irradiance : str
        Attribute that holds what it brings on a plane across its light.
    gain_in_water : float
        Factor on that for eyes that see what it lights through the surface, which leaves it out.
    """
    light = bpy.data.lights.new(NAME, "SUN")
    light.energy = 1.0
    light.angle = angular_diameter
    tree = light.node_tree
    tree.nodes.clear()
    attribute = tree.nodes.new("ShaderNodeAttribute")
    attribute.attribute_type = "VIEW_LAYER"
    attribute.attribute_name = irradiance
    emission = tree.nodes.new("ShaderNodeEmission")
    if gain_in_water != 1.0:
        graph = Graph(tree)
        through = graph.term(graph.node("ShaderNodeLightPath").outputs["Transmission Depth"])
        gain = NODES.select(NODES.less(0.5, through), gain_in_water, 1.0)
        graph.assign(gain, emission.inputs["Strength"])
    output = tree.nodes.new("ShaderNodeOutputLight")
    tree.links.new(attribute.outputs["Color"], emission.inputs["Color"])
    tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return light
