"""Objects that fluoresce, as EEVEE draws them, against the sum over excitation and emission."""

from __future__ import annotations

import dataclasses
import math

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups.node_mathematics import MARK
from underwater_spectral.node_groups.realtime_fluorescence import FluorescenceShape
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.materials import fluorescence
from underwater_spectral.scene.readers import lamps
from underwater_spectral.scene.terms.eevee_water import eevee_water
from underwater_spectral.scene.water import metering, realtime, scene_water, water_body
from underwater_spectral.scene.water.term import Eye
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes, snapshot
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.lamps.lamp_surface import arriving_light, patch_past_lamp
from underwater_spectral.uw_spectral.lamps.multiple_scattering import lamp_water
from underwater_spectral.uw_spectral.spectra.fluorophore import parse_fluorophore
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.validation.solved_cases import LightAround

DEPTH, AWAY, SIZE = 8.0, 2.0, 12
DAY = SceneSettings(
    water="jerlov:IB", bands=12, samples=8, surface="flat", sun_zenith=40.0, sun_azimuth=90.0,
    scene_floor=False, diffuse_shadows=False, shafts=False,
)  # fmt: skip
NIGHT = dataclasses.replace(DAY, sunlight=0.0, surface="none", filter="long-pass:500,15")
NORMAL = np.array([0.0, -1.0, 0.0])


@pytest.fixture
def scene(registered):
    """A camera at 8 m that looks along y, at a matt wall 2 m away."""
    scenes.add_camera((0.0, 0.0, -DEPTH), (math.pi / 2, 0.0, 0.0))
    render = registered.render
    render.resolution_x = render.resolution_y = SIZE
    render.filter_size = 0.0
    scenes.wall("wall", (0.0, AWAY, -DEPTH), 8.0, 0.05)
    bpy.context.view_layer.update()
    return registered


def _glow(name, strength=1.0, wall="wall"):
    own = bpy.data.objects[wall].active_material.underwater
    own.fluorophore, own.fluorescence = name, strength


def _blue_lamp():
    light = bpy.data.lights.new("Lamp", "POINT")
    light.energy, light.shadow_soft_size = 100.0, 0.02
    light.underwater.spectrum = "led:450,20"
    item = bpy.data.objects.new("Lamp", light)
    item.location = (0.0, 1.0, -DEPTH)
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.update()


def _picture(scene, plan, folder, *, by_band):
    """Bands, or red, green and blue, of a picture, top row first."""
    extent = water_body.water_extent(scene, plan.column, DEPTH)
    make = engines.eevee_bands if by_band else engines.eevee_realtime
    out = np.zeros((SIZE, SIZE, len(plan.bands) if by_band else 3))
    with make(scene, scene.camera, plan, extent, DEPTH) as water:
        draw = water.frame(plan, DEPTH)
        for number, bands in enumerate(water.passes):
            draw(bands, folder / f"{number}.exr")
            found = read_exr(folder / f"{number}.exr")[0]
            if not by_band:
                return found[..., :3].astype(np.float64)
            out[..., list(bands)] = found[..., : len(bands)]
    return out


def _places():
    half = math.tan(bpy.context.scene.camera.data.angle / 2)
    at = (np.arange(SIZE) + 0.5) / SIZE * 2.0 - 1.0
    return np.meshgrid(half * at, -half * at)


def _by_day(plan):
    """Irradiance of the wall, shape (SIZE, SIZE, n): solved anew, without tables."""
    _, z = _places()
    y, column = DEPTH - z * AWAY, plan.column
    field = plan.solved_field()
    depths = np.linspace(y.min(), y.max(), 9)
    E = LightAround.at(column, plan.phase, depths).on_patch(NORMAL)
    facing = max(-(NORMAL @ column.sun_direction), 0.0) / column.sun_cosine
    direct = np.exp(-field.extinction * depths[:, None] / column.sun_cosine)
    E += facing * column.sun_irradiance * direct
    bands = [np.exp(np.interp(y, depths, np.log(band))) for band in E.T]
    return np.stack(bands, axis=-1)


