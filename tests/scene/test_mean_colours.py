"""What patterns of nodes are in the mean, against Cycles, which draws them."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene.materials.mean_colours import mean_colour
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

ONE, OTHER, THIRD = (0.6, 0.5, 0.3, 1.0), (0.1, 0.15, 0.2, 1.0), (0.8, 0.1, 0.4, 1.0)


def _new(tree, kind, **inputs):
    node = tree.nodes.new(kind)
    for name, value in inputs.items():
        node.inputs[name.replace("_", " ")].default_value = value
    return node


def checker(tree):
    return _new(tree, "ShaderNodeTexChecker", Scale=7.0, Color1=ONE, Color2=OTHER).outputs["Color"]


def brick(tree):
    sizes = {"Mortar_Size": 0.04, "Brick_Width": 0.6, "Row_Height": 0.3, "Scale": 6.0}
    node = _new(tree, "ShaderNodeTexBrick", Color1=ONE, Color2=OTHER, Mortar=THIRD, **sizes)
    node.inputs["Mortar Smooth"].default_value = 0.0
    node.inputs["Bias"].default_value = 0.3
    return node.outputs["Color"]


def inverted(tree):
    node = _new(tree, "ShaderNodeInvert", Factor=0.7)
    tree.links.new(checker(tree), node.inputs["Color"])
    return node.outputs[0]


def grey(tree):
    node = tree.nodes.new("ShaderNodeRGBToBW")
    tree.links.new(checker(tree), node.inputs[0])
    return node.outputs[0]


def reckoned(tree):
    apart = tree.nodes.new("ShaderNodeSeparateColor")
    tree.links.new(checker(tree), apart.inputs[0])
    scaled = tree.nodes.new("ShaderNodeMath")
    scaled.operation = "MULTIPLY_ADD"
    scaled.inputs[1].default_value, scaled.inputs[2].default_value = 0.5, 0.2
    tree.links.new(apart.outputs[0], scaled.inputs[0])
    held = _new(tree, "ShaderNodeClamp", Min=0.1, Max=0.9)
    tree.links.new(scaled.outputs[0], held.inputs[0])
    joined = _new(tree, "ShaderNodeCombineColor", Green=0.25)
    tree.links.new(held.outputs[0], joined.inputs[0])
    tree.links.new(apart.outputs[2], joined.inputs[2])
    return joined.outputs[0]


@pytest.mark.parametrize("pattern", [checker, brick, inverted, grey, reckoned])
def test_the_mean_of_a_pattern_is_what_cycles_draws(pattern, tmp_path):
    scene = bpy.context.scene
    material = bpy.data.materials.new("pattern")
    tree = material.node_tree
    tree.nodes.clear()
    matt, output = (
        tree.nodes.new(kind) for kind in ("ShaderNodeBsdfDiffuse", "ShaderNodeOutputMaterial")
    )
    tree.links.new(pattern(tree), matt.inputs["Color"])
    tree.links.new(matt.outputs[0], output.inputs[0])
    expected = mean_colour(material)
    glow = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(matt.inputs["Color"].links[0].from_socket, glow.inputs["Color"])
    tree.links.new(glow.outputs[0], output.inputs[0])
    bpy.ops.mesh.primitive_plane_add(size=20.0, rotation=(math.pi / 2, 0.0, 0.0))
    bpy.context.object.data.materials.append(material)
    place = tree.nodes.new("ShaderNodeNewGeometry")
    for node in tree.nodes:
        if node.bl_idname in ("ShaderNodeTexChecker", "ShaderNodeTexBrick"):
            turned = _new(tree, "ShaderNodeVectorRotate", Angle=math.pi / 2)
            turned.rotation_type = "X_AXIS"
            tree.links.new(place.outputs["Position"], turned.inputs["Vector"])
            tree.links.new(turned.outputs[0], node.inputs["Vector"])
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -6.03, 0.0), (math.pi / 2, 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera, scene.render.engine = camera, "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 4, False
    scene.render.resolution_x = scene.render.resolution_y = 200
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(tmp_path / "drawn.exr")
    bpy.ops.render.render(write_still=True)
    drawn = read_exr(tmp_path / "drawn.exr")[0].astype(np.float64).mean(axis=(0, 1))
    assert expected == pytest.approx(drawn[:3], rel=0.03)
