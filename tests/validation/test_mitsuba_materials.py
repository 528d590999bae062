"""Materials under water against Mitsuba 3: what both are given, and that they agree."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.benchmarks import mitsuba_materials
from underwater_spectral.benchmarks.mitsuba_materials import (
    CYCLES,
    DIFFUSE,
    METAL,
    MITSUBA,
    PANE,
    PLACES,
    PLASTIC,
    STRAIGHT,
    Measured,
)
from underwater_spectral.benchmarks.mitsuba_reference import sky_picture, sky_pixels


def test_the_disc_in_mitsubas_sky_brings_the_sun():
    column = mitsuba_materials.plan_for(1).column
    band = 1
    disc = mitsuba_materials.sky_with_sun(column, band) - sky_picture(column.skylight, band)
    directions, solid_angles = sky_pixels(*disc.shape[:2])
    brought = np.einsum("hw,hwi->i", disc[..., 0] * solid_angles, directions)
    normal = column.sun_irradiance[band] / column.sun_cosine
    # Light of a disc 10° wide sums to 0.2 % less than a point's.
    assert np.allclose(-brought / normal, column.sun_direction, atol=0.005)


def test_every_place_is_seen_and_no_pixel_shows_two():
    seen = mitsuba_materials.places_seen(mitsuba_materials.plan_for(1).column)
    assert len(seen) == len(PLACES)
    assert seen.sum(axis=0).max() == 1
    assert seen.sum(axis=(1, 2)).min() > 20


def test_ratios_of_bands_that_share_their_paths_are_no_more_certain_than_one():
    """Bands of one seed err alike, so that three tell no more than one."""
    rng = np.random.default_rng(1)
    shape = (8, len(PLACES), 3)
    shared = 1.0 + 0.1 * rng.standard_normal(shape[:2])[..., None] * np.ones(3)
    measured = Measured(np.ones(3), {CYCLES: shared, MITSUBA: np.ones(shape)})
    ratio, error = measured.of_all_bands(CYCLES, MITSUBA)
    one, one_error = (x[:, 0] for x in measured.ratio(CYCLES, MITSUBA))
    assert np.allclose(ratio, one)
    assert np.allclose(error, one_error)


@pytest.mark.slow
def test_materials_agree_with_mitsuba():
    found = mitsuba_materials.measured(6, 32, "scalar_rgb")
    # Not EEVEE: the occlusion of tests is coarse.
    for name in (CYCLES, STRAIGHT):
        ratio, error = found.of_all_bands(name, MITSUBA)
        for place in (DIFFUSE, METAL, PLASTIC, PANE):
            number = PLACES.index(place)
            assert abs(ratio[number] - 1.0) < 0.03 + 2.0 * error[number]
