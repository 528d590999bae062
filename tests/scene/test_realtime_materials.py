"""Materials in water that is clear as air look as EEVEE itself draws them."""

from __future__ import annotations

import dataclasses
import math

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups import realtime_lamps
from underwater_spectral.node_groups.lamp_term import LampShape
from underwater_spectral.scene import temporary
from underwater_spectral.scene.engines import eevee_settings, exr_output
from underwater_spectral.scene.materials import (
    band_colors,
    closure_walk,
    material_kinds,
    realtime_materials,
    shader_nodes,
    wet_trees,
)
from underwater_spectral.scene.water import frame_water, realtime, scene_water, water_body
from underwater_spectral.scene.water.frame_water import FrameInputs
from underwater_spectral.tests.scene import columns, scenes, snapshot
from underwater_spectral.uw_spectral.spectra.reflectance import emission_basis, uplift_basis
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

_SIZE = (96, 24)
_STEP = 2.4


def _hair() -> bpy.types.Object:
    curves = bpy.data.hair_curves.new("hair")
    curves.add_curves([2] * 60)
    ends = np.random.default_rng(1).uniform(-0.9, 0.9, size=(60, 2))
    points = np.stack([(x, y, z) for x, y in ends for z in (-1.0, 1.0)])
    curves.position_data.foreach_set("vector", np.ravel(points).astype(np.float32))
    radius = curves.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.full(120, 0.05, np.float32))
    curves.materials.append(scenes.principled("hair", (0.5, 0.3, 0.1, 1.0)))
    return bpy.data.objects.new("hair", curves)


def _see_through() -> bpy.types.Material:
    material = scenes.principled("see-through", (0.2, 0.7, 0.4, 1.0))
    material.node_tree.nodes["Principled BSDF"].inputs["Alpha"].default_value = 0.4
    return material


def _metal() -> bpy.types.Material:
    material = scenes.principled("metal", (0.9, 0.7, 0.3, 1.0))
    material.node_tree.nodes["Principled BSDF"].inputs["Metallic"].default_value = 1.0
    return material


def _row() -> list[bpy.types.Object]:
    """Objects of many kinds side by side, and a wall behind them."""
    scene = bpy.context.scene
    makers = (
        scenes.textured,
        scenes.mixed,
        scenes.grouped,
        scenes.measured,
        _see_through,
        _metal,
        scenes.emissive,
    )
    row = []
    for index, maker in enumerate(makers):
        row.append(scenes._cube(f"kind {index}", (_STEP * index, 0.0, -8.0)))
        row[-1].data.materials.append(maker())
    row[3].data.materials[0].pop("uw_reflectance")
    slots = scenes._cube("two slots", (0.0, 0.0, -8.0))
    for name, colour in (("red", (0.7, 0.1, 0.1, 1.0)), ("blue", (0.1, 0.2, 0.7, 1.0))):
        slots.data.materials.append(scenes.principled(name, colour))
    slots.data.polygons.foreach_set("material_index", [0, 1, 0, 1, 0, 1])
    row += [slots, _hair(), bpy.data.objects.new("instance", None)]
    instance = row[-1]
    collection = bpy.data.collections.new("instanced")
    instance.instance_type, instance.instance_collection = "COLLECTION", collection
    original = scenes._cube("original", (0.0, 0.0, 0.0))
    original.data.materials.append(scenes.principled("instanced", (0.6, 0.6, 0.1, 1.0)))
    collection.objects.link(original)
    scene.collection.objects.unlink(original)
    for item in row[-2:]:
        scene.collection.objects.link(item)
    for index, item in enumerate(row):
        item.location = (_STEP * index, 0.0, -8.0)
        item.rotation_euler = (0.3, 0.2, 0.5)
    wall = scenes._cube("wall", (_STEP * (len(row) - 1) / 2, 4.0, -8.0))
    wall.scale = (_STEP * len(row), 0.1, 6.0)
    wall.data.materials.append(scenes.principled("wall", (0.5, 0.5, 0.5, 1.0)))
    return row


def _camera(middle: float, width: float) -> bpy.types.Object:
    camera = scenes.add_camera((middle, -20.0, -8.0), (math.pi / 2, 0.0, 0.0))
    camera.data.type, camera.data.ortho_scale = "ORTHO", width
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = _SIZE
    render.filter_size = 0.0
    return camera


def _picture(camera, path):
    scene = bpy.context.scene
    wanted = eevee_settings.wanted_settings(scene, camera, 1, None)
    with temporary.render_settings(scene, wanted):
        exr_output.write_float_exr(scene, path)
    return read_exr(path)[0].astype(np.float64)


