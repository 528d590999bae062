"""Material of the added floor: Lambertian, reflectance per band."""

from __future__ import annotations

import bpy
from nodebpy import shader as s

from . import attributes

NAME = "UW Floor"


def build() -> bpy.types.Material:
    """Build the material."""
    with s.material(NAME) as material:
        reflectance = s.Attribute.view_layer(attributes.FLOOR_REFLECTANCE).o.color
        s.DiffuseBSDF(color=reflectance) >> s.MaterialOutput().i.surface
    return material.material
