"""Where breakers leave bubbles, and how many."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.clouds.gaussian_blob import GaussianBlob
from underwater_spectral.uw_spectral.surface.plumes import (
    AIR_COLUMN,
    FADES,
    LASTS,
    MOST,
    Patch,
    patches,
    plume_air,
    plume_depth,
    plume_middle,
)
from underwater_spectral.uw_spectral.surface.raised_waves import HeightTile, RaisedWaves
from underwater_spectral.uw_spectral.surface.wave_patterns import Sea
from underwater_spectral.uw_spectral.surface.whitecaps import Foam

TILE, SAMPLES = 40.0, 400


def _waves(crowding):
    level = np.zeros((SAMPLES, SAMPLES))
    near = HeightTile(TILE, level, level, level, level)
    return RaisedWaves(near, HeightTile(TILE, level, level, level, crowding), Foam(0.5, 2.0))


def _ellipse(x0, y0, long, short, turn):
    x, y = np.meshgrid(*[np.arange(SAMPLES) * TILE / SAMPLES] * 2)
    u = (x - x0) * math.cos(turn) + (y - y0) * math.sin(turn)
    v = (y - y0) * math.cos(turn) - (x - x0) * math.sin(turn)
    return np.where((u / long) ** 2 + (v / short) ** 2 < 1.0, 1.0, 0.0)


def test_a_patch_of_foam_has_its_place_size_and_direction():
    waves = _waves(_ellipse(12.0, 9.0, 0.9, 0.45, 0.6) + _ellipse(20.0, 20.0, 0.08, 0.08, 0.0))
    (found,) = patches(waves, (11.0, 11.0), 8.0)
    assert (found.x, found.y) == pytest.approx((12.0, 9.0), abs=0.05)
    # Cells at its edge count whole.
    assert found.area == pytest.approx(math.pi * 0.9 * 0.45, rel=0.25)
    assert (found.long, found.short) == pytest.approx((0.9, 0.45), rel=0.1)
    # Half a cell over its half width.
    assert math.sin(found.turn - 0.6) == pytest.approx(0.0, abs=0.11)
    assert patches(waves, (30.0, 30.0), 8.0) == []


def test_a_plume_holds_the_air_below_its_foam():
    patch, depth = Patch(0.0, 0.0, 0.2, 0.9, 0.6, 0.3), 0.4
    blob = GaussianBlob.of_axes((0, 0, 0), np.diag([patch.long, patch.short, depth]))
    x, y = np.meshgrid(*[np.linspace(-3.0, 3.0, 121)] * 2, indexing="ij")
    heights = np.linspace(-1.5, 0.0, 121)
    fields = [blob.density((x, y, z)) for z in heights]
    volume = np.trapezoid([field.sum() * 0.05**2 for field in fields], heights)
    assert 1e-3 * plume_air(patch, depth, 0.0) * volume == pytest.approx(
        AIR_COLUMN * patch.area, rel=0.01
    )


def test_a_plume_thins_out():
    patch = Patch(0.0, 0.0, 0.02)
    fresh = plume_air(patch, 0.3, 0.0)
    assert 0.0 < fresh < MOST
    assert plume_air(Patch(0.0, 0.0, 1.0), 0.3, 0.0) == MOST
    assert plume_air(patch, 0.3, FADES) == pytest.approx(fresh / math.e)
    assert plume_air(patch, 0.3, LASTS) == plume_air(patch, 0.3, -0.01) == 0.0


def test_a_plume_is_below_the_surface_and_below_its_mean_level():
    depth = plume_depth(2.5)
    assert plume_middle(depth, -1.0) == pytest.approx(-1.0 - 0.3 * depth)
    assert plume_middle(depth, 1.0) < 0.0


def test_patches_hold_most_of_the_foam_of_a_sea():
    sea = Sea(12.0, resolution=128, raised=True, foam=True)
    waves, (middle, radius) = sea.raised_at(3.0), ((5.0, -3.0), 12.0)
    assert waves is not None
    side = np.arange(-radius, radius, 0.2) + 0.1
    x, y = np.meshgrid(middle[0] + side, middle[1] + side)
    near = np.hypot(x - middle[0], y - middle[1]) <= radius
    covered = 0.04 * np.count_nonzero(near & (waves.foam_fraction(x, y) > 0.0))
    found = patches(waves, middle, radius)
    assert 0.75 * covered < sum(patch.area for patch in found) <= covered + 1e-9


def test_the_height_to_first_order_is_near_that_of_the_surface():
    sea = Sea(8.0, resolution=128, raised=True)
    x, y = np.meshgrid(np.linspace(0.0, 200.0, 41), np.linspace(0.0, 200.0, 41))
    waves = sea.raised_at(2.0)
    assert waves is not None
    own, whole = sea.elevation(x, y, 2.0), waves.elevation(x, y)
    assert np.corrcoef(own.ravel(), whole.ravel())[0, 1] > 0.97
    assert sea.significant_height() == pytest.approx(4.0 * own.std(), rel=0.15)
    # Pierson & Moskowitz (1964): 0.0246 U².
    assert sea.significant_height() == pytest.approx(0.0246 * 64.0, rel=0.15)
