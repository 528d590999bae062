"""The coefficients of image formation against the pixel model, and what pictures tell of them."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging import (
    BandsDescription,
    CameraDescription,
    Description,
    FloorDescription,
    SurfaceDescription,
    WaterDescription,
    compute_image_formation,
    fit_formation,
    resolve,
)
from underwater_spectral.uw_spectral.imaging.formation_fit import BLACK
from underwater_spectral.uw_spectral.imaging.range_attenuation import (
    RangeAttenuation,
    fit_range_attenuation,
    least_squares,
)
from underwater_spectral.uw_spectral.spectra.reflectance import colorchecker_reflectance
from underwater_spectral.validation.sun_beam import sun_beam
from underwater_spectral.validation.tabulated_water import tabulated_water

DEPTH = 5.0
DOWN = (0.0, 0.6, -0.8)


@functools.cache
def optics(water: str, *, floor: float = math.inf, surface: str = "none"):
    return resolve(
        Description(
            WaterDescription(water),
            surface=SurfaceDescription(surface),
            floor=FloorDescription(floor, "0.3"),
            camera=CameraDescription("Nikon D7000"),
            bands=BandsDescription(12),
        )
    )


def pixels(found, w, z, J):
    """Bands of the pixel model, shape (m, n): light of the object, and of the water."""
    field, column = found.solved_field(), found.column
    beam = sun_beam(column, found.phase)
    index = column.refractive_index if column.reflects else None
    water = tabulated_water(field, beam, column.skylight, index)
    z = np.asarray(z, dtype=np.float64)[:, None]
    along = [np.full_like(z, part) for part in w]
    y_o = np.full_like(z, DEPTH)
    pixel = water.surface(y_o, y_o - w[2] * z, along, z, J)
    return pixel.direct, pixel.path + pixel.forward_scattered


@pytest.mark.parametrize("water", ["jerlov:IB", "jerlov:II", "jerlov:3C"])
@pytest.mark.parametrize(
    ("w", "tolerance"), [((1.0, 0.0, 0.0), 0.02), (DOWN, 0.02), ((0.6, 0.0, 0.8), 0.05)]
)
def test_the_backscatter_is_that_of_the_pixel_model(water, w, tolerance):
    found = optics(water, floor=60.0)
    z = np.array([0.5, 1.0, 2.0, 4.0])
    bands = compute_image_formation(found, DEPTH, w, z).bands
    direct, water_light = pixels(found, w, z, np.ones((len(z), 12)))
    assert np.exp(-bands.beta_direct * z[:, None]) == pytest.approx(direct, rel=1e-9)
    ours = bands.B_inf * -np.expm1(-bands.beta_backscatter * z[:, None])
    # Renderers look the field up in a table, which is coarsest towards the surface.
    assert ours == pytest.approx(water_light, rel=tolerance)


def test_in_a_band_level_light_decays_with_c():
    found = optics("jerlov:II")
    bands = compute_image_formation(found, DEPTH).bands
    assert bands.beta_direct == pytest.approx(np.broadcast_to(found.column.attenuation, (40, 12)))
    assert bands.beta_backscatter == pytest.approx(bands.beta_direct, rel=1e-9)


def test_channels_are_sums_over_bands():
    found = optics("jerlov:IB")
    formation = compute_image_formation(found, DEPTH)
    z, response = formation.channels.z, found.sensor.response_in(found.bands)
    Ed, c = found.solved_field().Ed(DEPTH), found.column.attenuation
    D = np.exp(-np.outer(z, c)) * Ed @ response.T / (response @ Ed)
    assert np.exp(-formation.channels.beta_direct * z[:, None]) == pytest.approx(D)
    B = -np.expm1(-np.outer(z, c)) * formation.bands.B_inf @ response.T
    fraction = -np.expm1(-formation.channels.beta_backscatter * z[:, None])
    assert formation.channels.B_inf * fraction == pytest.approx(B)
    # Light that is left travels better: coefficients fall with range, that of red most.
    assert (np.diff(formation.channels.beta_direct, axis=0) < 0).all()


def test_coefficients_depend_on_the_colour_of_the_object():
    found = optics("jerlov:IB")
    grey = compute_image_formation(found, DEPTH).channels
    red = compute_image_formation(
        found, DEPTH, reflectance=colorchecker_reflectance("red")
    ).channels
    assert (red.beta_direct[:, 1] > 1.02 * grey.beta_direct[:, 1]).all()
    assert red.B_inf == pytest.approx(grey.B_inf)


@pytest.mark.parametrize(("water", "order"), [("jerlov:IB", [2, 1, 0]), ("jerlov:9C", [0, 1, 2])])
def test_channels_attenuate_in_the_order_of_the_water(water, order):
    """Jerlov's types: the open sea lets blue through, coastal water red rather than blue."""
    found = compute_image_formation(optics(water), DEPTH, ranges=(0.5, 1.0, 2.0)).channels
    assert (np.argsort(found.beta_direct, axis=1) == order).all()


