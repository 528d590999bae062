"""The picture towards the sun: tables in numpy and in EEVEE against the solved light field."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.scene.water import frame_water
from underwater_spectral.tests.node_groups import realtime_probe as probe
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.surface.refraction import (
    in_water_cosine,
    sun_travel_direction,
)
from underwater_spectral.uw_spectral.transfer.radiance_table import tabulate
from underwater_spectral.uw_spectral.transfer.sun_beam import half_angle2
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.optical_properties import Water
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase
from underwater_spectral.uw_spectral.water.pure_water import molecular_scattering
from underwater_spectral.validation.tabulated_water import aureole_at

ZENITH, INDEX = 30.0, 1.34


def _optics(water, surface):
    nm, water = np.array([450.0, 540.0, 620.0]), Water.jerlov(water)
    b = water.b(nm)
    column = WaterColumn(
        Bands.uniform(3), water.a(nm), b, 1.0, float(in_water_cosine(ZENITH, INDEX)),
        sun_travel_direction(ZENITH, -90.0, INDEX), 0.1, 12.0, 0.2, surface, INDEX,
    )  # fmt: skip
    return column, parse_phase("mixture").for_bands(b, molecular_scattering(nm))


@pytest.mark.parametrize(("water", "y"), [("IB", 8.0), ("3C", 5.0)])
def test_factor_looked_up_is_that_of_the_solved_field(water, y):
    column, phase = _optics(water, "none")
    field = column.solved_field(phase)
    angles = np.radians([0.2, 0.5, 1.0, 2.0, 4.0, 7.0, 11.0, 14.0, 30.0])
    up = -np.array(column.sun_direction)
    across = np.cross(up, (1.0, 0.0, 0.0))
    w = np.cos(angles)[:, None] * up + np.sin(angles)[:, None] * across
    found = aureole_at(tabulate(field), y, w.T, column.sun_direction)
    wanted = field.aureole([y], np.sin(angles / 2) ** 2)[:, 0].T
    assert wanted.min() < 0.9
    np.testing.assert_allclose(found, wanted, atol=0.01)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("water", "surface", "y", "bound"), [("IB", "flat", 8.0, 0.03), ("3C", "none", 5.0, 0.08)]
)
def test_eevee_towards_the_sun(tmp_path, water, surface, y, bound):
    column, phase = _optics(water, surface)
    field = column.solved_field(phase)
    turn = 180.0 - math.degrees(math.acos(-column.sun_direction[2]))
    view = probe.View(y, turn, angle=24.0, square=None)
    numbers = frame_water.realtime_water(column, phase, y, np.eye(3), solved=field)
    found = probe.render(numbers, view, tmp_path / "sun.exr")
    w = tuple(view.rays()[..., axis] for axis in range(3))
    assert half_angle2(w, column.sun_direction).min() < math.radians(0.5) ** 2 / 4
    np.testing.assert_allclose(found, field.radiance(y, w), rtol=bound)
