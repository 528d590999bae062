"""The tables of the solved field where bands and depths differ most, against the field itself."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.imaging.description import (
    Description,
    FloorDescription,
    SunAndSky,
    SurfaceDescription,
    WaterDescription,
)
from underwater_spectral.uw_spectral.imaging.optics import resolve
from underwater_spectral.uw_spectral.transfer.discrete_ordinates import (
    OpticalLayer,
    solve_discrete_ordinates,
)
from underwater_spectral.uw_spectral.transfer.radiance_table import tabulate
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

MU = np.array([-0.95, -0.6, -0.25, 0.15, 0.4])
TURNS = np.array([1.6, 2.2, 3.0])


def _means(field, depths):
    """Mean over directions away from the sun of what is looked up, and of the field, (n, d)."""
    across = np.sqrt(1.0 - MU**2)[:, None]
    around = TURNS + math.atan2(field.sun[1], field.sun[0])
    w = np.broadcast_arrays(-across * np.cos(around), -across * np.sin(around), MU[:, None])
    found = tabulate(field).scattered(depths[:, None, None], w, field.sun)
    exact = field.scattered_on_grid(depths, MU, TURNS)
    return found.mean(axis=(1, 2)).T, exact.mean(axis=(2, 3))


@pytest.mark.parametrize("floor", [40.0, math.inf])
@pytest.mark.parametrize("water", ["jerlov:IB", "jerlov:3C"])
def test_raman_light_does_not_spoil_the_tables(water, floor):
    """It outlives the light of its bands, which must not be tabulated as if it died as slowly."""
    optics = resolve(
        Description(
            WaterDescription(water, inelastic="raman"), SunAndSky(sky_radiance=0.05),
            SurfaceDescription("flat"), FloorDescription(floor),
        )
    )  # fmt: skip
    found, exact = _means(optics.solved_field(24), np.array([1.0, 5.0, 15.0, 35.0]))
    error = np.abs(found / exact - 1.0)
    bright = exact > 0.05 * exact.max(axis=0)
    assert error[bright].max() < 0.025
    assert (error * exact / exact.max(axis=0)).max() < 0.02
    assert error.max() < 0.25


def test_murky_bands_in_a_clear_deep_table():
    """A band of which nothing is left at the last slices; the clear ones set their depth."""
    a, b = np.array([1e-4, 0.05, 2.0]), np.array([1e-4, 0.1, 30.0])
    layer = OpticalLayer(1000.0, a, b, parse_phase("hg:0.8").for_bands(b))
    field = solve_discrete_ordinates(
        [layer], np.ones(3), (0.0, 0.0, -1.0),
        floor_reflectance=0.5, streams=16,
    )  # fmt: skip
    table = tabulate(field)
    assert max(np.abs(table.radiance).max(), np.abs(table.irradiance).max()) <= 1.0
    found, exact = _means(field, np.array([0.01, 0.1, 0.4]))
    np.testing.assert_allclose(found[2], exact[2], rtol=0.1)
    found, exact = _means(field, np.array([3.0, 30.0, 900.0]))
    assert np.all(np.abs(found - exact) <= 0.05 * exact.max(axis=0))
