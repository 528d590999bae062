"""Light scattered by bubbles: the series against published numbers, and the table made of it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.surface.refraction import fresnel_reflectance
from underwater_spectral.uw_spectral.water.bubbles import (
    DIFFRACTED,
    BubblePhase,
    bubble_scattering,
)
from underwater_spectral.validation.bubbles import INDEX, TILT_DEG, bubbles
from underwater_spectral.validation.mie import scattered_by_sphere


def test_a_sphere_scatters_as_in_the_book():
    """The example of Bohren & Huffman (1983), appendix A: 0.525 µm, index 1.55, 632.8 nm."""
    size = 2.0 * math.pi * 0.525 / 0.6328
    efficiency, _, back, phase = scattered_by_sphere(size, 1.55, [1.0, -1.0])
    assert efficiency == pytest.approx(3.10543, rel=2e-5)
    # Their backscattering efficiency is 4 π p(180°) Q.
    assert 4.0 * math.pi * back * efficiency == pytest.approx(2.92534, rel=2e-5)
    assert phase[1] == pytest.approx(back)


def test_small_spheres_scatter_as_rayleigh_has_it():
    m, x = 1.0 / INDEX, 0.01
    efficiency, asymmetry, _, phase = scattered_by_sphere(x, m, [0.0, 1.0])
    assert efficiency == pytest.approx(8 / 3 * x**4 * ((m * m - 1) / (m * m + 2)) ** 2, rel=1e-3)
    assert abs(asymmetry) < 1e-4
    assert phase == pytest.approx([3 / (16 * math.pi), 3 / (8 * math.pi)], rel=1e-3)


@pytest.fixture(scope="module")
def plume():
    return bubbles(count=150)


@pytest.mark.slow
def test_a_plume_scatters_as_published(plume):
    assert plume.integral() == pytest.approx(1.0, abs=0.01)
    # Zhang et al. (1998): clean bubbles have a bb/b near 0.01; mean cosine about 0.85.
    assert plume.backscatter_ratio == pytest.approx(0.0121, abs=0.001)
    assert plume.asymmetry == pytest.approx(0.845, abs=0.01)
    assert plume.diffracted == pytest.approx(DIFFRACTED, abs=0.01)
    # Spheres: three quarters of the efficiency over the Sauter radius.
    assert bubble_scattering(1.0) == pytest.approx(plume.per_void, rel=0.01)


@pytest.mark.slow
def test_all_colours_are_scattered_alike(plume):
    for wavelength in (440.0, 670.0):
        other = bubbles(wavelength=wavelength, count=150)
        assert other.per_void == pytest.approx(plume.per_void, rel=0.02)
        assert other.asymmetry == pytest.approx(plume.asymmetry, rel=0.01)
        assert other.backscatter_ratio == pytest.approx(plume.backscatter_ratio, rel=0.05)


@pytest.mark.slow
def test_the_series_steps_where_reflection_ceases_to_be_total(plume):
    """Within 83° a disc's light is mirrored evenly; beyond, Fresnel's part of it and a little."""
    step = 180.0 - 2.0 * math.degrees(math.asin(1.0 / INDEX))
    assert step == pytest.approx(83.5, abs=0.1)
    rest = 1.0 - plume.diffracted
    before, after = plume.mean(step - 8, step - 4) / rest, plume.mean(step + 4, step + 8) / rest
    assert before > 3.0 * after
    # So far hardly anything is refracted: the whole disc mirrors evenly.
    assert before == pytest.approx(1.0 / (4.0 * math.pi), rel=0.08)
    mirrored = float(fresnel_reflectance(math.cos(math.radians(45.25)), 1.0 / INDEX))
    assert mirrored / (4.0 * math.pi) < after < 2.0 * mirrored / (4.0 * math.pi)


@pytest.mark.slow
def test_the_table_is_that_of_the_series_spread_a_little(plume):
    shipped, rest = BubblePhase(), 1.0 - DIFFRACTED
    # Spread by σ, the mean cosine of what is not diffracted falls as e^(-σ²).
    even = (plume.asymmetry - DIFFRACTED) / rest
    assert shipped.g == pytest.approx(even * math.exp(-(math.radians(TILT_DEG) ** 2)), rel=0.005)
    for low, high in ((5, 20), (20, 40), (40, 60), (110, 140)):
        x = np.radians(np.linspace(low, high, 200))
        drawn = np.average(shipped(np.cos(x)), weights=np.sin(x))
        assert rest * drawn == pytest.approx(plume.mean(low, high), rel=0.06)
    # Light of the step is only moved about.
    x = np.radians(np.linspace(60.0, 107.0, 400))
    drawn = np.average(shipped(np.cos(x)), weights=np.sin(x))
    assert rest * drawn == pytest.approx(plume.mean(60.0, 107.0), rel=0.03)
