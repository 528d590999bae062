"""Real-time water for EEVEE: put into a scene, given its values, taken out again.

Values change without rebuilding anything; only another :class:`Shape` (parts of the
phase function, surface, sky, shafts, lamps) builds new nodes.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...node_groups import (
    cloud_grids,
    lamp_images,
    realtime_adjacency,
    realtime_background,
    realtime_clouds,
    realtime_culling,
    realtime_filter,
    realtime_highlights,
    realtime_lamps,
    realtime_occlusion,
    realtime_rays,
    realtime_reflected_view,
    realtime_refracted_view,
    realtime_refraction,
    realtime_surface,
    realtime_tables,
    realtime_values,
    realtime_volume,
    realtime_waves,
    uplift,
)
from ...node_groups.realtime_values import PORT
from ...node_groups.realtime_water import Sources, exciting_layout, layout_of
from ...uw_spectral.errors import InputError
from ...uw_spectral.lamps.grouping import grouped
from ...uw_spectral.lamps.lamp_projection import project_lamps
from ...uw_spectral.lamps.multiple_scattering import LampWater
from .. import contents, marks
from ..materials import (
    above_water_culling,
    bare_surfaces,
    fluorescence,
    realtime_materials,
    wet_trees,
)
from ..materials.inserted import own_input
from ..materials.realtime_materials import Surfaces
from ..readers import clouds
from ..readers.closed_bodies import closed_materials
from ..readers.mirrored_eye import RISES, materials_above
from . import cloud_volumes, giving_back, particles, refraction_displacement, scene_water
from .frame_water import FLOOR, LONGEST_SHAFT, RealtimeWater
from .water_body import WaterExtent, box

VALUES = "uw_values"
_OWNER = "uw_owner"
_TABLE = "uw_table"
_OCCLUSION = "uw_shade"
ADJACENCY = "uw_cover"
_LAMPS, _SOURCES = "uw_lamps", "uw_lamp_sources"
_DISPLACEMENT, MIRRORED, WINDOW = "uw_apparent", "uw_mirrored", "uw_window"
_EXCITING, _CLOUDS, _GRIDS = "uw_exciting", "uw_clouds", "uw_cloud_grids"
_GRID_LAMPS = "uw_cloud_lamps"
_PLAIN, _FILTER, _HIGHLIGHT = "uw_plain", "uw_filter", "uw_highlight "
# Columns of red, green and blue come before those of measured reflectances.
_FIRST_MEASURED = 3
# Finest detail of the sun's shadow in m: Blender's millimetre costs several times as much,
# and the sun's disc blurs a shadow by 7 mm per metre, waves by far more.
_SHADOW, _WAVY_SHADOW = 0.01, 0.03


def add_realtime(scene: bpy.types.Scene, water: RealtimeWater, extent: WaterExtent) -> list[str]:
    """Put real-time water into a scene.

    Replaces the world, hides the scene's own lamps, adds sun, floor and the
    volume of the shafts, and sends every material through the surface group.
    :func:`.scene_water.remove` takes it out.

    Parameters
    ----------
    scene : Scene
        The scene; its z = 0 is the mean water surface.
    water : RealtimeWater
        The water of the current frame.
    extent : WaterExtent
        Size of the water.

    Returns
    -------
    list of str
        What could not be treated, one line each.

    Raises
    ------
    InputError
        If the scene has water already or is linked from another file, or the water has too
        many bands.
    """
    scene_water.prepare(scene)
    plain, bare = bare_surfaces.dress(scene)
    materials, notes = scene_water.own_materials(scene, routed=False)
    notes += bare
    shape = water.shape
    images = (
        None
        if water.waves is None
        else realtime_waves.new_images(raised=shape.raised, foam=shape.foam)
    )
    table = realtime_tables.new_image(layout_of(shape))
    values = realtime_values.build(shape)
    occlusion = None if water.inputs.occlusion is None else realtime_occlusion.new_image()
    buffer = None if water.inputs.buffer is None else realtime_adjacency.new_image()
    shining = water.inputs.lamps.shown
    lit = _lamp_images(water) if shining else None
    rays = realtime_refraction.build(values, images) if shape.above else None
    if shape.port:
        rays = realtime_rays.build_port(values, PORT)
    mirrored = None
    if shape.planar_reflections:
        rays, mirrored = realtime_rays.build_mirrored(), realtime_reflected_view.new_image()
    window = (
        realtime_reflected_view.new_image(realtime_refracted_view.NAME) if shape.window else None
    )
    exciting = realtime_tables.new_image(exciting_layout(shape)) if shape.fluorophores else None
    floating = realtime_clouds.new_image(shape) if shape.clouds else None
    grids = cloud_grids.new_image(len(shape.grids)) if shape.grids else None
    grid_lamps = None
    if shape.grids and shape.lamps > shape.virtual:
        grid_lamps = cloud_grids.new_lamp_image(len(shape.grids), shape.lamps - shape.virtual)
    sources = Sources(
        values, table, occlusion, buffer, lit, images, rays, mirrored, exciting, window,
        floating, grids, grid_lamps,
    )  # fmt: skip
    surface = realtime_surface.build(shape, sources)
    native = (
        realtime_surface.build(shape, sources, keeps=True) if water.has_native_closures else None
    )
    fluorescent = None
    if shape.fluorophores:
        fluorescent = realtime_surface.build(shape, sources, fluoresces=True)
    background = realtime_background.build(shape, sources)
    floor, objects = None, []
    if water.has_floor:
        floor = _floor_material()
        materials.append(floor)
    if shape.shafts:
        objects.append(box("UW Shafts", extent, 0.0))
        objects[0].data.materials.append(realtime_volume.build(shape, sources))
    clear = realtime_filter.build(values, shape)
    measured = floor if FLOOR in water.inputs.reflectances else None
    closed = closed_materials(scene) if shape.translucent or shape.filters else ()
    highlights = {kind: realtime_highlights.build(kind, values, shape) for kind in shape.highlights}
    surfaces = Surfaces(
        surface, clear, native, measured, closed, highlights, fluorescent, shape.fluorescent
    )
    notes += realtime_materials.insert(materials, surfaces)
    above: list[bpy.types.Material] = []
    if mirrored is not None or window is not None or shape.above:
        high = materials_above(scene, RISES)
        above = [material for material in materials if material in high]
        # In the picture of the air nothing is to be seen that is in the water.
        hidden = above if window is None else [m for m in materials if m != floor]
        above_water_culling.insert(hidden, realtime_culling.build(values, shape, images))
    apparent = None
    if shape.above:
        apparent = realtime_refraction.build_refraction_displacement(values, images)
        notes += refraction_displacement.insert(materials, apparent, extent.bottom)
    elif window is not None:
        lifting = realtime_refraction.build_refraction_displacement(values, images, from_air=False)
        notes += refraction_displacement.insert(above, lifting, LONGEST_SHAFT, from_air=False)
    sun = bpy.data.lights.new("UW Sun", "SUN")
    sun.energy = 1.0
    sun.shadow_maximum_resolution = _SHADOW if water.waves is None else _WAVY_SHADOW
    filling = scene_water.Filling(
        realtime_background.build_world(background),
        [sun],
        floor,
        objects,
        images,
        {VALUES: values, marks.SURFACE: surface}
        | {
            name: image
            for name, image in (
                (_TABLE, table),
                (marks.NATIVE, native),
                (_FILTER, clear),
                (_OCCLUSION, occlusion),
                (ADJACENCY, buffer),
                (_LAMPS, lit and lit.numbers),
                (_SOURCES, lit and lit.sources),
                (_DISPLACEMENT, apparent),
                (MIRRORED, mirrored),
                (WINDOW, window),
                (_EXCITING, exciting),
                (_CLOUDS, floating),
                (_GRIDS, grids),
                (_GRID_LAMPS, grid_lamps),
                (marks.FLUORESCENT, fluorescent),
                (_PLAIN, plain),
                *((_HIGHLIGHT + kind, group) for kind, group in highlights.items()),
            )
            if image is not None
        },
        list(zip(realtime_lamps.shadow_lamps([x.light for x in shining]), shining, strict=True)),
        traced=False,  # EEVEE would draw them; the shaders draw the lamps
        floor_occlusions=False,
    )
    notes += water.inputs.cloud_notes
    notes += cloud_volumes.leave_out(scene)
    if shape.grids:
        cleared = (cloud_volumes.clear(item) for item in clouds.grids_of(scene))
        notes += [said for said in cleared if said]
    notes += [*water.inputs.lamps.notes, *scene_water.add(scene, filling, water.column, extent)]
    values[_OWNER] = marks.collection_of(scene)
    set_values(scene, water)
    if water.inputs.above is not None:
        refraction_displacement.subdivide(scene, water.inputs.above.camera)
    elif water.window_from is not None:
        refraction_displacement.subdivide(scene, water.window_from, from_air=False)
    return notes


def is_dry(item: bpy.types.Object) -> bool:
    """Whether an object came, or got a material, after the water of its scene."""
    return bare_surfaces.is_bare(item) or any(
        wet_trees.is_dry(material) for material in contents.materials_of(item)
    )


def take_in(scene: bpy.types.Scene) -> list[str]:
    """Let what has come into a scene since its water get wet; other nodes stay.

    Returns
    -------
    list of str
        What could not be treated, one line each.
    """
    plain, notes = bare_surfaces.dress(scene, marks.part(scene, _PLAIN))
    collection = marks.collection_of(scene)
    if plain is not None and collection is not None:
        collection[_PLAIN] = plain
    materials, _ = scene_water.own_materials(scene, routed=False)
    for material in [m for m in materials if wet_trees.is_dry(m) or wet_trees.is_rewired(m)]:
        if wet_trees.has_remains(material):
            notes += giving_back.dry_but(set(bpy.data.materials) - {material})
        _wet(scene, material)
    return notes


def set_values(scene: bpy.types.Scene, water: RealtimeWater) -> None:
    """Give the water in a scene other values; nothing is rebuilt.

    Raises
    ------
    InputError
        If the scene has no real-time water, or water of another shape.
    """
    values = marks.part(scene, VALUES)
    if values is None:
        raise InputError(f"scene {scene.name!r} has no real-time water; add it first")
    if values[realtime_values.SHAPE] != repr(water.shape):
        raise InputError(
            "this water needs other nodes; remove the real-time water and add it again"
        )
    realtime_values.write(values, water.numbers)
    realtime_tables.write_light(marks.part(scene, _TABLE), water.projected)
    if water.shape.fluorophores:
        realtime_tables.write_light(marks.part(scene, _EXCITING), water.exciting)
    if water.inputs.occlusion is not None:
        realtime_occlusion.write_table(marks.part(scene, _OCCLUSION), water.inputs.occlusion)
    if water.inputs.buffer is not None:
        realtime_adjacency.write_adjacency(marks.part(scene, ADJACENCY), water.adjacency)
    if water.shape.clouds:
        realtime_clouds.write_clouds(marks.part(scene, _CLOUDS), water.clouds)
    if water.shape.grids:
        _set_grids(scene, water)
    if water.around_lamps is not None:
        _set_lamps(scene, water, water.around_lamps)
    if water.waves is not None:
        realtime_waves.write_patterns(marks.images(scene), water.waves)
    particles.bring(scene, water.particles, lambda material: _wet(scene, material))
    known = {m.name: m for m in contents.materials(scene) if m.is_editable}
    known[FLOOR] = marks.part(scene, marks.FLOOR)
    for place, (name, reflectance) in enumerate(water.inputs.reflectances.items()):
        if known.get(name) is not None:
            measured = water.channels.project(reflectance)
            realtime_materials.write_reflectance(known[name], _FIRST_MEASURED + place, measured)
    for name, absorptance in water.inputs.fluorescent.materials.items():
        if known.get(name) is not None:
            realtime_materials.write_fluorescence(known[name], absorptance)
    floor = marks.part(scene, marks.FLOOR)
    if water.inputs.seabed is not None and floor is not None:
        _paint(floor, water.inputs.seabed_colour)
    wet_trees.refresh()
    uplift.set_wet_grains(water.column.refractive_index)
    uplift.set_water_index(water.column.refractive_index if water.indices_in_water else 1.0)
    scene_water.place(scene, water.column, water.inputs.seabed)
    for item in marks.objects(scene):
        if item.get(marks.IS_SUN):
            if water.inputs.above is not None:
                scene_water.centre_floor(scene, water.inputs.above.camera)
                drawn = (water.numbers.single[name] for name in realtime_values.DRAWN_SUN)
                scene_water.turn(item, drawn)
            # At night it would hide the shadows of lamps.
            shines = bool(np.any(water.column.sun_irradiance > 0))
            item.data.energy = shines / water.sun_gain
            item.data.angle = scene_water.SUN_DIAMETER_IN_AIR / water.column.refractive_index
            of_volume = water.sun_gain / water.shafts.scale if water.shafts is not None else 0.0
            item.data.volume_factor = of_volume


def keep_images(scene: bpy.types.Scene) -> None:
    """Pack what :func:`set_values` has drawn: a file that is saved then shows it without us."""
    names = (_TABLE, _OCCLUSION, ADJACENCY, _LAMPS, _EXCITING, _CLOUDS, _GRIDS, _GRID_LAMPS)
    drawn = [marks.part(scene, name) for name in names]
    waves = marks.images(scene)
    for image in (*drawn, waves.caustics, waves.slopes):
        if image is not None and image.is_dirty:
            image.pack()


def _wet(scene: bpy.types.Scene, material: bpy.types.Material) -> None:
    """Send a material of the water's own through the surface group that is there."""
    lit, clear, native = (
        marks.part(scene, name) for name in (marks.SURFACE, _FILTER, marks.NATIVE)
    )
    own = realtime_materials.kinds([material])
    closed = closed_materials(scene) if own.translucent or own.filters else ()
    kinds = realtime_highlights.NUMBERS
    found = {kind: marks.part(scene, _HIGHLIGHT + kind) for kind in kinds}
    highlights = {kind: group for kind, group in found.items() if group is not None}
    surfaces = Surfaces(
        lit, clear, native, closed=closed, highlights=highlights,
        fluorescent=marks.part(scene, marks.FLUORESCENT), fluorescing=fluorescence.of([material]),
    )  # fmt: skip
    realtime_materials.insert([material], surfaces)
    apparent = marks.part(scene, _DISPLACEMENT)
    if apparent is not None:
        refraction_displacement.insert([material], apparent, LONGEST_SHAFT)


