"""Sockets are read as Blender reads them: what it draws dry is the measure."""

from __future__ import annotations

import dataclasses

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups import attributes, realtime_surface
from underwater_spectral.scene import contents
from underwater_spectral.scene.engines import eevee_settings, exr_output
from underwater_spectral.scene.materials import (
    band_colors,
    bare_colours,
    closure_walk,
    inlined_shaders,
    material_kinds,
    native_closures,
    realtime_materials,
    wet_trees,
)
from underwater_spectral.scene.materials.inserted import has_inserted
from underwater_spectral.scene.materials.mean_colours import mean_colour
from underwater_spectral.scene.readers.lamp_nodes import nodes_of
from underwater_spectral.scene.water import frame_water, realtime, water_body
from underwater_spectral.scene.water.frame_water import FrameInputs
from underwater_spectral.tests.scene import columns, scenes
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

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
    "negative colour": lambda t: _glow(
        t, 0.5, _mix(t, 1.0, (0.2, 0.9, 0.7, 1.0), _rgb(t), blend_type="SUBTRACT", **_COLOURS)
    ),
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
        if found.unsupported or not np.allclose(found.factor, wanted, rtol=0.02, atol=2e-3):
            wrong[name] = found.factor.round(3), wanted.round(3), found.unsupported
    assert not wrong, wrong


_ACROSS, _PIXELS = 8, 4


def _principled(tree, *fed, **values):
    """A shader that glows and reflects; what is fed comes by links."""
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    given = {
        "Base Color": (0.5, 0.3, 0.2, 1.0),
        "Specular IOR Level": 0.0,
        "Emission Strength": 0.5,
    }
    for name, value in (given | {k.replace("_", " "): v for k, v in values.items()}).items():
        node.inputs[name].default_value = value
    for name, value in fed:
        tree.links.new(_number(tree, value), node.inputs[name])
    return node.outputs[0]


_TINT = {"Coat_Tint": (0.4, 0.6, 0.5, 1.0), "Coat_IOR": 1.0}
_LIMITED = {"Alpha": (1.5, 1.0, -0.5, 0.0), "Coat Weight": (3.0, 1.0, -1.0, 0.0)}


def _repeated(tree):
    """Three times the same on top."""
    first, last = (tree.nodes.new(f"GeometryNodeRepeat{end}") for end in ("Input", "Output"))
    first.pair_with_output(last)
    for item in list(last.repeat_items):
        last.repeat_items.remove(item)
    last.repeat_items.new("SHADER", "sum")
    last.repeat_items.new("RGBA", "colour")
    first.inputs["Iterations"].default_value = 3
    first.inputs["colour"].default_value = (0.1, 0.2, 0.3, 1.0)
    tree.links.new(first.outputs["colour"], last.inputs["colour"])
    more = _glow(tree, 1.0, first.outputs["colour"])
    both = _node(tree, "ShaderNodeAddShader", first.outputs["sum"], more)
    tree.links.new(both, last.inputs["sum"])
    return last.outputs["sum"]


def _called(tree):
    """A closure zone, evaluated."""
    first, last = (tree.nodes.new(f"NodeClosure{end}") for end in ("Input", "Output"))
    first.pair_with_output(last)
    last.input_items.new("RGBA", "colour")
    last.output_items.new("SHADER", "shader")
    tree.links.new(_glow(tree, 0.5, first.outputs["colour"]), last.inputs["shader"])
    call = tree.nodes.new("NodeEvaluateClosure")
    call.input_items.new("RGBA", "colour")
    call.output_items.new("SHADER", "shader")
    tree.links.new(last.outputs[0], call.inputs[0])
    call.inputs["colour"].default_value = (*_PALE, 1.0)
    return call.outputs["shader"]


def _bundled(tree):
    into, out = tree.nodes.new("NodeCombineBundle"), tree.nodes.new("NodeSeparateBundle")
    into.bundle_items.new("SHADER", "shader")
    out.bundle_items.new("SHADER", "shader")
    tree.links.new(_glow(tree, 0.5, _PALE), into.inputs[0])
    tree.links.new(into.outputs[0], out.inputs[0])
    return out.outputs[0]


def _chosen(tree):
    menu = tree.nodes.new("GeometryNodeMenuSwitch")
    menu.data_type = "SHADER"
    for place, colour in enumerate((_PALE, (0.1, 0.7, 0.4))):
        tree.links.new(_glow(tree, 0.5, colour), menu.inputs[place + 1])
    menu.inputs[0].default_value = menu.enum_items[1].name
    return menu.outputs[0]


