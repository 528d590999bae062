"""A cloud for a scene: an empty that is marked as one."""

from __future__ import annotations

import bpy
from mathutils import Vector

from ...uw_spectral.clouds.matter import BUBBLES, MINERALS, PHYTOPLANKTON
from ..stored_clouds import PROPERTY

_AHEAD = 3.0  # m from the camera
_SIZE = 1.0
_NAMES = {MINERALS: "Silt Cloud", PHYTOPLANKTON: "Bloom", BUBBLES: "Bubble Cloud"}
_AMOUNTS = {BUBBLES: 3.0}
"""Where another concentration than the usual one looks like what it is."""


def add_blob(scene: bpy.types.Scene, constituent: str = MINERALS) -> bpy.types.Object:
    """Add a blob of one of :data:`.matter.UNITS` to a scene, before its camera if it has one."""
    item = bpy.data.objects.new(_NAMES[constituent], None)
    item.empty_display_type, item.empty_display_size = "SPHERE", _SIZE
    camera = scene.camera
    if camera is not None:
        item.location = camera.matrix_world @ Vector((0.0, 0.0, -_AHEAD))
    else:
        item.location = scene.cursor.location
    own = getattr(item, PROPERTY)
    own.constituent = constituent
    own.concentration = _AMOUNTS.get(constituent, own.concentration)
    scene.collection.objects.link(item)
    return item
