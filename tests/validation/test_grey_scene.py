"""A sphere over a floor: pictures by the formulas against Cycles'."""

from __future__ import annotations

import pytest
from underwater_spectral.benchmarks import grey_scene
from underwater_spectral.benchmarks.grey_scene import CLEAR, CLOSED_FORM, PAPERS, TABLES

# The coefficients of types I and IA are doubted by their source, which is no fault of a picture.
pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)


@pytest.mark.parametrize(
    ("water", "depth"),
    [
        pytest.param("IB", 5.0, marks=pytest.mark.slow),
        pytest.param("I", 5.0, marks=pytest.mark.slow),
        pytest.param("IA", 9.0, marks=pytest.mark.slow),
        pytest.param("II", 3.0, marks=pytest.mark.slow),
    ],
)
def test_closed_form_picture_against_cycles(water, depth):
    found = grey_scene.compare(water, depth, 36, 27, samples=128, light=PAPERS)
    assert found.srgb_noise < 0.03
    assert found.delta_e_noise < 0.5
    closed_form = found.deviations[CLOSED_FORM]
    assert closed_form.srgb_rmse <= 0.02
    assert closed_form.delta_e <= 2.0
    assert closed_form.radiance.max() <= 0.10


@pytest.mark.parametrize(
    ("water", "depth"), [("I", 5.0), pytest.param("IA", 9.0, marks=pytest.mark.slow)]
)
def test_default_phase_function_under_a_clear_sky(water, depth):
    """The difference in colour of tables to Cycles is not seen: ΔE2000 0.8, ISO/TR 28642:2016."""
    found = grey_scene.compare(water, depth, 36, 27, samples=128, light=CLEAR)
    assert found.srgb_noise < 0.01
    tables, closed_form = (found.deviations[name] for name in (TABLES, CLOSED_FORM))
    assert tables.delta_e + 2 * found.delta_e_noise < 0.8
    assert tables.srgb_rmse <= 0.02
    assert tables.radiance.max() <= 0.03
    assert closed_form.srgb_rmse <= 0.02
    assert closed_form.radiance.max() <= 0.10
