"""Raman scattering and fluorescence: photons, energy, and the closed form."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import expn
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.surface.refraction import fresnel_reflectance
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.bio_optics import Constituents, parse_constituents
from underwater_spectral.uw_spectral.water.inelastic_processes import (
    EXCITATION,
    RAMAN_PHASE,
    InelasticProcess,
    cdom_emission,
    chlorophyll_emission,
    chlorophyll_process,
    inelastic_processes,
    parse_processes,
    raman_coefficient,
    raman_emission,
    raman_process,
)
from underwater_spectral.uw_spectral.water.named import named_waters
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase
from underwater_spectral.uw_spectral.water.pure_water import pure_water_absorption
from underwater_spectral.validation.closed_form.light_field import (
    TwoStreamWater,
    light_field_of,
    solve_light_field,
)
from underwater_spectral.validation.closed_form.paths import under_surface
from underwater_spectral.validation.inelastic_light import excitation_fields, solve_inelastic

FINE = np.arange(400.0, 1000.0, 0.05)
WIDE, TABLES = Bands.uniform(110, 300, 850), Bands.uniform(100, 300, 800)
ONE, OTHER = Bands([500.0], [10.0]), Bands([600.0], [10.0])


def test_raman_coefficient_and_its_slope():
    assert raman_coefficient([488.0])[0] == pytest.approx(2.6e-4, rel=0.1)
    slope = np.diff(np.log(raman_coefficient([400.0, 600.0]))) / math.log(1.5)
    assert slope[0] == pytest.approx(-5.5)
    # Gutierrez et al. 2008 take the absorption of water for it.
    assert pure_water_absorption([488.0]) > 20 * raman_coefficient([488.0])


def test_raman_line():
    """488 nm goes to about 585 nm; the four Gaussians of Walrafen, in wavenumbers."""
    shape = raman_emission(488.0, FINE)
    assert np.trapezoid(shape, FINE) == pytest.approx(1.0, abs=1e-6)
    assert FINE[shape.argmax()] == pytest.approx(585.0, abs=2.0)
    assert np.trapezoid(shape * FINE, FINE) == pytest.approx(585.0, abs=1.5)
    # Per wavenumber, against the sum written out by hand at its two shoulders.
    for shift in (3250.0, 3425.0, 3625.0):
        nm = 1e7 / (1e7 / 488.0 - shift)
        by_hand = sum(
            A / d * math.exp(-4 * math.log(2) * ((shift - k) / d) ** 2)
            for A, k, d in (
                (0.41, 3250, 210),
                (0.39, 3425, 175),
                (0.1, 3530, 140),
                (0.1, 3625, 140),
            )
        ) / math.sqrt(math.pi / (4 * math.log(2)))
        assert raman_emission(488.0, [nm])[0] * nm**2 / 1e7 == pytest.approx(by_hand, rel=1e-12)


def test_chlorophyll_line_and_shoulder():
    """Ocean Optics Web Book: 25 nm wide at 685 nm, and a quarter at 730 nm, 50 nm wide."""
    shape = chlorophyll_emission(FINE)
    assert FINE[shape.argmax()] == pytest.approx(685.0, abs=0.3)
    wide = FINE[shape >= shape.max() / 2]
    assert wide[-1] - wide[0] == pytest.approx(25.0, abs=0.8)
    assert np.trapezoid(shape, FINE) == pytest.approx(1.0, abs=1e-6)
    red, shoulder = chlorophyll_emission([685.0, 730.0])
    assert shoulder / red == pytest.approx(1 / 6, rel=0.05)
    far = FINE >= 755.0  # half way down the shoulder
    assert chlorophyll_emission([755.0])[0] == pytest.approx(shoulder / 2, rel=0.01)
    assert np.trapezoid(shape[far], FINE[far]) == pytest.approx(0.25 * 0.1194, rel=0.02)


def test_cdom_quantum_yields():
    """Integral of η over emission, from the table of Hawes's sample FA7."""
    for excitation, expected in ((350.0, 0.0138), (410.0, 0.0163), (450.0, 0.0193)):
        grid = np.arange(excitation, 1200.0, 0.1)
        found = np.trapezoid(cdom_emission(excitation, grid), grid)
        assert found == pytest.approx(expected, rel=0.02)
    assert cdom_emission(300.0, [500.0])[0] == 0
    assert cdom_emission(450.0, [449.0])[0] == 0


def test_yields_of_the_settings():
    """Gutierrez et al. 2008, Table 5: 0.1 of phytoplankton, 0.025 of CDOM."""
    sea = parse_constituents("chl=1,cdom=0.1,chl-yield=0.1,cdom-yield=0.025")
    _, chlorophyll, cdom = inelastic_processes(sea, TABLES, WIDE)
    assert chlorophyll.photons.sum(axis=1) == pytest.approx(0.1, rel=1e-6)
    assert cdom.photons.sum(axis=1).max() == pytest.approx(0.025, rel=0.03)
    with pytest.raises(InputError, match="chlorophyll_yield must be a finite number, 0 to 1"):
        parse_constituents("chl=1,chl-yield=1.1")


