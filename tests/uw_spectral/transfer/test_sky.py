"""Skies by direction: their irradiance, what enters the water, and which way they face."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.surface.refraction import (
    fresnel_reflectance,
    in_water_cosine,
    sun_travel_direction,
)
from underwater_spectral.uw_spectral.transfer.rough_surface import WaterSurface
from underwater_spectral.uw_spectral.transfer.sky import SKIES, Sky
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase
from underwater_spectral.validation.closed_form.closed_form import solve_closed_form
from underwater_spectral.validation.closed_form.internal_reflectance import (
    diffuse_internal_reflectance,
)
from underwater_spectral.validation.closed_form.light_field import light_field_of
from underwater_spectral.validation.closed_form.unoccluded_water import UnoccludedWater
from underwater_spectral.validation.monte_carlo import simulate

ZENITH, AZIMUTH, INDEX = 60.0, 160.0, 1.34
TOWARDS_SUN = -sun_travel_direction(ZENITH, AZIMUTH, 1.0)
PHASE = parse_phase("hg:0.8").for_bands([0.1])


def _column(sky, **changes):
    values = {"sun_irradiance": 0.0, "sky_radiance": 2.0, "surface": "flat"} | changes
    return WaterColumn(
        Bands.uniform(1), 0.05, values.pop("scattering", 0.1),
        sun_cosine=float(in_water_cosine(ZENITH, INDEX)),
        sun_direction=sun_travel_direction(ZENITH, AZIMUTH, INDEX),
        floor_depth=math.inf, floor_reflectance=0.0, refractive_index=INDEX, sky=sky, **values,
    )  # fmt: skip


def _hemisphere():
    """Directions of a fine even grid, and the weight of each in an irradiance."""
    cosine, turn = np.linspace(0.0005, 0.9995, 1000), np.linspace(0, 2 * math.pi, 181)[:-1]
    across = np.sqrt(1 - cosine**2)[:, None]
    x, y, z = np.broadcast_arrays(across * np.cos(turn), across * np.sin(turn), cosine[:, None])
    return (x[..., None], y[..., None], z[..., None]), 2 * math.pi * z / z.size


@pytest.mark.parametrize("kind", SKIES)
def test_irradiance_is_that_of_the_uniform_sky(kind):
    v, weight = _hemisphere()
    L = _column(kind).skylight.radiance(v)[..., 0]
    assert L.min() > 0
    assert (weight * L).sum() == pytest.approx(2 * math.pi, rel=2e-3)
    transmitted = (weight * L * (1 - fresnel_reflectance(v[2][..., 0], INDEX))).sum()
    fraction = _column(kind).skylight.transmittance(WaterSurface(INDEX))
    assert fraction == pytest.approx(transmitted / (2 * math.pi), rel=1e-3)


def test_fraction_that_enters():
    fraction = {kind: _column(kind).skylight.transmittance(WaterSurface(INDEX)) for kind in SKIES}
    # Reciprocity; a bright horizon is reflected, a bright zenith is not.
    uniform = INDEX**2 * (1 - diffuse_internal_reflectance(INDEX))
    assert fraction["uniform"] == pytest.approx(uniform, rel=1e-12)
    assert fraction["clear"] < fraction["uniform"] - 0.01 < fraction["overcast"] - 0.02


def test_overcast_and_clear():
    """CIE S 011: a third of the zenith's radiance at the horizon; bright around the sun."""
    horizon = (1.0, 0.0, 0.0)
    overcast, clear = (_column(kind).skylight for kind in ("overcast", "clear"))
    assert overcast.radiance((0, 0, 1)) == pytest.approx(3 * overcast.radiance(horizon), rel=0.02)
    assert clear.radiance(TOWARDS_SUN) > 5 * clear.radiance((0.0, 0.0, 1.0))
    opposite = TOWARDS_SUN * (-1, -1, 1)
    assert clear.radiance(opposite) < 0.2 * clear.radiance(TOWARDS_SUN)
    # Type 12 by hand, at 90° from the sun, 60° from the zenith.
    across = np.array([-math.sin(math.radians(AZIMUTH)), math.cos(math.radians(AZIMUTH)), 0.0])
    v = across * math.sqrt(0.75) + np.array([0.0, 0.0, 0.5])
    towards = math.acos(0.25)
    by_hand = [
        (1 - math.exp(-0.32 / z)) * (1 + 10 * (math.exp(-3 * g) - math.exp(-1.5 * math.pi))
                                     + 0.45 * math.cos(g) ** 2)
        for z, g in ((0.5, towards), (1.0, math.radians(ZENITH)))
    ]  # fmt: skip
    seen = clear.radiance(v) / clear.radiance((0.0, 0.0, 1.0))
    assert seen == pytest.approx(by_hand[0] / by_hand[1], rel=1e-12)


