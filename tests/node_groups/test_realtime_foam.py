"""Foam in EEVEE against numpy, pixel by pixel, from above and from below."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from underwater_spectral.node_groups import realtime_values, realtime_waves
from underwater_spectral.scene.readers.moving_surface import ViewFromAir
from underwater_spectral.scene.terms.view_from_air import AirTerm
from underwater_spectral.scene.terms.waves import WaveTerm
from underwater_spectral.scene.water import frame_water
from underwater_spectral.scene.water.frame_water import FrameInputs
from underwater_spectral.tests.node_groups import realtime_probe as probe
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.surface.raised_waves import surface_ahead
from underwater_spectral.uw_spectral.surface.refraction import (
    in_water_cosine,
    sun_travel_direction,
)
from underwater_spectral.uw_spectral.surface.wave_patterns import Sea
from underwater_spectral.uw_spectral.surface.whitecaps import Foam
from underwater_spectral.uw_spectral.transfer.radiance_field import surface_normal
from underwater_spectral.uw_spectral.transfer.radiance_table import TABLE_STREAMS
from underwater_spectral.uw_spectral.transfer.sunlit_water import SunlitWater
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

SEA = Sea(5.0, 40.0, seed=3, tile=4.0, resolution=64, raised=True, foam=True)
MUCH = Foam(-0.05, 10.0)  # foam over half of a sea that has hardly any
NONE = Foam(1e3, 1.0)
PHASE = parse_phase("hg:0.9").for_bands(np.ones(3))
ZENITH, ABSORPTION, SKY = 30.0, np.array([0.4, 0.2, 0.1]), 0.1


@pytest.fixture
def column() -> WaterColumn:
    """Water that hardly scatters, under a sun and an even sky."""
    return WaterColumn(
        Bands.uniform(3), ABSORPTION, np.full(3, 1e-3), np.ones(3),
        float(in_water_cosine(ZENITH)), sun_travel_direction(ZENITH, 160.0), np.full(3, SKY),
        np.inf, np.zeros(3), "waves", 1.34,
    )  # fmt: skip


def _pictures(column, view, path, **seen):
    """Pictures without foam and with it, and the surface."""
    now = SEA.at(1.0, column.sun_direction, column.refractive_index)
    found = []
    for foam in (NONE, MUCH):
        waves = dataclasses.replace(now, raised=dataclasses.replace(now.raised, foam=foam))
        depth = max(view.depth, 0.0)
        water = frame_water.realtime_water(column, PHASE, depth, np.eye(3), **seen)
        contrast = waves.contrast(SunlitWater(column.solved_field(PHASE, TABLE_STREAMS)))
        water = water.with_terms(WaveTerm(waves, contrast, 1.0))
        water.numbers.single[realtime_waves.GLITTER] = 0.0
        found.append(probe.render(water, view, path))
    return *found, waves.raised


@pytest.mark.slow
def test_from_above_it_is_a_matte_white_that_hides_the_water(tmp_path, empty_blender, column):
    view = probe.View(-1.0, turn=50.0, angle=25.0, square=None)
    above = ViewFromAir((0.0, 0.0, 1.0), True, (0.0, 0.9, -0.4))
    bare, foamy, raised = _pictures(
        column, view, tmp_path / "a.exr", inputs=FrameInputs(terms=(AirTerm(above),))
    )
    v = tuple(np.moveaxis(view.rays(), -1, 0))
    found, away = surface_ahead((0.0, 0.0, 1.0), v, raised.elevation, raised.highest, 1.0, 0.1)
    judged = (found > 0) & (v[2] < -0.15)
    place = away * v[0], away * v[1]
    parts, slopes = (raised.near, raised.far), []
    for axis in "xy":
        slopes.append(sum(p.at(*place, getattr(p, f"slope_{axis}"))[0] for p in parts))
    # The sun in air has E/(1 - R) of the irradiance below; R is 0.022 at 30 degrees.
    sun = np.array(column.skylight.sun)
    across = 1.0 / 0.978 / math.cos(math.radians(ZENITH))
    facing = np.maximum(-sum(n * s for n, s in zip(surface_normal(*slopes), sun, strict=True)), 0)
    white = (0.55 / math.pi) * (across * facing + math.pi * SKY)[..., None]
    fraction = raised.foam_fraction(*place)[..., None]
    judged &= fraction[..., 0] > 0.05
    wanted = (1.0 - fraction) * bare + fraction * white
    blue = Bands.uniform(3).centres < 560.0
    print(f"\nfoam: {foamy[judged].mean() / wanted[judged].mean():.3f}")  # noqa: T201
    error = (np.abs(foamy - wanted) / wanted)[judged][:, blue]
    assert fraction[judged].mean() > 0.2
    assert np.median(error) < 0.02
    assert foamy[judged][:, blue].mean() == pytest.approx(wanted[judged][:, blue].mean(), rel=0.03)
    full = judged & (fraction[..., 0] > 0.99)
    falls = foamy[full].mean(axis=0) / foamy[full][:, blue].mean()
    assert np.all(falls[~blue] < 0.95)


@pytest.mark.slow
def test_from_below_it_glows_with_what_it_lets_through(tmp_path, empty_blender, column):
    view = probe.View(0.8, turn=180.0, angle=110.0, square=None)
    bare, foamy, raised = _pictures(column, view, tmp_path / "a.exr")
    w = tuple(np.moveaxis(view.rays(), -1, 0))
    start = (0.0, 0.0, -view.depth)
    found, away = surface_ahead(start, w, raised.elevation, raised.highest, -1.0)
    judged = (found > 0) & (w[2] > 0.3)
    fraction = raised.foam_fraction(away * w[0], away * w[1])[..., None]
    judged &= fraction[..., 0] > 0.05
    E = 1.0 / 0.978 + math.pi * SKY
    glow = (0.45 / math.pi) * E * np.exp(-(ABSORPTION + 1e-3) * away[..., None])
    wanted = (1.0 - fraction) * bare + fraction * glow
    print(f"\nfoam: {foamy[judged].mean() / wanted[judged].mean():.3f}")  # noqa: T201
    error = (np.abs(foamy - wanted) / wanted)[judged]
    assert fraction[judged].mean() > 0.2
    assert np.median(error) < 0.02
    assert foamy[judged].mean() == pytest.approx(wanted[judged].mean(), rel=0.03)


def test_without_foam_there_is_nothing_of_it(column):
    calm = dataclasses.replace(SEA, foam=False)
    now = calm.at(1.0, column.sun_direction, column.refractive_index)
    water = frame_water.realtime_water(column, PHASE, 1.0, np.eye(3))
    shape = water.with_terms(WaveTerm(now, np.ones((7, 3)), 1.0)).shape
    assert realtime_waves.FoamShape not in shape
    names = {*realtime_values.channel_names(shape), *realtime_values.single_names(shape)}
    assert not any(name.startswith("foam") for name in names)
    assert realtime_waves.WaveImages(None, None).crowding is None
