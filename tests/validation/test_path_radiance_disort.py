"""The closed form against discrete ordinates; the cases are those of the benchmark."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase
from underwater_spectral.validation import discrete_ordinates_reference as table

pytest.importorskip("PythonicDISORT")


def _medians(rows):
    return dict(zip(table.FORMS, np.median(table.errors(rows), axis=0), strict=True))


def test_path_radiance_quickly():
    rows = [row for water in table.WATERS for row in table.compare(water, (450.0, 600.0), (5.0,))]
    medians = _medians(rows)
    assert medians["closed form"] <= 0.03
    assert medians["Eq. 9 corrected"] > 10 * medians["closed form"]
    assert medians["Eq. 9 as printed"] > 10 * medians["closed form"]


@pytest.mark.slow
def test_path_radiance():
    """Target: median relative error ≤ 3 % over all rays, none left out."""
    rows = [row for water in table.WATERS for row in table.compare(water)]
    assert len(rows) == 24300
    assert _medians(rows)["closed form"] <= 0.03


@pytest.mark.slow
@pytest.mark.parametrize("phase", ["fournier-forand:1.10,0.0183", "hg:0.95"])
def test_path_radiance_of_sea_particles(phase):
    rows = [
        row for water in table.WATERS for row in table.compare(water, (450.0, 550.0), (5.0,), phase)
    ]
    assert _medians(rows)["closed form"] <= 0.03


@pytest.mark.slow
def test_irradiance():
    """Bounds are what the two-stream field reaches, not a target."""
    black, bright = range(2)
    errors = {
        name: np.median(values, axis=1) for name, values in table.compare_irradiance().items()
    }
    assert errors["Ed"].max() <= 0.01
    assert errors["scalar_irradiance"].max() <= 0.03
    assert errors["Eu"][bright] <= 0.03
    # Over a black floor two streams miss the little light that comes back by more.
    assert errors["Eu"][black] <= 0.2
    assert errors["Eu, integrated"][black] <= 0.03
    assert errors["Eu, integrated"][bright] <= 0.02
    assert errors["Eu fraction of Ed"].max() <= 0.01


def test_reference_against_a_second_solver():
    """PythonicDISORT against cdisort, two codes with nothing in common."""
    import nanodisort

    phase, mu_s = parse_phase("hg:0.8"), 0.9
    ours = table.reference(0.05, 0.1, mu_s, 6.0, 0.2, phase)
    chosen = np.sort(ours.mu[[0, 10, 23, 24, 34, 47]])
    theirs = nanodisort.DisortState()
    theirs.nstr, theirs.nlyr, theirs.nmom = 48, 1, 299
    theirs.ntau, theirs.numu, theirs.nphi, theirs.nphase = 2, len(chosen), 2, 20000
    theirs.allocate()
    theirs.usrtau = theirs.usrang = theirs.lamber = theirs.quiet = True
    theirs.intensity_correction, theirs.old_intensity_correction = True, False
    theirs.dtauc, theirs.ssalb = np.array([0.9]), np.array([2 / 3])
    theirs.pmom = (0.8 ** np.arange(300)).reshape(-1, 1)
    cosine = np.cos(np.linspace(math.pi, 0, 20000))
    theirs.mu_phase, theirs.phase = cosine, (4 * math.pi * phase(cosine)).reshape(1, -1)
    theirs.utau, theirs.umu, theirs.phi = np.array([0.3, 0.6]), chosen, np.array([0.0, 75.0])
    theirs.fbeam, theirs.umu0, theirs.phi0, theirs.albedo, theirs.fisot = 1 / mu_s, mu_s, 0, 0.2, 0
    theirs.solve()
    for row, w_y in enumerate(chosen):
        seen = ours.L([2.0, 4.0], w_y, (0.0, math.radians(75)))
        np.testing.assert_allclose(theirs.uu[row], seen, rtol=1e-3)
    np.testing.assert_allclose(theirs.flup, [ours.Eu(2.0), ours.Eu(4.0)], rtol=1e-5)
