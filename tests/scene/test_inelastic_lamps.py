"""Light of changed wavelength that lamps make in pictures: laws, its integral, and both engines."""

from __future__ import annotations

import dataclasses
import math

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups.lamp_term import LampShape
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.readers import lamps
from underwater_spectral.scene.readers.lamp_shadows import LampShadowCache
from underwater_spectral.scene.terms import eevee_water
from underwater_spectral.scene.water import excited_water, water_body
from underwater_spectral.scene.water.occlusion import Cache
from underwater_spectral.scene.water.term import Eye
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.lamps.inelastic_source import inelastic_light
from underwater_spectral.uw_spectral.lamps.lamp import ray_past_lamp
from underwater_spectral.uw_spectral.lamps.lamp_projection import with_soft_shadow
from underwater_spectral.uw_spectral.lamps.multiple_scattering import BandLight, light_along
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

DEPTH, WIDTH, HEIGHT = 8.0, 24, 16
NIGHT = SceneSettings(
    water="bio:chl=5,cdom=0.3", inelastic="all", wavelengths="460,540,685", samples=8,
    surface="none", sunlight=0.0, scene_floor=False, diffuse_shadows=False, shafts=False,
)  # fmt: skip
BLUE = "led:450,20"


@pytest.fixture
def scene(registered):
    """A camera at 8 m that looks along y, into open water."""
    scenes.add_camera((0.0, 0.0, -DEPTH), (math.pi / 2, 0.0, 0.0))
    render = registered.render
    render.resolution_x, render.resolution_y = WIDTH, HEIGHT
    render.filter_size = 0.0
    return registered


def _lamp(place, kind="POINT", turn=(0.0, 0.0, 0.0), spectrum=BLUE):
    light = bpy.data.lights.new("Lamp", kind)
    light.energy, light.shadow_soft_size = 100.0, 0.02
    if kind == "SPOT":
        light.spot_size, light.spot_blend = math.radians(70.0), 0.4
    light.underwater.spectrum = spectrum
    item = bpy.data.objects.new("Lamp", light)
    item.location, item.rotation_euler = (place[0], place[1], place[2] - DEPTH), turn
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    return item


def _bands(scene, folder, *, cycles=False, notes=(), **changes):
    """Bands of a picture, (HEIGHT, WIDTH, 3), top row first; and the plan."""
    plan = make_plan(dataclasses.replace(NIGHT, **changes))
    extent = water_body.water_extent(scene, plan.column, DEPTH)
    opened = (
        engines.cycles_bands(scene, scene.camera, plan, extent, seed=1)
        if cycles
        else engines.eevee_bands(scene, scene.camera, plan, extent, DEPTH)
    )
    with opened as water:
        said = [note for note in water.notes if "inelastic" in note]
        assert [note.split(" is ")[0] for note in said] == list(notes)
        water.frame(plan, DEPTH)((0, 1, 2), folder / "a.exr")
    return read_exr(folder / "a.exr")[0][..., :3], plan


def _integral(scene, plan, known=None):
    """The same, of light of changed wavelength alone, of formulas."""
    half = math.tan(scene.camera.data.angle / 2)
    x = half * ((np.arange(WIDTH) + 0.5) / WIDTH * 2.0 - 1.0)
    z = -half * ((np.arange(HEIGHT) + 0.5) * 2.0 - HEIGHT) / WIDTH
    x, z = np.meshgrid(x, z)
    w = np.stack([x, np.ones_like(x), z]) / np.sqrt(1 + x**2 + z**2)
    water, total = plan.lamp_water(DEPTH), 0.0
    shining = known or lamps.plan_lamps(scene, plan).lamps, lamps.lamp_excitations(scene, plan)
    for lamp, excited in zip(*shining, strict=True):
        seen = water.field.harmonics
        light = BandLight(1.0, water, inelastic_light(excited, lamp.profile, seen, seen.scale))
        ray = ray_past_lamp(lamp, (0.0, 0.0, -DEPTH), tuple(w[..., None]), 1e3)
        total = total + light_along(lamp, ray, light)[1]
    return total


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "place"), [("SPOT", (0.7, 0.5, 0.4)), ("POINT", (0.5, 3.0, 0.3))])
def test_light_in_the_water_is_the_integral_of_its_source(scene, tmp_path, kind, place):
    _lamp(place, kind, (math.pi / 2, 0.0, 0.1))
    on, plan = _bands(scene, tmp_path)
    off, _ = _bands(scene, tmp_path, inelastic="")
    # The lamp itself has no light at 685 nm: that of chlorophyll is all.
    assert not np.any(off[..., 2])
    ratio = (on - off)[..., 1:] / _integral(scene, plan)[..., 1:]
    assert np.median(ratio, axis=(0, 1)) == pytest.approx([1.0, 1.0], rel=2e-3)
    assert np.quantile(np.abs(ratio - 1.0), 0.95) < 5e-3


