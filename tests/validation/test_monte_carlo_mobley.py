"""The Monte Carlo against published problems, and the closed form against the Monte Carlo."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from underwater_spectral.validation import monte_carlo_cases as table
from underwater_spectral.validation.monte_carlo import numba_available

needs_numba = pytest.mark.skipif(not numba_available(), reason="takes too long without numba")


@pytest.mark.parametrize(("problem", "case", "photons"), [(1, 2, 60_000), (6, 1, 120_000)])
def test_canonical_problems_quickly(problem, case, photons):
    """Within the tolerance and three standard errors: few photons."""
    for row in table.canonical(problem, case, photons, engine="numpy"):
        assert row.error < 0.2 or row.tau > 1
        assert abs(row.difference) <= row.tolerance + 3 * row.error, row


@pytest.mark.slow
@needs_numba
@pytest.mark.parametrize(
    ("problem", "case", "photons"),
    [(1, 1, 20_000_000), (1, 2, 4_000_000), (2, 1, 20_000_000), (2, 2, 4_000_000),
     (6, 1, 20_000_000)],
)  # fmt: skip
def test_canonical_problems(problem, case, photons, record_property):
    """Mobley et al. 1993: max(3 CV, 1 %), 5 % for Lu, to τ = 5."""
    rows = table.canonical(problem, case, photons)
    assert len(rows) == 6
    for row in rows:
        record_property(f"τ {row.tau:g} {row.quantity}", f"{row.difference:+.4f} ± {row.error:.4f}")
        assert row.error < row.tolerance / 2, row
        assert abs(row.difference) <= row.tolerance, row


@pytest.mark.slow
@needs_numba
def test_irradiance_of_the_closed_form(record_property):
    """Targets: Ed within 2 %, Eu within 5 %; the medians meet them."""
    rows = table.irradiances(500_000)
    assert len(rows) == 5 * 2 * 2 * 3 * 4 * 2
    for phase, r, (quantity, median, worst) in itertools.product(
        table.PHASES,
        table.FLOORS,
        (("Ed", 0.02, 0.06), ("Eu, two streams", 0.15, 0.4), ("Eu, integrated", 0.05, 0.2)),
    ):
        mine = [x for x in rows if (x["phase"], x["r"], x["quantity"]) == (phase, r, quantity)]
        errors = table.differences(mine)
        record_property(f"{phase}, floor {r:g}, {quantity}", f"{np.median(errors):.4f}")
        assert np.median(errors) <= median
        assert errors.max() <= worst
