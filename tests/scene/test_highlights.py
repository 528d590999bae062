"""Closures that EEVEE lacks are as bright in the sun under water as Cycles draws them in air."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene import contents
from underwater_spectral.scene.engines import eevee_settings, exr_output
from underwater_spectral.scene.materials import material_kinds
from underwater_spectral.scene.water import frame_water, realtime, scene_water, water_body
from underwater_spectral.scene.water.frame_water import FrameInputs
from underwater_spectral.tests.scene import columns, scenes, snapshot
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

_DEPTH, _AWAY, _PIXELS = 4.0, 5.0, 24
_SUN = np.array([0.3, 0.5, -math.sqrt(1.0 - 0.34)])
_KINDS = {
    "anisotropic": ("BsdfAnisotropic", {"Roughness": 0.5, "Anisotropy": 0.6}),
    "turned": ("BsdfAnisotropic", {"Roughness": 0.5, "Anisotropy": -0.4, "Rotation": 0.1}),
    "toon": ("BsdfToon", {"Size": 0.5, "Smooth": 0.2}),
}


def _balls(scene):
    """Put a ball of each kind before a camera, half mixed with black."""
    count = len(_KINDS)
    scene.camera = camera = scenes.add_camera((0.0, 0.0, -_DEPTH), (math.pi / 2, 0.0, 0.0))
    camera.data.angle = 2.0 * math.atan(0.5 * count / _AWAY)
    for number, (kind, values) in enumerate(_KINDS.values()):
        material, tree, output = scenes._material(kind)
        node, mix = tree.nodes.new(f"ShaderNode{kind}"), tree.nodes.new("ShaderNodeMixShader")
        black = tree.nodes.new("ShaderNodeBsdfDiffuse")
        black.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
        node.inputs["Color"].default_value = (0.8, 0.8, 0.8, 1.0)
        if hasattr(node, "distribution"):
            node.distribution = "GGX"
        for name, value in values.items():
            node.inputs[name].default_value = value
        tree.links.new(black.outputs[0], mix.inputs[1])
        tree.links.new(node.outputs[0], mix.inputs[2])
        tree.links.new(mix.outputs[0], output.inputs["Surface"])
        place = (number - (count - 1) / 2.0, _AWAY, -_DEPTH)
        bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48, radius=0.4, location=place)
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(material)
    scene.render.resolution_x, scene.render.resolution_y = count * _PIXELS, _PIXELS
    scene.render.resolution_percentage = 100
    scene.view_layers[0].update()
    return camera


def _in_air(scene, path):
    """Let Cycles draw them under the sun."""
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    sun.data.energy, sun.data.angle = 1.0, 0.01
    scene.collection.objects.link(sun)
    scene_water.turn(sun, _SUN)
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.max_bounces = 32, False, 0
    exr_output.write_float_exr(scene, path)
    bpy.data.objects.remove(sun)
    return read_exr(path)[0][..., 0]


@pytest.mark.slow
def test_highlights_are_those_of_cycles(empty_blender, tmp_path, monkeypatch):
    scene = empty_blender
    camera = _balls(scene)
    wanted = _in_air(scene, tmp_path / "a.exr")
    before = snapshot.snapshot()
    column = columns.grey_column(
        1e-6, 1e-6, sun_irradiance=-_SUN[2], sun_cosine=-_SUN[2], sun_direction=_SUN,
        floor_depth=12.0,
    )  # fmt: skip
    inputs = FrameInputs(kinds=material_kinds.kinds(contents.materials(scene)))
    phase = parse_phase("hg:0.5").for_bands(np.ones(3))
    water = frame_water.realtime_water(column, phase, _DEPTH, np.eye(3), inputs=inputs)
    for keeps in (True, False):
        monkeypatch.setattr(frame_water.RealtimeWater, "has_native_closures", keeps)
        realtime.add_realtime(scene, water, water_body.water_extent(scene, column, _DEPTH))
        with eevee_settings.realtime_settings(scene, camera, samples=16, water=water):
            exr_output.write_float_exr(scene, tmp_path / "a.exr")
        scene_water.remove(scene)
        assert snapshot.differences(before, snapshot.snapshot()) == []
        found = read_exr(tmp_path / "a.exr")[0][..., 0]
        for number, kind in enumerate(_KINDS):
            ours, truth = (x[:, number * _PIXELS :][:, :_PIXELS] for x in (found, wanted))
            assert ours.mean() == pytest.approx(truth.mean(), rel=0.05), (kind, keeps)
            assert np.abs(ours - truth).mean() < 0.1 * truth.mean(), (kind, keeps)


def test_only_what_is_stretched_pays(empty_blender):
    """A round highlight is EEVEE's own."""
    material, tree, output = scenes._material("round")
    node = tree.nodes.new("ShaderNodeBsdfAnisotropic")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    node.inputs["Anisotropy"].default_value = 0.0
    assert material_kinds.kinds([material]).highlights == ()
    node.inputs["Anisotropy"].default_value = 0.1
    assert len(material_kinds.kinds([material]).highlights) == 1
