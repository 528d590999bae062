"""Water for Cycles: a volume for each layer, with its sun, sky, surface and floor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np

from ...node_groups import attributes, sky_world, suns
from ...node_groups.data_blocks import new_material, of_view_layer
from ...uw_spectral.transfer.water_column import WaterColumn
from .. import marks
from ..readers.scene_lamps import SceneLamps
from . import cycles_lamps, cycles_surface, layer_volumes, routed_materials, scene_water
from .cycles_phase import CyclesPhase
from .water_body import WaterExtent, plane

_LID = "uw_sun_lid"
_LID_HEIGHT, _LID_REACH = 200.0, 6.0  # m above the water; heights that it is wider


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
    notes = routed_materials.insert(scene, column, indices_in_water=options.indices_in_water)
    above, dry = options.above, options.dry
    raised = options.raised and column.surface == "waves"
    objects = layer_volumes.build(column, phases, extent, raised=raised)
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
