"""Water for Cycles: a volume for each layer, with its sun, sky, surface and floor."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import (
    attributes,
    realtime_waves,
    sea_floor,
    sky_world,
    sun_lamp,
    sun_lid,
    uplift,
    water_lamp,
    water_surface,
    water_volume,
)
from ...uw_spectral.transfer.water_column import WaterColumn
from .. import marks
from ..materials import (
    band_colors,
    bare_colours,
    bare_surfaces,
    clear_shadows,
    refractive_indices,
    wet_colours,
)
from ..readers.lamps import SceneLamps
from . import raised_surface, scene_water
from .cycles_phase import CyclesPhase
from .water_body import WaterExtent, box, plane

INTERFACE = "uw_interface"
"""Part that is the material of the water surface; see :func:`.marks.part`."""

_LID = "uw_sun_lid"
_LID_HEIGHT, _LID_REACH = 200.0, 6.0  # m above the water; heights that it is wider

# The volume box stays clear of the interface, or Cycles would nest the two media; the
# gap is water that is not there, so it is kept to this optical depth.
_SURFACE_GAP = 1e-3
_LARGEST_GAP = 0.01
# Layers overlap: faces in one place would count as one. It is a tenth of that gap, and lies
# below the depth where they meet, so that a camera there is in the upper one alone.
_OVERLAP = 0.1


def add_water(
    scene: bpy.types.Scene,
    column: WaterColumn,
    phases: Sequence[CyclesPhase],
    extent: WaterExtent,
    lamps: SceneLamps | None = None,
    *,
    above: bool = False,
    dry: bool = False,
    indices_in_water: bool = True,
    own_seabed: bool = False,
    raised: bool = False,
    foam: bool = False,
) -> list[str]:
    """Put water under z = 0 of a scene; returns what could not be treated, one line each.

    Adds the water box, the sun, and, where the column has them, the surface and the floor; replaces
    the world by the sky; hides the scene's own lamps; routes the colours of materials through the
    bands. :func:`.scene_water.remove` takes it out. InputError if the scene has water already, or
    is linked from another file.

    ``above`` is whether the camera may be in the air, ``dry`` whether objects may, which have the
    sun of the air; ``own_seabed``, whether a floor may continue the scene's own, hidden until it is
    placed. Waves that are ``raised`` have heights, and may leave ``foam``.
    """
    scene_water.prepare(scene)
    _, bare = bare_surfaces.dress(scene)
    materials, notes = scene_water.own_materials(scene, routed=True)
    notes += bare
    bare_colours.insert(materials)
    if column.reflects:
        clear_shadows.insert(materials)
    wet_colours.insert(materials)
    uplift.set_wet_grains(column.refractive_index)
    notes += band_colors.insert(materials)
    if indices_in_water:
        refractive_indices.insert(materials)
        uplift.set_water_index(column.refractive_index)
    raised = raised and column.surface == "waves"
    objects, parts, images = _layers(column, phases, extent, raised=raised), {}, None
    if column.reflects:
        if column.surface == "waves":
            images = realtime_waves.new_images(raised=raised, foam=raised and foam)
        parts[INTERFACE] = water_surface.build(
            column.refractive_index, images, from_air=above or not dry
        )
        make = raised_surface.surface if raised else plane
        objects.append(make("UW Surface", 2.0 * extent.half_width))
        objects[-1].data.materials.append(parts[INTERFACE])
    gain = column.refractive_index**2 if above and column.reflects else 1.0
    world = sky_world.build(column.sky, gain)
    sky_world.turn(world, column.skylight.sun)
    # Sampling the sky through an interface would ignore refraction. Without one, Cycles 5.2 then
    # draws water that scatters forward 1 to 2 % too bright, in twice the time; rays find it anyway.
    world.cycles.sampling_method = "NONE"
    suns = [sun_lamp.build(scene_water.SUN_DIAMETER_IN_AIR / column.refractive_index)]
    if (above or (dry and column.reflects)) and _suns_differ(column):
        # What is seen through the surface has n², which Cycles leaves out.
        gain = 1.0 if above else column.refractive_index**2
        in_air = sun_lamp.build(scene_water.SUN_DIAMETER_IN_AIR, attributes.SUN_IN_AIR, gain)
        suns.append(in_air)
        parts[_LID] = sun_lid.build(_LID_HEIGHT)
        objects.append(_lid(extent, parts[_LID]))
    floor = sea_floor.build() if own_seabed or math.isfinite(column.floor_depth) else None
    lamps = lamps or SceneLamps()
    lit = [
        (water_lamp.build(index, lamp, one.light), one)
        for index, (lamp, one) in enumerate(zip(lamps.lamps, lamps.shown, strict=True))
    ]
    filling = scene_water.Filling(world, suns, floor, objects, images, parts, lit)
    notes += [*lamps.notes, *scene_water.add(scene, filling, column, extent)]
    for item in marks.objects(scene):
        if marks.IS_SUN in item:
            # Under an interface a refracted ray must not meet the disc: the lamp's shadow rays
            # bring the sun already. Glossy rays none meets; without the switch Cycles would leave
            # the sun out of what shines.
            item.visible_transmission = not column.reflects
            # Light that is left to rays that meet nothing would be lost.
            item.data.cycles.use_multiple_importance_sampling = not column.reflects
    shape_lamps(scene, lamps)
    _let_through(
        [i for i, x in zip(marks.followers(scene), lamps.lamps, strict=True) if x.unblocked]
    )
    return notes


def _let_through(unblocked: list[bpy.types.Object]) -> None:
    """Let no object keep the light of lamps from others.

    Without its shadow Cycles would leave out the water on the way too. So it has one, of what is
    in a collection without any surface: the water is not asked.
    """
    if not unblocked:
        return
    nothing = bpy.data.collections.new("UW Nothing")
    nothing[marks.MARK] = True
    nothing.objects.link(unblocked[0])
    for item in unblocked:
        item.light_linking.blocker_collection = nothing


def shape_lamps(scene: bpy.types.Scene, lamps: SceneLamps) -> None:
    """Give lamps whose cone, profile or size has changed since a frame the new ones.

    Those in the air are put where they seem to be: their light goes straight through the surface.
    """
    found = zip(marks.followers(scene), lamps.lamps, lamps.shown, strict=True)
    for index, (item, lamp, own) in enumerate(found):
        before = item.data
        if not water_lamp.fits(before, lamp, own.light):
            item.data = water_lamp.build(index, lamp, own.light)
            if marks.MARK in before:
                item.data[marks.MARK] = before[marks.MARK]
            bpy.data.lights.remove(before)
        scene_water.follow(item, own)
        for constraint in item.constraints:
            constraint.mute = lamp.shines_in
        if lamp.shines_in:
            item.location = lamp.position
            scene_water.turn(item, lamp.axis)
            # Rays that are refracted must not find it too; shadow rays bring its light.
            item.visible_transmission = False


def place(scene: bpy.types.Scene, column: WaterColumn, own_seabed: float | None = None) -> None:
    """Bring sun, sky and floor of a water to their places, see :func:`.scene_water.place`."""
    scene_water.place(scene, column, own_seabed)
    sky_world.turn(scene.world, column.skylight.sun)
    lid = marks.part(scene, _LID)
    if lid is not None:
        sun_lid.turn(lid, column.sun_direction.tolist(), column.skylight.sun)
        for item in marks.objects(scene):
            if marks.IS_SUN in item and not item[marks.IS_SUN]:
                scene_water.turn(item, column.skylight.sun)


def _suns_differ(column: WaterColumn) -> bool:
    """Whether the suns of water and air can be told apart by where they stand."""
    cosine = float(np.dot(column.sun_direction, column.skylight.sun))
    return math.acos(min(cosine, 1.0)) > 2.0 * scene_water.SUN_DIAMETER_IN_AIR


def _lid(extent: WaterExtent, material: bpy.types.Material) -> bpy.types.Object:
    item = plane("UW Sun Lid", extent.half_width + _LID_REACH * _LID_HEIGHT, _LID_HEIGHT)
    item.data.materials.append(material)
    for kind in ("camera", "diffuse", "glossy", "transmission", "volume_scatter"):
        setattr(item, f"visible_{kind}", False)
    return item


def _layers(
    column: WaterColumn, phases: Sequence[CyclesPhase], extent: WaterExtent, *, raised: bool
) -> list[bpy.types.Object]:
    gap = _gap(column.attenuation)
    tops, bottoms = [gap if column.reflects else 0.0], []
    above = column.attenuation
    for layer in column.below:
        here = layer.absorption + layer.scattering
        overlap = _OVERLAP * _gap(np.maximum(above, here))
        above = here
        if layer.top + overlap >= extent.bottom:
            break
        tops.append(layer.top + overlap)
        bottoms.append(min(layer.top + 2.0 * overlap, extent.bottom))
    bottoms.append(extent.bottom)
    boxes = []
    # Layers below the water's bottom have no box.
    for index, (top, bottom, phase) in enumerate(zip(tops, bottoms, phases, strict=False)):
        part = WaterExtent(extent.half_width, bottom)
        follows = raised and index == 0
        boxes.append((raised_surface.body if follows else box)("UW Water", part, top))
        boxes[-1].data.materials.append(water_volume.build(phase.lobes, index))
    return boxes


def _gap(attenuation: NDArray[np.float64]) -> float:
    return min(_LARGEST_GAP, _SURFACE_GAP / max(float(attenuation.max()), _SURFACE_GAP))
