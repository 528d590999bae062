"""Optimised bands against many bands, on spectra that the weights were not fitted to."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging import band_selection as module
from underwater_spectral.uw_spectral.imaging.band_selection import (
    MOST_SEARCHED,
    FittedViewpoint,
    fitted_reduction,
    optimised_bands,
)
from underwater_spectral.uw_spectral.imaging.summary import colour_error
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.colour_rendering import (
    delta_e_CIE2000_images,
    luminance,
)
from underwater_spectral.uw_spectral.spectra.illuminant import parse_illuminant
from underwater_spectral.uw_spectral.spectra.reflectance import (
    colorchecker_patches,
    colorchecker_reflectance,
)
from underwater_spectral.uw_spectral.spectra.sensor import parse_sensor
from underwater_spectral.uw_spectral.water.optical_properties import Water
from underwater_spectral.validation.viewpoints import make_viewpoint

FINE = Bands.uniform(60)
D65 = parse_illuminant("d65")


def camera(bands, water="IB", sensor="cie1931", depth=8.0, light=D65, scale=1.0, **options):
    return make_viewpoint(
        Water.jerlov(water).scaled(scale, scale), light, parse_sensor(sensor), depth, bands,
        **options,
    )  # fmt: skip


@pytest.fixture(scope="module")
def six():
    return optimised_bands(6, camera(FINE)).bands


@pytest.mark.parametrize(
    ("water", "sensor", "depth", "options"),
    [
        ("I", "cie1931", 20.0, {}),
        ("III", "Nikon D7000", 10.0, {"white_balance": "depth"}),
        ("3C", "ARRI D21", 6.0, {"sun_zenith": 70.0, "floor_depth": 9.0}),
        ("9C", "Kodak Ektachrome 100D", 3.0, {"surface": "flat"}),
    ],
)
def test_six_beat_eight_equal_bands(water, sensor, depth, options):
    """With the patches and the distance of the panel's colour error, neither of them fitted to."""
    reference = camera(Bands.uniform(150), water, sensor, depth, **options)
    fine = camera(FINE, water, sensor, depth, **options)
    bands = optimised_bands(6, fine).bands
    view = camera(bands, water, sensor, depth, **options)
    fitted = FittedViewpoint(
        **{f.name: getattr(view, f.name) for f in dataclasses.fields(view)}, reference=fine
    )
    eight = camera(Bands.uniform(8), water, sensor, depth, **options)
    error = colour_error(fitted, reference).mean
    # What half of all observers see, ISO/TR 28642:2016.
    assert error < 0.8
    assert error < 0.7 * colour_error(eight, reference).mean


@pytest.mark.parametrize("count", [1, 2, 3, 6, MOST_SEARCHED, MOST_SEARCHED + 1, 40])
def test_bands_are_distinct_and_inside(count):
    found = optimised_bands(count, camera(FINE))
    assert len(found.bands) == count
    assert found.bands.centres[0] > 400
    assert found.bands.centres[-1] < 700
    assert np.all(np.diff(found.bands.centres) >= (8.0 if count <= MOST_SEARCHED else 7.0))
    assert math.isfinite(found.delta_e)


def test_more_bands_err_less():
    errors = [optimised_bands(count, camera(FINE)).delta_e for count in (3, 4, 6, 9, 12, 20, 30)]
    assert errors == sorted(errors, reverse=True)


def test_search_finds_what_trying_everything_finds():
    """All choices of three bands out of 30 that are far enough apart."""
    fine = camera(Bands.uniform(30))
    found = optimised_bands(3, fine)
    targets = [module._Target.of(eye, eye) for eye in module._eyes(fine, module.DEPTHS)]
    choices = np.array(list(itertools.combinations(range(30), 3)))
    assert found.delta_e <= 1.01 * module._delta_e(targets, choices).min()


def test_choice_is_the_same_again_and_for_any_camera(six):
    again = optimised_bands(6, camera(FINE, sensor="Nikon D7000", depth=3.0, exposure_stops=2.0))
    np.testing.assert_array_equal(again.bands.centres, six.centres)


def test_depths_matter_and_stay_in_the_light():
    deep = camera(FINE, "3C", depth=12.0)
    target = [module._Target.of(deep, deep)]
    for_it, for_shallow = (
        module._delta_e(target, module._nearest(FINE, optimised_bands(6, deep, (d,)).bands)[None])
        for d in (12.0, 1.0)
    )
    assert for_it < for_shallow
    for options in ({"scale": 500.0, "depth": 0.01}, {"floor_depth": 0.5, "depth": 0.1}):
        assert optimised_bands(4, camera(FINE, **options)).delta_e < 5.0