@pytest.mark.slow
def test_lamps_add_and_a_farther_one_is_darker(scene, tmp_path):
    near = _lamp((0.7, 2.0, 0.4))
    first, _ = _bands(scene, tmp_path)
    _lamp((0.7, 5.0, 0.4))
    both, _ = _bands(scene, tmp_path)
    near.hide_render = True
    second, _ = _bands(scene, tmp_path)
    assert both == pytest.approx(first + second, rel=2e-3, abs=1e-3 * float(second[..., 1:].max()))
    assert np.all(second.mean(axis=(0, 1)) < 0.5 * first.mean(axis=(0, 1)))


@pytest.mark.parametrize(
    ("spectrum", "inelastic", "count"), [(BLUE, "all", 1), (BLUE, "", 0), ("", "raman", 1)]
)
def test_nodes_have_it_where_something_is_excited(scene, spectrum, inelastic, count):
    _lamp((0.7, 2.0, 0.4), spectrum=spectrum)
    plan = make_plan(dataclasses.replace(NIGHT, inelastic=inelastic))
    water = eevee_water.eevee_water(
        plan, scene, Eye(scene.camera, DEPTH), np.ones((3, 3)), Cache(of_job=True)
    )
    (shape,) = (x for x in water.shape.terms if isinstance(x, LampShape))
    assert shape.inelastic == count


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "changes"),
    [
        ("POINT", {}),
        ("POINT", {"water": "jerlov:IB", "inelastic": "raman", "wavelengths": "500,530,560"}),
    ],
)
def test_cycles_emits_it(scene, tmp_path, kind, changes):
    _lamp((0.7, 0.5, 0.4), kind, (math.pi / 2, 0.0, 0.1))
    on, plan = _bands(scene, tmp_path, cycles=True, samples=256, **changes)
    off, _ = _bands(scene, tmp_path, cycles=True, samples=256, **{**changes, "inelastic": ""})
    # With the same seed the elastic light has the same noise.
    ratio = (on - off).mean(axis=(0, 1)) / _integral(scene, plan).mean(axis=(0, 1))
    assert ratio == pytest.approx(np.ones(3), rel=0.05)


@pytest.mark.slow
def test_objects_keep_light_from_what_it_would_excite_in_cycles(scene, tmp_path):
    _lamp((0.7, 0.5, 0.4))
    ways = {"cycles": True, "samples": 128}
    free, plan = _bands(scene, tmp_path, **ways)
    wanted = _integral(scene, plan)
    # Beside the view, half of which it keeps in the dark, black.
    scenes.wall("wall", (0.6, 0.55, -DEPTH + 0.35), 0.15, 0.0)
    found = lamps.plan_lamps(scene, plan)
    (lamp,) = LampShadowCache().of(scene, found).lamps
    shadowed = with_soft_shadow(lamp, plan.lamp_water(DEPTH))
    dark, _ = _bands(scene, tmp_path, **ways)
    # The lamp itself has no light at 685 nm.
    kept = _integral(scene, plan, [shadowed])[..., 2].mean() / wanted[..., 2].mean()
    assert 0.2 < kept < 0.8
    assert dark[..., 2].mean() / free[..., 2].mean() == pytest.approx(kept, rel=0.08)


@pytest.mark.slow
def test_cycles_adds_what_sun_and_lamps_excite(scene, tmp_path):
    day = {"sunlight": 0.02, "samples": 64, "wavelengths": "685,690,695"}
    lamp = _lamp((0.7, 0.5, 0.4))
    both, _ = _bands(scene, tmp_path, cycles=True, **day)
    lamp.hide_render = True
    sun, _ = _bands(scene, tmp_path, cycles=True, **day)
    lamp.hide_render = False
    night, _ = _bands(scene, tmp_path, cycles=True, **{**day, "sunlight": 0.0})
    found = both.mean(axis=(0, 1)) / (sun + night).mean(axis=(0, 1))
    assert found == pytest.approx(np.ones(3), rel=0.03)
    assert sun.mean() > 0.1 * night.mean()


def test_volume_of_cycles_comes_with_what_excites(scene, tmp_path):
    """It is seen in no other render, and leaves nothing in the file."""
    _lamp((0.7, 0.5, 0.4))
    plan = make_plan(dataclasses.replace(NIGHT, samples=1))
    extent = water_body.water_extent(scene, plan.column, DEPTH)
    with engines.cycles_bands(scene, scene.camera, plan, extent, seed=1) as water:
        for _ in range(2):
            water.frame(plan, DEPTH)
            (item,) = excited_water.volumes(scene)
            assert item.hide_render
            images = [one for one in bpy.data.images if one.name.startswith("UW Excited")]
            assert len(images) == 1
    assert not bpy.data.images
    assert not bpy.data.materials
    elastic = make_plan(dataclasses.replace(NIGHT, samples=1, inelastic=""))
    with engines.cycles_bands(scene, scene.camera, elastic, extent, seed=1) as water:
        water.frame(elastic, DEPTH)
        assert not excited_water.volumes(scene)


def test_cycles_says_what_it_lacks(scene, tmp_path):
    item = _lamp((-0.6, 1.6, 0.2))
    item.location.z, item.data.underwater.from_above = 1.0, True
    _bands(scene, tmp_path, cycles=True, notes=["inelastic light of lamps in the air"], samples=1)
