"""Worlds of the tests: pictures of known skies, and Blender's own sky texture."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from underwater_spectral.tests.uw_spectral.transfer.sky_pictures import KnownSky
from underwater_spectral.uw_spectral.spectra.spectral_image import write_rgb_exr


def world(scene: bpy.types.Scene, kind: str = "") -> bpy.types.Node | None:
    """Give a scene a world whose background has a texture, without a kind none; return that."""
    scene.world = bpy.data.worlds.new("Sky")
    tree = scene.world.node_tree
    tree.nodes.clear()
    output, shown = (tree.nodes.new(f"ShaderNode{x}") for x in ("OutputWorld", "Background"))
    tree.links.new(shown.outputs[0], output.inputs["Surface"])
    if not kind:
        return None
    texture = tree.nodes.new(kind)
    tree.links.new(texture.outputs["Color"], shown.inputs["Color"])
    return texture


def with_picture(scene: bpy.types.Scene, sky: KnownSky, path: Path) -> bpy.types.Node:
    """Give a scene a picture of a sky as its world; return the node of its mapping."""
    write_rgb_exr(path, sky.picture(512).astype(np.float32))
    texture = world(scene, "ShaderNodeTexEnvironment")
    texture.image = bpy.data.images.load(str(path))
    tree = scene.world.node_tree
    mapping, place = (tree.nodes.new(f"ShaderNode{x}") for x in ("Mapping", "TexCoord"))
    tree.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    return mapping


def strength(scene: bpy.types.Scene) -> bpy.types.NodeSocket:
    """How bright the world of a scene is."""
    return scene.world.node_tree.nodes["Background"].inputs["Strength"]
