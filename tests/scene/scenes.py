"""Small scenes with many kinds of materials, for the tests."""

from __future__ import annotations

import math

import bpy


def _cube(name: str, location: tuple[float, float, float]) -> bpy.types.Object:
    mesh = bpy.data.meshes.new(name)
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh.from_pydata(corners, [], faces)
    item = bpy.data.objects.new(name, mesh)
    item.location = location
    bpy.context.scene.collection.objects.link(item)
    return item


def wall(
    name: str, place: tuple[float, float, float], size: float, colour: float = 0.8
) -> bpy.types.Object:
    """Add a matt square across the y axis."""
    bpy.ops.mesh.primitive_plane_add(size=size, location=place, rotation=(math.pi / 2, 0.0, 0.0))
    item = bpy.context.object
    material, tree, output = _material(name)
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (colour, colour, colour, 1.0)
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    item.data.materials.append(material)
    item.name = name
    return item


def _material(name: str) -> tuple[bpy.types.Material, bpy.types.NodeTree, bpy.types.Node]:
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.clear()
    return material, tree, tree.nodes.new("ShaderNodeOutputMaterial")


def principled(name: str, color=(0.8, 0.2, 0.1, 1.0)) -> bpy.types.Material:
    material, tree, output = _material(name)
    shader = tree.nodes.new("ShaderNodeBsdfPrincipled")
    shader.inputs["Base Color"].default_value = color
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def textured() -> bpy.types.Material:
    material = principled("textured")
    tree = material.node_tree
    image = bpy.data.images.new("checker", 8, 8)
    image.generated_type = "COLOR_GRID"
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    tree.links.new(texture.outputs["Color"], tree.nodes["Principled BSDF"].inputs["Base Color"])
    return material


def glow(strength: float) -> bpy.types.Material:
    """A material that emits and reflects nothing."""
    material, tree, output = _material("glow")
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Strength"].default_value = strength
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    return material


def muted_link() -> bpy.types.Material:
    material = textured()
    material.name = "muted"
    material.node_tree.links[-1].is_muted = True
    return material


def mixed() -> bpy.types.Material:
    material, tree, output = _material("mixed")
    glossy = tree.nodes.new("ShaderNodeBsdfAnisotropic")
    glossy.inputs["Color"].default_value = (0.9, 0.6, 0.2, 1.0)
    transparent = tree.nodes.new("ShaderNodeBsdfTransparent")
    transparent.inputs["Color"].default_value = (0.5, 0.9, 0.9, 1.0)
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(glossy.outputs[0], mix.inputs[1])
    tree.links.new(transparent.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return material


def emissive() -> bpy.types.Material:
    material = principled("emissive")
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Emission Color"].default_value = (1.0, 0.5, 0.1, 1.0)
    shader.inputs["Emission Strength"].default_value = 3.0
    shader.inputs["Subsurface Weight"].default_value = 0.3
    return material


def grouped() -> bpy.types.Material:
    group = bpy.data.node_groups.new("paint", "ShaderNodeTree")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    diffuse = group.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (0.1, 0.3, 0.7, 1.0)
    group.links.new(diffuse.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    material, tree, output = _material("grouped")
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def animated() -> bpy.types.Material:
    material = principled("animated")
    socket = material.node_tree.nodes["Principled BSDF"].inputs["Base Color"]
    for frame, red in ((1, 0.1), (20, 0.9)):
        socket.default_value[0] = red
        socket.keyframe_insert("default_value", frame=frame)
    driven = principled("driven")
    curve = (
        driven.node_tree.nodes["Principled BSDF"]
        .inputs["Base Color"]
        .driver_add("default_value", 1)
    )
    curve.driver.expression = "0.25"
    return material


def measured() -> bpy.types.Material:
    material = textured()
    material.name = "measured"
    material["uw_reflectance_wavelengths_nm"] = [380.0, 550.0, 780.0]
    material["uw_reflectance"] = [0.1, 0.6, 0.3]
    return material


def varied_scene() -> bpy.types.Scene:
    """Fill the empty scene with objects of every material, lamps, a sun, a world."""
    scene = bpy.context.scene
    makers = (textured, muted_link, mixed, emissive, grouped, animated, measured)
    for index, maker in enumerate(makers):
        item = _cube(maker.__name__, (3.0 * index - 9.0, 12.0, -6.0))
        item.data.materials.append(maker())
    metal = principled("metal", (0.9, 0.7, 0.3, 1.0))
    metal.node_tree.nodes["Principled BSDF"].inputs["Metallic"].default_value = 1.0
    both = _cube("two slots", (0.0, 8.0, -7.0))
    both.data.materials.append(metal)
    both.data.materials.append(bpy.data.materials["driven"])
    _cube("no material", (4.0, 8.0, -7.0))
    for kind in ("SUN", "POINT", "AREA"):
        lamp = bpy.data.lights.new(f"{kind} lamp", kind)
        lamp.color = (1.0, 0.8, 0.5)
        scene.collection.objects.link(bpy.data.objects.new(lamp.name, lamp))
    scene.world = bpy.data.worlds.new("own world")
    add_camera()
    bpy.context.view_layer.update()  # what drivers and animations say, before it is compared
    return scene


def add_camera(
    location: tuple[float, float, float] = (0.0, 0.0, -5.0),
    rotation: tuple[float, float, float] = (1.4, 0.0, 0.0),
) -> bpy.types.Object:
    """Add a camera, make it the active one."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = location
    camera.rotation_euler = rotation
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    return camera
