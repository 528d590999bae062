"""Sockets are read as Blender reads them: what it draws dry is the measure."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from underwater_spectral.scene.engines import exr_output
from underwater_spectral.scene.seen.lamp_nodes import nodes_of
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

_PALE = (0.9, 0.6, 0.2)


def _node(tree, kind, *inputs, mute=False, **properties):
    """Add a node; each input is a value, or an output that is linked to it."""
    node = tree.nodes.new(kind)
    for name, value in properties.items():
        setattr(node, name, value)
    shown = [socket for socket in node.inputs if not socket.is_unavailable]
    for socket, given in zip(shown, inputs, strict=False):
        if isinstance(given, bpy.types.NodeSocket):
            tree.links.new(given, socket)
        elif given is not None:
            socket.default_value = given
    node.mute = mute
    return next(o for o in node.outputs if not o.is_unavailable)


def _rgb(tree, colour=_PALE):
    output = _node(tree, "ShaderNodeRGB")
    output.default_value = (*colour, 1.0)
    return output


def _number(tree, value):
    output = _node(tree, "ShaderNodeValue")
    output.default_value = value
    return output


def _glow(tree, strength=1.0, colour=(1.0, 1.0, 1.0)):
    if not isinstance(colour, bpy.types.NodeSocket):
        colour = (*colour, 1.0)
    return _node(tree, "ShaderNodeEmission", colour, strength)


def _mixed(tree, factor, **properties):
    one, other = _glow(tree, 0.3, (0.8, 0.2, 0.1)), _glow(tree, 0.7, (0.2, 0.5, 0.9))
    return _node(tree, "ShaderNodeMixShader", factor, one, other, **properties)


def _group(*outputs, inputs=()):
    """Make a group; each output is what makes a socket of its tree and its group input."""
    group = bpy.data.node_groups.new("group", "ShaderNodeTree")
    for kind, default in inputs:
        socket = group.interface.new_socket("given", in_out="INPUT", socket_type=kind)
        if default is not None:
            socket.default_value = default
    given = group.nodes.new("NodeGroupInput").outputs
    end = group.nodes.new("NodeGroupOutput")
    for place, make in enumerate(outputs):
        made = make(group, given)
        kind = "NodeSocketShader" if made.type == "SHADER" else "NodeSocketColor"
        group.interface.new_socket(f"out {place}", in_out="OUTPUT", socket_type=kind)
        group.links.new(made, end.inputs[place])
    return group


def _in_group(tree, group, *inputs, output=0, mute=False):
    _node(tree, "ShaderNodeGroup", *inputs, node_tree=group, mute=mute)
    return tree.nodes[-1].outputs[output]


def _nested(tree, depth=3):
    group = _group(lambda t, _: _glow(t, 0.2), lambda t, _: _glow(t, 0.6, _PALE))
    for _ in range(depth - 1):
        inner = group
        group = _group(*(lambda t, _, i=i, g=inner: _in_group(t, g, output=i) for i in (0, 1)))
    return _in_group(tree, group, output=1)


def _rerouted(tree):
    output = _mixed(tree, 0.25)
    for _ in range(3):
        node = tree.nodes.new("NodeReroute")
        tree.links.new(output, node.inputs[0])
        output = node.outputs[0]
    return output


def _muted_links(tree):
    output = _glow(tree, _number(tree, 0.9), _rgb(tree))
    for link in list(tree.links):
        if link.to_node == output.node:
            link.is_muted = True
    output.node.inputs[0].default_value = (0.3, 0.6, 0.1, 1.0)
    output.node.inputs[1].default_value = 0.8
    return output


def _vector(tree):
    return _node(tree, "ShaderNodeCombineXYZ", 0.9, 0.3, 0.0)


def _mix(tree, *values, **properties):
    return _node(tree, "ShaderNodeMix", *values, **properties)


_COLOURS = {"data_type": "RGBA"}
_SHADERS = {
    "factor of 3": lambda t: _mixed(t, _number(t, 3.0)),
    "factor of -1.5": lambda t: _mixed(t, _number(t, -1.5)),
    "socket of 3": lambda t: _mixed(t, 3.0),
    "colour as factor": lambda t: _mixed(t, _rgb(t)),
    "vector as factor": lambda t: _mixed(t, _vector(t)),
    "colour as strength": lambda t: _glow(t, _rgb(t)),
    "number as colour": lambda t: _glow(t, 0.8, _number(t, 0.4)),
    "vector as colour": lambda t: _glow(t, 0.8, _vector(t)),
    "muted mix": lambda t: _mixed(t, 0.25, mute=True),
    "muted mix of one": lambda t: _node(
        t, "ShaderNodeMixShader", 0.5, None, _glow(t, 0.7), mute=True
    ),
    "mix of one": lambda t: _node(t, "ShaderNodeMixShader", 0.25, None, _glow(t, 0.8)),
    "muted mathematics": lambda t: _glow(
        t, _node(t, "ShaderNodeMath", 0.2, _number(t, 0.7), operation="ADD", mute=True)
    ),
    "muted constants": lambda t: _glow(
        t, _node(t, "ShaderNodeMath", 0.2, 0.7, operation="ADD", mute=True)
    ),
    "muted links": _muted_links,
    "reroutes": _rerouted,
    "added to itself": lambda t: (
        lambda one: _node(t, "ShaderNodeAddShader", one, one)
    )(_glow(t, 0.3, _PALE)),
    "clamped sum": lambda t: _glow(
        t, _node(t, "ShaderNodeMath", _number(t, 0.8), 0.7, operation="ADD", use_clamp=True)
    ),
    "factor not clamped": lambda t: _glow(
        t, _mix(t, _number(t, 1.5), 0.2, 0.4, clamp_factor=False)
    ),
    "factor clamped": lambda t: _glow(t, _mix(t, _number(t, 1.5), 0.2, 0.4)),
    "result clamped": lambda t: _glow(
        t, 0.5, _mix(t, 1.0, _rgb(t), (0.5, 0.5, 0.5, 1.0), blend_type="ADD", clamp_result=True,
        **_COLOURS)
    ),
    "factor by channel": lambda t: _glow(
        t, _mix(t, _vector(t), (0.2, 0.2, 0.2), (0.8, 0.8, 0.8), data_type="VECTOR",
        factor_mode="NON_UNIFORM")
    ),
    "from what is not there": lambda t: _glow(t, _mix(t, **_COLOURS).node.outputs[0], _PALE),
    "nested groups": _nested,
    "group by its default": lambda t: _in_group(
        t, _group(lambda g, given: _glow(g, given[0]), inputs=[("NodeSocketFloat", 0.7)])
    ),
    "colour into a group's number": lambda t: _in_group(
        t, _group(lambda g, given: _glow(g, given[0]), inputs=[("NodeSocketFloat", 0.7)]), _rgb(t)
    ),
    "shader into a group": lambda t: _in_group(
        t,
        _group(
            lambda g, given: _node(g, "ShaderNodeAddShader", given[0], _glow(g, 0.2)),
            inputs=[("NodeSocketShader", None)],
        ),
        _glow(t, 0.4, _PALE),
    ),
    "muted group": lambda t: _in_group(
        t, _group(lambda g, _: _glow(g, 0.9), inputs=[("NodeSocketShader", None)]),
        _glow(t, 0.4), mute=True,
    ),
    "integer as factor": lambda t: _mixed(t, _node(t, "FunctionNodeInputInt", integer=2)),
    "truth as factor": lambda t: _mixed(t, _node(t, "FunctionNodeInputBool", boolean=True)),
    "bare colour": _rgb,
    "negative colour": lambda t: _glow(t, 0.5, (-0.5, 0.4, 0.2)),
}  # fmt: skip
"""What makes a shader of a tree; no two of them read the same way."""


@pytest.fixture
def wall(empty_blender):
    """A wall before a camera, to be lit by one lamp in Cycles."""
    scene = empty_blender
    scenes.wall("wall", (0.0, 4.0, 0.0), 20.0, 0.8)
    scene.camera = scenes.add_camera((0.0, 0.0, 0.0), (np.pi / 2, 0.0, 0.0))
    scene.camera.data.angle = 0.02
    scene.render.engine, scene.cycles.samples, scene.cycles.max_bounces = "CYCLES", 64, 0
    scene.cycles.use_denoising = False
    scene.render.resolution_x = scene.render.resolution_y = 4
    return scene


def _lamp(scene, make):
    light = bpy.data.lights.new("lamp", "POINT")
    light.energy, light.shadow_soft_size = 500.0, 0.0
    tree = light.node_tree
    if make is not None:
        tree.nodes.remove(tree.nodes["Emission"])
        tree.links.new(make(tree), tree.nodes["Light Output"].inputs[0])
    item = bpy.data.objects.new("lamp", light)
    scene.collection.objects.link(item)
    return item


@pytest.mark.parametrize("space", ["Linear Rec.709", "ACEScg"])
def test_lamps_read_their_nodes_as_cycles_does(wall, tmp_path, space):
    """A colour's luminance is that of the primaries that the file works in."""
    bpy.ops.wm.set_working_color_space(working_space=space, convert_colors=False)

    def drawn():
        bpy.context.view_layer.update()
        exr_output.write_float_exr(wall, tmp_path / "a.exr")
        return read_exr(tmp_path / "a.exr")[0].astype(float).mean(axis=(0, 1))[:3]

    item = _lamp(wall, None)
    plain, wrong = drawn(), {}
    for name, make in _SHADERS.items():
        bpy.data.objects.remove(item)
        item = _lamp(wall, make)
        found, wanted = nodes_of(item.data), drawn() / plain
        if found.unheeded or not np.allclose(found.factor, wanted, rtol=0.02, atol=2e-3):
            wrong[name] = found.factor.round(3), wanted.round(3), found.unheeded
    assert not wrong, wrong