@pytest.mark.slow
def test_in_clear_water_every_kind_looks_as_eevee_draws_it(tmp_path):
    scene, row = bpy.context.scene, _row()
    camera = _camera(_STEP * (len(row) - 1) / 2, _STEP * len(row))
    column = columns.grey_column(1e-9, 0.0, surface="none", sky_radiance=0.0)
    # The sensor that undoes the way from colours to bands.
    weights = np.linalg.inv(uplift_basis(column.bands))
    phase = parse_phase("hg:0.8").for_bands(np.ones(3))
    # Without their look-ups mirrors are matte.
    kinds = dataclasses.replace(material_kinds.kinds(bpy.data.materials), mirrors=False)
    water = frame_water.realtime_water(column, phase, 8.0, weights, inputs=FrameInputs(kinds=kinds))
    notes = realtime.add_realtime(scene, water, water_body.WaterExtent(100.0, 100.0))
    assert {"'metal'" in note for note in notes} == {True, False}
    assert all("mirrors" in note for note in notes)
    seen = _picture(camera, tmp_path / "water.exr")
    lamp = next(o for o in scene.objects if o.type == "LIGHT")
    sun = bpy.data.lights.new("own sun", "SUN")
    sun.energy, sun.angle = float(column.sun_irradiance[0]), lamp.data.angle
    sun.shadow_maximum_resolution = lamp.data.shadow_maximum_resolution
    own = bpy.data.objects.new("own sun", sun)
    own.matrix_world = lamp.matrix_world
    scene_water.remove(scene)
    scene.collection.objects.link(own)
    shader = bpy.data.materials["emissive"].node_tree.nodes["Principled BSDF"]
    glow = shader.inputs["Emission Color"].default_value
    glow[:3] = weights @ emission_basis(column.bands) @ glow[:3]
    wanted = _picture(camera, tmp_path / "plain.exr")
    assert wanted.max() > 0.1
    width = _SIZE[0] // len(row)
    wrong = {}
    for index, item in enumerate(row):
        part = np.s_[:, index * width : (index + 1) * width]
        error = np.abs(seen[part] - wanted[part]) / (wanted[part] + 0.01)
        # Edges of shadows and of transparent noise fall elsewhere.
        wrong[item.name] = float(np.quantile(error, 0.9))
    assert max(wrong.values()) < 0.01, wrong


_WIDE = 32  # pixels of a ball
_KINDS = {
    "diffuse": {},
    "metal": {"Metallic": 1.0},
    # Lit first, its gloss would have its colour.
    "measured": {"Specular IOR Level": 0.0},
    "coat": {"Coat Weight": 1.0, "Coat Roughness": 0.5},
    "sheer": {"Alpha": 0.5},
    "glowing": {"Emission Strength": 0.1},
}


def _balls() -> list[bpy.types.Material]:
    """Balls of all kinds in a row, as far apart as they are wide."""
    materials = []
    for index, (kind, values) in enumerate(_KINDS.items()):
        place = (index + 0.5 - len(_KINDS) / 2, 4.0, -5.0)
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.45, location=place)
        materials.append(scenes.principled(kind))
        bpy.context.object.data.materials.append(materials[-1])
        shader = materials[-1].node_tree.nodes["Principled BSDF"].inputs
        shader["Base Color"].default_value = (0.8, 0.4, 0.1, 1.0)
        shader["Roughness"].default_value = 0.6
        for name, value in values.items():
            shader[name].default_value = value
        if kind == "measured":
            materials[-1][band_colors.MEASURED_WAVELENGTHS] = [400.0, 700.0]
            materials[-1][band_colors.MEASURED_REFLECTANCE] = [0.2, 0.8]
    return materials