_ZONES = {"repeat": _repeated, "closure": _called, "bundle": _bundled, "menu": _chosen}


def _tiles(scene, made):
    """Put tiles with materials side by side, before a camera that looks straight down at them."""
    rows = -(-len(made) // _ACROSS)
    for place, make in enumerate(made):
        row, column = divmod(place, _ACROSS)
        material, tree, output = scenes._material("tile")
        tree.links.new(make(tree), output.inputs["Surface"])
        where = column - _ACROSS / 2 + 0.5, rows / 2 - 0.5 - row, 0.0
        bpy.ops.mesh.primitive_plane_add(size=1.0, location=where)
        bpy.context.object.data.materials.append(material)
    scene.camera = scenes.add_camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0))
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", max(_ACROSS, rows)
    render = scene.render
    render.resolution_x, render.resolution_y = _ACROSS * _PIXELS, rows * _PIXELS
    render.filter_size, scene.eevee.taa_render_samples = 0.0, 4
    render.engine, scene.cycles.samples = "BLENDER_EEVEE", 64
    return [item.data.materials[0] for item in scene.objects if item.type == "MESH"]


def _seen(scene, path):
    """Colours of the tiles, (n, 3)."""
    exr_output.write_float_exr(scene, path)
    picture = read_exr(path)[0].astype(float)
    cells = picture.reshape(-1, _PIXELS, _ACROSS, _PIXELS, picture.shape[-1])[:, 1:-1, :, 1:-1, :3]
    return cells.mean(axis=(1, 3)).reshape(-1, 3)


def _shown(name):
    """A stand-in for the water: what it is told of a shader, and nothing else."""
    group = bpy.data.node_groups.new("told", "ShaderNodeTree")
    for each in (realtime_surface.LIT, realtime_surface.COLOR, realtime_surface.EMITTED):
        group.interface.new_socket(each, in_out="INPUT", socket_type="NodeSocketColor")
    coverage = realtime_surface.COVERAGE
    covered = group.interface.new_socket(coverage, in_out="INPUT", socket_type="NodeSocketFloat")
    covered.default_value = 1.0
    group.interface.new_socket("Normal", in_out="INPUT", socket_type="NodeSocketVector")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    told = group.nodes.new("NodeGroupInput").outputs[name]
    end = group.nodes.new("NodeGroupOutput")
    group.links.new(_glow(group, 1.0, told), end.inputs[0])
    return closure_walk.Surfaces(group)


@pytest.mark.slow
def test_real_time_is_told_of_materials_what_eevee_draws(empty_blender, tmp_path):
    limits = [
        (lambda t, n=name, v=value: _principled(t, (n, v), **_TINT))
        for name, values in _LIMITED.items() for value in values
    ]  # fmt: skip
    negative = lambda t: _node(  # noqa: E731
        t, "ShaderNodeAddShader", _principled(t, Emission_Strength=-0.2), _glow(t, 0.6)
    )
    negative_light = lambda t: _node(  # noqa: E731
        t, "ShaderNodeAddShader", _glow(t, -0.2), _glow(t, 0.6)
    )
    made = [*_SHADERS.values(), *_ZONES.values(), negative, negative_light, *limits]
    materials = _tiles(empty_blender, made)
    wanted = _seen(empty_blender, tmp_path / "a.exr")[: len(made)]
    realtime_materials.insert(materials, _shown(realtime_surface.EMITTED))
    found = _seen(empty_blender, tmp_path / "a.exr")[: len(made)]
    names = [*_SHADERS, *_ZONES, "negative", "negative light"] + [f"limit {i}" for i in range(99)]
    wrong = {
        name: (a.round(3), b.round(3))
        for name, a, b in zip(names, found, wanted, strict=False)
        if not np.allclose(a, b, rtol=0.02, atol=2e-3)
    }
    assert not wrong, wrong
    wet_trees.remove(())
    inlined_shaders.remove([])
    assert _seen(empty_blender, tmp_path / "a.exr")[: len(made)] == pytest.approx(wanted, abs=1e-3)