def _by_lamp(scene, plan):
    """Irradiance of the wall in every band by itself."""
    (lamp,) = lamps.plan_lamps(scene, plan).lamps
    water = lamp_water(plan.column.absorption, plan.column.scattering, plan.phase)
    x, z = (AWAY * part[..., None] for part in _places())
    normal = [np.full_like(x, part) for part in NORMAL]
    patch = patch_past_lamp(lamp, [x, np.full_like(x, AWAY), z - DEPTH], normal)
    light = arriving_light(lamp, patch, water)
    E = light.direct + light.about * np.maximum(patch.cosine, 0.0) + light.rest
    return E * lamp.intensity * np.exp(-water.a * light.length)


def _bispectral(dye, bands, E):
    """Radiance of a wall in bands, by summation over wavelengths that come in and go out."""
    step = 0.25
    grid = np.arange(300.0, 900.0, step) + step / 2
    low, high = bands.centres - bands.widths / 2, bands.centres + bands.widths / 2
    inside = (grid[:, None] >= low) & (grid[:, None] < high)
    E_nm = E @ inside.T
    photons = np.interp(grid, dye.emission.wavelengths, dye.emission.values)
    photons = photons / (photons.sum() * step)
    absorbed = np.interp(grid, dye.excitation.wavelengths, dye.excitation.values)
    matrix = dye.quantum_yield * photons[:, None] * absorbed * grid / grid[:, None]
    L_nm = E_nm @ matrix.T * step / math.pi
    return L_nm @ inside / inside.sum(axis=0)


def _wanted(plan, dye, E):
    """What is left of that at the camera: unscattered, for nothing else is in the water."""
    x, z = _places()
    P = AWAY * np.sqrt(1.0 + x * x + z * z)
    c = plan.column.absorption + plan.column.scattering
    return _bispectral(dye, plan.bands, E) * np.exp(-c * P[..., None])


def _errors(scene, plan, folder, name, E, *, by_band):
    """Errors of what a fluorophore adds to a picture, over the most of a band, or of a colour.

    Green and blue of a red glow are small differences of what a sensor sees.
    """
    _glow(name)
    glowing = _picture(scene, plan, folder, by_band=by_band)
    _glow(name, 0.0)
    added = glowing - _picture(scene, plan, folder, by_band=by_band)
    wanted = _wanted(plan, parse_fluorophore(name), E)
    if not by_band:
        lit = metering.lamplight(scene, scene.camera, plan)
        wanted = wanted @ plan.reduction(DEPTH, lit).weights.T
        return np.abs(added - wanted) / np.abs(wanted).max()
    shown = np.abs(wanted).max(axis=(0, 1)) > 1e-2 * np.abs(wanted).max()
    most = np.abs(wanted).max(axis=(0, 1))[shown]
    return np.abs(added - wanted)[..., shown] / most


@pytest.mark.slow
def test_by_daylight_a_picture_has_the_bispectral_sum(scene, tmp_path):
    plan = render_plan.make_plan(DAY)
    errors = _errors(scene, plan, tmp_path, "coral-red", _by_day(plan), by_band=False)
    assert np.median(errors) < 0.005
    assert np.quantile(errors, 0.95) < 0.01


@pytest.mark.slow
def test_by_daylight_bands_have_the_bispectral_sum(scene, tmp_path):
    plan = render_plan.make_plan(DAY)
    errors = _errors(scene, plan, tmp_path, "anemone-red", _by_day(plan), by_band=True)
    assert np.median(errors) < 0.01
    assert np.quantile(errors, 0.95) < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("by_band", [True, False])
def test_under_a_blue_lamp_it_is_drawn_and_has_the_bispectral_sum(scene, tmp_path, by_band):
    """A shader with too many constants is not drawn at all."""
    _blue_lamp()
    plan = render_plan.make_plan(NIGHT)
    E = _by_lamp(scene, plan)
    errors = _errors(scene, plan, tmp_path, "coral-red", E, by_band=by_band)
    assert errors.max() < 0.01


