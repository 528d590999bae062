"""Material of the added floor: Lambertian, reflectance per band."""

from __future__ import annotations

import bpy

from . import attributes
from .data_blocks import new_material, of_view_layer

NAME = "UW Floor"


def build() -> bpy.types.Material:
    """Build the material."""
    material, graph, output = new_material(NAME)
    reflectance = of_view_layer(graph, attributes.FLOOR_REFLECTANCE).outputs["Color"]
    diffuse = graph.node("ShaderNodeBsdfDiffuse", {"Color": reflectance})
    graph.assign(diffuse.outputs[0], output.inputs["Surface"])
    return material
