"""Bio-optical waters against published Kd, and the fraction of inelastic light."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.water.bio_optics import Constituents
from underwater_spectral.uw_spectral.water.diffuse_attenuation import (
    Kd490_Morel2007,
    Kd_Lee2013,
)
from underwater_spectral.uw_spectral.water.kd_inversion import water_of_chlorophyll
from underwater_spectral.uw_spectral.water.named import named_waters
from underwater_spectral.validation import constituent_seas as figures
from underwater_spectral.validation.closed_form.closed_form import solve_closed_form

RED_DEPTHS = (0.0, 5.0, 10.0, 20.0, 40.0, 80.0)


@pytest.fixture(scope="module")
def round_trip():
    return figures.kd_round_trip()


def _errors(round_trip, key):
    return np.abs(np.concatenate([row[key] for row in round_trip.values() if key in row]) - 1)


@pytest.mark.parametrize(
    ("key", "median", "worst"),
    [
        ("Lee 2005", 0.06, 0.17),
        ("Lee 2013", 0.05, 0.16),
        ("closed form", 0.06, 0.23),
        # Another paper's inversion of Kd; a measured in a type differs by 13 to 26 % between
        # campaigns (Williamson & Hollins 2022). The light of known waters is in the tests below.
        ("a by inversion", 0.12, 0.95),
        ("case 1, Lee 2013", 0.09, 0.28),
        ("case 1, closed form", 0.07, 0.29),
        ("fitted, Lee 2013", 0.03, 0.13),
        ("fitted, closed form", 0.06, 0.18),
    ],
)
def test_round_trip_to_the_published_Kd(round_trip, key, median, worst):
    """The sun of the published Kd is not known, so these bounds are what was found, by type in
    docs/measured/bio_optics.md; those of others, with the sun known, are in test_outside.py.
    """
    error = _errors(round_trip, key)
    assert np.median(error) < median
    assert error.max() < worst


@pytest.mark.slow
def test_round_trip_by_monte_carlo():
    """Published and fitted waters of all ten types; the same bounds as the closed form has."""
    pytest.importorskip("numba")
    found = figures.kd_round_trip(10_000)
    assert len(found) == 10
    for key, median, worst in (("Monte Carlo", 0.06, 0.23), ("fitted, Monte Carlo", 0.08, 0.23)):
        error = _errors(found, key)
        assert error.size == 130
        assert np.median(error) < median, key
        assert error.max() < worst, key


def test_the_two_Kd_agree_with_each_other(round_trip):
    for row in round_trip.values():
        ratio = row["closed form"] / row["Lee 2005"]
        assert np.median(np.abs(ratio - 1)) < 0.06


@pytest.fixture(scope="module")
def inverted():
    return figures.inversion_round_trip()


def test_inversion_of_light_solved_for_known_waters(inverted):
    """Kd of fields by discrete ordinates, sun at 0 to 70°, gives back the absorption put in."""
    errors = np.concatenate([row["a"].ravel() for row in inverted.values()]) - 1
    assert errors.size == len(figures.SUNS) * len(figures.CASE1) * len(figures.MEASURED)
    assert np.median(np.abs(errors)) < 0.03
    assert abs(np.median(errors)) < 0.02
    assert np.percentile(np.abs(errors), 90) < 0.07
    assert np.abs(errors).max() < 0.17
    for zenith, row in inverted.items():
        assert np.median(np.abs(row["a"] - 1)) < (0.06 if zenith == 0 else 0.04)
        # Usual ocean: where Kd(490) and chlorophyll go together as in Morel et al. (2007).
        typical = row["a"][1:4] - 1
        assert np.abs(typical).max() < 0.11


def test_inversion_needs_sun_and_backscatter(inverted):
    """Without either it was three times as far off."""
    error = {
        key: np.median(np.abs(np.concatenate([row[key].ravel() for row in inverted.values()]) - 1))
        for key in ("a", "blind")
    }
    assert error["blind"] > 3 * error["a"]


@pytest.mark.parametrize("zenith", figures.SUNS)
def test_lee_2013_against_the_solver(zenith):
    """Kd to the depth of 10 % of the light: their fit has 5 % or so; no bias of 10 % passes."""
    ratios = []
    for C in (0.1, 1.0, 10.0):
        sea, nm = Constituents.case1(C), figures.MEASURED
        molecular = sea.scatterings(nm)["water"] / 2
        found = Kd_Lee2013(sea.absorption(nm), sea.backscattering(nm), molecular, zenith)
        ratios.append(found / figures.kd_solved(sea, nm, zenith))
    assert np.median(ratios) == pytest.approx(1.0, abs=0.04)
    np.testing.assert_allclose(ratios, 1.0, atol=0.07)


@pytest.mark.parametrize("C", figures.CASE1)
def test_water_of_chlorophyll_has_the_measured_Kd(C):
    """By discrete ordinates, at 490 nm, for the sun of the inversion."""
    found = figures.kd_solved(water_of_chlorophyll(C), np.array([490.0]), figures.SUN_ZENITH)[0]
    assert found == pytest.approx(float(Kd490_Morel2007(C)), rel=0.05)


def test_case1_waters_against_measured_Kd():
    """Kd(490) of Morel et al. (2007), by both regressions; docs/measured/bio_optics.md says why."""
    for row in figures.case1_rows():
        published = np.mean([row.published, row.merged])
        off = dict.fromkeys((0.03, 0.1, 0.3), (0.12, 0.16)) | {1.0: (0.18, 0.11)}
        by_lee, solved = off.get(row.chlorophyll, (0.32, 0.28))
        assert row.by_lee == pytest.approx(published, rel=by_lee)
        assert row.solved == pytest.approx(published, rel=solved)
        if row.chlorophyll >= 1:
            assert abs(row.by_lee / published - 1) < abs(row.before / published - 1)


def _red_fraction(constituents, wavelength=650.0):
    """Raman fraction of the upwelling (nadir-viewing) radiance at the depths of ``RED_DEPTHS``.

    Radiance, not Eu: the two-stream Eu of the elastic light is not usable
    where absorption is far above scattering.
    """
    solved = figures.scene(constituents, 0.0, ("raman",))
    band = int(np.argmin(np.abs(figures.VISIBLE.centres - wavelength)))
    y, down = np.array(RED_DEPTHS)[:, None], (0.0, 0.0, -1.0)
    raman = solved.inelastic.radiance(y, down)[:, band]
    phase = solved.elastic.phase
    elastic = [
        solve_closed_form(solved.elastic.field, phase, depth, solved.elastic.sun).radiance(
            np.array([depth]), down
        )[band]
        for depth in RED_DEPTHS
    ]
    return raman / (raman + np.array(elastic))


def test_raman_comes_to_dominate_the_red_with_depth():
    for C in (0.03, 0.3):
        fraction = _red_fraction(Constituents.case1(C))
        assert np.all(np.diff(fraction[:4]) > 0)
        assert fraction[0] < 0.2
        assert fraction[RED_DEPTHS.index(20.0)] > 0.9


def test_inelastic_fraction_of_the_baltic():
    """Gutierrez et al. 2008: about 2 % of the radiance."""
    fractions = figures.luminous_fractions(named_waters()["baltic"].constituents)
    assert fractions["all"] == pytest.approx(0.02, rel=0.25)
    parts = sum(fractions[name] for name in figures.PROCESSES)
    assert parts == pytest.approx(fractions["all"], rel=1e-9)


def test_twelve_waters_are_twelve_colours():
    """Gutierrez et al. 2008, §5: detritus and CDOM take the blue, chlorophyll does so slowly."""
    waters = figures.constituents_of_figure2()
    assert len(waters) == 12
    colours = np.array([figures.water_colour(water) for water in waters]).reshape(3, 4, 3)
    assert np.all(colours[0, :3].argmax(axis=-1) == 2)
    assert np.all(colours[1:, :, 2] / colours[1:, :, 1] < colours[0, :, 2] / colours[0, :, 1])
    assert np.all(np.diff(colours[..., 1] / colours[..., 2], axis=1) > -0.02)