@pytest.mark.parametrize("kind", SKIES)
@pytest.mark.parametrize("surface", ["none", "flat"])
def test_solved_and_closed_form_get_the_same_light(kind, surface):
    """In water that does not scatter, where only what enters comes down."""
    column = _column(kind, surface=surface, scattering=0.0)
    fraction = column.skylight.transmittance(WaterSurface(INDEX)) if surface == "flat" else 1.0
    solved = column.solved_field(PHASE)
    np.testing.assert_allclose(solved.Ed(0.0), 2 * math.pi * fraction, rtol=3e-3)
    closed, uniform = light_field_of(column, PHASE), dataclasses.replace(column, sky="uniform")
    of_uniform = uniform.skylight.transmittance(WaterSurface(INDEX)) if surface == "flat" else 1.0
    gain = closed.Ed(3.0) / light_field_of(uniform, PHASE).Ed(3.0)
    np.testing.assert_allclose(gain, fraction / of_uniform, rtol=1e-9)


@pytest.mark.parametrize("kind", SKIES)
@pytest.mark.parametrize("surface", ["none", "flat"])
def test_solver_and_pixel_see_the_same_sky(kind, surface):
    column = _column(kind, surface=surface, scattering=1e-9)
    field = light_field_of(column, PHASE)
    closed = solve_closed_form(field, PHASE, 0.0, column.sun_direction)
    index = column.refractive_index if column.reflects else None
    water = UnoccludedWater(closed, column.skylight, index)
    w = np.random.default_rng(1).normal(size=(3, 40))
    w[2] = np.abs(w[2])
    w /= np.linalg.norm(w, axis=0)
    seen = water.radiance(1.0, tuple(part[:, None] for part in w))
    found = column.solved_field(PHASE).radiance(1.0, tuple(w))
    np.testing.assert_allclose(found, seen, rtol=1e-6, atol=1e-7)


def test_clear_sky_is_seen_refracted():
    sky, w = _column("clear").skylight, -sun_travel_direction(ZENITH, AZIMUTH, INDEX)
    at_sun = sky.radiance(TOWARDS_SUN)
    assert sky.seen_through(w, INDEX) == pytest.approx(at_sun, rel=1e-9)
    # A wave that turns the normal onto the ray lets it pass straight on.
    slopes = (-w[0] / w[2], -w[1] / w[2])
    assert sky.seen_through(w, INDEX, slopes=slopes) == pytest.approx(sky.radiance(w), rel=1e-9)
    assert sky.radiance(w) < 0.9 * at_sun


def test_column_counts_its_sky():
    assert _column("clear") == _column("clear") != _column("overcast")
    assert dataclasses.replace(_column("clear"), sky="uniform") == _column("uniform")


def test_skies_that_cannot_be_used():
    with pytest.raises(InputError, match="stormy"):
        Sky.standard("stormy", [1.0])
    with pytest.raises(InputError, match="not negative"):
        Sky.standard("clear", [-1.0])
    with pytest.raises(InputError, match="overcst.*overcast"):
        _column("overcst")
    with pytest.raises(InputError, match="Monte Carlo: the column's sky is clear"):
        simulate(_column("clear"), PHASE, [1.0], photons=1000, engine="numpy")
