"""White objects in a white furnace cannot be told from what is behind them."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene import contents
from underwater_spectral.scene.engines import eevee_settings, exr_output
from underwater_spectral.scene.materials import material_kinds
from underwater_spectral.scene.terms.hair import HairTerm
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


def _drawn(scene, camera, path, scattering=1e-6, terms=()):
    """Return a picture of the scene in water where light comes from all sides alike."""
    scene.view_layers[0].update()
    column = columns.grey_column(
        1e-6, scattering, sun_irradiance=0.0, sky_radiance=1.0, floor_depth=12.0,
        floor_reflectance=1.0,
    )  # fmt: skip
    kinds = material_kinds.kinds(contents.materials(scene))
    inputs = FrameInputs(kinds=kinds, terms=terms)
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


def _fur(colour):
    """Put threads round a ball before a camera that sees all of it; return that.

    White threads are on a white ball, others on a black one.
    """
    rng, count, points = np.random.default_rng(2), 3000, 4
    out = rng.normal(size=(count, 1, 3))
    out /= np.linalg.norm(out, axis=2, keepdims=True)
    hair = bpy.data.hair_curves.new("fur")
    hair.add_curves([points] * count)
    places = (out * np.linspace(0.25, 0.45, points)[:, None]).astype(np.float32)
    hair.points.foreach_set("position", places.ravel())
    radius = hair.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.full(count * points, 0.004, np.float32))
    item = bpy.data.objects.new("fur", hair)
    item.location = (0.0, 2.0, -_DEPTH)
    bpy.context.scene.collection.objects.link(item)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.25, location=item.location)
    for data, grey in ((hair, colour), (bpy.context.object.data, float(colour == 1.0))):
        data.materials.append(_of("BsdfDiffuse", Color=(grey, grey, grey, 1.0))())
    camera = scenes.add_camera((0.0, 0.0, -_DEPTH), (math.pi / 2, 0.0, 0.0))
    camera.data.angle = math.radians(28.0)
    return camera


def _by_cycles(scene, path):
    """Return a picture of the scene in a white world, without water."""
    scene.world = bpy.data.worlds.new("white")
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = _WHITE
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 64, False
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 256
    exr_output.write_float_exr(scene, path)
    return read_exr(path)[0]


@pytest.mark.slow
@pytest.mark.parametrize(("colour", "within"), [(0.1, 0.3), (0.5, 0.15), (1.0, 0.02)])
def test_threads_hide_the_light_from_one_another(empty_blender, tmp_path, colour, within):
    scene, camera = empty_blender, _fur(colour)
    scene.render.resolution_x = scene.render.resolution_y = 64
    ball = np.hypot(*(np.indices((64, 64)) - 31.5)) < 27.0
    wanted = _by_cycles(scene, tmp_path / "cycles.exr")[ball, :3].mean()
    terms = (HairTerm(),)
    found = _drawn(scene, camera, tmp_path / "eevee.exr", terms=terms)[0][ball, :3].mean()
    assert found == pytest.approx(wanted, rel=within)
