"""Three bands that stand for all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from underwater_spectral.uw_spectral.lamps.representative_bands import representative_bands

X = np.linspace(0.2, 1.0, 20)
LENGTHS = np.array([0.1, 0.5, 1.0, 2.0])[:, None]
DECAYS = np.exp(-X * LENGTHS)


def _error(found, values):
    return np.abs(values[:, found.indices] @ found.fractions / values - 1.0).max()


def test_representative_bands_carry_a_family_of_decays():
    found = representative_bands(DECAYS, np.ones_like(DECAYS))
    between = np.exp(-X * np.array([[0.3], [0.7], [1.6]]))
    assert _error(found, between) < 0.01
    # Two of them do not, which the bound would tell.
    two = replace(found, fractions=found.fractions * np.array([[1.0], [0.0], [1.0]]))
    assert _error(two, between) > 0.1


def test_bands_in_the_dark_are_not_chosen():
    light = np.ones_like(DECAYS)
    light[:, :8] = 0.0
    found = representative_bands(DECAYS, light)
    assert found.indices.min() >= 8
    assert not np.any(found.fractions[:, :8])


def test_where_three_shine_they_are_themselves():
    light = np.zeros_like(DECAYS)
    light[:, [2, 9, 17]] = [1.0, 1e-3, 5.0]
    found = representative_bands(DECAYS, light)
    assert found.indices.tolist() == [2, 9, 17]
    assert np.array_equal(found.fractions[:, [2, 9, 17]], np.eye(3))


@pytest.mark.parametrize("values", [np.ones((4, 5)), np.outer([1.0, 2.0, 3.0, 4.0], X[:5])])
def test_bands_that_are_alike_need_one(values):
    found = representative_bands(values, np.ones_like(values))
    assert np.count_nonzero(found.fractions.any(axis=1)) == 1
    assert values[:, found.indices] @ found.fractions == pytest.approx(values)


def test_where_nothing_shines_there_is_an_answer():
    found = representative_bands(DECAYS, 0.0 * DECAYS)
    assert np.isfinite(found.fractions).all()
