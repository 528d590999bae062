"""One refractive index for all wavelengths: what docs/measured/refractive_index.md says of it."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.validation import one_index as benchmark


@pytest.mark.parametrize("zenith", benchmark.SUNS)
@pytest.mark.parametrize("name", benchmark.WATERS)
def test_light_hardly_depends_on_the_dispersion(name, zenith):
    ratios = benchmark.light(name, zenith)
    for key, bound in (("Ed", 0.01), ("Eu", 0.01), ("Kd", 0.005)):
        np.testing.assert_allclose(ratios[key], 1.0, atol=bound)


def test_the_rim_of_the_window():
    blue, red = benchmark.row(1.3499), benchmark.row(1.3365)
    assert red.window - blue.window == pytest.approx(0.64, abs=0.02)
    assert red.refracted - blue.refracted == pytest.approx(0.48, abs=0.02)
    for zenith in blue.transmittance:
        assert red.transmittance[zenith] == pytest.approx(blue.transmittance[zenith], abs=0.005)
