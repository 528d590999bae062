"""White things in a white furnace cannot be told from what is behind them."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene import contents
from underwater_spectral.scene.engines import eevee_settings, exr_output
from underwater_spectral.scene.materials import realtime_materials
from underwater_spectral.scene.seen.snapshot import Snapshot
from underwater_spectral.scene.water import (
    frame_water,
    realtime,
    water_body,
)
from underwater_spectral.tests.scene import columns, scenes
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.water.phase import parse_phase

_WHITE = (1.0, 1.0, 1.0, 1.0)
_DEPTH = 4.0


def _of(kind, **values):
    def make():
        material, tree, output = scenes._material(kind)
        node = tree.nodes.new(f"ShaderNode{kind}")
        for name in ("Color", "Base Color", "Edge Tint"):
            if name in node.inputs:
                node.inputs[name].default_value = _WHITE
        for name, value in values.items():
            node.inputs[name.replace("_", " ")].default_value = value
        tree.links.new(node.outputs[0], output.inputs["Surface"])
        return material

    return make


_KINDS = {
    "diffuse": _of("BsdfDiffuse"),
    "rough diffuse": _of("BsdfDiffuse", Roughness=1.0),
    "principled": _of("BsdfPrincipled"),
    "metal": _of("BsdfPrincipled", Metallic=1.0, Roughness=0.2),
    "rough metal": _of("BsdfPrincipled", Metallic=1.0, Roughness=0.6),
    "metallic": _of("BsdfMetallic", Roughness=0.3),
    "glossy": _of("BsdfAnisotropic", Roughness=0.2),
    "coat": _of("BsdfPrincipled", Coat_Weight=1.0),
    "translucent": _of("BsdfTranslucent"),
    "toon": _of("BsdfToon"),
    "subsurface": _of("SubsurfaceScattering"),
    "principled subsurface": _of("BsdfPrincipled", Subsurface_Weight=1.0),
    "hair": _of("BsdfHair"),
    "glass": _of("BsdfGlass"),
    "refraction": _of("BsdfRefraction"),
    "transmission": _of("BsdfPrincipled", Transmission_Weight=1.0, Roughness=0.0),
    "transparent": _of("BsdfTransparent"),
    "alpha": _of("BsdfPrincipled", Alpha=0.5),
}


def _furnace():
    """Uniform light of 1 all over, in clear water, and a ball in it."""
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = 16
    camera = scenes.add_camera((0.0, 0.0, -_DEPTH), (math.pi / 2, 0.0, 0.0))
    camera.data.angle = math.radians(20.0)
    bpy.ops.mesh.primitive_uv_sphere_add(
        segments=64, ring_count=32, radius=0.5, location=(0.0, 2.5, -_DEPTH)
    )
    bpy.ops.object.shade_smooth()
    return (
        scene,
        camera,
        columns.grey_column(
            1e-6, 1e-6, sun_irradiance=0.0, sky_radiance=1.0, floor_depth=9.0, floor_reflectance=1.0
        ),
    )


@pytest.mark.parametrize("kind", _KINDS)
def test_eevee(kind, empty_blender, tmp_path):
    scene, camera, column = _furnace()
    bpy.context.object.data.materials.append(_KINDS[kind]())
    bpy.context.view_layer.update()
    seen = Snapshot(kinds=realtime_materials.kinds(contents.materials(scene)))
    water = frame_water.realtime_water(
        column, parse_phase("hg:0.5").for_bands(np.ones(3)), _DEPTH, np.eye(3), seen=seen
    )
    realtime.add_realtime(scene, water, water_body.water_extent(scene, column, _DEPTH))
    with eevee_settings.realtime_settings(scene, camera, samples=16, water=water):
        exr_output.write_float_exr(scene, tmp_path / "a.exr")
    image = read_exr(tmp_path / "a.exr")[0][..., 0]
    assert image[3:-3, 3:-3].mean() == pytest.approx(1.0, rel=0.03)
