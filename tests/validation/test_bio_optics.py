"""Bio-optical waters against published Kd, and the share of inelastic light."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.benchmarks import gutierrez_figures as figures
from underwater_spectral.uw_spectral.water.bio_optics import Constituents, named_waters


@pytest.fixture(scope="module")
def round_trip():
    return figures.kd_round_trip()


def _errors(round_trip, key):
    return np.abs(np.concatenate([row[key] for row in round_trip.values() if key in row]) - 1)


@pytest.mark.parametrize(
    ("key", "median", "worst"),
    [
        ("Lee 2005", 0.06, 0.17),
        ("closed form", 0.06, 0.23),
        ("a by inversion", 0.10, 0.95),
        ("case 1, Lee 2005", 0.10, 0.33),
        ("case 1, closed form", 0.07, 0.33),
        ("fitted, Lee 2005", 0.03, 0.13),
        ("fitted, closed form", 0.06, 0.18),
    ],
)
def test_round_trip_to_the_published_Kd(round_trip, key, median, worst):
    """Bounds just above what was measured; docs/bio_optics.md lists it by type."""
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


def test_raman_comes_to_dominate_the_red_with_depth():
    for C in (0.03, 0.3):
        share = figures.red_share(Constituents.case1(C))
        assert np.all(np.diff(share[:4]) > 0)
        assert share[0] < 0.2
        assert share[figures.RED_DEPTHS.index(20.0)] > 0.9


def test_inelastic_share_of_the_baltic():
    """Gutierrez et al. 2008: about 2 % of the radiance."""
    shares = figures.luminous_shares(named_waters()["baltic"].constituents)
    assert shares["all"] == pytest.approx(0.02, rel=0.25)
    parts = sum(shares[name] for name in figures.PROCESSES)
    assert parts == pytest.approx(shares["all"], rel=1e-9)


def test_twelve_waters_are_twelve_colours():
    """Gutierrez et al. 2008, §5: detritus and CDOM take the blue, chlorophyll does so slowly."""
    waters = figures.constituents_of_figure2()
    assert len(waters) == 12
    colours = np.array([figures.water_colour(water) for water in waters]).reshape(3, 4, 3)
    assert np.all(colours[0, :3].argmax(axis=-1) == 2)
    assert np.all(colours[1:, :, 2] / colours[1:, :, 1] < colours[0, :, 2] / colours[0, :, 1])
    assert np.all(np.diff(colours[..., 1] / colours[..., 2], axis=1) > -0.02)
