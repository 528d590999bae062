"""An empty to grab: where it stands in the sky, there is the sun.

Drivers read its place, so moves, keyframes and constraints of it all count.
"""

from __future__ import annotations

import math
from typing import override

import bpy
from mathutils import Euler, Vector

from ..scene import stored_settings
from .reporting import ReportingOperator

NAME = "Underwater Sun"
_DISTANCE = 12.0  # m
_LIMIT = 89.9  # degrees; as the setting
_EXPRESSIONS = {
    "sun_zenith": f"min(degrees(atan2(sqrt(x*x + y*y), max(z, 0.001))), {_LIMIT})",
    # The light travels away from the sun.
    "sun_azimuth": "degrees(atan2(-y, -x))",
}


def driven(scene: bpy.types.Scene) -> bool:
    """Whether drivers turn the sun of a scene."""
    data = scene.animation_data
    paths = {f"{stored_settings.PROPERTY}.{name}" for name in _EXPRESSIONS}
    return data is not None and any(d.data_path in paths for d in data.drivers)


class AddSunHandle(ReportingOperator):
    """Add an empty in the sky above the origin; the sun stands where you move it. Delete the
    drivers of zenith and azimuth to set numbers again.
    """

    bl_idname = "underwater.add_sun_handle"
    bl_label = "Grab the Sun"

    @classmethod
    @override
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.scene.is_editable and not driven(context.scene)

    @override
    def run(self, context: bpy.types.Context) -> None:
        scene = context.scene
        group = getattr(scene, stored_settings.PROPERTY)
        handle = bpy.data.objects.new(NAME, None)
        handle.empty_display_type, handle.empty_display_size = "SPHERE", 0.8
        turn = Euler((0.0, -math.radians(group.sun_zenith), math.radians(group.sun_azimuth)))
        handle.location = _DISTANCE * (turn.to_matrix() @ Vector((0.0, 0.0, 1.0)))
        scene.collection.objects.link(handle)
        for name, expression in _EXPRESSIONS.items():
            driver = scene.driver_add(f"{stored_settings.PROPERTY}.{name}").driver
            driver.type, driver.expression = "SCRIPTED", expression
            for axis in "xyz":
                variable = driver.variables.new()
                variable.name, variable.type = axis, "TRANSFORMS"
                target = variable.targets[0]
                target.id, target.transform_type = handle, f"LOC_{axis.upper()}"
                target.transform_space = "WORLD_SPACE"


register, unregister = bpy.utils.register_classes_factory((AddSunHandle,))