def test_backscatter_has_other_coefficients_than_what_is_seen_through_it():
    """Akkaynak & Treibitz (2018): of red in the open sea, where backscatter has little of it."""
    found = compute_image_formation(optics("jerlov:IB"), DEPTH, ranges=(1.0, 5.0)).channels
    assert (found.beta_backscatter[:, 0] < 0.8 * found.beta_direct[:, 0]).all()
    assert found.beta_backscatter[:, 2] == pytest.approx(found.beta_direct[:, 2], rel=0.03)


def test_ranges_beyond_the_floor_are_left_out():
    found = optics("jerlov:IB", floor=8.0)
    z = compute_image_formation(found, DEPTH, (0, 0, -1), [1.0, 2.9, 3.1, 50.0]).channels.z
    assert z.tolist() == [1.0, 2.9]
    with pytest.raises(InputError, match="between surface and floor"):
        compute_image_formation(found, DEPTH, (0, 0, -2), [4.0])


@pytest.mark.parametrize("direction", [(0, 0, 0), (1, 0), (math.nan, 0, 0)])
def test_no_direction_is_refused(direction):
    with pytest.raises(InputError, match="no direction"):
        compute_image_formation(optics("jerlov:IB"), DEPTH, direction)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("water", ["jerlov:IB", "jerlov:II", "jerlov:1C", "jerlov:3C", "jerlov:9C"])
@pytest.mark.parametrize("w", [(1.0, 0.0, 0.0), DOWN])
def test_fitted_constants_follow_the_curves(water, w):
    formation = compute_image_formation(optics(water), DEPTH, w, np.geomspace(0.25, 20, 30))
    for curves in (formation.channels, formation.bands):
        fit, z = curves.fitted(), curves.z
        for beta, found in (
            (curves.beta_direct, fit.beta_direct),
            (curves.beta_backscatter, fit.beta_backscatter),
        ):
            ours = np.stack([channel.at(z) for channel in found], axis=1)
            assert np.abs(ours / beta - 1).max() < 0.005


# How far: to where about e^-3 of the best channel is left.
PICTURES = {"jerlov:IB": 30.0, "jerlov:II": 6.5, "jerlov:1C": 6.0, "jerlov:3C": 2.5}


def synthetic(water: str, noise: float, seed: int = 0):
    """Pictures by the pixel model: patches of six greys at 40 ranges, 25 pixels each, and water."""
    found, far = optics(water), PICTURES[water]
    z = np.linspace(0.03 * far, far, 40)
    response = found.sensor.response_in(found.bands)
    Ed = found.solved_field().Ed(DEPTH)
    greys = (0.0, 0.1, 0.2, 0.4, 0.6, 0.9)
    seen = [
        sum(pixels(found, (1, 0, 0), z, np.full((40, 1), grey) * Ed / math.pi)) @ response.T
        for grey in greys
    ]
    open_water = found.solved_field().radiance(DEPTH, (1, 0, 0)) @ response.T
    values = np.concatenate(
        [np.repeat(np.concatenate(seen), 25, axis=0), np.tile(open_water, (200, 1))]
    )
    ranges = np.concatenate([np.repeat(np.tile(z, 6), 25), np.full(200, np.inf)])
    surfaces = np.concatenate([np.repeat(np.arange(6), 40 * 25), np.full(200, BLACK)])
    random = np.random.default_rng(seed)
    values = values + random.normal(0.0, noise * values.max(axis=0), values.shape)
    return values, ranges, surfaces, z


