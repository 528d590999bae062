"""What closures that EEVEE lacks throw back of the sun."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.transfer.highlights import stretched_highlight, toon_highlight

_UP, _ALONG = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)


def _hemisphere(count=1000):
    """Return directions, and solid angles times cosines over pi."""
    z, angle = np.meshgrid((np.arange(count) + 0.5) / count, np.arange(count) * 2 * np.pi / count)
    side = np.sqrt(1.0 - z * z)
    return (side * np.cos(angle), side * np.sin(angle), z), 2.0 * z / count**2


@pytest.mark.parametrize(
    ("roughness", "anisotropy", "rotation"), [(0.3, 0.0, 0.0), (0.3, 0.5, 0.1), (0.35, -0.4, 0.0)]
)
def test_hardly_any_light_is_lost(roughness, anisotropy, rotation):
    """But between facets, some percent."""
    w, weight = _hemisphere()
    eye = (0.3, 0.2, math.sqrt(1.0 - 0.13))
    found = stretched_highlight(_UP, _ALONG, eye, w, roughness, anisotropy, rotation)
    assert 0.96 < (found * weight).sum() < 1.001


@pytest.mark.parametrize(
    ("slope", "along", "rotation"),
    [(0.09 * 0.4, 0, 0.0), (0.09 / 0.4, 1, 0.0), (0.09 / 0.4, 0, 0.25)],
)
def test_highlights_are_as_wide_as_slopes(slope, along, rotation):
    """At the slope of a width facets are a quarter as dense, over the fourth power of cosines."""
    half = np.array([0.0, 0.0, 1.0])
    half[along] = slope
    half /= np.linalg.norm(half)
    at_slope, at_top = (
        stretched_highlight(_UP, _ALONG, w, w, 0.3, 0.6, rotation) for w in (half, _UP)
    )
    masked = half[2] ** 2 * math.sqrt(1.0 + slope**4)
    assert at_slope / at_top == pytest.approx(0.25 / half[2] ** 4 / masked, rel=0.01)


@pytest.mark.parametrize(("size", "smooth"), [(0.5, 0.0), (0.3, 0.0), (0.9, 0.0)])
def test_a_toon_throws_back_all(size, smooth):
    w, weight = _hemisphere()
    found = toon_highlight(_UP, w, size, smooth)
    # Each of these directions gets what an object throws there; it is the same both ways.
    assert (found * weight).sum() == pytest.approx(1.0, rel=0.02)
