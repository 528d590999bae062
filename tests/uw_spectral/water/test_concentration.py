"""What is in the water is multiplied; the water itself is not."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging.visibility import concentration_for, sighting_range
from underwater_spectral.uw_spectral.water.optical_properties import JERLOV_TYPES, Water
from underwater_spectral.uw_spectral.water.pure_water import (
    molecular_scattering,
    pure_water_absorption,
)

WAVELENGTHS = np.array([410.0, 450.0, 500.0, 550.0, 600.0])


@pytest.mark.parametrize("water", [*JERLOV_TYPES, None])
@pytest.mark.parametrize("factor", [0.0, 0.3, 2.0, 7.0])
def test_the_water_itself_stays(water, factor):
    """At the nodes of both tables, where nothing is interpolated."""
    before = Water.uniform(0.7, 0.3) if water is None else Water.jerlov(water)
    now = before.concentrated(factor)
    for found, plain, pure in (
        (now.a(WAVELENGTHS), before.a(WAVELENGTHS), pure_water_absorption(WAVELENGTHS)),
        (now.b(WAVELENGTHS), before.b(WAVELENGTHS), molecular_scattering(WAVELENGTHS)),
    ):
        inside = np.maximum(plain - pure, 0.0)
        np.testing.assert_allclose(found, plain - inside + factor * inside, rtol=2e-3, atol=1e-4)


def test_half_and_half_is_a_mixture_with_pure_water():
    """Another way to the same: by volume."""
    water = Water.jerlov("5C")
    pure = water.concentrated(0.0)
    mixed, thinned = water.mixed(pure, 0.5), water.concentrated(0.5)
    np.testing.assert_allclose(mixed.a(WAVELENGTHS), thinned.a(WAVELENGTHS), rtol=1e-6)
    np.testing.assert_allclose(mixed.b(WAVELENGTHS), thinned.b(WAVELENGTHS), rtol=1e-6)


@pytest.mark.parametrize("factor", [-1.0, np.nan, np.inf])
def test_a_bad_concentration_is_named(factor):
    with pytest.raises(InputError, match="concentration"):
        Water.jerlov("I").concentrated(factor)


def test_a_setting_of_the_scene():
    plain, twice = (
        make_plan(SceneSettings(water="jerlov:III", concentration=x, bands=5)) for x in (1.0, 2.0)
    )
    centres = plain.bands.centres
    wanted = Water.jerlov("III").concentrated(2.0)
    np.testing.assert_allclose(twice.column.absorption, wanted.a(centres))
    np.testing.assert_allclose(twice.column.scattering, wanted.b(centres))


def test_fluorescence_grows_with_what_fluoresces():
    """Raman scattering is the water's own; in the limit of thin water both are linear."""
    settings = {"water": "bio:chl=0.01,cdom=0.001", "bands": 5}
    found = {
        (process, x): make_plan(
            SceneSettings(**settings, inelastic=process, concentration=x)
        ).excitation.processes[0].coefficient
        for process in ("raman", "chlorophyll")
        for x in (1.0, 3.0)
    }  # fmt: skip
    np.testing.assert_allclose(found["raman", 3.0], found["raman", 1.0])
    np.testing.assert_allclose(found["chlorophyll", 3.0], 3.0 * found["chlorophyll", 1.0])


@pytest.mark.parametrize("wanted", [0.3, 2.0, 11.0, 40.0])
def test_concentration_for_a_range(wanted):
    """With two wavelengths, where the range is not the inverse of one number."""

    def seen(x):
        return sighting_range([0.02 + 0.1 * x, 0.07 + 0.3 * x], [1.0, 2.0])

    assert seen(concentration_for(wanted, seen)) == pytest.approx(wanted, rel=2e-3)


def test_pure_water_is_the_limit():
    assert concentration_for(300.0, lambda x: 3.91 / (0.02 + 0.1 * x)) == 0.0
    with pytest.raises(InputError, match="distance above 0"):
        concentration_for(0.0, lambda x: 3.91 / (0.02 + 0.1 * x))
