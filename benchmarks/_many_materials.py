"""A scene of fifty different materials on a seabed; one of them has ten images."""

from __future__ import annotations

import math

import bpy
import numpy as np

from ._scenery import camera_at

COUNT = 50
_COLUMNS = 10
_IMAGES = 10  # of the material that has many, in a row with what the water looks up
_SIZE = 128
_FLOOR = -7.0
_KINDS = ("ShaderNodeTexNoise", "ShaderNodeTexVoronoi", "ShaderNodeTexWave", "ShaderNodeTexMagic")


def build() -> None:
    """Build it in an empty file, always the same."""
    bpy.ops.mesh.primitive_plane_add(size=80.0, location=(0.0, 0.0, _FLOOR))
    bpy.context.object.data.materials.append(_material(0))
    for index in range(1, COUNT):
        row, column = divmod(index - 1, _COLUMNS)
        place = (1.1 * (column - (_COLUMNS - 1) / 2), 1.3 * row, _FLOOR + 0.5)
        if index % 3 == 2:
            bpy.ops.mesh.primitive_cube_add(size=0.8, location=place, rotation=(0.0, 0.0, index))
        elif index % 3 == 1:
            bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, location=place)
            bpy.ops.object.shade_smooth()
        else:
            bpy.ops.mesh.primitive_torus_add(
                major_radius=0.36, minor_radius=0.14, location=place, rotation=(1.2, 0.0, index)
            )
            bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(_material(index))
    camera = camera_at((0.0, -5.5, -3.8), (math.radians(68.0), 0.0, 0.0), 1.0)
    camera.data.lens = 24.0


def _material(index: int) -> bpy.types.Material:
    """Return a material whose nodes differ from those of the others."""
    material = bpy.data.materials.new(f"Material {index}")
    tree = material.node_tree
    shader = tree.nodes["Principled BSDF"]
    random = np.random.default_rng(index)
    shader.inputs["Roughness"].default_value = float(random.uniform(0.15, 0.95))
    if index % 7 == 3:
        shader.inputs["Metallic"].default_value = 1.0
    if index % 11 == 5:
        shader.inputs["Coat Weight"].default_value = 0.6
    count = _IMAGES if index == 1 else index % 4
    colours = [_image(tree, 100 * index + number) for number in range(count)]
    # Three kinds in an order of their own, so that no two shaders are one.
    for number in range(3):
        kind = _KINDS[index // len(_KINDS) ** number % len(_KINDS)]
        texture = tree.nodes.new(kind)
        texture.inputs["Scale"].default_value = float(random.uniform(1.0, 6.0))
        colours.append(_tinted(tree, texture.outputs["Color"], random.uniform(0.2, 0.9, 3)))
    mixed = colours[0]
    for number, colour in enumerate(colours[1:], 2):
        node = tree.nodes.new("ShaderNodeMix")
        node.data_type = "RGBA"
        node.inputs["Factor"].default_value = 1.0 / number
        sockets = [socket for socket in node.inputs if socket.type == "RGBA"]
        tree.links.new(mixed, sockets[0])
        tree.links.new(colour, sockets[1])
        mixed = next(socket for socket in node.outputs if socket.type == "RGBA")
    tree.links.new(mixed, shader.inputs["Base Color"])
    return material


def _tinted(
    tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket, tint: np.ndarray
) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = "MULTIPLY"
    node.inputs[1].default_value = tint.tolist()
    tree.links.new(socket, node.inputs[0])
    return node.outputs[0]


def _image(tree: bpy.types.NodeTree, seed: int) -> bpy.types.NodeSocket:
    """Return the colour of a texture of smooth spots, packed into the file."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[0:_SIZE, 0:_SIZE] * (2.0 * np.pi / _SIZE)
    waves = [
        np.sin(a * x + b * y + phase)
        for a, b, phase in zip(*random.integers(1, 6, (2, 5)), random.uniform(0, 6, 5), strict=True)
    ]
    level = 0.5 + 0.5 * np.tanh(sum(waves))
    low, high = random.uniform(0.05, 0.4, 3), random.uniform(0.3, 0.9, 3)
    pixels = np.ones((_SIZE, _SIZE, 4), np.float32)
    pixels[..., :3] = low + level[..., None] * (high - low)
    image = bpy.data.images.new(f"Spots {seed}", _SIZE, _SIZE)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    return node.outputs["Color"]