_BYTES = {"VALUE": 4, "INT": 4, "BOOLEAN": 4, "RGBA": 16, "VECTOR": 16}


def _constants(tree):
    """Bytes of a tree's constants, about: its open inputs, and those of its groups."""
    total = 0
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeGroup":
            total += _constants(node.node_tree)
        if node.bl_idname != "NodeGroupOutput":
            total += sum(_BYTES.get(s.type, 0) for s in node.inputs if not s.is_linked)
    return total


@pytest.mark.slow
def test_lamps_find_room_for_it_among_the_constants(scene):
    """A shader holds 64 KB; a second set of all lamps' light would need as much again."""
    _blue_lamp()
    plan, found = render_plan.make_plan(NIGHT), []
    for name in ("", "coral-red"):
        _glow(name)
        water = eevee_water(plan, scene, Eye(scene.camera, DEPTH), np.ones((3, 12)))
        realtime.add_realtime(scene, water, water_body.water_extent(scene, plan.column, DEPTH))
        found.append(_constants(bpy.data.objects["wall"].active_material.node_tree))
        scene_water.remove(scene)
    assert found[0] < found[1] < 1.15 * found[0]


def _water(scene):
    plan = render_plan.make_plan(dataclasses.replace(DAY, bands=3))
    return plan, eevee_water(plan, scene, Eye(scene.camera, DEPTH), np.eye(3))


def test_it_costs_nothing_where_nothing_glows(scene):
    plan, water = _water(scene)
    assert FluorescenceShape not in water.shape
    assert len(water.projected.glowing) == 3
    realtime.add_realtime(scene, water, water_body.water_extent(scene, plan.column, DEPTH))
    assert not any("Fluorescent" in group.name for group in bpy.data.node_groups)


def test_two_objects_glow_each_by_its_own_and_it_leaves_no_trace(scene):
    scenes.wall("other", (4.0, AWAY, -DEPTH), 2.0)
    _glow("coral-red", 0.5)
    _glow("coral-green", 0.25, "other")
    before = snapshot.snapshot()
    plan, water = _water(scene)
    realtime.add_realtime(scene, water, water_body.water_extent(scene, plan.column, DEPTH))
    absorbed = {}
    for name in ("wall", "other"):
        nodes = bpy.data.objects[name].active_material.node_tree.nodes
        node = next(n for n in nodes if MARK in n and "Fluorescence" in n.inputs)
        absorbed[name] = list(node.inputs["Fluorescence"].default_value)
    assert sorted(absorbed["wall"]) == [0.0, 0.0, 0.5]
    assert sorted(absorbed["other"]) == [0.0, 0.0, 0.25]
    assert np.dot(absorbed["wall"], absorbed["other"]) == 0.0
    scene_water.remove(scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_too_many_and_unknown_ones_are_refused(scene):
    for number, name in enumerate(("coral-red", "coral-green", "coral-cyan", "fluorescein")):
        scenes.wall(name, (number, AWAY, -DEPTH), 1.0)
        _glow(name, wall=name)
    with pytest.raises(InputError, match="4 fluorophores .* a picture can have 3"):
        _water(scene)
    _glow("coral-gren", wall="fluorescein")
    _glow("", wall="coral-red")
    with pytest.raises(InputError, match="material 'fluorescein': unknown fluorophore"):
        _water(scene)


def test_cycles_says_that_it_leaves_it_out(scene):
    _glow("coral-red")
    plan = render_plan.make_plan(dataclasses.replace(DAY, bands=3))
    extent = water_body.water_extent(scene, plan.column, DEPTH)
    with engines.cycles_bands(scene, scene.camera, plan, extent, seed=1) as water:
        assert any("'wall' is not drawn by Cycles" in note for note in water.notes)
    materials = [bpy.data.objects["wall"].active_material]
    _glow("")
    assert fluorescence.unseen(materials, "Cycles") == []
