"""Skies with a direction: Cycles against the solved field."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.water import water_body
from underwater_spectral.scene.water.cycles_phase import cycles_phase
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import columns, scenes
from underwater_spectral.tests.validation import cycles_probe
from underwater_spectral.uw_spectral.errors import DataWarning
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.surface.refraction import in_water_cosine, sun_travel_direction
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase, seawater_mixture

G, INDEX, ZENITH, AZIMUTH, DEPTH = 0.8, 1.34, 50.0, 130.0, 2.0
LOBES = columns.henyey_greenstein(G)
PHASE = parse_phase(f"hg:{G}").for_bands(np.ones(3))


def _column(sky, surface="flat", azimuth=AZIMUTH, **changes):
    values = {"sun_irradiance": 0.0, "sky_radiance": 1.0, "floor_depth": 6.0,
              "floor_reflectance": 0.3} | changes  # fmt: skip
    return columns.grey_column(
        0.05, 0.1, surface=surface, refractive_index=INDEX, sky=sky,
        sun_cosine=float(in_water_cosine(ZENITH, INDEX)),
        sun_direction=sun_travel_direction(ZENITH, azimuth, INDEX), **values,
    )  # fmt: skip


def _rotation(w):
    """Euler angles of a camera that looks along w."""
    return (math.acos(-w[2]), 0.0, math.atan2(w[1], w[0]) - math.pi / 2)


def _towards(zenith, azimuth):
    """Unit direction of view into the water at an angle from the zenith."""
    z, turn = math.radians(zenith), math.radians(azimuth)
    return math.sin(z) * math.cos(turn), math.sin(z) * math.sin(turn), math.cos(z)


# Up beside the sun and opposite, level across the sun, and down; and samples that they need.
VIEWS = ((_towards(30.0, AZIMUTH + 165), 256), (_towards(30.0, AZIMUTH), 256),
         (_towards(85.0, AZIMUTH + 100), 2048), (_towards(150.0, AZIMUTH), 1024))  # fmt: skip
LEVEL = _towards(75.0, AZIMUTH + 100)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("sky", "surface"), [("overcast", "flat"), ("clear", "flat"), ("clear", "none")]
)
def test_light_in_the_water(empty_blender, tmp_path, sky, surface):
    column = _column(sky, surface)
    field, path = column.solved_field(PHASE), tmp_path / "a.exr"
    found = cycles_probe.downwelling_irradiance(
        empty_blender, column, LOBES, DEPTH, samples=1024, path=path
    )
    wanted = float(field.Ed(DEPTH)[0])
    assert found.error < 0.005 * wanted
    assert abs(found.mean - wanted) <= 3 * found.error + 5e-3 * wanted
    for w, samples in VIEWS:
        found = cycles_probe.radiance(
            empty_blender, column, LOBES, DEPTH, _rotation(w), samples=samples, path=path
        )
        wanted = float(field.radiance(DEPTH, w)[0])
        assert found.error < 0.01 * wanted
        assert abs(found.mean - wanted) <= 3 * found.error + 5e-3 * wanted


def test_two_lobes_without_a_surface(empty_blender, tmp_path):
    """If Cycles 5.2 sampled the sky, it would be 1.2 % too bright here."""
    column = _column("clear", "none", floor_reflectance=0.1)
    phase = seawater_mixture(column.scattering, 0.02)
    wanted = float(column.solved_field(phase, 48).radiance(DEPTH, LEVEL)[0])
    found = cycles_probe.radiance_of_phases(
        empty_blender, column, [cycles_phase(phase, bounded=True)], DEPTH, _rotation(LEVEL),
        samples=1024, path=tmp_path / "a.exr",
    )  # fmt: skip
    assert found.error < 0.0015 * wanted
    assert abs(found.mean - wanted) <= 3 * found.error + 5e-3 * wanted


@pytest.mark.filterwarnings(f"ignore::{DataWarning.__module__}.DataWarning")
def test_sky_follows_the_sun(empty_blender, tmp_path):
    """From frame to frame of an animation, nothing is built anew."""
    scene, path, (w, _) = empty_blender, tmp_path / "a.exr", VIEWS[0]
    plans = [
        make_plan(SceneSettings(water="jerlov:I", phase="hg:0.8", bands=3, surface="flat",
                                sky="clear", sky_radiance=1.0, sun_zenith=ZENITH,
                                sun_azimuth=azimuth, samples=64))
        for azimuth in (AZIMUTH, AZIMUTH + 90.0)
    ]  # fmt: skip
    camera = scenes.add_camera((0.0, 0.0, -DEPTH), _rotation(w))
    camera.data.angle = math.radians(1.0)
    scene.render.resolution_x = scene.render.resolution_y = 8
    extent = water_body.water_extent(scene, plans[0].column, DEPTH)
    with engines.cycles_bands(scene, camera, plans[0], extent, seed=1) as engine:
        for plan in plans:
            engine.frame(plan, DEPTH)((0, 1, 2), path)
            wanted = plan.column.solved_field(plan.phase).radiance(DEPTH, w)
            np.testing.assert_allclose(read_exr(path)[0].mean(axis=(0, 1)), wanted, rtol=0.03)