def test_cycles_draws_what_zones_hand_on(empty_blender, tmp_path):
    """Where bands are the channels, the groups of the water change nothing."""
    scene, made = empty_blender, [*_SHADERS.values(), *_ZONES.values()]
    materials = _tiles(scene, made)
    scene.render.engine = "CYCLES"
    wanted = _seen(scene, tmp_path / "a.exr")[: len(made)]
    layer = scene.view_layers[0]
    for basis in (attributes.REFLECTANCE_BASIS, attributes.EMISSION_BASIS):
        for name, weights in zip(basis, np.eye(3).tolist(), strict=True):
            layer[name] = weights
    bare_colours.insert(materials)
    assert band_colors.insert(materials) == []
    found = _seen(scene, tmp_path / "a.exr")[: len(made)]
    assert found == pytest.approx(wanted, rel=0.03, abs=0.01)
    zones = [n for m in materials for n in m.node_tree.nodes if n.bl_idname.startswith("Geometry")]
    assert zones
    assert not [n for n in zones for i in n.inputs if has_inserted(i)]
    band_colors.remove([])
    bare_colours.remove([])
    assert _seen(scene, tmp_path / "a.exr")[: len(made)] == pytest.approx(wanted, rel=1e-5)


_MANY = {"red": (0.6, 0.1, 0.1), "green": (0.1, 0.5, 0.1)}


@pytest.mark.slow
def test_each_shader_of_a_group_is_read(empty_blender, tmp_path):
    group = _group(
        *(
            lambda g, given, c=c: _node(
                g, "ShaderNodeAddShader", _node(g, "ShaderNodeBsdfDiffuse", (*c, 1.0)),
                _glow(g, given[0], c),
            )
            for c in _MANY.values()
        ),
        inputs=[("NodeSocketFloat", 0.5)],
    )  # fmt: skip
    made = [
        lambda t, o=o, s=s: _in_group(t, group, s, output=o) for o in (1, 0) for s in (0.2, 1.0)
    ]
    materials = _tiles(empty_blender, made)
    realtime_materials.insert(materials, _shown(realtime_surface.EMITTED))
    green, red = np.array(_MANY["green"]), np.array(_MANY["red"])
    wanted = [green * 0.2, green, red * 0.2, red]
    found = _seen(empty_blender, tmp_path / "a.exr")[:4]
    assert found == pytest.approx(np.array(wanted), rel=0.02, abs=2e-3)
    wet_trees.remove(())
    assert [o.name for o in materials[0].node_tree.nodes[-1].outputs] == ["out 0", "out 1"]


def _diffuse(tree, colour=_PALE):
    return _node(tree, "ShaderNodeBsdfDiffuse", (*colour, 1.0))


def _told_of_light(tree, strength=1.0):
    return _glow(tree, strength, _node(tree, "ShaderNodeShaderToRGB", _diffuse(tree)))


def test_materials_that_share_a_group_of_shaders_are_lit_one_way(empty_blender):
    group = bpy.data.node_groups.new("water", "ShaderNodeTree")
    surfaces = closure_walk.Surfaces(group, native=group)
    for own, expected in ((False, 0), (True, 1)):
        shared = [_group(lambda g, _: _diffuse(g)) for _ in range(2)]
        made = (
            lambda t, g=shared[0]: _in_group(t, g),
            lambda t, g=shared[own]: _node(
                t, "ShaderNodeAddShader", _in_group(t, g), _node(t, "ShaderNodeBsdfGlass")
            ),
        )
        materials = _tiles(empty_blender, made)[-2:]
        assert len(native_closures.native_materials(materials, surfaces)) == expected


@pytest.mark.slow
def test_opaque_objects_are_as_bright_however_they_are_expressed(empty_blender, tmp_path):
    """In water; a group that a clear material shares is lit first, for both."""
    scene, shared = empty_blender, _group(lambda g, _: _diffuse(g))
    made = {
        "plain": _diffuse,
        "of a shared group": lambda t: _in_group(t, shared),
        "beside glass": lambda t: _node(
            t, "ShaderNodeMixShader", 0.0, _in_group(t, shared), _node(t, "ShaderNodeBsdfGlass")
        ),
        "told of its light": _told_of_light,
        "told of half": lambda t: _told_of_light(t, 0.5),
        "half": lambda t: _diffuse(t, [0.5 * part for part in _PALE]),
    }
    materials = _tiles(scene, list(made.values()))
    for item in scene.objects:
        item.location.z -= 8.0
    bpy.context.view_layer.update()
    column = columns.grey_column(0.05, 0.02)
    inputs = FrameInputs(kinds=material_kinds.kinds(materials))
    phase = parse_phase("hg:0.5").for_bands(np.ones(3))
    water = frame_water.realtime_water(column, phase, 3.0, np.eye(3), inputs=inputs)
    realtime.add_realtime(scene, water, water_body.WaterExtent(100.0, 100.0))
    with eevee_settings.realtime_settings(scene, scene.camera, samples=4, water=water):
        found = dict(zip(made, _seen(scene, tmp_path / "a.exr"), strict=False))
    assert found["plain"].min() > 0.01
    for name in ("of a shared group", "beside glass", "told of its light"):
        assert found[name] == pytest.approx(found["plain"], rel=0.02), name
    assert found["told of half"] == pytest.approx(found["half"], rel=0.02)