@pytest.mark.slow
def test_closures_that_are_kept_are_as_bright_as_lit_ones(tmp_path, monkeypatch):
    """Within the thousandth of their range in which EEVEE keeps the colours of closures."""
    scene, materials = bpy.context.scene, _balls()
    camera = scenes.add_camera(rotation=(math.pi / 2, 0.0, 0.0))
    camera.data.angle = 2.0 * math.atan(len(_KINDS) / 8.0)
    scene.render.resolution_x, scene.render.resolution_y = _WIDE * len(_KINDS), _WIDE
    column = columns.grey_column(0.1, 0.1)
    phase = parse_phase("hg:0.8").for_bands(np.full(3, 0.1))
    water = frame_water.realtime_water(
        column, phase, 5.0, np.eye(3), inputs=FrameInputs(
            {"measured": np.linspace(0.2, 0.8, 3)},
            kinds=material_kinds.kinds(bpy.data.materials),
        ),
    )  # fmt: skip
    bpy.context.view_layer.update()
    before, pictures = snapshot.snapshot(), []
    for keeps in (True, False):
        monkeypatch.setattr(frame_water.RealtimeWater, "has_native_closures", keeps)
        realtime.add_realtime(scene, water, water_body.WaterExtent(100.0, 100.0))
        for material in materials:
            # What the sun's colours and the light of the water need is computed once.
            groups = [getattr(node, "node_tree", None) for node in material.node_tree.nodes]
            named = [group.name for group in groups if group is not None]
            assert sum(name.startswith(("UW Water", "UW Surface")) for name in named) == 1
        with eevee_settings.realtime_settings(scene, camera, samples=8, water=water):
            exr_output.write_float_exr(scene, tmp_path / "a.exr")
        pictures.append(read_exr(tmp_path / "a.exr")[0].astype(float))
        scene_water.remove(scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []
    for index, kind in enumerate(_KINDS):
        kept, lit = (picture[:, _WIDE * index :][:, :_WIDE] for picture in pictures)
        error = np.abs(kept - lit) / lit.mean()
        brightness = kept.mean(axis=(0, 1)) / lit.mean(axis=(0, 1))
        assert brightness == pytest.approx(np.ones(3), abs=0.01), kind
        assert np.quantile(error, 0.9) < 0.01, kind
    middles = pictures[0][_WIDE // 2, _WIDE // 2 :: _WIDE]
    assert len({tuple(colour.round(3)) for colour in middles}) > 3, "the balls are not seen"


def test_the_shader_nodes_of_the_table_are_blenders(empty_blender):
    tree = bpy.data.materials.new("Any").node_tree
    for name, known in shader_nodes.SHADER_NODES.items():
        node = tree.nodes.new(name)
        assert any(output.type == "SHADER" for output in node.outputs)
        named = known.colour, known.cover, known.clear, known.mirrors, known.anisotropy
        for read in (*named, *(known.emits or ())):
            assert not read or not isinstance(read, str) or read in node.inputs, name
        assert "Roughness" in node.inputs or not (known.mirrors or known.facets), name


def test_volumes_are_left_out_and_said_and_come_back(empty_blender):
    """EEVEE's froxels drew a black blotch: the sun that is drawn does not light them."""
    material, tree, output = scenes._material("smoke")
    tree.links.new(tree.nodes.new("ShaderNodeVolumeScatter").outputs[0], output.inputs["Volume"])
    mesh = bpy.data.meshes.new("smoke")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    mesh.materials.append(material)
    empty_blender.collection.objects.link(bpy.data.objects.new("smoke", mesh))
    surfaces = closure_walk.Surfaces(bpy.data.node_groups.new("lit", "ShaderNodeTree"))
    notes = realtime_materials.insert([material], surfaces)
    assert output.inputs["Volume"].links[0].is_muted
    assert any("'smoke'" in note and "volume" in note for note in notes)
    (clear,) = output.inputs["Surface"].links
    assert clear.from_node.bl_idname == "ShaderNodeBsdfTransparent"
    wet_trees.remove(())
    assert not output.inputs["Surface"].is_linked
    assert not output.inputs["Volume"].links[0].is_muted


def test_every_shader_of_blender_has_a_row_or_is_joined(empty_blender):
    """What EEVEE draws as something else is said by the row; nothing is grey in silence."""
    tree = bpy.data.materials.new("all").node_tree
    joining = {"ShaderNodeMixShader", "ShaderNodeAddShader", "ShaderNodeGroup"}
    own = {"ShaderNodeScript", *joining}
    missing = []
    for name in sorted(n for n in dir(bpy.types) if n.startswith("ShaderNode")):
        try:
            node = tree.nodes.new(name)
        except RuntimeError:  # a base class
            continue
        closes = any(output.type == "SHADER" for output in node.outputs)
        volume = "Volume" in name
        if closes and not volume and name not in own and name not in shader_nodes.SHADER_NODES:
            missing.append(name)
    assert missing == []


def _leaf() -> bpy.types.Image:
    """An image of thin green stripes between clear ones that are black."""
    image = bpy.data.images.new("leaf", 64, 64, alpha=True)
    texels = np.zeros((64, 64, 4), np.float32)
    texels[:, ::2] = (0.1, 0.8, 0.1, 1.0)
    image.pixels.foreach_set(texels.ravel())
    image.pack()
    return image


def _cut_out(name: str, *, nodes: int) -> bpy.types.Material:
    """A leaf whose colour and alpha come from one node, or from two."""
    material = scenes.principled(name)
    tree = material.node_tree
    shader = tree.nodes["Principled BSDF"]
    colour = tree.nodes.new("ShaderNodeTexImage")
    alpha = colour if nodes == 1 else tree.nodes.new("ShaderNodeTexImage")
    colour.image = alpha.image = bpy.data.images.get("leaf") or _leaf()
    tree.links.new(colour.outputs["Color"], shader.inputs["Base Color"])
    tree.links.new(alpha.outputs["Alpha"], shader.inputs["Alpha"])
    return material


def _cut_out_water() -> frame_water.RealtimeWater:
    seen = FrameInputs(kinds=material_kinds.kinds(bpy.data.materials))
    phase = parse_phase("hg:0.8").for_bands(np.full(3, 0.1))
    return frame_water.realtime_water(
        columns.grey_column(0.01, 0.0), phase, 5.0, np.eye(3), inputs=seen
    )


@pytest.mark.parametrize(("extension", "is_read"), [("REPEAT", True), ("CLIP", False)])
def test_alpha_is_read_where_the_colour_is(empty_blender, extension, is_read):
    """EEVEE darkens a colour by an alpha that nothing reads there."""
    material = _cut_out("leaf", nodes=2)
    nodes = [n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeTexImage"]
    nodes[1].extension = extension  # clipped, it is another texel
    bpy.ops.mesh.primitive_plane_add(location=(0.0, 0.0, -5.0))
    bpy.context.object.data.materials.append(material)
    before = snapshot.snapshot()
    realtime.add_realtime(empty_blender, _cut_out_water(), water_body.WaterExtent(100.0, 100.0))
    assert nodes[0].outputs["Alpha"].is_linked == is_read
    scene_water.remove(empty_blender)
    assert snapshot.differences(before, snapshot.snapshot()) == []


@pytest.mark.slow
def test_the_edges_of_what_is_cut_out_are_as_bright_as_the_rest(empty_blender, tmp_path):
    """Files of OBJ have a node for the colour, another one for the alpha."""
    camera = scenes.add_camera(rotation=(math.pi / 2, 0.0, 0.0))
    empty_blender.render.resolution_x, empty_blender.render.resolution_y = 32, 16
    for nodes, x in ((1, -1.0), (2, 1.0)):
        bpy.ops.mesh.primitive_plane_add(size=1.9, location=(x, 5.0, -5.0))
        bpy.context.object.rotation_euler = (math.radians(60.0), 0.0, 0.0)
        bpy.context.object.data.materials.append(_cut_out(f"{nodes} nodes", nodes=nodes))
    bpy.context.view_layer.update()
    water = _cut_out_water()
    realtime.add_realtime(empty_blender, water, water_body.WaterExtent(100.0, 100.0))
    with eevee_settings.realtime_settings(empty_blender, camera, samples=32, water=water):
        exr_output.write_float_exr(empty_blender, tmp_path / "a.exr")
    picture = read_exr(tmp_path / "a.exr")[0][4:12]
    one, two = picture[:, 10:15, 1].mean(), picture[:, 17:22, 1].mean()
    assert two == pytest.approx(one, rel=0.1)  # it was 0.65 of it
    scene_water.remove(empty_blender)


def test_only_facets_in_lamplight_pay(empty_blender):
    """Without lamps, or without facets, the groups have no inputs for them."""
    matte, glossy, coated = (scenes.principled(name) for name in ("matte", "glossy", "coated"))
    inputs = {m: m.node_tree.nodes["Principled BSDF"].inputs for m in (matte, glossy, coated)}
    inputs[matte]["Specular IOR Level"].default_value = 0.0
    inputs[coated]["Coat Weight"].default_value = 0.5
    found = [material_kinds.kinds([m]).facets for m in (matte, glossy, coated)]
    assert found == [0, 1, 2]
    column = columns.grey_column(0.1, 0.1)
    seen = FrameInputs(kinds=material_kinds.kinds([coated]))
    phase = parse_phase("hg:0.5").for_bands(np.ones(3))
    water = frame_water.realtime_water(column, phase, 4.0, np.eye(3), inputs=seen)
    assert LampShape not in water.shape


def test_clear_objects_that_hide_lamps_are_said(empty_blender):
    """EEVEE's dithering throws away what is wholly transparent, emission and all."""
    material, tree, output = scenes._material("pane")
    glass = tree.nodes.new("ShaderNodeBsdfGlass")
    tree.links.new(glass.outputs[0], output.inputs["Surface"])
    group = bpy.data.node_groups.new("lit", "ShaderNodeTree")
    for name in (n for one in realtime_lamps.FACETS for n in one):
        group.interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketFloat")
    surfaces = closure_walk.Surfaces(group)
    for method, expected in (("DITHERED", 1), ("BLENDED", 0)):
        material.surface_render_method = method
        notes = []
        dithered = method == "DITHERED"
        walk = closure_walk.ClosureWalk(tree, "pane", notes, surfaces, dithered=dithered)
        walk.closure(output.inputs["Surface"])
        assert sum("Blended" in note for note in notes) == expected