@pytest.mark.parametrize("white_balance", ["daylight", "depth", "none"])
def test_white_keeps_its_colour(six, white_balance):
    few, many = (camera(b, "II", "ARRI D21", white_balance=white_balance) for b in (six, FINE))
    white = fitted_reduction(few, many).apply(few.light / math.pi)
    np.testing.assert_allclose(white, many.reduction.apply(many.light / math.pi), rtol=1e-9)
    assert luminance(white) == pytest.approx(0.9)
    if white_balance == "depth":
        np.testing.assert_allclose(white, 0.9, rtol=1e-9)


def test_many_bands_are_fitted_to_themselves():
    """Sixty bands fitted to sixty develop as they do without."""
    view = camera(FINE)
    patches = np.random.default_rng(3).uniform(0, 1, (20, 60)).cumsum(axis=1) / 60
    radiance = patches * view.light
    fitted, plain = fitted_reduction(view, view).apply(radiance), view.reduction.apply(radiance)
    assert delta_e_CIE2000_images(fitted, plain).max() < 0.1


def test_weights_do_not_amplify_noise(six):
    """One per cent of independent noise in each band is not much more than with equal bands."""
    fine = camera(FINE)
    noise = {}
    for bands in (six, Bands.uniform(6)):
        view = camera(bands)
        weights = (fitted_reduction(view, fine) if bands is six else view.reduction).weights
        rgb = weights * view.light / math.pi
        noise[bands is six] = np.sqrt(np.sum((luminance(rgb.T)) ** 2))
    assert noise[True] < 1.5 * noise[False]


def test_light_scale_does_not_matter(six):
    """An illuminant in watts gives the colours of a relative one."""
    views = {}
    for factor in (1.0, 1e-3):
        direct = dataclasses.replace(D65.direct, values=D65.direct.values * factor)
        light = dataclasses.replace(D65, direct=direct)
        few, many = camera(six, light=light), camera(FINE, light=light)
        views[factor] = fitted_reduction(few, many).weights * factor
    np.testing.assert_allclose(views[1.0], views[1e-3], rtol=1e-6)


@pytest.mark.parametrize("depth", [30.0, 600.0])
def test_lamps_keep_their_colours(six, depth):
    """Below the daylight, red bands must not be weighted as if only daylight could be there."""
    few, many = camera(six, depth=depth), camera(FINE, depth=depth)
    patches = [colorchecker_reflectance(patch) for patch in colorchecker_patches()]

    def lit(view):
        bands = view.column.bands
        reflectance = np.stack([patch.at(bands.centres) for patch in patches])
        return reflectance * np.exp(-2.0 * view.column.attenuation) * D65.total_in(bands)

    truth = many.reduction.apply(lit(many))
    seen = fitted_reduction(few, many).apply(lit(few))
    gain = 0.5 / luminance(truth).max()
    assert delta_e_CIE2000_images(seen * gain, truth * gain).mean() < 2.0


def test_bands_without_light_do_no_harm(six):
    """An illuminant that ends at 600 nm."""
    dark = np.where(D65.direct.wavelengths < 600, D65.direct.values, 0.0)
    light = dataclasses.replace(D65, direct=dataclasses.replace(D65.direct, values=dark))
    few, many = camera(six, light=light), camera(FINE, light=light)
    weights = fitted_reduction(few, many).weights
    assert np.all(np.isfinite(weights))
    assert np.all(weights[:, six.centres - six.widths / 2 > 600] == 0)


def test_bad_input_is_named():
    with pytest.raises(InputError, match="the number must be 1 to 512"):
        optimised_bands(0, camera(FINE))
    with pytest.raises(InputError, match="at least one depth"):
        optimised_bands(3, camera(FINE), depths=())
    with pytest.raises(InputError, match="the depths differ, 8 and 9 m"):
        fitted_reduction(camera(Bands.uniform(3)), camera(FINE, depth=9.0))
    abyss = [camera(b, "9C", depth=900.0, exposure_stops=0.0) for b in (Bands.uniform(3), FINE)]
    with pytest.raises(InputError, match="no daylight is left at 900 m"):
        fitted_reduction(*abyss)
