"""A scene of Blender's own assets: hair, scattered pebbles, an array, smooth by angle."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
from underwater_spectral.tests.scene import scenes


def essentials_scene() -> bpy.types.Scene:
    """Sand with scattered pebbles, a furry ball, a row of posts and a rock, 6 m deep."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    sand = scenes.principled("sand", (0.55, 0.45, 0.3, 1.0))
    stone = scenes.principled("stone", (0.12, 0.1, 0.1, 1.0))
    fur = scenes.principled("fur", (0.8, 0.25, 0.05, 1.0))
    paint = scenes.principled("paint", (0.7, 0.7, 0.65, 1.0))

    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=0.12, location=(0.0, 0.0, 5.0))
    pebble = _named("pebble", stone)
    pebble.hide_render = True
    bpy.ops.mesh.primitive_grid_add(
        x_subdivisions=8, y_subdivisions=8, size=16.0, location=(0.0, 2.0, -6.0)
    )
    ground = _named("ground", sand)
    scatter = _asset(ground, "geometry_nodes_essentials", "Scatter on Surface")
    _set(scatter, "Socket_8", pebble)
    _set(scatter, "Socket_27", 1.5)

    bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=12, location=(-1.3, 0.0, -5.0))
    ball = _named("ball", fur)
    hair = bpy.data.objects.new("hair", bpy.data.hair_curves.new("hair"))
    scene.collection.objects.link(hair)
    hair.parent, hair.data.surface, hair.data.surface_uv_map = ball, ball, "UVMap"
    hair.matrix_world = ball.matrix_world
    hair.data.materials.append(fur)
    grown = _asset(hair, "procedural_hair_node_assets", "Generate Hair Curves")
    for name, value in {
        "Input_2": ball, "Input_20": 0.35, "Input_22": fur, "Input_27": 6, "Input_15": 120.0,
    }.items():  # fmt: skip
        _set(grown, name, value)
    _set(_asset(hair, "procedural_hair_node_assets", "Set Hair Curve Profile"), "Input_3", 0.012)

    bpy.ops.mesh.primitive_cube_add(size=0.5, location=(0.7, 0.8, -5.75))
    post = _named("post", paint)
    row = _asset(post, "geometry_nodes_essentials", "Array")
    _set(row, "Socket_5", 4)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=0.6, location=(1.4, -1.0, -5.6))
    _asset(_named("rock", stone), "geometry_nodes_essentials", "Smooth by Angle")

    camera = scenes.add_camera((0.0, -5.0, -4.4), (math.radians(80.0), 0.0, 0.0))
    camera.data.angle = math.radians(55.0)
    scene.render.resolution_x, scene.render.resolution_y = 96, 54
    return scene


def _named(name: str, material: bpy.types.Material) -> bpy.types.Object:
    item = bpy.context.object
    item.name = name
    item.data.materials.append(material)
    return item


def _asset(item: bpy.types.Object, file: str, name: str) -> bpy.types.NodesModifier:
    """Give an object a node group of Blender's, linked and packed as the asset browser does."""
    folder = Path(bpy.utils.system_resource("DATAFILES"), "assets", "nodes")
    path = str(folder / f"{file}.blend")
    with bpy.data.libraries.load(path, link=True, pack=True) as (_, wanted):
        wanted.node_groups = [name]
    modifier = item.modifiers.new(name, "NODES")
    modifier.node_group = wanted.node_groups[0]
    return modifier


def _set(modifier: bpy.types.NodesModifier, identifier: str, value: object) -> None:
    getattr(modifier.properties.inputs, identifier).value = value
