"""Materials that refraction moves for EEVEE, and that pictures of one side of the surface hide."""

from __future__ import annotations

import bpy

from ...node_groups import realtime_culling, realtime_refraction
from ...node_groups.realtime_air import AirShape
from ...node_groups.realtime_reflected_view import ReflectionShape
from ...node_groups.realtime_refracted_view import WindowShape
from ...node_groups.realtime_waves import images_in
from ...node_groups.shape import Sources
from ..materials import above_water_culling
from ..readers.mirrored_eye import RISES, materials_above
from . import refraction_displacement, shafts
from .frame_water import RealtimeWater


def insert(
    scene: bpy.types.Scene,
    water: RealtimeWater,
    sources: Sources,
    materials: list[bpy.types.Material],
    floor: bpy.types.Material | None,
    bottom: float,
) -> tuple[bpy.types.ShaderNodeTree | None, list[str]]:
    """Hide and move what the shape of a water asks for.

    Returns the group that moves what is seen from the air, and what could not be treated, one line
    each. The water ends at the depth ``bottom``, m.
    """
    shape, values, images = water.shape, sources.values, images_in(sources.parts)
    if {ReflectionShape, WindowShape, AirShape}.isdisjoint(map(type, shape.terms)):
        return None, []
    high = materials_above(scene, RISES)
    above = [material for material in materials if material in high]
    # In the picture of the air nothing is to be seen that is in the water.
    hidden = above if WindowShape not in shape else [m for m in materials if m != floor]
    above_water_culling.insert(hidden, realtime_culling.build(values, shape, images))
    if AirShape in shape:
        moved = realtime_refraction.build_refraction_displacement(values, images)
        return moved, refraction_displacement.insert(materials, moved, bottom)
    if WindowShape not in shape:
        return None, []
    lifted = realtime_refraction.build_refraction_displacement(values, images, from_air=False)
    return None, refraction_displacement.insert(above, lifted, shafts.LONGEST, from_air=False)


def move(material: bpy.types.Material, group: bpy.types.ShaderNodeTree | None) -> None:
    """Let one more material move as the group of a scene says, if that has one."""
    if group is not None:
        refraction_displacement.insert([material], group, shafts.LONGEST)
