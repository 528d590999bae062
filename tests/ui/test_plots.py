"""Pictures of spectra: what is drawn where."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.ui.plots import (
    plot_coefficients,
    plot_sensor,
    plot_transmitted_light,
    spectrum_colours,
)
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.sensor import list_sensors, parse_sensor
from underwater_spectral.uw_spectral.spectra.spectrum import Spectrum
from underwater_spectral.uw_spectral.water.optical_properties import JERLOV_TYPES, Water

BANDS = Bands.uniform(8)
RANGE = np.array([400.0, 700.0])


def valid(picture, size):
    assert picture.dtype == np.float32
    assert picture.shape == (size[1], size[0], 4)
    assert picture.min() >= 0
    assert picture.max() <= 1
    assert picture[0, 0, 3] == 0
    assert picture[size[1] // 2, size[0] // 2, 3] == 1
    return picture


def curves(water):
    found = {"a": water.absorption, "b": water.scattering, "Kd": water.diffuse_attenuation}
    return {label: spectrum for label, spectrum in found.items() if spectrum is not None}


def rows_of(picture, column, colour):
    """Rows, from the top, in which a column of the picture shows a colour."""
    return np.flatnonzero(np.abs(picture[:, column, :3] - colour).max(axis=1) < 0.1)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("name", JERLOV_TYPES)
@pytest.mark.parametrize("size", [(320, 160), (640, 320), (200, 90)])
def test_every_water_draws(name, size):
    valid(plot_coefficients(curves(Water.jerlov(name)), BANDS, size), size)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("name", list_sensors())
def test_every_sensor_draws(name):
    valid(plot_sensor(parse_sensor(name), BANDS), (320, 160))


def test_a_curve_lies_where_its_values_are():
    # A step over half a decade, in the first curve's colour.
    step = Spectrum([400, 549, 551, 700], [0.1, 0.1, 0.5, 0.5], "step")
    picture = plot_coefficients({"a": step, "b": Spectrum(RANGE, np.ones(2), "b")}, BANDS)
    orange, blue = (1.0, 0.66, 0.30), (0.45, 0.78, 1.0)
    one, low, high = (
        rows_of(picture, column, colour).mean()
        for column, colour in ((110, blue), (110, orange), (240, orange))
    )
    assert one < high < low
    assert (high - one) / (low - one) == pytest.approx(np.log10(1 / 0.5), abs=0.03)


def test_light_fills_the_area_below_it():
    picture = plot_transmitted_light(Spectrum(RANGE, np.array([0.2, 0.2]), "light"))
    column = picture[:, 200, :3]
    # The axis ends at 20 %: the fill reaches 95 % of the plot area.
    filled = np.flatnonzero(np.ptp(column, axis=1) > 0.3)
    assert filled.min() == pytest.approx(17 + 0.05 * 121, abs=2)
    none = plot_transmitted_light(Spectrum(RANGE, np.zeros(2), "no light"))
    assert not (np.ptp(none[20:130, 60:300, :3], axis=2) > 0.3).any()


@pytest.mark.parametrize("scale", [1e-9, 1e-5, 1e-3, 1.0, 1e7])
def test_any_order_of_magnitude_draws(scale):
    values = scale * np.array([1.0, 3.0])
    valid(plot_coefficients({"a": Spectrum(RANGE, values, "a")}, BANDS), (320, 160))
    valid(plot_transmitted_light(Spectrum(RANGE, np.minimum(values, 1.0), "light")), (320, 160))


def test_light_outside_the_table_is_not_drawn():
    short = Spectrum(np.array([500.0, 600.0]), np.ones(2), "light", "")
    picture = plot_transmitted_light(short, BANDS)
    assert valid(picture, (320, 160))[60, 50, :3].max() < 0.5


def test_band_centres_are_marked():
    sensor = parse_sensor("cie1931")
    difference = plot_sensor(sensor, Bands.uniform(3)) - plot_sensor(sensor)
    columns = np.flatnonzero(np.abs(difference).max(axis=(0, 2)) > 0.05)
    centres = 16 + (np.array([450, 550, 650]) - 400) / 300 * (308 - 16)
    assert [np.abs(columns - centre).min() for centre in centres] == pytest.approx([0] * 3, abs=1)
    assert len(columns) <= 9


def test_spectrum_runs_from_blue_over_green_to_red():
    assert spectrum_colours([460, 540, 640]).argmax(axis=1).tolist() == [2, 1, 0]
    colours = spectrum_colours(np.arange(300, 900))
    assert colours.min() >= 0
    assert colours.max() <= 1


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        (lambda: plot_sensor(parse_sensor("cie1931"), size=(80, 160)), "too few"),
        (lambda: plot_coefficients({}, BANDS), "1 to 4 curves"),
        (lambda: plot_coefficients({"a": Spectrum(RANGE, np.zeros(2), "")}, BANDS), "is zero"),
        (lambda: plot_coefficients({"é": Spectrum(RANGE, np.ones(2), "")}, BANDS), "cannot be"),
    ],
)
def test_refusals(draw, message):
    with pytest.raises(InputError, match=message):
        draw()