def test_photons_are_conserved_per_event():
    sea = Constituents(1.0, cdom=0.1, chlorophyll_yield=0.05)
    raman, chlorophyll, cdom = inelastic_processes(sea, TABLES, WIDE)
    inside = TABLES.centres < 600  # the line of these stays within the bands
    assert raman.photons[inside].sum(axis=1) == pytest.approx(1.0, abs=1e-6)
    assert chlorophyll.photons.sum(axis=1) == pytest.approx(0.05, rel=1e-6)
    assert np.all(cdom.photons.sum(axis=1) < 0.025)
    for process in (raman, chlorophyll, cdom):
        assert np.all(process.photons >= 0)
        assert np.all(process.coefficient >= 0)


def test_energy_that_comes_out():
    """Power out over scalar irradiance in: b_R in energy units, and Φ a λ'/λ for chlorophyll."""
    raman = raman_process(WIDE, WIDE)
    per_metre = raman.energy_matrix(WIDE, WIDE) @ WIDE.widths / WIDE.widths
    inside = WIDE.centres < 600
    assert per_metre[inside] == pytest.approx(raman_coefficient(WIDE.centres[inside]), rel=2e-3)
    a = np.full(len(WIDE), 0.03)
    light = chlorophyll_process(a, WIDE, WIDE, 0.02)
    per_metre = light.energy_matrix(WIDE, WIDE) @ WIDE.widths / WIDE.widths
    band = int(np.argmin(np.abs(WIDE.centres - 440)))
    line = 1 / (0.75 / 685 + 0.25 / 730)
    assert per_metre[band] == pytest.approx(0.02 * 0.03 * WIDE.centres[band] / line, rel=2e-3)
    assert per_metre[0] == 0


def test_coarse_bands_keep_the_energy_of_fine_ones():
    fine, coarse = Bands.uniform(150, 300, 900), Bands.uniform(30, 300, 900)
    totals = [
        float(np.sum(raman_process(b, b).energy_matrix(b, b) @ b.widths)) for b in (fine, coarse)
    ]
    assert totals[1] == pytest.approx(totals[0], rel=0.01)


def _single(a=0.3, b=0.0, q=0.1, y_f=math.inf, r=0.0, R=0.0):
    common = {"mu_s": 1.0, "y_f": y_f, "r": r, "R": R}
    excitation = solve_light_field(TwoStreamWater(q, 0.0, 0.8, 0.64), E=1.0, **common)
    emission = solve_light_field(TwoStreamWater(a, b, 0.8, 0.64), E=0.0, **common)
    process = InelasticProcess("raman", np.array([1e-3]), np.array([[1.0]]), RAMAN_PHASE)
    return solve_inelastic([process], excitation, ONE, emission, OTHER)


@pytest.mark.parametrize("y", [0.0, 2.0, 10.0])
@pytest.mark.parametrize("q", [0.02, 0.1])
def test_upwelling_light_of_an_absorbing_band(y, q):
    """Against the exact integral over E2 of what every layer below emits."""
    light = _single(q=q)
    layers = quad(lambda z: light.source(z)[0] / 2 * expn(2, 0.3 * (z - y)), y, y + 80, limit=200)
    assert light.Eu(y)[0] == pytest.approx(layers[0], rel=0.1)


def test_path_radiance_of_an_absorbing_band_is_exact():
    light = _single()
    for w_y in (-0.7, 0.0, 0.9):
        w = (math.sqrt(1 - w_y**2), 0.0, -w_y)
        P = 4.0
        along = quad(
            lambda v, w_y=w_y: light.source(6.0 + w_y * v)[0] / (4 * math.pi) * math.exp(-0.3 * v),
            0,
            P,
        )
        assert light.path(6.0, w, P)[0] == pytest.approx(along[0], rel=1e-9)


@pytest.mark.parametrize(("y_f", "r", "R"), [(math.inf, 0.0, 0.0), (8.0, 0.3, 0.48)])
def test_gershun_and_boundaries(y_f, r, R):
    """The net flux gains what is emitted and loses what is absorbed."""
    light = _single(b=0.2, y_f=y_f, r=r, R=R)
    y, step = np.linspace(0.5, 7.0, 7)[:, None], 1e-4
    rise = (light.F(y + step) - light.F(y - step)) / (2 * step)
    np.testing.assert_allclose(rise, light.source(y) - 0.3 * light.E0(y), rtol=1e-5)
    np.testing.assert_allclose(light.Ed(0.0), R * light.Eu(0.0), atol=1e-12)
    if np.isfinite(y_f):
        np.testing.assert_allclose(light.Eu(y_f), r * light.Ed(y_f), rtol=1e-9)
        assert light.floor_radiance()[0] > 0