@pytest.mark.slow_but_first
@pytest.mark.parametrize("water", PICTURES)
def test_pictures_alone_return_the_coefficients(water):
    values, ranges, surfaces, z = synthetic(water, 0.0)
    truth = compute_image_formation(optics(water), DEPTH, ranges=z).channels
    fit = fit_formation(values, ranges, surfaces)
    direct, backscatter = (
        np.stack([channel.at(z) for channel in found], axis=1)
        for found in (fit.beta_direct, fit.beta_backscatter)
    )
    assert np.abs(direct / truth.beta_direct - 1).max() < 0.02
    assert np.abs(backscatter / truth.beta_backscatter - 1).max() < 0.02
    assert np.abs(np.array(fit.B_inf) / truth.B_inf - 1).max() < 0.02


@pytest.mark.slow_but_first
@pytest.mark.parametrize("water", PICTURES)
def test_noise_moves_the_model_little(water):
    values, ranges, surfaces, z = synthetic(water, 0.005)
    truth = compute_image_formation(optics(water), DEPTH, ranges=z).channels
    fit = fit_formation(values, ranges, surfaces)
    T = np.exp(-truth.beta_direct * z[:, None])
    B = truth.B_inf * (1 - np.exp(-truth.beta_backscatter * z[:, None]))
    assert np.abs(fit.transmittance(z) - T).max() < 0.02
    assert np.abs(fit.backscatter(z) - B).max() < 0.02 * truth.B_inf.max()


def test_without_labels_the_darkest_pixels_serve_as_black():
    random = np.random.default_rng(2)
    z = random.uniform(0.5, 12.0, 40_000)
    J = random.uniform(0.0, 1.0, (40_000, 1)) * (random.random((40_000, 1)) > 0.03)
    seen = J * np.exp(-0.2 * z[:, None]) + 0.3 * (1 - np.exp(-0.25 * z[:, None]))
    z, seen = np.append(z, [np.inf] * 50), np.vstack([seen, np.full((50, 1), 0.3)])
    fit = fit_formation(seen, z)
    assert fit.B_inf[0] == pytest.approx(0.3, rel=0.02)
    assert fit.beta_direct[0].at(6.0) == pytest.approx(0.2, rel=0.05)
    assert fit.beta_backscatter[0].at(6.0) == pytest.approx(0.25, rel=0.02)


def test_what_cannot_be_fitted_says_why():
    z, ones = np.linspace(1, 5, 5), np.ones((5, 1))
    with pytest.raises(InputError, match="one range each"):
        fit_formation(ones, z[:3])
    with pytest.raises(InputError, match="something black"):
        fit_formation(ones, z, np.ones(5, int))
    with pytest.raises(InputError, match="something lit"):
        fit_formation(ones, z, np.zeros(5, int))
    with pytest.raises(InputError, match="ranges positive"):
        fit_formation(ones, z - 1.0)
    with pytest.raises(InputError, match="one surface per pixel"):
        fit_formation(ones, z, np.ones(3, int))
    with pytest.raises(InputError, match="too few pixels"):
        fit_formation(ones, np.full(5, np.inf))
    with pytest.raises(InputError, match="4 points"):
        fit_range_attenuation([1.0, 2.0], [0.1, 0.1])
    with pytest.raises(InputError, match="must be positive"):
        fit_range_attenuation(z, -z)


def test_least_squares_finds_what_a_solver_finds():
    from scipy.optimize import least_squares as scipys

    x = np.linspace(0, 4, 50)
    data = 2 * np.exp(-0.7 * x) + 0.3 + 0.01 * np.sin(40 * x)

    def error(p):
        return p[0] * np.exp(-p[1] * x) + p[2] - data

    start = np.array([1.0, 1.0, 0.0])
    assert least_squares(error, start) == pytest.approx(scipys(error, start).x, rel=1e-5)


def test_curves_say_what_is_left():
    curve = RangeAttenuation(0.1, -0.5, 0.2, 0.0)
    assert curve.transmittance([0.0, 2.0]) == pytest.approx([1.0, np.exp(-2 * curve.at(2.0))])
