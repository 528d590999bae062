from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.validation.monzon import (
    path_radiance_Monzon2024,
    path_radiance_Monzon2024_corrected,
)

B, C, KD, R, Y_F = 0.2, 0.3, 0.12, 0.4, 8.0


@pytest.mark.parametrize("w_y", [-0.7, 0.0, 0.6])
def test_corrected_form_is_the_integral_it_stands_for(w_y):
    v = np.linspace(0, 2, 20001)
    y = 5 + w_y * v
    light = np.exp(-KD * y) + R * np.exp(-KD * (2 * Y_F - y))
    expected = B / (4 * math.pi) * np.trapezoid(light * np.exp(-C * v), v)
    result = path_radiance_Monzon2024_corrected(B, C, KD, 1.0, R, 5.0, w_y, 2.0, Y_F)
    assert result == pytest.approx(expected, rel=1e-7)


def test_printed_form_has_one_exponent():
    q, P = C - KD * 0.6, 2.0
    factor = np.exp(-KD * 5) + R / math.pi * np.exp(-KD * (2 * Y_F - 5))
    expected = B / (4 * math.pi) * factor * -np.expm1(-q * P) / q
    result = path_radiance_Monzon2024(B, C, KD, 1.0, R, 5.0, 0.6, P, Y_F)
    assert result == pytest.approx(expected, rel=1e-8)


def test_forms_agree_level_over_a_black_floor():
    arguments = (B, C, KD, 1.0, 0.0, 5.0, 0.0, 2.0, Y_F)
    printed, corrected = (
        form(*arguments) for form in (path_radiance_Monzon2024, path_radiance_Monzon2024_corrected)
    )
    assert printed == pytest.approx(corrected)


def test_removable_singularity_and_kd_above_c():
    # Kd w_y = c gives G = P; Kd > c has a rising exponent, bounded by the surface.
    for kd in (0.3, 0.5, 5.0):
        value = path_radiance_Monzon2024_corrected(B, C, kd, 1.0, R, 5.0, -1.0, math.inf, Y_F)
        assert np.isfinite(value)
        assert value > 0
