"""The group of the closed form, rendered in EEVEE without the extension, against numpy."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene.engines import eevee_settings, exr_output
from underwater_spectral.scene.water import scene_water
from underwater_spectral.tests.node_groups import realtime_probe as probe
from underwater_spectral.tools import closed_form_group as group
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.water.optical_properties import Water
from underwater_spectral.validation.closed_form import PlainLight, TwoStreamWater, plain_water
from underwater_spectral.validation.closed_form.pixel import surface_light

_OF_THE_SURFACE = {group.LIT, group.COLOR, group.EMISSION, group.NORMAL}
GLOW = (0.02, 0.01, 0.03)
WATERS = {
    "by default": {},
    "turbid": {
        group.ABSORPTION: (0.4, 0.2, 0.3),
        group.SCATTERING: (1.0, 0.9, 0.5),
        group.ASYMMETRY: (0.8, 0.9, 0.924),
        group.SECOND_MOMENT: (0.64, 0.81, 0.88),
        group.SUN_IRRADIANCE: (1.0, 2.0, 3.0, 1.0),
        group.SUN_DIRECTION: (0.5, -0.3, -math.sqrt(0.66)),
    },
    "over a floor, no surface": {
        group.FLOOR_DEPTH: 9.0,
        group.FLOOR_REFLECTANCE: (0.6, 0.3, 0.0, 1.0),
        group.INDEX: 1.0,
        group.SKY_RADIANCE: (0.1, 0.2, 0.3, 1.0),
    },
    "clear as air": {group.ABSORPTION: (0.0, 0.0, 1e-4), group.SCATTERING: (0.0, 1e-4, 0.01)},
    "where the rates meet": {
        # k = ks of isotropic scattering and light straight down: 3a (a + b) = (a + b)².
        group.ABSORPTION: (0.1, 0.1, 0.1),
        group.SCATTERING: (0.2, 0.25, 0.3),
        group.ASYMMETRY: (0.0, 0.0, 0.0),
        group.SECOND_MOMENT: (0.0, 0.0, 0.0),
        group.SUN_DIRECTION: (0.0, 0.0, -1.0),
    },
}
VIEWS = [
    probe.View(4.0),
    probe.View(4.0, 30.0),
    probe.View(7.0, 140.0, square=((-1.5, -1.0, -3.0), (3.0, 0.0, 0.0), (0.0, 1.5, -3.0))),
]
ALL = dict.fromkeys(WATERS, (0, 1, 2))
# Each picture takes a second, of whatever size.
SOME = {
    "by default": (0, 1, 2),
    "turbid": (1, 2),
    "over a floor, no surface": (0, 2),
    "clear as air": (1,),
    "where the rates meet": (1,),
}


def _wet(tree):
    """Put the group into the square's material and into the world."""
    scene = bpy.context.scene
    material = bpy.data.materials["Square"]
    nodes, links = material.node_tree.nodes, material.node_tree.links
    end = next(n for n in nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    diffuse = next(n for n in nodes if n.bl_idname == "ShaderNodeBsdfDiffuse")
    glow, both, lit, wet, seen = (
        nodes.new(f"ShaderNode{kind}")
        for kind in ("Emission", "AddShader", "ShaderToRGB", "Group", "Emission")
    )
    glow.inputs["Color"].default_value = (*GLOW, 1.0)
    wet.node_tree = tree
    wet.inputs[group.COLOR].default_value = diffuse.inputs["Color"].default_value
    wet.inputs[group.EMISSION].default_value = (*GLOW, 1.0)
    for number, shader in enumerate((diffuse, glow)):
        links.new(shader.outputs[0], both.inputs[number])
    links.new(both.outputs[0], lit.inputs[0])
    links.new(lit.outputs["Color"], wet.inputs[group.LIT])
    links.new(wet.outputs[group.SURFACE], seen.inputs["Color"])
    links.new(seen.outputs[0], end.inputs["Surface"])
    scene.world = bpy.data.worlds.new("water")
    scene.world.probe_resolution = "128"  # only cameras see it
    tree_of_world = scene.world.node_tree
    around = tree_of_world.nodes.new("ShaderNodeGroup")
    around.name, around.node_tree = "water", tree
    shown = tree_of_world.nodes["Background"]
    tree_of_world.links.new(around.outputs[group.OPEN_WATER], shown.inputs["Color"])
    sight = tree_of_world.nodes.new("ShaderNodeLightPath")
    tree_of_world.links.new(sight.outputs["Is Camera Ray"], shown.inputs["Strength"])
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.angle, sun.data.energy = 0.0, 1.0
    scene.collection.objects.link(sun)
    return wet


def _give(wet, changes):
    """Give both nodes the values of a water, those of the group where it says nothing."""
    around = bpy.context.scene.world.node_tree.nodes["water"]
    for item in wet.node_tree.interface.items_tree:
        if item.in_out == "INPUT" and item.name not in _OF_THE_SURFACE:
            value = changes.get(item.name, item.default_value)
            for node in (wet, around):
                node.inputs[item.name].default_value = value
    scene_water.turn(bpy.data.objects["sun"], wet.inputs[group.SUN_DIRECTION].default_value)


def _numbers(wet):
    return {
        socket.name: np.array(socket.default_value, dtype=float)[:3]
        if socket.type != "VALUE"
        else float(socket.default_value)
        for socket in wet.inputs
    }


def _expected(wet, view):
    given, rays = _numbers(wet), view.rays()
    w = tuple(np.moveaxis(rays, -1, 0)[..., None])
    sun = given[group.SUN_DIRECTION]
    water = plain_water(
        TwoStreamWater(given[group.ABSORPTION], given[group.SCATTERING], given[group.ASYMMETRY],
                       given[group.SECOND_MOMENT]),
        PlainLight(given[group.SUN_IRRADIANCE], given[group.SKY_RADIANCE], sun.tolist()),
        y_o=view.depth,
        y_f=given[group.FLOOR_DEPTH], r=given[group.FLOOR_REFLECTANCE], index=given[group.INDEX],
    )  # fmt: skip
    P, normal, where = probe.square_ahead(view)
    P = np.where(where > 0, P, 1.0)[..., None]
    y = np.maximum(view.depth - w[2] * P, 0.0)
    cosine = float(-(normal @ sun))
    light = surface_light(water.patch_light(y, tuple(normal)), y, normal[2])
    colour = np.array(probe.COLOR)
    L = light.reflected(colour / math.pi * max(cosine, 0.0), colour, cosine) + GLOW
    on_it = water.surface(view.depth, y, w, P, L).total
    open_water = water.open_water(view.depth, w).total
    return np.where(where[..., None] == 1, on_it, open_water), where


@pytest.mark.slow
@pytest.mark.parametrize("views", [SOME, pytest.param(ALL, marks=pytest.mark.slow)])
def test_nodes_are_the_formula(empty_blender, tmp_path, views):
    tree, scene, wet = group.build(), empty_blender, None
    for name, seen_from in views.items():
        for number in seen_from:
            view = VIEWS[number]
            camera = probe.place(view)
            wet = wet or _wet(tree)
            _give(wet, WATERS[name])
            with eevee_settings.realtime_settings(scene, camera, samples=1, water=None):
                exr_output.write_float_exr(scene, tmp_path / "readers.exr")
            seen = read_exr(tmp_path / "readers.exr")[0].astype(np.float64)
            wanted, where = _expected(wet, view)
            # A pixel across the edge of Snell's window is neither bright nor dark.
            zenith = np.degrees(np.arccos(view.rays()[..., 2]))
            index = wet.inputs[group.INDEX].default_value
            inside = np.abs(zenith - math.degrees(math.asin(1 / index))) > 1.0
            for part in (0, 1):
                # EEVEE cuts the digits beyond half floats; half a step is put back.
                errors = np.abs(seen / wanted - 1 + 2.0**-11)[inside & (where == part)]
                assert errors.size
                assert errors.max() < 5e-3, (name, number, part)


@pytest.mark.slow
def test_defaults_are_jerlov_ib():
    nm, IB = [600.0, 540.0, 450.0], Water.jerlov("IB")
    tree = group.build("defaults")
    values = {s.name: s.default_value for s in tree.interface.items_tree if s.in_out == "INPUT"}
    np.testing.assert_allclose(values[group.ABSORPTION], IB.a(nm), rtol=2e-3)
    np.testing.assert_allclose(values[group.SCATTERING], IB.b(nm), rtol=2e-3)
    np.testing.assert_allclose(
        values[group.SECOND_MOMENT], np.square(values[group.ASYMMETRY]), rtol=1e-6
    )
    assert np.linalg.norm(values[group.SUN_DIRECTION]) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.slow
def test_it_needs_nothing_else():
    """No image, driver, attribute or object: it works in any file, and each input is open."""
    tree = group.build("alone")
    trees = [tree]
    for one in trees:
        trees += [n.node_tree for n in one.nodes if n.bl_idname == "ShaderNodeGroup"]
        assert one.animation_data is None
        kinds = {n.bl_idname for n in one.nodes}
        assert not {k for k in kinds if "Tex" in k or "Attribute" in k or "Script" in k}
    for socket in tree.interface.items_tree:
        assert len(socket.description) > 10, socket.name
