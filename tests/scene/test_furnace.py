"""White objects in a white furnace cannot be told from what is behind them."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene import contents
from underwater_spectral.scene.engines import eevee_settings, exr_output
from underwater_spectral.scene.materials import material_kinds
from underwater_spectral.scene.water import frame_water, realtime, water_body
from underwater_spectral.scene.water.frame_water import FrameInputs
from underwater_spectral.tests.scene import columns, scenes
from underwater_spectral.uw_spectral.spectra.reflectance import uplift_basis
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

_WHITE = (1.0, 1.0, 1.0, 1.0)
_DEPTH, _AWAY = 4.0, 6.87
_COLUMNS, _PITCH, _PIXELS = 5, 1.0, 10


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


_FIRST = ("principled", "metal", "coat", "translucent", "transmission", "alpha")


def _balls(kinds):
    """Put a ball of each kind before a camera, side by side; return the camera."""
    camera = scenes.add_camera((0.0, 0.0, -_DEPTH), (math.pi / 2, 0.0, 0.0))
    camera.data.angle = math.radians(40.0)
    for number, make in enumerate(_KINDS[kind] for kind in kinds):
        row, column = divmod(number, _COLUMNS)
        x, z = (column - (_COLUMNS - 1) / 2.0), (_COLUMNS - 1) / 2.0 - row
        place = (_PITCH * x, _AWAY, _PITCH * z - _DEPTH)
        bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=0.4, location=place)
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(make())
    return camera


def _drawn(scene, camera, path, scattering=1e-6):
    """Return a picture of the scene in water where light comes from all sides alike."""
    scene.view_layers[0].update()
    column = columns.grey_column(
        1e-6, scattering, sun_irradiance=0.0, sky_radiance=1.0, floor_depth=12.0,
        floor_reflectance=1.0,
    )  # fmt: skip
    inputs = FrameInputs(kinds=material_kinds.kinds(contents.materials(scene)))
    phase = parse_phase("hg:0.5").for_bands(np.ones(3))
    water = frame_water.realtime_water(column, phase, _DEPTH, np.eye(3), inputs=inputs)
    realtime.add_realtime(scene, water, water_body.water_extent(scene, column, _DEPTH))
    with eevee_settings.realtime_settings(scene, camera, samples=16, water=water):
        exr_output.write_float_exr(scene, path)
    return read_exr(path)[0], column.bands


@pytest.mark.slow
@pytest.mark.parametrize(
    "kinds",
    [
        _FIRST,
        # Each shader takes four seconds to compile.
        pytest.param([kind for kind in _KINDS if kind not in _FIRST], marks=pytest.mark.slow),
    ],
    ids=("first", "others"),
)
def test_white_objects_vanish_in_a_white_furnace(empty_blender, tmp_path, kinds):
    scene, camera = empty_blender, _balls(kinds)
    scene.render.resolution_x = scene.render.resolution_y = _COLUMNS * _PIXELS
    image = _drawn(scene, camera, tmp_path / "a.exr")[0][..., 0]
    cells = image.reshape(_COLUMNS, _PIXELS, _COLUMNS, _PIXELS)[:, 3:-3, :, 3:-3]
    means = cells.mean(axis=(1, 3)).ravel()[: len(kinds)]
    off = {k: round(float(m), 3) for k, m in zip(kinds, means, strict=True) if abs(m - 1) > 0.03}
    assert not off


@pytest.mark.slow
def test_two_walls_of_coloured_glass_filter_by_its_colour(empty_blender, tmp_path):
    """As one of them does by its root: EEVEE itself lets through but means of channels."""
    scene, colour, thickness, scattering = empty_blender, (0.3, 0.8, 0.4), 0.02, 0.2
    camera = scenes.add_camera((0.0, 0.0, -_DEPTH), (math.pi / 2, 0.0, 0.0))
    camera.data.angle = math.radians(5.0)
    scene.render.resolution_x = scene.render.resolution_y = 12
    bpy.ops.mesh.primitive_cube_add(
        size=1.0, location=(0.0, _DEPTH, -_DEPTH), scale=(1.0, thickness, 1.0)
    )
    material = _of("BsdfPrincipled", Transmission_Weight=1.0, Roughness=0.0)()
    shader = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    shader.inputs["Base Color"].default_value = (*colour, 1.0)
    bpy.context.object.data.materials.append(material)
    image, bands = _drawn(scene, camera, tmp_path / "a.exr", scattering)
    arrives = math.exp(-scattering * (_DEPTH - thickness))
    found = 1.0 - (1.0 - image.mean(axis=(0, 1))[:3]) / arrives
    assert found == pytest.approx(uplift_basis(bands) @ colour, rel=0.05)
