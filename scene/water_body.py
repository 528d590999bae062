"""Puts a body of water with its sun, sky, surface and floor into a scene, and takes it out."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Vector

from ..node_groups import realtime_waves, sea_floor, sky, sun_lamp, water_surface, water_volume
from ..uw_spectral.errors import InputError
from ..uw_spectral.transfer.water_column import WaterColumn
from . import band_colors, pass_values

COLLECTION = "Underwater"
_WORLD = "uw_original_world"
_HIDDEN = "uw_hidden_objects"
IS_SUN = "uw_sun"
_IS_FLOOR = "uw_floor"

# Seen from the water the disc shrinks with refraction by about the index.
SUN_DIAMETER_IN_AIR = math.radians(0.53)
# The volume box stays clear of the interface, or Cycles would nest the two media; the
# gap is water that is not there, so it is kept to this optical depth.
_SURFACE_GAP = 1e-3
_LARGEST_GAP = 0.01
_FAR = 12.0
_LARGEST = 5000.0
_SMALLEST = 50.0


@dataclass(frozen=True)
class WaterExtent:
    """Size of the box of water, in metres.

    ``half_width`` reaches beyond the distance from which light can still
    arrive, ``bottom`` is the depth of the box's lower face.
    """

    half_width: float
    bottom: float


def water_extent(scene: bpy.types.Scene, column: WaterColumn, camera_depth: float) -> WaterExtent:
    """Choose the size of the water from its clearest band and the scene's size."""
    decay = float(column.decay.min())
    reach = float(np.clip(_FAR / max(decay, _FAR / _LARGEST), _SMALLEST, _LARGEST))
    corners = [
        item.matrix_world @ Vector(corner)
        for item in scene.objects
        if item.type not in {"CAMERA", "LIGHT"}
        for corner in item.bound_box
    ]
    radius = max((math.hypot(c.x, c.y) for c in corners), default=0.0)
    lowest = max((-c.z for c in corners), default=0.0)
    if math.isfinite(column.floor_depth):
        bottom = column.floor_depth + 1.0
    else:
        bottom = max(camera_depth, lowest) + reach
    return WaterExtent(radius + reach, bottom)


def add_water(
    scene: bpy.types.Scene,
    column: WaterColumn,
    lobes: tuple[water_volume.ScatteringLobe, ...],
    extent: WaterExtent,
) -> list[str]:
    """Put water into a scene.

    Adds one collection with the water box, the sun, and, where the column
    has them, the surface and the floor; replaces the world by the sky; hides
    the scene's own suns from renders; routes the colours of materials and
    lamps through the bands.

    Parameters
    ----------
    scene : Scene
        The scene; its z = 0 is the mean water surface.
    column : WaterColumn
        The water, the light and the floor.
    lobes : tuple of ScatteringLobe
        The phase function, as Cycles knows it.
    extent : WaterExtent
        Size of the water.

    Returns
    -------
    list of str
        What could not be treated, one line each.

    Raises
    ------
    InputError
        If the scene has water already.
    """
    if has_water(scene):
        raise InputError(f"scene {scene.name!r} has water already; remove it first")
    notes = band_colors.insert(scene)
    collection = bpy.data.collections.new(COLLECTION)
    hidden = {item.name: item for item in _suns(scene)}
    for item in hidden.values():
        item.hide_render = True
    scene.collection.children.link(collection)
    collection[_HIDDEN] = hidden
    if scene.world is not None:
        collection[_WORLD] = scene.world

    gap = min(_LARGEST_GAP, _SURFACE_GAP / max(float(column.attenuation.max()), _SURFACE_GAP))
    top = -gap if column.reflects else 0.0
    water = box("UW Water", extent, top)
    water.data.materials.append(water_volume.build(lobes))
    collection.objects.link(water)
    if math.isfinite(column.floor_depth):
        collection.objects.link(floor_plane(extent, sea_floor.build()))
    if column.reflects:
        surface = plane("UW Surface", 2.0 * extent.half_width, 0.0)
        waves = column.surface == "waves"
        if waves:
            realtime_waves.write_calm()
        material = water_surface.build(column.refractive_index, waves=waves)
        surface.data.materials.append(material)
        collection.objects.link(surface)
    collection.objects.link(_sun(column.refractive_index))
    place(scene, column)
    scene.world = sky.build()
    # Sampling the sky through the interface would ignore refraction; rays find it anyway.
    scene.world.cycles.sampling_method = "NONE" if column.reflects else "AUTOMATIC"
    return notes


