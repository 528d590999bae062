"""The Monte Carlo against published problems, and the closed form against the Monte Carlo."""

from __future__ import annotations

import pytest
from underwater_spectral.benchmarks import monte_carlo_table as table
from underwater_spectral.uw_spectral.monte_carlo import numba_available

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
