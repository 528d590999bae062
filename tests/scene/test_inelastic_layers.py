"""Emitting layers in Cycles against the solved field."""

from __future__ import annotations

import math
from dataclasses import replace

import bpy
import numpy as np
import pytest
from underwater_spectral.scene.engines import cycles_settings, exr_output
from underwater_spectral.scene.terms import inelastic_layers, limits
from underwater_spectral.scene.water import cycles_water, pass_values, scene_water, water_body
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import columns, scenes
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.transfer.discrete_ordinates import Emission
from underwater_spectral.uw_spectral.water.inelastic_processes import EXCITATION
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

DEPTH = 3.0


LIGHT = Emission(np.full((1, 3), 0.3), np.full((1, 3), 0.05))
"""What falls off like light of 0.3 1/m, in every band."""


def radiance(column, w, depth=DEPTH):
    phase = parse_phase("hg:0.8").for_bands(np.ones(3))
    return column.solved_field(phase, 32, LIGHT).radiance(depth, w)


def rendered(column, tilt, tmp_path, samples, depth=DEPTH):
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = 8
    camera = scenes.add_camera((0.0, 0.0, -depth), (tilt, 0.0, 0.0))
    camera.data.angle = math.radians(1.0)
    extent = water_body.water_extent(scene, column, depth)
    cycles_water.add_water(
        scene, column, columns.layers_of(column, columns.henyey_greenstein(0.8)), extent
    )
    emitted = inelastic_layers.bring(scene, LIGHT, column.floor_depth, extent, depth)
    values = pass_values.PassValues.of_column(
        column, columns.layers_of(column, columns.henyey_greenstein(0.8))
    )
    values = values.with_values(emitted)
    values.apply(scene.view_layers[0], (0, 1, 2))
    settings = {"samples": samples, "seed": 1}
    with cycles_settings.reference_settings(scene, camera, **settings):
        exr_output.write_float_exr(scene, tmp_path / "a.exr")
    scene_water.remove(scene)
    assert not [o for o in bpy.data.objects if o.name.startswith(inelastic_layers.NAME)]
    return read_exr(tmp_path / "a.exr")[0].astype(np.float64).mean(axis=(0, 1))


@pytest.mark.parametrize("depth", [DEPTH, 16.0, 40.0])
@pytest.mark.parametrize(("tilt", "w_z"), [(0.0, -1.0), (math.radians(120.0), 0.5)])
def test_layers_in_absorbing_water(tmp_path, tilt, w_z, depth):
    """Without scattering the solution is exact: what is emitted along the ray, and absorbed.

    With more layers above a camera than Cycles tells apart, it was wrong below 10 m.
    """
    column = replace(
        columns.grey_column(0.2, 0.0, sun_irradiance=0.0), absorption=np.array([0.1, 0.2, 0.4])
    )
    w = (0.0, math.sqrt(1 - w_z**2), w_z)
    off = 0.01 if depth == DEPTH else 0.025
    found = rendered(column, tilt, tmp_path, 4, depth)
    np.testing.assert_allclose(found, radiance(column, w, depth), rtol=off)
    # By hand: 0.05/4π e^{-0.3 (y + v down)} e^{-a v} dv, to the surface or for ever.
    rate = column.absorption - 0.3 * w_z
    transmittance = 1.0 - np.exp(-rate * depth / w_z) if w_z > 0 else 1.0
    by_hand = 0.05 / (4 * math.pi) * math.exp(-0.3 * depth) * transmittance / rate
    np.testing.assert_allclose(found, by_hand, rtol=off)


def test_layers_in_scattering_water_over_a_floor(tmp_path):
    column = columns.grey_column(
        0.1, 0.3, sun_irradiance=0.0, floor_depth=6.0, floor_reflectance=0.5
    )
    found = rendered(column, 0.0, tmp_path, 256)
    np.testing.assert_allclose(found, radiance(column, (0.0, 0.0, -1.0)), rtol=0.03)


