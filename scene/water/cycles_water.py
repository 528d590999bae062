"""Water for Cycles: a volume for each layer, with its sun, sky, surface and floor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import attributes, sky_world, suns, uplift, water_volume
from ...node_groups.data_blocks import new_material, of_view_layer
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
from ..readers.scene_lamps import SceneLamps
from . import cycles_lamps, cycles_surface, raised_surface, scene_water
from .cycles_phase import CyclesPhase
from .water_body import WaterExtent, box, plane

_LID = "uw_sun_lid"
_LID_HEIGHT, _LID_REACH = 200.0, 6.0  # m above the water; heights that it is wider
# The volume box stays clear of the interface, or Cycles would nest the two media; the
# gap is water that is not there, so it is kept to this optical depth.
_SURFACE_GAP = 1e-3
_LARGEST_GAP = 0.01
# Layers overlap: faces in one place would count as one. It is a tenth of that gap, and lies
# below the depth where they meet, so that a camera there is in the upper one alone.
_OVERLAP = 0.1


@dataclass(frozen=True)
class Options:
    """What Cycles draws of a water besides what is always there."""

    above: bool = False  #: The camera may be in the air.
    dry: bool = False  #: Objects may be, which have the sun of the air.
    indices_in_water: bool = True
    #: A floor may continue the scene's own, hidden until it is placed.
    own_seabed: bool = False
    raised: bool = False  #: Waves have heights,
    foam: bool = False  #: and leave foam then.


def add_water(
    scene: bpy.types.Scene,
    column: WaterColumn,
    phases: Sequence[CyclesPhase],
    extent: WaterExtent,
    lamps: SceneLamps | None = None,
    options: Options | None = None,
) -> list[str]:
    """Put water under z = 0 of a scene; returns what could not be treated, one line each.

    Adds the water box, the sun, and, where the column has them, the surface and the floor; replaces
    the world by the sky; hides the scene's own lamps; routes the colours of materials through the
    bands. :func:`.scene_water.remove` takes it out. InputError if the scene has water already, or
    is linked from another file.
    """
    options = options or Options()
    scene_water.prepare(scene)
    notes = _route_materials(scene, column, indices_in_water=options.indices_in_water)
    above, dry = options.above, options.dry
    raised = options.raised and column.surface == "waves"
    objects = _layer_volumes(column, phases, extent, raised=raised)
    parts: dict[str, bpy.types.ID] = {}
    if column.reflects:
        item, parts = cycles_surface.build(
            column, 2.0 * extent.half_width,
            raised=raised, foam=raised and options.foam, from_air=above or not dry,
        )  # fmt: skip
        objects.append(item)
    gain = column.refractive_index**2 if above and column.reflects else 1.0
    world = sky_world.build(column.sky, gain)
    sky_world.turn(world, column.skylight.sun)
    # Sampling the sky through an interface would ignore refraction. Without one, Cycles 5.2 then
    # draws water that scatters forward 1 to 2 % too bright, in twice the time; rays find it anyway.
    world.cycles.sampling_method = "NONE"
    shining = [suns.build(scene_water.SUN_DIAMETER_IN_AIR / column.refractive_index)]
    if (above or (dry and column.reflects)) and _suns_differ(column):
        # What is seen through the surface has n², which Cycles leaves out.
        gain = 1.0 if above else column.refractive_index**2
        in_air = suns.build(scene_water.SUN_DIAMETER_IN_AIR, attributes.SUN_IN_AIR, gain)
        shining.append(in_air)
        parts[_LID] = suns.build_lid(_LID_HEIGHT)
        objects.append(_lid(extent, parts[_LID]))
    floor = _floor() if options.own_seabed or math.isfinite(column.floor_depth) else None
    lamps = lamps or SceneLamps()
    followers = cycles_lamps.followers(lamps)
    filling = scene_water.Filling(world, shining, floor, objects, parts, followers)
    notes += [*lamps.notes, *scene_water.add(scene, filling, column, extent)]
    for item in marks.objects(scene):
        if marks.IS_SUN in item:
            # Under an interface a refracted ray must not meet the disc: the lamp's shadow rays
            # bring the sun already. Glossy rays none meets; without the switch Cycles would leave
            # the sun out of what shines.
            item.visible_transmission = not column.reflects
            # Light that is left to rays that meet nothing would be lost.
            item.data.cycles.use_multiple_importance_sampling = not column.reflects
    cycles_lamps.shape(scene, lamps)
    cycles_lamps.let_through(scene, lamps)
    return notes


def place(scene: bpy.types.Scene, column: WaterColumn, own_seabed: float | None = None) -> None:
    """Bring sun, sky and floor of a water to their places, see :func:`.scene_water.place`."""
    scene_water.place(scene, column, own_seabed)
    sky_world.turn(scene.world, column.skylight.sun)
    lid = marks.part(scene, _LID)
    if lid is not None:
        suns.turn_lid(lid, column.sun_direction.tolist(), column.skylight.sun)
        for item in marks.objects(scene):
            if marks.IS_SUN in item and not item[marks.IS_SUN]:
                scene_water.turn(item, column.skylight.sun)


def _route_materials(
    scene: bpy.types.Scene, column: WaterColumn, *, indices_in_water: bool
) -> list[str]:
    """Let the colours of materials be those of the bands; returns what could not be treated."""
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
    return notes


def _layer_volumes(
    column: WaterColumn, phases: Sequence[CyclesPhase], extent: WaterExtent, *, raised: bool
) -> list[bpy.types.Object]:
    """Build a box for each layer; the first follows waves with heights if it is ``raised``."""
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


def _suns_differ(column: WaterColumn) -> bool:
    """Whether the suns of water and air can be told apart by where they stand."""
    cosine = float(np.dot(column.sun_direction, column.skylight.sun))
    return math.acos(min(cosine, 1.0)) > 2.0 * scene_water.SUN_DIAMETER_IN_AIR


def _floor() -> bpy.types.Material:
    """Make the material of the added floor: Lambertian, with a reflectance per band."""
    material, graph, output = new_material("UW Floor")
    reflectance = of_view_layer(graph, attributes.FLOOR_REFLECTANCE).outputs["Color"]
    diffuse = graph.node("ShaderNodeBsdfDiffuse", {"Color": reflectance})
    graph.assign(diffuse.outputs[0], output.inputs["Surface"])
    return material


def _lid(extent: WaterExtent, material: bpy.types.Material) -> bpy.types.Object:
    item = plane("UW Sun Lid", extent.half_width + _LID_REACH * _LID_HEIGHT, _LID_HEIGHT)
    item.data.materials.append(material)
    for kind in ("camera", "diffuse", "glossy", "transmission", "volume_scatter"):
        setattr(item, f"visible_{kind}", False)
    return item