def _lamp_images(water: RealtimeWater) -> lamp_images.LampImages:
    shape, lamps = water.shape, water.inputs.lamps
    # What stands for objects has one profile.
    profiles = len(lamps.lamps) + bool(lamps.virtual)
    return lamp_images.new_images(
        shape.lamps,
        profiles,
        len(shape.lamp_components),
        shape.measured,
        len(lamps.virtual),
        from_air=shape.lamps_in_air,
        exciting=shape.fluorophores > 0,
        in_clouds=bool(shape.floating),
    )


def _set_grids(scene: bpy.types.Scene, water: RealtimeWater) -> None:
    grids, of_lamps = water.grids, marks.part(scene, _GRID_LAMPS)
    realtime_clouds.write_grids(marks.part(scene, _GRIDS), grids)
    if of_lamps is not None:
        realtime_clouds.write_lamps(of_lamps, grids)


def _set_lamps(scene: bpy.types.Scene, water: RealtimeWater, around: LampWater) -> None:
    lamps, numbers = water.inputs.lamps.lamps, water.numbers.single
    codes = realtime_lamps.CODES[int(numbers[realtime_lamps.SUNLIT]) :]
    blocked = [index for index, lamp in enumerate(lamps) if not lamp.unblocked]
    groups = grouped([lamps[index].position for index in blocked], len(codes))
    colours = [realtime_lamps.NO_SHADOW] * len(lamps)
    for index, group in zip(blocked, groups, strict=True):
        colours[index] = codes[group]
    shown = colours + [realtime_lamps.NO_SHADOW] * len(water.inputs.lamps.virtual)
    measured = list(water.inputs.reflectances.values())
    projected = project_lamps(
        water.inputs.lamps.all, around, water.channels, measured, water.inputs.lamps.waters,
        water.excitation, clouds=water.cloud_size,
    )  # fmt: skip
    images = lamp_images.LampImages(marks.part(scene, _LAMPS), marks.part(scene, _SOURCES))
    lamp_images.write_lamps(images, projected, shown)
    followers, shown = marks.followers(scene), water.inputs.lamps.shown
    for item, lamp, own, colour in zip(followers, lamps, shown, colours, strict=True):
        scene_water.follow(item, own)
        code = numbers[realtime_lamps.CODE]
        realtime_lamps.write_shadow_lamp(item.data, lamp, colour, code)


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
    values = marks.part(scene, VALUES)
    if values is None or values[realtime_values.SHAPE] != repr(water.shape):
        return False
    has_floor = marks.part(scene, marks.FLOOR) is not None
    own = values.get(_OWNER) == marks.collection_of(scene)
    if not particles.is_there(scene, water.particles):
        return False
    return own and has_floor == water.has_floor


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