def place(scene: bpy.types.Scene, column: WaterColumn) -> None:
    """Turn the sun and move the floor of a scene's water to where a column has them."""
    collection = _collection(scene)
    if collection is not None:
        place_in(collection, column)


def place_in(collection: bpy.types.Collection, column: WaterColumn) -> None:
    """Turn the sun of a collection and move its floor; see :func:`place`."""
    for item in collection.objects:
        if item.get(IS_SUN):
            turn(item, column.sun_direction)
        elif item.get(_IS_FLOOR):
            item.location.z = -column.floor_depth


def turn(lamp: bpy.types.Object, direction: Iterable[float]) -> None:
    """Let a lamp's light travel along a direction."""
    lamp.rotation_mode = "QUATERNION"
    lamp.rotation_quaternion = Vector([float(x) for x in direction]).to_track_quat("-Z", "Y")


def remove_water(scene: bpy.types.Scene) -> None:
    """Take the water out; the scene is as it was before :func:`add_water`."""
    collection = _collection(scene)
    if collection is None:
        return
    for item in collection.get(_HIDDEN, {}).values():
        item.hide_render = False
    own_world = scene.world
    scene.world = collection.get(_WORLD)
    bpy.data.worlds.remove(own_world)
    for item in list(collection.objects):
        delete(item)
    bpy.data.collections.remove(collection)
    realtime_waves.remove_images()
    band_colors.remove()
    for layer in scene.view_layers:
        pass_values.clear(layer)


def delete(item: bpy.types.Object) -> None:
    """Delete a mesh or lamp with its data and materials."""
    data = item.data
    bpy.data.objects.remove(item)
    if isinstance(data, bpy.types.Mesh):
        materials = [m for m in data.materials if m is not None]
        bpy.data.meshes.remove(data)
        for material in materials:
            bpy.data.materials.remove(material)
    else:
        bpy.data.lights.remove(data)


def has_water(scene: bpy.types.Scene) -> bool:
    """Whether :func:`add_water` has put water into the scene."""
    return _collection(scene) is not None


def _collection(scene: bpy.types.Scene) -> bpy.types.Collection | None:
    for collection in scene.collection.children:
        if _HIDDEN in collection:
            return collection
    return None


def _suns(scene: bpy.types.Scene) -> Iterator[bpy.types.Object]:
    for item in scene.objects:
        if item.type == "LIGHT" and item.data.type == "SUN" and not item.hide_render:
            yield item


def _sun(refractive_index: float) -> bpy.types.Object:
    lamp = bpy.data.objects.new(
        sun_lamp.NAME, sun_lamp.build(SUN_DIAMETER_IN_AIR / refractive_index)
    )
    lamp[IS_SUN] = True
    # A refracted ray must not meet the disc: the lamp's shadow rays bring the sun already.
    lamp.visible_transmission = False
    lamp.visible_glossy = False
    return lamp


def box(name: str, extent: WaterExtent, top: float) -> bpy.types.Object:
    """Make the box of water, from its bottom up to the height ``top``."""
    w, bottom = extent.half_width, -extent.bottom
    corners = [(x, y, z) for z in (bottom, top) for x, y in ((-w, -w), (w, -w), (w, w), (-w, w))]
    faces = [(3, 2, 1, 0), (4, 5, 6, 7)]
    faces += [(i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4) for i in range(4)]
    return _mesh_object(name, corners, faces)


def floor_plane(extent: WaterExtent, material: bpy.types.Material) -> bpy.types.Object:
    """Make the floor, which :func:`place_in` moves to its depth; it is wider than the water."""
    # A floor wider than the water closes the view below the horizon.
    floor = plane(material.name, 2.0 * extent.half_width, 0.0)
    floor[_IS_FLOOR] = True
    floor.data.materials.append(material)
    return floor


def has_floor(scene: bpy.types.Scene) -> bool:
    """Whether a scene holds a floor of :func:`floor_plane`."""
    return any(item.get(_IS_FLOOR) for item in scene.objects)


def plane(name: str, half_width: float, height: float) -> bpy.types.Object:
    """Make a horizontal square around the origin, facing up."""
    w = half_width
    corners = [(-w, -w, height), (w, -w, height), (w, w, height), (-w, w, height)]
    return _mesh_object(name, corners, [(0, 1, 2, 3)])


def _mesh_object(
    name: str, corners: list[tuple[float, float, float]], faces: list[tuple[int, ...]]
) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    return bpy.data.objects.new(name, mesh)
