"""Real-time water for EEVEE: put into a scene, given its values, taken out again.

Values change without rebuilding anything; only another :class:`Shape` (parts of the
phase function, surface, sky, shafts, terms of light) builds new nodes.
"""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ...node_groups import (
    realtime_background,
    realtime_tables,
    realtime_values,
    realtime_volume,
    uplift,
)
from ...node_groups.realtime_waves import WaveShape
from ...node_groups.shape import Sources
from ...uw_spectral.errors import InputError
from .. import marks
from ..materials import wet_trees
from ..materials.inserted import own_input
from . import scene_water, wet_materials
from .frame_water import RealtimeWater
from .water_body import WaterExtent, box

_OWNER = "uw_owner"
# Finest detail of the sun's shadow in m: Blender's millimetre costs several times as much,
# and the sun's disc blurs a shadow by 7 mm per metre, waves by far more.
_SHADOW, _WAVY_SHADOW = 0.01, 0.03


def shadow_resolution(water: RealtimeWater) -> float:
    """Finest detail of the sun's shadow in the open, m."""
    return _WAVY_SHADOW if WaveShape in water.shape else _SHADOW


def add_realtime(scene: bpy.types.Scene, water: RealtimeWater, extent: WaterExtent) -> list[str]:
    """Put real-time water into a scene, whose z = 0 is the mean water surface.

    Replaces the world, hides the scene's own lamps, adds sun, floor and the volume of the shafts,
    and sends every material through the surface group. :func:`.scene_water.remove` takes it out.
    Returns what could not be treated, one line each. InputError if the scene has water already or
    is linked from another file, or the water has too many bands.
    """
    scene_water.prepare(scene)
    shape, terms = water.shape, water.inputs.terms
    values = realtime_values.build(shape)
    parts: dict[str, bpy.types.ID] = {
        marks.VALUES: values,
        realtime_tables.PART: realtime_tables.new_image(realtime_tables.sizes_of(shape)),
    }
    for own in shape.terms:
        parts |= own.parts(shape)
    sources = Sources(values, parts)
    for own in shape.terms:
        sources = replace(sources, rays=own.rays(sources) or sources.rays)
    floor, objects = _floor_material() if water.has_floor else None, []
    groups, notes = wet_materials.add(scene, water, sources, floor, extent.bottom)
    if shape.shafts:
        objects.append(box("UW Shafts", extent, 0.0))
        objects[0].data.materials.append(realtime_volume.build(shape, sources))
    sun = bpy.data.lights.new("UW Sun", "SUN")
    sun.energy = 1.0
    sun.shadow_maximum_resolution = shadow_resolution(water)
    filling = scene_water.Filling(
        realtime_background.build_world(realtime_background.build(shape, sources)),
        [sun],
        floor,
        objects,
        parts | groups,
        [follower for term in terms for follower in term.followers()],
        traced=False,  # EEVEE would draw them; the shaders draw the lamps
        floor_occlusions=False,
    )
    notes += scene_water.add(scene, filling, water.column, extent)
    values[_OWNER] = marks.collection_of(scene)
    set_values(scene, water)
    return notes + [note for term in terms for note in term.prepare(scene)]


def set_values(scene: bpy.types.Scene, water: RealtimeWater) -> None:
    """Give the water in a scene other values; nothing is rebuilt.

    Raises
    ------
    InputError
        If the scene has no real-time water, or water of another shape.
    """
    values = marks.part(scene, marks.VALUES)
    if values is None:
        raise InputError(f"scene {scene.name!r} has no real-time water; add it first")
    if values[realtime_values.SHAPE] != repr(water.shape):
        raise InputError(
            "this water needs other nodes; remove the real-time water and add it again"
        )
    realtime_values.write(values, water.numbers)
    realtime_tables.write_light(marks.part(scene, realtime_tables.PART), water.projected)
    wet_materials.write_reflectances(scene, water)
    floor = marks.part(scene, marks.FLOOR)
    if water.inputs.seabed is not None and floor is not None:
        _paint(floor, water.inputs.seabed_colour)
    uplift.set_wet_grains(water.column.refractive_index)
    uplift.set_water_index(water.column.refractive_index if water.indices_in_water else 1.0)
    scene_water.place(scene, water.column, water.inputs.seabed)
    for item in marks.suns(scene):
        # At night it would hide the shadows of lamps.
        shines = bool(np.any(water.column.sun_irradiance > 0))
        item.data.energy = shines / water.sun_gain
        item.data.angle = scene_water.SUN_DIAMETER_IN_AIR / water.column.refractive_index
        of_volume = water.sun_gain / water.shafts.scale if water.shafts is not None else 0.0
        item.data.volume_factor = of_volume
    for term in water.inputs.terms:
        term.write(scene, water)
    wet_trees.refresh()


def keep_images(scene: bpy.types.Scene) -> None:
    """Pack what :func:`set_values` has drawn: a file that is saved then shows it without us."""
    for image in (marks.collection_of(scene) or {}).values():
        if isinstance(image, bpy.types.Image) and image.is_dirty:
            image.pack()


def lost_parts(scene: bpy.types.Scene) -> list[str]:
    """Name what :func:`set_values` needs and the user has deleted."""
    collection = marks.collection_of(scene)
    if collection is None:
        return ["its collection"]
    lost = [f"its {key.removeprefix('uw_')}" for key, part in collection.items() if part is None]
    if len(marks.followers(scene)) < collection.get(marks.FOLLOWERS, 0):
        lost.append("some of its lamps")
    return lost


def fits(scene: bpy.types.Scene, water: RealtimeWater) -> bool:
    """Whether :func:`set_values` can give the water in a scene the values of another.

    A full copy of a scene still shows the water of the original, and needs its own.
    """
    values = marks.part(scene, marks.VALUES)
    if values is None or values[realtime_values.SHAPE] != repr(water.shape):
        return False
    has_floor = marks.part(scene, marks.FLOOR) is not None
    own = values.get(_OWNER) == marks.collection_of(scene)
    fits = all(term.fits(scene) for term in water.inputs.terms)
    return own and fits and has_floor == water.has_floor


def _paint(floor: bpy.types.Material, colour: tuple[float, float, float]) -> None:
    """Give a floor the mean colour of the seabed that it continues."""
    diffuse = next(n for n in floor.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfDiffuse")
    socket = own_input(diffuse.inputs["Color"])
    if tuple(socket.default_value)[:3] != tuple(map(np.float32, colour)):
        for channel, value in enumerate(colour):
            socket.default_value[channel] = value


def _floor_material() -> bpy.types.Material:
    material = bpy.data.materials.new("UW Floor")
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    return material
