"""Sunlight goes straight through what is clear, also under a water surface in Cycles."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups import attributes
from underwater_spectral.scene.engines import cycles_settings, exr_output
from underwater_spectral.scene.materials import clear_shadows
from underwater_spectral.scene.water import cycles_water, pass_values, water_body
from underwater_spectral.tests.scene import columns, scenes
from underwater_spectral.tests.scene.snapshot import snapshot
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr


def _glass(color=(1.0, 1.0, 1.0, 1.0)) -> bpy.types.Material:
    material, tree, output = scenes._material("glass")
    node = tree.nodes.new("ShaderNodeBsdfGlass")
    node.inputs["Color"].default_value = color
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def _principled(color=(1.0, 1.0, 1.0, 1.0)) -> bpy.types.Material:
    material = scenes.principled("jelly", color)
    material.node_tree.nodes["Principled BSDF"].inputs["Transmission Weight"].default_value = 1.0
    material.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 0.0
    return material


def _plane(z, material):
    bpy.ops.mesh.primitive_plane_add(size=2.0, location=(0.0, 0.0, z))
    bpy.context.object.data.materials.append(material)


def _floor_under(make, tmp_path):
    """Mean radiance of a white plate, of which a sheet between it and the sun is the roof."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = 8
    camera = scenes.add_camera((0.0, 0.0, -5.9), (0.0, 0.0, 0.0))
    camera.data.angle = math.radians(30.0)
    _plane(-7.0, scenes.principled("plate"))
    if make is not None:
        _plane(-5.0, make())
    column = columns.grey_column(1e-6, 0.0, surface="flat", refractive_index=1.33)
    phases = columns.layers_of(column, columns.henyey_greenstein(0.8))
    cycles_water.add_water(scene, column, phases, water_body.water_extent(scene, column, 5.9))
    values = pass_values.PassValues.of_column(column, phases)
    values = values.with_values(dict.fromkeys(attributes.REFLECTANCE_BASIS, np.full(3, 1.0 / 3.0)))
    values.apply(scene.view_layers[0], (0, 1, 2))
    with cycles_settings.reference_settings(scene, camera, samples=64, seed=1):
        exr_output.write_float_exr(scene, tmp_path / "a.exr")
    return float(read_exr(tmp_path / "a.exr")[0][..., 0].mean())


@pytest.mark.parametrize(
    ("make", "through"), [(_glass, 0.5), (_principled, math.sqrt(0.5))], ids=["glass", "principled"]
)
def test_the_sun_shines_through_a_pane(make, through, tmp_path):
    """It threw a black shadow: a refracted ray finds no sun through the water surface."""
    open_sky = _floor_under(None, tmp_path)
    grey = _floor_under(lambda: make((0.5, 0.5, 0.5, 1.0)), tmp_path)
    assert grey / open_sky == pytest.approx(through, rel=0.05)


def test_what_lets_shadows_through_is_taken_out_again(empty_blender):
    materials = [_glass(), _principled(), scenes.principled("plain")]
    before = snapshot()
    clear_shadows.insert(materials)
    changed = [m for m in materials if "Mix Shader" in m.node_tree.nodes]
    assert changed == materials[:2]
    clear_shadows.insert(materials)
    clear_shadows.remove(set())
    assert snapshot() == before
