"""Material of the flat water surface for Cycles: refraction and total reflection.

The camera and scattered light see a smooth dielectric; shadow rays pass, since
the sun's lamp already carries the refracted direction and the transmitted share.
"""

from __future__ import annotations

import bpy
from nodebpy import shader as s

NAME = "UW Surface"


def build(refractive_index: float) -> bpy.types.Material:
    """Build the material; the surface's normal points up, into the air."""
    with s.material(NAME) as material:
        shader = s.MixShader(
            s.LightPath().o.is_shadow_ray,
            s.GlassBSDF(color=(1.0, 1.0, 1.0, 1.0), roughness=0.0, ior=refractive_index),
            s.TransparentBSDF(color=(1.0, 1.0, 1.0, 1.0)),
        )
        shader >> s.MaterialOutput().i.surface
    return material.material
