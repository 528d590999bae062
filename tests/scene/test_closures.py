"""Cycles has room for every closure of a material and of the water."""

from __future__ import annotations

import math
import subprocess
import sys

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups import uplift
from underwater_spectral.node_groups.water_volume import ScatteringLobe
from underwater_spectral.scene.engines import cycles_settings, exr_output
from underwater_spectral.scene.materials import band_colors
from underwater_spectral.scene.water import cycles_water, pass_values, water_body
from underwater_spectral.scene.water.cycles_phase import cycles_phase, cycles_phases
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import columns, scenes
from underwater_spectral.uw_spectral.errors import DataWarning
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.water.phase_functions import EinsteinSmoluchowski


@pytest.mark.slow
@pytest.mark.filterwarnings(f"ignore::{DataWarning.__module__}.DataWarning")
def test_cycles_does_not_run_out_of_closures(tmp_path, pytestconfig):
    bpy.ops.wm.read_factory_settings()
    scene = bpy.context.scene
    for item in scene.objects:
        item.location.z -= 8.0
    scene.render.resolution_x, scene.render.resolution_y = 16, 9
    blend = tmp_path / "cube.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    command = [sys.executable, pytestconfig.rootpath / "render_bands.py", blend]
    command += ["--engine", "cycles", "--bands", "3", "--samples", "1", "--out", tmp_path / "out"]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    assert (tmp_path / "out" / "0001.exr").exists()
    assert "closures" not in done.stdout + done.stderr
    # Cycles counts 32 for each lobe of a volume, and has room for 64.
    for peak in ("bounded", "exact"):
        plan = make_plan(SceneSettings(bands=3, forward_peak=peak))
        assert len(cycles_phases(plan)[0].lobes) <= 2


@pytest.mark.filterwarnings(f"ignore::{DataWarning.__module__}.DataWarning")
def test_eevee_asks_for_no_phase_functions_of_cycles():
    plan = make_plan(SceneSettings(bands=3, phase="petzold", forward_peak="exact"))
    assert not any("Cycles" in note for note in plan.notes)
    notes = [note for phase in cycles_phases(plan) for note in phase.notes]
    assert any("petzold is rendered" in note for note in notes)


def _column(b, **changes):
    return columns.grey_column(0.1, b, **{"floor_depth": 10.0} | changes)


def _radiance(lobes, fractions, tilt, tmp_path):
    """Mean radiance and its standard error, single and multiple scattering alike."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene, column = bpy.context.scene, _column(0.5, sky_radiance=0.1)
    scene.render.resolution_x = scene.render.resolution_y = 16
    camera = scenes.add_camera((0.0, 0.0, -3.0), (math.radians(tilt), 0.0, 0.0))
    camera.data.angle = math.radians(1.0)
    phases = columns.layers_of(column, lobes, fractions)
    cycles_water.add_water(scene, column, phases, water_body.water_extent(scene, column, 3.0))
    pass_values.PassValues.of_column(column, phases).apply(scene.view_layers[0], (0, 1, 2))
    scene.cycles.pixel_filter_type = "BOX"
    with cycles_settings.reference_settings(scene, camera, samples=128, seed=1):
        exr_output.write_float_exr(scene, tmp_path / "a.exr")
    image = read_exr(tmp_path / "a.exr")[0][..., 0].astype(np.float64)
    return image.mean(), image.std() / 16


@pytest.mark.parametrize("tilt", [0.0, 90.0])
def test_molecules_scatter_as_rayleigh_and_a_constant_do(tilt, tmp_path):
    """1 + f cos² is f (1 + cos²) and a constant, by their fractions of the integral."""
    f = EinsteinSmoluchowski().anisotropy
    fraction = f * (4.0 / 3.0) / (1.0 + f / 3.0)
    parts = ScatteringLobe("RAYLEIGH"), ScatteringLobe("HENYEY_GREENSTEIN", 0.0)
    wanted, noise = _radiance(parts, (fraction, 1.0 - fraction), tilt, tmp_path)
    one = cycles_phase(EinsteinSmoluchowski().for_bands(np.ones(3)))
    assert len(one.lobes) == 1
    found, own_noise = _radiance(one.lobes, (one.fractions[0][0],), tilt, tmp_path)
    assert abs(found - wanted) < 3 * math.hypot(noise, own_noise)
    assert noise < 0.01 * wanted


def test_only_inputs_that_weigh_something_follow_the_bands():
    material = scenes.principled("paint")
    inputs = material.node_tree.nodes["Principled BSDF"].inputs
    pairs = {
        "Coat Tint": "Coat Weight",
        "Sheen Tint": "Sheen Weight",
        "Emission Color": "Emission Strength",
        "Subsurface Radius": "Subsurface Weight",
    }
    for name in pairs:
        for channel, value in enumerate((0.9, 0.5, 0.2)):
            inputs[name].default_value[channel] = value

    def routed():
        band_colors.insert([material])
        found = {
            i.name
            for i in inputs
            if i.is_linked and uplift.is_uplift(i.links[0].from_node.node_tree)
        }
        band_colors.remove([])
        return found

    assert routed() == {"Base Color"}
    for weight in pairs.values():
        inputs[weight].default_value = 0.1
    assert routed() == {"Base Color", *pairs}
