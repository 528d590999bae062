"""Read-outs: visibility, depth of light, colour of the water, error of few bands."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging.summary import PATCHES, colour_error, readouts
from underwater_spectral.uw_spectral.imaging.visibility import (
    diffuse_attenuation,
    euphotic_depth,
    horizontal_visibility,
    sighting_range,
    transmitted_light,
)
from underwater_spectral.uw_spectral.imaging.water_colour import (
    dominant_colour,
    dominant_colour_of,
    water_swatch,
)
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.colour_rendering import (
    luminance,
    reduction,
    srgb_encode,
)
from underwater_spectral.uw_spectral.spectra.illuminant import parse_illuminant
from underwater_spectral.uw_spectral.spectra.sensor import parse_sensor
from underwater_spectral.uw_spectral.water.optical_properties import JERLOV_TYPES, Water
from underwater_spectral.validation.viewpoints import make_viewpoint

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)

D65 = parse_illuminant("d65")
CAMERA = parse_sensor("Nikon D7000")
FINE = Bands.uniform(60)
JERLOV = {name: Water.jerlov(name) for name in JERLOV_TYPES}


def viewpoint(name="IB", bands=FINE, depth=5.0, **settings):
    return make_viewpoint(JERLOV[name], D65, CAMERA, depth, bands, **settings)


def test_grey_water_is_seen_as_far_as_the_law_says():
    assert sighting_range([0.2] * 3, [1, 5, 2]) == pytest.approx(-math.log(0.02) / 0.2)
    grey = make_viewpoint(Water.uniform(0.1, 0.3), D65, CAMERA, 2.0, FINE)
    assert horizontal_visibility(grey) == pytest.approx(-math.log(0.02) / 0.4)
    assert horizontal_visibility(grey, 0.1) == pytest.approx(-math.log(0.1) / 0.4)


@given(
    st.lists(st.tuples(st.floats(1e-3, 10), st.floats(0, 1)), min_size=1, max_size=8).filter(
        lambda rows: any(weight > 1e-6 for _, weight in rows)
    )
)
def test_contrast_at_the_sighting_range_is_liminal(rows):
    c, weights = np.array(rows).T
    distance = sighting_range(c, weights)
    assert weights @ np.exp(-c * distance) / weights.sum() == pytest.approx(0.02, rel=1e-6)
    assert -math.log(0.02) / c.max() * 0.999 <= distance <= -math.log(0.02) / c.min() * 1.001


def test_water_that_attenuates_nothing_is_seen_through():
    assert sighting_range([0.0, 1.0], [1.0, 1.0]) == math.inf


def test_light_of_absorbing_water_follows_beers_law():
    column = make_viewpoint(Water.uniform(0.2, 0.0), D65, CAMERA, 1.0, FINE, sun_zenith=60.0)
    mu = column.column.sun_cosine
    assert euphotic_depth(column.column, column.phase) == pytest.approx(
        -math.log(0.01) * mu / 0.2, rel=1e-6
    )
    assert transmitted_light(column) == pytest.approx(math.exp(-0.2 / mu))
    assert diffuse_attenuation(column) == pytest.approx(0.2 / mu)


@pytest.mark.parametrize("name", JERLOV_TYPES)
@pytest.mark.parametrize("fraction", [0.5, 0.1, 0.01, 1e-6])
def test_fraction_of_light_at_that_depth(name, fraction):
    view = viewpoint(name)
    depth = euphotic_depth(view.column, view.phase, fraction)
    photons = FINE.centres * FINE.widths
    transmittance = view.field.Ed(depth) @ photons / (view.field.Ed(0.0) @ photons)
    assert transmittance == pytest.approx(fraction, rel=1e-4)


@pytest.mark.parametrize("name", JERLOV_TYPES)
def test_diffuse_attenuation_takes_the_light_away(name):
    depths = np.linspace(4.0, 5.0, 21)
    views = [viewpoint(name, depth=depth) for depth in depths]
    attenuation = np.array([diffuse_attenuation(view) for view in views])
    taken = np.trapezoid(attenuation, depths, axis=0)
    assert np.exp(-taken) == pytest.approx(
        transmitted_light(views[-1]) / transmitted_light(views[0]), rel=1e-3
    )
    assert (attenuation[-1] > JERLOV[name].a(FINE.centres)).all()


def test_euphotic_depth_ignores_the_floor():
    shallow, deep = viewpoint(floor_depth=8.0), viewpoint()
    assert euphotic_depth(shallow.column, shallow.phase) == euphotic_depth(deep.column, deep.phase)


def test_light_of_no_absorption_never_ends():
    clear = make_viewpoint(Water.uniform(0.0, 0.0), D65, CAMERA, 1.0, FINE)
    assert euphotic_depth(clear.column, clear.phase) == math.inf


def test_jerlov_order():
    views = [viewpoint(name, depth=1.0) for name in ("I", "IA", "IB", "II", "III")]
    for series in (
        [horizontal_visibility(view) for view in views],
        [euphotic_depth(view.column, view.phase) for view in views],
    ):
        assert series == sorted(series, reverse=True)


def test_colours_of_oceanic_and_coastal_water():
    assert dominant_colour(viewpoint("I")).name == "blue"
    assert dominant_colour(viewpoint("5C")).name == "green"
    wavelengths = [dominant_colour(viewpoint(name)).wavelength for name in JERLOV_TYPES]
    assert wavelengths == sorted(wavelengths)


def test_dominant_colour_of_spectral_light_and_of_none():
    observer = parse_sensor("cie1931").sensitivity
    white = observer.values.sum(axis=0)
    found = dominant_colour_of(observer.at([520.0])[0], white)
    assert found.wavelength == pytest.approx(520, abs=1)
    assert found.purity == pytest.approx(1, abs=0.01)
    assert found.name == "green"
    assert dominant_colour_of(3 * white, white).name == "grey"
    # Mixed with the complement of green, across the line of purples.
    purple = dominant_colour_of(white + 40 * observer.at([440.0])[0] + 9 * white[0] * np.eye(3)[0], white)  # fmt: skip # noqa: E501
    assert purple.name == "purple"
    assert purple.wavelength < 0


def test_swatch_is_the_developed_background():
    view = viewpoint("II", exposure_stops=1.0, sun_azimuth=40.0)
    sun = view.column.sun_direction
    assert np.dot(view.level, sun) == pytest.approx(0, abs=1e-12)
    radiance = view.field.radiance(5.0, view.level)
    develop = reduction(CAMERA, FINE, D65, exposure_stops=1.0)
    assert water_swatch(view) == pytest.approx(srgb_encode(develop.apply(radiance)))


@pytest.mark.parametrize("balance", ["daylight", "depth", "none"])
def test_automatic_exposure_brings_white_at_depth_to_its_luminance(balance):
    view = viewpoint(white_balance=balance)
    assert luminance(view.reduction.apply(view.light / math.pi)) == pytest.approx(0.9)


def test_no_light_is_black():
    assert water_swatch(viewpoint("9C", depth=1e4)).tolist() == [0, 0, 0]
    with pytest.raises(InputError, match="no light to see by"):
        horizontal_visibility(viewpoint("9C", depth=1e4))
    with pytest.raises(InputError, match="no light to see;"):
        dominant_colour(viewpoint("9C", depth=1e4))


def test_colour_error_falls_with_the_number_of_bands():
    reference = viewpoint()
    errors = [colour_error(viewpoint(bands=Bands.uniform(n)), reference) for n in (4, 8, 16, 30)]
    means = [error.mean for error in errors]
    assert means == sorted(means, reverse=True)
    assert errors[-1].maximum < 0.5
    assert list(errors[0].by_colour) == ["water", *PATCHES]
    assert colour_error(reference, viewpoint()).maximum == 0


def test_error_of_far_patches_is_that_of_the_water():
    error = colour_error(viewpoint(bands=Bands.uniform(6)), viewpoint(), distance=2000.0)
    assert list(error.by_colour.values()) == pytest.approx([error.maximum] * 7, abs=1e-3)


def test_readouts_collect_the_single_ones():
    view, reference = viewpoint(bands=Bands.uniform(8)), viewpoint()
    found = readouts(view, reference)
    assert found.visibility == horizontal_visibility(reference)
    assert found.euphotic_depth == euphotic_depth(reference.column, reference.phase)
    assert found.swatch.tolist() == water_swatch(reference).tolist()
    assert found.transmitted_light.values.tolist() == transmitted_light(reference).tolist()
    assert found.colour == dominant_colour(reference)
    assert found.colour_error == colour_error(view, reference)


def test_refusals():
    view = viewpoint()
    with pytest.raises(InputError, match="camera is at depth 9 m, but the water reaches"):
        viewpoint(depth=9.0, floor_depth=8.0)
    with pytest.raises(InputError, match="contrast must lie between 0 and 1"):
        sighting_range([0.1], [1.0], 1.0)
    with pytest.raises(InputError, match="fraction of light must lie"):
        euphotic_depth(view.column, view.phase, 0.0)
    with pytest.raises(InputError, match="no light between 400 and 700 nm"):
        euphotic_depth(replace(view.column, sun_irradiance=0.0), view.phase)
    with pytest.raises(InputError, match="the depths differ, 5 and 6 m"):
        colour_error(view, viewpoint(depth=6.0))
    with pytest.raises(InputError, match="distance must be positive"):
        colour_error(view, view, 0.0)