def test_light_adds_up_over_processes():
    sea, bands = Constituents(2.0, cdom=0.2), Bands.uniform(25, 300, 800)
    a, b = sea.absorption(bands.centres), sea.scattering(bands.centres)
    field = solve_light_field(TwoStreamWater(a, b, 0.9, 0.8), 1.0, 0.9)
    processes = inelastic_processes(sea, bands, bands)
    parts = [solve_inelastic([p], field, bands, field, bands).Eu(3.0) for p in processes]
    together = solve_inelastic(processes, field, bands, field, bands).Eu(3.0)
    np.testing.assert_allclose(together, sum(parts), rtol=1e-9)
    assert np.all(solve_inelastic([], field, bands, field, bands).Eu(3.0) == 0)


def _sea(constituents, y_f=math.inf, surface="flat", sky=0.1):
    """Inelastic light of a water, 12 emission bands."""
    lights = []
    for bands in (EXCITATION, EMISSION):
        nm = bands.centres
        column = WaterColumn(
            bands, constituents.absorption(nm), constituents.scattering(nm), 1.0, 0.9,
            (math.sqrt(0.19), 0.0, -0.9), sky, y_f, 0.3, surface, 1.34,
        )  # fmt: skip
        lights.append((column, constituents.phase(nm)))
    processes = inelastic_processes(constituents, EXCITATION, EMISSION)
    exciting, field = excitation_fields(*lights[0]), light_field_of(lights[1][0], lights[1][1])
    return solve_inelastic(processes, exciting, EXCITATION, field, EMISSION)


EMISSION = Bands.uniform(12)
CLEAR, BALTIC = Constituents.case1(0.03), named_waters()["baltic"].constituents


def test_surface_mirrors_what_rises():
    light = _sea(CLEAR)
    level, steep = ((math.sqrt(1 - z**2), 0.0, z) for z in (0.3, 0.99))
    below = light.radiance(0.0, (level[0], 0.0, -0.3))
    np.testing.assert_allclose(under_surface(light, level, 0.0, 1.34), below)  # total reflection
    assert np.all(under_surface(light, steep, 0.0, 1.34) < 0.03 * light.radiance(0.0, (0, 0, -1)))
    seen = light.radiance(2.0, level, under_surface(light, level, 0.0, 1.34))
    assert np.all(seen > light.radiance(2.0, level))


def test_skylight_excites_as_a_beam_of_its_mean_cosine():
    """In water that only absorbs the skylight of a flat surface dies as E3 and its like do."""
    a, n = 1.0, 1.34
    column = WaterColumn(Bands([400.0], [10.0]), a, 1e-6, 0.0, 1.0, (0, 0, -1), 1.0,
                         math.inf, 0.0, "flat", n)  # fmt: skip
    fields = excitation_fields(column, parse_phase("hg:0.8").for_bands([1e-6]))
    assert len(fields) == 2

    def exact(y):
        def integrand(mu):
            inside = math.sqrt(1 - (1 - mu**2) / n**2)
            entering = mu * (1 - float(fresnel_reflectance(mu, n)))
            return 2 * math.pi * entering / inside * math.exp(-a * y / inside)

        return quad(integrand, 0, 1)[0]

    for y, allowed in ((0.0, 0.01), (1.0, 0.01), (4.0, 0.1)):
        found = sum(field.scalar_irradiance(y)[0] for field in fields)
        assert found == pytest.approx(exact(y), rel=allowed)
        plain = light_field_of(column, parse_phase("hg:0.8").for_bands([1e-6])).scalar_irradiance(y)
        assert abs(plain[0] / exact(y) - 1) > 5 * allowed
    black = dataclasses.replace(column, sky_radiance=0.0, sun_irradiance=1.0)
    assert len(excitation_fields(black, parse_phase("hg:0.8").for_bands([1e-6]))) == 1


def test_names_of_processes():
    assert parse_processes("") == ()
    assert parse_processes("all") == ("raman", "chlorophyll", "cdom")
    with pytest.raises(InputError, match="raman"):
        parse_processes("ramen")


def test_bad_input():
    with pytest.raises(InputError, match="Near names: raman"):
        inelastic_processes(Constituents(), WIDE, WIDE, ("ramen",))
    with pytest.raises(InputError, match="phytoplankton"):
        chlorophyll_process(-0.1, WIDE, WIDE, 0.02)
    with pytest.raises(InputError, match="finite and positive"):
        raman_coefficient([math.nan])
    light = _single()
    other = dataclasses.replace(light.field, y_f=5.0)
    process = InelasticProcess("raman", np.array([1e-3]), np.array([[1.0]]), RAMAN_PHASE)
    with pytest.raises(InputError, match="one water column"):
        solve_inelastic([process], light.field, ONE, other, OTHER)
    with pytest.raises(InputError, match="matrix"):
        solve_inelastic([process], light.field, ONE, light.field, Bands([1.0, 2.0], [1.0, 1.0]))
