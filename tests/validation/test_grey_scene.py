"""A sphere over a floor: the closed form's picture against Cycles'."""

from __future__ import annotations

import pytest
from underwater_spectral.benchmarks import grey_scene

# The coefficients of types I and IA are doubted by their source, which is no fault of a picture.
pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)


@pytest.mark.parametrize(
    ("water", "depth"),
    [
        ("IB", 5.0),
        pytest.param("I", 5.0, marks=pytest.mark.slow),
        pytest.param("IA", 9.0, marks=pytest.mark.slow),
        pytest.param("II", 3.0, marks=pytest.mark.slow),
    ],
)
def test_closed_form_picture_against_cycles(water, depth):
    found = grey_scene.compare(water, depth, 36, 27, samples=128)
    assert found.srgb_noise < 0.03
    assert found.delta_e_noise < 0.5
    assert found.srgb_rmse <= 0.02
    assert found.delta_e <= 2.0
    assert found.radiance_error.max() <= 0.10