def test_layers_reach_the_bottom_and_keep_the_emission():
    edges = inelastic_layers.boundaries(LIGHT, math.inf, 200.0, 60.0)
    assert edges[0] == 0
    assert edges[-1] == 200
    assert np.all(np.diff(edges) > 0)
    assert (edges < 60.0).sum() <= 24
    per_metre = np.array(list(inelastic_layers.emission(LIGHT, math.inf, edges).values()))
    made = (per_metre * (np.diff(edges) - 2e-3)[:, None]).sum(axis=0) * 4 * math.pi
    np.testing.assert_allclose(made, 0.05 / 0.3, rtol=1e-6)


def test_layers_follow_the_camera():
    scene, column = bpy.context.scene, columns.grey_column(0.1, 0.0)
    extent = water_body.WaterExtent(50.0, 100.0)
    cycles_water.add_water(
        scene, column, columns.layers_of(column, columns.henyey_greenstein(0.8)), extent
    )
    for depth in (3.0, 30.0, 3.0):
        emitted = inelastic_layers.bring(scene, LIGHT, math.inf, extent, depth)
        found = [item for item in scene.objects if item.name.startswith(inelastic_layers.NAME)]
        assert len(found) == len(emitted)
        heights = sorted(z for item in found for _, _, z in item.bound_box)
        assert min(abs(np.array(heights) + depth)) > 0.05, "the camera is in the middle of one"
    assert inelastic_layers.bring(scene, None, math.inf, extent, 3.0) == {}
    assert not [m for m in bpy.data.materials if m.name.startswith(inelastic_layers.NAME)]


@pytest.mark.parametrize(
    ("count", "step", "more", "said"),
    [(40, 0.1, 0, True), (10, 0.1, 0, False), (40, 9.0, 0, False), (10, 0.1, 24, True)],
)
def test_more_volumes_than_cycles_tells_apart_are_named(count, step, more, said):
    fog = bpy.data.materials.new("Fog")
    tree = fog.node_tree
    scatter = tree.nodes.new("ShaderNodeVolumeScatter")
    tree.links.new(scatter.outputs[0], tree.get_output_node("ALL").inputs["Volume"])
    for k in range(count):
        bpy.ops.mesh.primitive_cube_add(size=5.0, location=(step * k, 0.0, -20.0))
        bpy.context.object.data.materials.append(fog)
    found = limits.of_volumes(bpy.context.scene, [(0.0, 0.0, -30.0)], more)
    assert bool(found) == said


def test_settings_switch_inelastic_light_on():
    off = SceneSettings(water="case:baltic", bands=6)
    assert make_plan(off).emission() is None
    plan = make_plan(replace(off, inelastic="all", surface="flat", floor_depth=8.0))
    parts = [
        make_plan(replace(plan.settings, inelastic=name)).emission().at([3.0], 8.0)
        for name in ("raman", "chlorophyll", "cdom")
    ]
    # Each excites the others, too.
    together = plan.emission().at([3.0], 8.0) / sum(parts)
    assert np.all((together > 0.9999) & (together < 1.01))
    assert len(EXCITATION) == 20
    assert make_plan(SceneSettings(inelastic="raman")).emission() is not None
    with pytest.raises(InputError, match="bio: or case:"):
        make_plan(SceneSettings(inelastic="cdom"))
    with pytest.raises(InputError, match="second water"):
        make_plan(
            replace(off, inelastic="all", second_water="jerlov:II", second_water_fraction=0.1)
        )
    with pytest.raises(InputError, match="raman"):
        make_plan(SceneSettings(inelastic="ramen"))


def test_bio_optical_water_brings_its_phase_function():
    plan = make_plan(SceneSettings(water="bio:chl=1,minerals=2", bands=3))
    assert len(plan.phase.components) == 3
    chosen = make_plan(SceneSettings(water="bio:chl=1,minerals=2", bands=3, phase="hg:0.9"))
    assert len(chosen.phase.components) == 1
