"""World: uniform sky radiance above the horizon, black below it."""

from __future__ import annotations

import bpy
from nodebpy import shader as s

from . import attributes

NAME = "UW Sky"


def build() -> bpy.types.World:
    """Build the world."""
    with s.world(NAME) as world:
        upwards = s.Geometry().o.incoming.z < 0.0
        radiance = s.Attribute.view_layer(attributes.SKY_RADIANCE).o.color
        s.Background(color=radiance, strength=upwards) >> s.WorldOutput()
    return world.world