@pytest.mark.slow
def test_what_gets_no_shader_is_black_in_the_water_and_stays_so(empty_blender, tmp_path):
    """Dry, EEVEE draws it black; without a shader there is nothing to put water before."""
    scene = empty_blender
    materials = _tiles(scene, [_diffuse, _diffuse, _diffuse])
    trees = [material.node_tree for material in materials]
    trees[1].nodes.remove(trees[1].nodes["Diffuse BSDF"])
    trees[2].nodes.clear()
    names = [[node.name for node in tree.nodes] for tree in trees]
    assert _seen(scene, tmp_path / "a.exr")[1:3] == pytest.approx(0.0)
    surfaces = _shown(realtime_surface.COLOR)
    emission = next(n for n in surfaces.lit.nodes if n.bl_idname == "ShaderNodeEmission")
    veil = _node(surfaces.lit, "ShaderNodeAddShader", emission.outputs[0], _glow(surfaces.lit, 0.1))
    end = next(n for n in surfaces.lit.nodes if n.bl_idname == "NodeGroupOutput")
    surfaces.lit.links.new(veil, end.inputs[0])
    realtime_materials.insert(materials, surfaces)
    assert _seen(scene, tmp_path / "a.exr")[1:3] == pytest.approx(0.1, rel=0.01)
    wet_trees.remove(())
    bare_colours.remove([])
    assert [[node.name for node in tree.nodes] for tree in trees] == names


def _changed_in_a_group(tree):
    def lit(group, _):
        told = _node(group, "ShaderNodeShaderToRGB", _diffuse(group))
        return _node(group, "ShaderNodeGamma", told, 1.0)

    return _glow(tree, 1.0, _in_group(tree, _group(lit)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("make", "said"), [(_told_of_light, False), (_changed_in_a_group, True)], ids=["plain", "group"]
)
def test_light_that_is_told_is_no_glow(empty_blender, tmp_path, make, said):
    materials = _tiles(empty_blender, [make])
    notes = realtime_materials.insert(materials, _shown(realtime_surface.EMITTED))
    assert any("Shader to RGB" in note for note in notes) == said
    assert _seen(empty_blender, tmp_path / "a.exr")[0] == pytest.approx(0.0)


def test_a_group_is_read_for_closed_bodies_and_for_sheets(empty_blender):
    """Light comes into a body through one wall and out through another."""
    group = _group(lambda g, _: _node(g, "ShaderNodeBsdfTranslucent", (*_PALE, 1.0)))
    materials = _tiles(empty_blender, [lambda t: _in_group(t, group)] * 2)
    surfaces = dataclasses.replace(_shown(realtime_surface.COLOR), closed=materials[:1])
    realtime_materials.insert(materials, surfaces)
    links = ([k.from_socket.name for k in m.node_tree.links] for m in materials)
    read = [{name for name in names if "UW Behind" in name} for names in links]
    assert all(read)
    assert not read[0] & read[1]


@pytest.mark.parametrize(("colour", "covers"), [(2.0, 0.0), (0.25, 0.75), (-1.0, 1.0)])
def test_nothing_covers_less_than_nothing(empty_blender, colour, covers):
    """EEVEE lets through 1 of a white of 2."""
    given = lambda t: _node(t, "ShaderNodeMath", colour, 0.0, operation="ADD")  # noqa: E731
    made = _tiles(empty_blender, [lambda t: _node(t, "ShaderNodeBsdfTransparent", given(t))])
    realtime_materials.insert(made, _shown(realtime_surface.COVERAGE))
    # Blender works out what is constant.
    inlined = made[0].inline_shader_nodes()
    told = next(n for n in inlined.node_tree.nodes if n.bl_idname == "ShaderNodeEmission")
    assert told.inputs["Color"].default_value[0] == pytest.approx(covers)


def test_mean_colours_are_those_of_the_output_that_is_drawn(empty_blender):
    (material,) = _tiles(empty_blender, [_diffuse])
    tree, other = material.node_tree, (0.1, 0.2, 0.7)
    tree.get_output_node("ALL").target = "EEVEE"
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.target = "CYCLES"
    tree.links.new(_diffuse(tree, other), output.inputs["Surface"])
    for engine, colour in (("EEVEE", _PALE), ("CYCLES", other)):
        with contents.drawn_by(empty_blender, engine):
            assert mean_colour(material) == pytest.approx(colour)
    assert mean_colour(material) == pytest.approx(_PALE)
    assert not tree.keys()
