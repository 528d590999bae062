"""Translucent sheets throw on the light behind them, bodies that of all their sides."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene import contents
from underwater_spectral.scene.engines import eevee_settings, exr_output
from underwater_spectral.scene.materials import material_kinds
from underwater_spectral.scene.readers.closed_bodies import closed_materials, is_closed
from underwater_spectral.scene.water import frame_water, realtime, scene_water, water_body
from underwater_spectral.scene.water.frame_water import FrameInputs
from underwater_spectral.tests.scene import columns, scenes, snapshot
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

_DEPTH, _UP, _PITCH, _PIXELS = 6.0, 4.0, 1.2, 10
_C = 0.5


def _translucent(weight):
    """Make a translucent material that is mixed with black."""
    material, tree, output = scenes._material("translucent")
    through, black = (tree.nodes.new(f"ShaderNodeBsdf{x}") for x in ("Translucent", "Diffuse"))
    through.inputs["Color"].default_value = (_C, _C, _C, 1.0)
    black.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    mix = tree.nodes.new("ShaderNodeMixShader")
    mix.inputs[0].default_value = weight
    tree.links.new(black.outputs[0], mix.inputs[1])
    tree.links.new(through.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return material


def _objects(scene):
    """Put two sheets and a ball over a camera that looks up."""
    scene.camera = camera = scenes.add_camera((0.0, 0.0, -_DEPTH), (math.pi, 0.0, 0.0))
    camera.data.angle = 2.0 * math.atan(1.5 * _PITCH / _UP)
    for number, weight in enumerate((1.0, 0.3, 1.0)):
        place = ((number - 1) * _PITCH, 0.0, _UP - _DEPTH)
        if number < 2:
            bpy.ops.mesh.primitive_plane_add(size=0.9, location=place)
        else:
            bpy.ops.mesh.primitive_uv_sphere_add(radius=0.45, location=place)
            bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(_translucent(weight))
    scene.render.resolution_x, scene.render.resolution_y = 3 * _PIXELS, _PIXELS
    scene.render.resolution_percentage = 100
    scene.view_layers[0].update()
    return camera


@pytest.mark.slow
@pytest.mark.parametrize("keeps", [True, pytest.param(False, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("sun", "sky"), [(1.0, 0.0), (0.0, 1.0)])
def test_light_crosses_one_sheet_or_two_walls(
    empty_blender, tmp_path, monkeypatch, sun, sky, keeps
):
    """In clear water over a black floor everything is known."""
    scene = empty_blender
    camera = _objects(scene)
    before = snapshot.snapshot()
    column = columns.grey_column(
        1e-6, 1e-6, sun_irradiance=sun, sky_radiance=sky, floor_depth=12.0, floor_reflectance=0.0
    )
    inputs = FrameInputs(kinds=material_kinds.kinds(contents.materials(scene)))
    phase = parse_phase("hg:0.5").for_bands(np.ones(3))
    monkeypatch.setattr(frame_water.RealtimeWater, "has_native_closures", keeps)
    water = frame_water.realtime_water(column, phase, _DEPTH, np.eye(3), inputs=inputs)
    realtime.add_realtime(scene, water, water_body.water_extent(scene, column, _DEPTH))
    with eevee_settings.realtime_settings(scene, camera, samples=16, water=water):
        exr_output.write_float_exr(scene, tmp_path / "a.exr")
    scene_water.remove(scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []
    assert {x.thickness_mode for x in contents.materials(scene)} == {"SPHERE"}
    image = read_exr(tmp_path / "a.exr")[0][..., 0]
    found = image.reshape(_PIXELS, 3, _PIXELS)[3:-3, :, 3:-3].mean(axis=(0, 2))
    down = sun / math.pi + sky
    around = (sun / -column.sun_direction[2] / math.pi + sky * 2.0) / 4.0
    assert found == pytest.approx([_C * down, 0.3 * _C * down, _C**2 * around], rel=0.05)


def test_bodies_are_told_from_sheets(empty_blender):
    """Each edge of a body is that of two faces."""
    bpy.ops.mesh.primitive_cube_add()
    mesh = bpy.context.object.data
    assert is_closed(mesh)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    bpy.ops.object.mode_set(mode="OBJECT")
    mesh.polygons[0].select = True
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.delete(type="FACE")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert not is_closed(mesh)


def test_a_material_on_a_sheet_too_is_that_of_sheets(empty_blender):
    """Bodies are known by all that is seen with a material."""
    scene, material, other = empty_blender, _translucent(1.0), _translucent(1.0)
    bpy.ops.mesh.primitive_cube_add()
    for each in (material, other):
        bpy.context.object.data.materials.append(each)
    assert closed_materials(scene) == {material, other}
    bpy.ops.mesh.primitive_plane_add()
    bpy.context.object.data.materials.append(material)
    assert closed_materials(scene) == {other}
